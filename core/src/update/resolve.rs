//! From proposals to changes: what is on the map already, what it replaces, which descriptor a removal means.

use super::overlap::Overlap;
use resurvey_schema::{
    ChangeRegion, ClassId, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor, Proposal, Rejection,
    Uncertainty,
};

/// Reach of a removal, metres, where three times its 1σ is less: Lee & Hsu's Algorithm 2 has none and would take a
/// chair 100 m away.
const REMOVAL_REACH_M: f64 = 3.0;
/// Two rectangles of which this share of both together coincides are one.
const SAME_OVER_UNION: f64 = 0.5;
/// A rectangle that covers this share of a smaller one replaces it.
const COVERS_OVER_SMALLER: f64 = 0.6;
/// A rectangle whose centre moved by less did not move, metres: the edge of a label is no sharper.
const SAME_CENTRE_M: f64 = 0.5;
/// One whose sides changed by less did not grow, metres.
const SAME_SIDE_M: f64 = 0.3;
/// Both in shares of the rectangle's diagonal, for large ones.
const SAME_SHARE: f64 = 0.1;
/// Both in 1σ of the difference, where measurements say how sure they are.
const SAME_SIGMAS: f64 = 3.0;
/// Share of the smaller footprint side within which two objects of one class are the same.
const SAME_OBJECT_SHARE: f64 = 1.0;

/// An object that is gone and one of its class that is new within this distance are one that was moved, metres.
const MOVE_REACH_M: f64 = 2.5;
/// One that moved by less stayed, metres: 1 m of range is 4 px at 10 m.
const LEAST_MOVE_M: f64 = 0.25;
/// So does one that is seen to be gone from its place but moved by fewer 1σ of the difference.
const MOVE_SIGMAS: f64 = 2.0;

/// One change of the map.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// A new descriptor.
    Add(Descriptor),
    /// Another state of the descriptor with this feature id.
    Modify {
        /// Feature id.
        fid: u64,
        /// Its state in the map.
        before: Descriptor,
        /// Its new state.
        after: Descriptor,
    },
    /// The descriptor with this feature id goes.
    Remove {
        /// Feature id.
        fid: u64,
        /// Its state in the map.
        before: Descriptor,
    },
}

/// Changes, and what was not changed with the reason.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Resolution {
    /// What changes.
    pub changes: Vec<Change>,
    /// What does not.
    pub rejections: Vec<Rejection>,
}

/// Makes changes of `proposals` about `regions` on a map with `descriptors`. Each descriptor of the map is changed at
/// most once.
pub fn resolve(proposals: Vec<Proposal>, regions: &[ChangeRegion], descriptors: &[(u64, Descriptor)]) -> Resolution {
    let mut resolver = Resolver { regions, descriptors, taken: Vec::new(), resolution: Resolution::default() };
    let (mut removals, mut objects) = (Vec::new(), Vec::new());
    for proposal in proposals {
        match proposal {
            Proposal::Place { region, descriptor: Descriptor::Dynamic(object) } => objects.push((region, object)),
            Proposal::Place { region, descriptor } => resolver.place(region, descriptor),
            Proposal::Remove { region, class, near, sigma_m } => {
                removals.push(Removal { region, class, near, sigma_m });
            }
            Proposal::Reject { rejection, .. } => resolver.resolution.rejections.push(rejection),
        }
    }
    // What replaces a descriptor is known by now; a chair that is gone here and seen a metre away was moved.
    let gone = resolver.gone(&removals);
    let stayed = resolver.move_or_place(objects, gone);
    for (fid, before) in stayed {
        resolver.resolution.changes.push(Change::Remove { fid, before });
    }
    resolver.resolution
}

/// The descriptor of the map that `measured` is or replaces, if there is one.
pub fn in_the_way(measured: &Descriptor, descriptors: &[(u64, Descriptor)]) -> Option<u64> {
    let is_other = |present: &Descriptor| matches!(relation(present, measured), Relation::Unrelated);
    descriptors.iter().find(|(_, present)| !is_other(present)).map(|(fid, _)| *fid)
}

