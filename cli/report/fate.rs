//! What became of each region: the change it led to, or the requirement it missed.

use resurvey_core::update::{Change, Resolution};
use resurvey_schema::{ChangeRegion, Descriptor, GridPoint, Proposal, Rejection};

/// What one proposal about a region came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Index into the changes.
    Changed(usize),
    /// Index into the rejections.
    Dropped(usize),
}

/// The fates of each of `regions`; none for a region that no proposal speaks of. Every change and rejection is given away
/// once: first to the proposals that name it, then removals to the nearest.
pub fn fates(regions: &[ChangeRegion], proposals: &[Proposal], resolution: &Resolution) -> Vec<Vec<Fate>> {
    let mut telling = Telling {
        regions,
        resolution,
        told: vec![false; resolution.rejections.len()],
        made: vec![false; resolution.changes.len()],
        fates: vec![Vec::new(); regions.len()],
    };
    for proposal in proposals {
        if let Proposal::Reject { region, rejection } = proposal {
            telling.drop_by(*region, |other| other.requirement == rejection.requirement);
        }
    }
    for proposal in proposals {
        if let Proposal::Place { region, descriptor } = proposal {
            telling.place(*region, descriptor);
        }
    }
    for proposal in proposals {
        if let Proposal::Remove { region, near, .. } = proposal
            && !telling.drop_by(*region, |_| true)
        {
            telling.remove(*region, *near);
        }
    }
    telling.fates
}

struct Telling<'a> {
    regions: &'a [ChangeRegion],
    resolution: &'a Resolution,
    told: Vec<bool>,
    made: Vec<bool>,
    fates: Vec<Vec<Fate>>,
}

impl Telling<'_> {
    fn give(&mut self, region: u32, fate: Fate) {
        if let Some(fates) = self.fates.get_mut(region as usize) {
            fates.push(fate);
        }
    }

    /// Gives `region` the first rejection of its classes and size that `is_it` takes and nobody has; whether there is one.
    fn drop_by(&mut self, region: u32, is_it: impl Fn(&Rejection) -> bool) -> bool {
        let Some(of) = self.regions.get(region as usize) else { return false };
        let is_of = |rejection: &Rejection| {
            (rejection.class_before, rejection.class_after, rejection.pixels)
                == (of.class_before, of.class_after, of.pixels)
        };
        let rejections = self.resolution.rejections.iter().enumerate();
        let found = rejections.into_iter().find(|(index, other)| !self.told[*index] && is_of(other) && is_it(other));
        let Some((index, _)) = found else { return false };
        self.told[index] = true;
        self.give(region, Fate::Dropped(index));
        true
    }

    fn place(&mut self, region: u32, descriptor: &Descriptor) {
        let after = |change: &Change| match change {
            Change::Add(after) | Change::Modify { after, .. } => Some(after.clone()),
            Change::Remove { .. } => None,
        };
        let changes = self.resolution.changes.iter().enumerate();
        let found = changes
            .into_iter()
            .find(|(index, change)| !self.made[*index] && after(change).as_ref() == Some(descriptor));
        match found {
            Some((index, _)) => {
                self.made[index] = true;
                self.give(region, Fate::Changed(index));
            }
            None => {
                self.drop_by(region, |_| true);
            }
        }
    }

    fn remove(&mut self, region: u32, near: GridPoint) {
        let distance_m = |change: &Change| match change {
            Change::Remove { before, .. } | Change::Modify { before, .. } => {
                Some(before.anchor().plan_distance_m(&near))
            }
            Change::Add(_) => None,
        };
        let changes = self.resolution.changes.iter().enumerate().filter(|(index, _)| !self.made[*index]);
        let nearest = changes
            .filter_map(|(index, change)| Some((distance_m(change)?, index)))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if let Some((_, index)) = nearest {
            self.made[index] = true;
            self.give(region, Fate::Changed(index));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_core::update::resolve;
    use resurvey_schema::{ClassId, DynamicDescriptor, PixelBox};

    fn region(after: u8, pixels: u32) -> ChangeRegion {
        let bounds = PixelBox { left: 0, top: 0, right: 1, bottom: 1 };
        ChangeRegion { class_before: ClassId(0), class_after: ClassId(after), bounds, mask: vec![1], pixels }
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

    #[test]
    fn every_region_is_told_what_became_of_it() {
        let regions = [region(5, 900), region(3, 700), region(0, 500), region(0, 400), region(8, 300)];
        let near = |east: f64| GridPoint::new(836_700.0 + east, 818_430.0, 7.2);
        let rejection = Rejection {
            class_before: ClassId(0),
            class_after: ClassId(3),
            pixels: 700,
            requirement: "rectangle".to_owned(),
            measured: f64::NAN,
            limit: 0.85,
            unit: "ratio".to_owned(),
        };
        let proposals = vec![
            Proposal::Remove { region: 2, class: ClassId(5), near: near(0.2), sigma_m: 0.1 },
            Proposal::Remove { region: 3, class: ClassId(5), near: near(90.0), sigma_m: 0.1 },
            Proposal::Reject { region: 1, rejection },
            Proposal::Place { region: 0, descriptor: chair(20.0) },
        ];
        let resolution = resolve(proposals.clone(), &regions, &[(7, chair(0.0))]);
        let told = fates(&regions, &proposals, &resolution);
        let op = |fates: &[Fate]| match fates {
            [] => "none".to_owned(),
            [Fate::Changed(index)] => match &resolution.changes[*index] {
                Change::Add(_) => "add".to_owned(),
                Change::Modify { .. } => "modify".to_owned(),
                Change::Remove { fid, .. } => format!("remove {fid}"),
            },
            [Fate::Dropped(index)] => resolution.rejections[*index].requirement.clone(),
            several => format!("{several:?}"),
        };
        let words: Vec<String> = told.iter().map(|fates| op(fates)).collect();
        assert_eq!(words, ["add", "rectangle", "remove 7", "nothing-to-remove", "none"]);
    }
}