struct Removal {
    region: u32,
    class: ClassId,
    near: GridPoint,
    sigma_m: f64,
}

struct Resolver<'a> {
    regions: &'a [ChangeRegion],
    descriptors: &'a [(u64, Descriptor)],
    /// Feature ids that a change speaks of already.
    taken: Vec<u64>,
    resolution: Resolution,
}

/// What a measured descriptor is to one on the map.
enum Relation {
    Unrelated,
    Same { moved_m: f64, limit_m: f64 },
    Replaces,
}

impl Resolver<'_> {
    fn place(&mut self, region: u32, descriptor: Descriptor) {
        for (fid, present) in self.descriptors {
            if self.taken.contains(fid) {
                continue;
            }
            match relation(present, &descriptor) {
                Relation::Unrelated => {}
                Relation::Same { moved_m, limit_m } => {
                    return self.reject(region, "already-on-map", moved_m, limit_m, "m");
                }
                Relation::Replaces => {
                    self.taken.push(*fid);
                    let change = Change::Modify { fid: *fid, before: present.clone(), after: descriptor };
                    return self.resolution.changes.push(change);
                }
            }
        }
        self.resolution.changes.push(Change::Add(descriptor));
    }

    /// The descriptors that `removals` speak of: nearest pairs first, one removal to one descriptor.
    fn gone(&mut self, removals: &[Removal]) -> Vec<(u64, Descriptor)> {
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (index, removal) in removals.iter().enumerate() {
            let reach_m = reach_m(removal);
            for (position, (fid, present)) in self.descriptors.iter().enumerate() {
                let distance_m = distance_m(removal.near, present.anchor());
                if present.class() == removal.class && distance_m <= reach_m && !self.taken.contains(fid) {
                    pairs.push((distance_m, index, position));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut served = vec![false; removals.len()];
        let mut gone = Vec::new();
        for (_, index, position) in pairs {
            let (fid, present) = &self.descriptors[position];
            if !served[index] && !self.taken.contains(fid) {
                served[index] = true;
                self.taken.push(*fid);
                gone.push((*fid, present.clone()));
            }
        }
        for (removal, _) in removals.iter().zip(&served).filter(|(_, served)| !**served) {
            let of_class = self.descriptors.iter().filter(|(_, present)| present.class() == removal.class);
            let nearest_m =
                of_class.map(|(_, present)| distance_m(removal.near, present.anchor())).min_by(f64::total_cmp);
            // A map without any such descriptor has none in any reach; the reach itself is the one honest number then.
            self.reject(
                removal.region,
                "nothing-to-remove",
                nearest_m.unwrap_or(reach_m(removal)),
                reach_m(removal),
                "m",
            );
        }
        gone
    }

    /// Places `objects`, those within reach of a `gone` one of their class as its new place, nearest pairs first; returns
    /// what is gone for good.
    fn move_or_place(
        &mut self,
        objects: Vec<(u32, DynamicDescriptor)>,
        mut gone: Vec<(u64, Descriptor)>,
    ) -> Vec<(u64, Descriptor)> {
        let moved_m = |object: &DynamicDescriptor, before: &Descriptor| {
            let distance_m = distance_m(object.position, before.anchor());
            (before.class() == object.class && distance_m <= MOVE_REACH_M).then_some(distance_m)
        };
        let mut objects: Vec<Option<(u32, DynamicDescriptor)>> = objects.into_iter().map(Some).collect();
        loop {
            let mut nearest: Option<(f64, usize, usize)> = None;
            for (index, (_, object)) in
                objects.iter().enumerate().filter_map(|(at, object)| Some((at, object.as_ref()?)))
            {
                for (at, (_, before)) in gone.iter().enumerate() {
                    let is_nearer = |moved_m: &f64| nearest.is_none_or(|(least_m, ..)| *moved_m < least_m);
                    if let Some(moved_m) = moved_m(object, before).filter(is_nearer) {
                        nearest = Some((moved_m, index, at));
                    }
                }
            }
            let Some((moved_m, index, at)) = nearest else { break };
            let (Some((region, object)), (fid, before)) = (objects[index].take(), gone.swap_remove(at)) else { break };
            // That it is seen to be gone from its place speaks for a move, so two sigmas are enough.
            let sigma_m = |sigma: Option<Uncertainty>| sigma.map_or(0.0, |sigma| sigma.position_m);
            let limit_m = LEAST_MOVE_M.max(MOVE_SIGMAS * sigma_m(before.sigma()).hypot(sigma_m(object.sigma)));
            if moved_m > limit_m {
                let after = Descriptor::Dynamic(object);
                self.resolution.changes.push(Change::Modify { fid, before, after });
            } else {
                self.reject(region, "already-on-map", moved_m, limit_m, "m");
            }
        }
        for (region, object) in objects.into_iter().flatten() {
            self.place(region, Descriptor::Dynamic(object));
        }
        gone
    }

    fn reject(&mut self, region: u32, requirement: &str, measured: f64, limit: f64, unit: &str) {
        let Some(region) = self.regions.get(region as usize) else { return };
        self.resolution.rejections.push(Rejection {
            class_before: region.class_before,
            class_after: region.class_after,
            pixels: region.pixels,
            requirement: requirement.to_owned(),
            measured,
            limit,
            unit: unit.to_owned(),
        });
    }
}

fn reach_m(removal: &Removal) -> f64 {
    REMOVAL_REACH_M.max(3.0 * removal.sigma_m)
}

fn distance_m(a: GridPoint, b: GridPoint) -> f64 {
    a.plan_distance_m(&b).hypot(a.height_m - b.height_m)
}

fn relation(present: &Descriptor, measured: &Descriptor) -> Relation {
    match (present, measured) {
        (Descriptor::Material(present), Descriptor::Material(measured)) => material_relation(present, measured),
        (Descriptor::Dynamic(present), Descriptor::Dynamic(measured)) => dynamic_relation(present, measured),
        _ => Relation::Unrelated,
    }
}

fn material_relation(present: &MaterialDescriptor, measured: &MaterialDescriptor) -> Relation {
    let Some(overlap) = Overlap::of(present, measured) else { return Relation::Unrelated };
    if overlap.over_union() < SAME_OVER_UNION && overlap.over_smaller() < COVERS_OVER_SMALLER {
        return Relation::Unrelated;
    }
    if present.class != measured.class {
        return Relation::Replaces;
    }
    let sigma_m = |of: fn(&Uncertainty) -> Option<f64>| {
        let one = |descriptor: &MaterialDescriptor| descriptor.sigma.as_ref().and_then(of).unwrap_or(0.0);
        one(present).hypot(one(measured))
    };
    let diagonal_m = distance_m(present.corners[0], present.corners[2]);
    let at_least = |least_m: f64, sigma_m: f64| least_m.max(SAME_SHARE * diagonal_m).max(SAME_SIGMAS * sigma_m);
    let moved_m = distance_m(present.centre(), measured.centre());
    let limit_m = at_least(SAME_CENTRE_M, sigma_m(|sigma| Some(sigma.position_m)));
    let sides = |descriptor: &MaterialDescriptor| {
        [0, 1].map(|side| distance_m(descriptor.corners[side], descriptor.corners[side + 1]))
    };
    let ([width, height], [other_width, other_height]) = (sides(present), sides(measured));
    let grown_m = (width - other_width).abs().max((height - other_height).abs());
    let side_limit_m = at_least(SAME_SIDE_M, sigma_m(|sigma| sigma.size_m));
    if moved_m > limit_m || grown_m > side_limit_m {
        return Relation::Replaces;
    }
    Relation::Same { moved_m, limit_m }
}

fn dynamic_relation(present: &DynamicDescriptor, measured: &DynamicDescriptor) -> Relation {
    let moved_m = distance_m(present.position, measured.position);
    let size_m = SAME_OBJECT_SHARE * present.size_m[0].min(present.size_m[1]);
    if present.class != measured.class || moved_m > size_m {
        return Relation::Unrelated;
    }
    let limit_m = move_limit_m(present.sigma, measured.sigma, size_m);
    // Two objects cannot stand within each other: one that is surely elsewhere by less than its size was moved.
    if moved_m <= limit_m { Relation::Same { moved_m, limit_m } } else { Relation::Replaces }
}

/// How far apart two measurements of one object may be, at most `size_m`; as much where one does not say how sure it is.
fn move_limit_m(present: Option<Uncertainty>, measured: Option<Uncertainty>, size_m: f64) -> f64 {
    let (Some(present), Some(measured)) = (present, measured) else { return size_m };
    (SAME_SIGMAS * present.position_m.hypot(measured.position_m)).max(LEAST_MOVE_M).min(size_m)
}

#[cfg(test)]
mod tests {
    use super::super::overlap::tests::banner;
    use super::*;
    use resurvey_schema::PixelBox;

    fn region() -> ChangeRegion {
        let bounds = PixelBox { left: 0, top: 0, right: 1, bottom: 1 };
        ChangeRegion { class_before: ClassId(0), class_after: ClassId(3), bounds, mask: vec![1], pixels: 1 }
    }

    fn chair(east: f64) -> Descriptor {
        Descriptor::Dynamic(DynamicDescriptor {
            class: ClassId(5),
            position: GridPoint::new(836_700.0 + east, 818_430.0, 7.2),
            size_m: [0.5, 0.5, 0.9],
            yaw_rad: None,
            sigma: None,
        })
    }

    fn place(descriptor: Descriptor) -> Proposal {
        Proposal::Place { region: 0, descriptor }
    }

    fn remove(near: &Descriptor, sigma_m: f64) -> Proposal {
        Proposal::Remove { region: 0, class: near.class(), near: near.anchor(), sigma_m }
    }

    #[test]
    fn a_banner_that_is_there_already_is_not_added_again() {
        let map = [(7, Descriptor::Material(banner(0.0, 0.0, 6.0, 4.0)))];
        let seen = Descriptor::Material(banner(0.2, 0.2, 6.1, 4.0));
        let resolution = resolve(vec![place(seen)], &[region()], &map);
        assert!(resolution.changes.is_empty());
        assert_eq!(resolution.rejections[0].requirement, "already-on-map");
    }

    #[test]
    fn a_grown_banner_is_a_modification_not_an_add_beside_a_remove() {
        let before = Descriptor::Material(banner(0.0, 0.0, 6.0, 4.0));
        let after = Descriptor::Material(banner(-1.0, 0.0, 9.0, 4.0));
        let resolution = resolve(vec![place(after.clone()), remove(&before, 0.1)], &[region()], &[(7, before.clone())]);
        assert_eq!(resolution.changes, [Change::Modify { fid: 7, before, after }]);
        assert_eq!(resolution.rejections[0].requirement, "nothing-to-remove");
    }

    #[test]
    fn a_banner_on_another_wall_is_new() {
        let map = [(7, Descriptor::Material(banner(0.0, 0.0, 6.0, 4.0)))];
        let other = Descriptor::Material(banner(0.0, 20.0, 6.0, 4.0));
        assert_eq!(resolve(vec![place(other.clone())], &[region()], &map).changes, [Change::Add(other)]);
    }

    #[test]
    fn two_removals_take_two_chairs_and_each_the_nearest() {
        let map = [(1, chair(0.0)), (2, chair(1.1)), (3, chair(50.0))];
        let resolution = resolve(vec![remove(&chair(1.0), 0.2), remove(&chair(0.4), 0.2)], &[region()], &map);
        let gone: Vec<u64> = resolution
            .changes
            .iter()
            .map(|change| match change {
                Change::Remove { fid, .. } => *fid,
                other => panic!("expected a removal, found {other:?}"),
            })
            .collect();
        assert_eq!(gone, [2, 1]);
    }

    #[test]
    fn a_chair_that_is_gone_here_and_seen_half_a_metre_away_was_moved() {
        let map = [(1, chair(0.0)), (2, chair(5.0))];
        for moved_m in [0.45, 0.6, 2.0] {
            let proposals = vec![remove(&chair(0.0), 0.2), place(chair(moved_m))];
            let resolution = resolve(proposals, &[region()], &map);
            let expected = Change::Modify { fid: 1, before: chair(0.0), after: chair(moved_m) };
            assert_eq!((resolution.changes, resolution.rejections), (vec![expected], vec![]));
        }
    }

    #[test]
    fn a_chair_surely_seen_within_its_own_size_beside_its_place_was_moved() {
        let sure = |east: f64, position_m: f64| match chair(east) {
            Descriptor::Dynamic(chair) => {
                let sigma = Some(Uncertainty { position_m, size_m: None, area_m2: None });
                Descriptor::Dynamic(DynamicDescriptor { sigma, ..chair })
            }
            material @ Descriptor::Material(_) => material,
        };
        let map = [(1, sure(0.0, 0.05))];
        let moved = resolve(vec![place(sure(0.45, 0.1))], &[region()], &map);
        assert_eq!(moved.changes, [Change::Modify { fid: 1, before: sure(0.0, 0.05), after: sure(0.45, 0.1) }]);
        let unsure = resolve(vec![place(sure(0.45, 0.3))], &[region()], &map);
        assert_eq!((unsure.changes, unsure.rejections[0].requirement.as_str()), (vec![], "already-on-map"));
    }

    #[test]
    fn a_chair_that_is_gone_here_and_seen_here_stayed() {
        let resolution = resolve(vec![remove(&chair(0.0), 0.2), place(chair(0.1))], &[region()], &[(1, chair(0.0))]);
        assert!(resolution.changes.is_empty());
        assert_eq!(resolution.rejections[0].requirement, "already-on-map");
    }

    #[test]
    fn one_of_two_moved_chairs_takes_the_nearer_place() {
        let map = [(1, chair(0.0)), (2, chair(1.5))];
        let proposals = vec![remove(&chair(0.0), 0.2), remove(&chair(1.5), 0.2), place(chair(0.7)), place(chair(2.1))];
        let resolution = resolve(proposals, &[region()], &map);
        let moves: Vec<(u64, Descriptor)> = resolution
            .changes
            .into_iter()
            .map(|change| match change {
                Change::Modify { fid, after, .. } => (fid, after),
                other => panic!("expected a move, found {other:?}"),
            })
            .collect();
        assert_eq!(moves, [(2, chair(2.1)), (1, chair(0.7))]);
    }

    #[test]
    fn a_chair_100_m_away_is_not_removed() {
        let resolution = resolve(vec![remove(&chair(0.0), 0.2)], &[region()], &[(3, chair(100.0))]);
        assert!(resolution.changes.is_empty());
        let Rejection { requirement, measured, limit, .. } = &resolution.rejections[0];
        assert_eq!((requirement.as_str(), measured.round(), *limit), ("nothing-to-remove", 100.0, 3.0));
    }

    #[test]
    fn a_chair_beside_another_is_a_second_chair() {
        let resolution = resolve(vec![place(chair(1.1))], &[region()], &[(1, chair(0.0))]);
        assert_eq!(resolution.changes, [Change::Add(chair(1.1))]);
    }
}
