//! What the host does for a plugin in another process during a call: it takes results and answers requests.

use super::call_log::CallLog;
use super::lending::{Lending, first, view_bytes};
use super::link::Handled;
use super::memory::Plain;
use super::translate;
use crate::plugin::check::{Rules, Violation, violation};
use crate::plugin::results::{Collected, MOST_RESULTS};
use crate::plugin::services::{
    SERVICE_PANICKED, ServiceError, Services, class_slots, finite, finite_points, finite_poses, some_columns,
    some_stride,
};
use resurvey_schema::abi;
use resurvey_schema::service::{ClassCounts, ClassSet, CompareRequest, Level, PanoramaRequest};
use resurvey_schema::wire::{
    Array, CastRaysRequest, ComparePanoramasRequest, CompareViewsRequest, Dtype, NearFeature, RenderRequest, Served,
    ToHost, ToPlugin, WireProposal, WireRegion,
};
use resurvey_schema::{ChangeRegion, ClassId, GridPoint, PixelBox, Pose, Wgs84};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Bytes that one answer may hold.
const MOST_ANSWERED: usize = 256 << 20;
/// Bytes of masks and texts that the results of one call may hold.
const MOST_TAKEN: usize = 256 << 20;
/// Bytes of the views that one answer should hold.
const ANSWERED_VIEWS: usize = 32 << 20;
/// Numbers in [`ClassCounts`].
const COUNTS: usize = size_of::<ClassCounts>() / size_of::<u32>();

/// One call, as its requests see it.
pub(super) struct Desk<'a> {
    services: &'a dyn Services,
    rules: Rules<'a>,
    /// Size of the photo, pixels.
    size: (u32, u32),
    /// Where answers begin in the memory.
    mark: usize,
    collected: Collected,
    /// Bytes of masks and texts in it.
    taken: usize,
    log: CallLog,
}

type Answer = Result<Served, ServiceError>;

fn wrong<T>(text: impl Into<String>) -> Result<T, ServiceError> {
    Err(ServiceError(text.into()))
}

fn no_memory(error: &std::io::Error) -> ServiceError {
    ServiceError(format!("the host has no memory for the answer: {error}"))
}

impl<'a> Desk<'a> {
    /// A desk for a call whose inputs are lent already.
    pub(super) fn new(services: &'a dyn Services, rules: Rules<'a>, lending: &Lending) -> Self {
        let size = (rules.width, rules.height);
        let (mark, collected, log) = (lending.mark(), Collected::default(), CallLog::default());
        Self { services, rules, size, mark, collected, taken: 0, log }
    }

    /// All results of the call.
    pub(super) fn finish(self) -> Collected {
        self.log.finish(self.services);
        self.collected
    }

    /// Does what one message asks for. A panic of a service is a bug of the host, and no reason to end the run.
    pub(super) fn handle(&mut self, lending: &mut Lending, message: &ToHost) -> Handled {
        let handled = catch_unwind(AssertUnwindSafe(|| self.handle_one(lending, message)));
        handled.unwrap_or_else(|_| match message {
            ToHost::Log { .. } | ToHost::Progress(_) => Handled::Noted,
            _ => Handled::Reply(Box::new(ToPlugin::Error { text: SERVICE_PANICKED.to_owned() })),
        })
    }

    fn handle_one(&mut self, lending: &mut Lending, message: &ToHost) -> Handled {
        lending.back_to(self.mark);
        let answer = match message {
            ToHost::Heat { cells } => self.take(lending, |desk, lending| desk.heat(lending, cells)),
            ToHost::Regions(regions) => self.take(lending, |desk, lending| desk.regions(lending, regions)),
            ToHost::Proposals(proposals) => self.take(lending, |desk, _| {
                proposals.iter().try_for_each(|proposal| {
                    let index = desk.collected.proposals.len();
                    let bytes = match proposal {
                        WireProposal::Reject(rejected) => rejected.requirement.len() + rejected.unit.len(),
                        _ => 0,
                    };
                    desk.has_room(index, "proposal", bytes)?;
                    let mut proposal = translate::proposal(proposal.clone());
                    desk.rules.proposal(index, &mut proposal)?;
                    desk.collected.proposals.push(proposal);
                    Ok(())
                })
            }),
            ToHost::Log { level, text } => {
                let level = match level.as_str() {
                    "warning" => Level::Warning,
                    "info" => Level::Info,
                    _ => Level::Debug,
                };
                self.log.take(self.services, level, text);
                return Handled::Noted;
            }
            ToHost::Progress(fraction) => {
                let fraction = f64::from(*fraction);
                if !fraction.is_nan() {
                    self.services.progress(fraction.clamp(0.0, 1.0));
                }
                return Handled::Noted;
            }
            request => match self.answer(lending, request) {
                Some(answer) => answer,
                None => return Handled::OutOfTurn,
            },
        };
        Handled::Reply(Box::new(match answer {
            Ok(served) => ToPlugin::Served(Served { memory: lending.memory.bytes(), ..served }),
            Err(ServiceError(text)) => ToPlugin::Error { text },
        }))
    }

    fn answer(&self, lending: &mut Lending, request: &ToHost) -> Option<Answer> {
        let services = self.services;
        Some(match request {
            ToHost::Render(request) => self.render(lending, request),
            ToHost::CompareViews(request) => self.compare_views(lending, request),
            ToHost::ComparePanoramas(request) => self.compare_panoramas(lending, request),
            ToHost::CastRays(request) => self.cast_rays(lending, request),
            ToHost::InsideSolid(request) => points(lending, &request.points).and_then(|points| {
                let inside: Vec<u8> = services.inside_solid(&points)?.into_iter().map(u8::from).collect();
                values(lending, &[points.len()], &inside)
            }),
            ToHost::PixelRays(request) => read::<[f64; 2]>(lending, &request.pixels).and_then(|pixels| {
                let pose = pose(request.pose)?;
                finite(pixels.as_flattened())?;
                values(lending, &[pixels.len(), 3], &services.pixel_rays(&pose, &pixels)?)
            }),
            ToHost::Project(request) => points(lending, &request.points).and_then(|points| {
                let found = services.project(&pose(request.pose)?, &points)?;
                let pixels: Vec<[f64; 2]> = found.into_iter().map(|pixel| pixel.unwrap_or([f64::NAN; 2])).collect();
                values(lending, &[points.len(), 2], &pixels)
            }),
            ToHost::DescriptorsNear { point, radius_m } => self.descriptors_near(*point, *radius_m),
            ToHost::GroundHeight { point } => grid(*point).and_then(|point| {
                let height_m = services.ground_height(point)?;
                Ok(Served { height_m, ..Served::default() })
            }),
            ToHost::GridFromWgs84 { position } => finite(position).and_then(|()| {
                let [latitude_deg, longitude_deg, ellipsoidal_height_m] = *position;
                let found = services.grid_from_wgs84(Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m })?;
                Ok(Served { position: Some(found.into()), ..Served::default() })
            }),
            ToHost::Wgs84FromGrid { point } => grid(*point).and_then(|point| {
                let found = services.wgs84_from_grid(point)?;
                let position = [found.latitude_deg, found.longitude_deg, found.ellipsoidal_height_m];
                Ok(Served { position: Some(position), ..Served::default() })
            }),
            _ => return None,
        })
    }

    fn render(&self, lending: &mut Lending, request: &RenderRequest) -> Answer {
        let poses = poses(lending, &request.poses)?;
        some_stride(request.stride)?;
        let size = (self.size.0.div_ceil(request.stride), self.size.1.div_ceil(request.stride));
        let most = (ANSWERED_VIEWS / view_bytes(size)).clamp(1, poses.len().max(1));
        let poses = &poses[..most.min(poses.len())];
        let (mut place, mut failure, mut count) = (None, None, 0);
        self.services.render(request.stride, request.with_descriptors, poses, &mut |view| {
            let size = (view.labels.width(), view.labels.height());
            if place.is_none() {
                match lending.reserve_views(poses.len(), size, view.feature_table) {
                    Ok(views) => place = Some(views),
                    Err(error) => failure = Some(no_memory(&error)),
                }
            }
            if let Some(views) = place.as_ref().filter(|_| count < poses.len()) {
                lending.put_view(views, count, view);
            }
            count += 1;
        })?;
        match (failure, place) {
            (Some(failure), _) => Err(failure),
            _ if count != poses.len() => wrong("the host has a bug: it rendered another number of views"),
            (None, Some(views)) => Ok(Served { views: Some(first(&views, count)), ..Served::default() }),
            (None, None) => wrong("there are no poses to render"),
        }
    }

    fn compare_views(&self, lending: &mut Lending, request: &CompareViewsRequest) -> Answer {
        let poses = poses(lending, &request.poses)?;
        some_stride(request.stride)?;
        finite(&[request.boundary_tolerance_px])?;
        let how = CompareRequest {
            stride: request.stride,
            ignored_in_photo: ClassSet(request.ignored_in_photo),
            ignored_in_view: ClassSet(request.ignored_in_view),
            boundary_tolerance_px: request.boundary_tolerance_px,
        };
        let slots = class_slots(self.services.classes());
        let mut counts = counts(&[poses.len(), slots])?;
        self.services.compare_views(&how, &poses, &mut counts)?;
        values(lending, &[poses.len(), slots, COUNTS], &counts)
    }

    fn compare_panoramas(&self, lending: &mut Lending, request: &ComparePanoramasRequest) -> Answer {
        let positions = points(lending, &request.positions)?;
        finite(&[request.first_yaw_rad, request.pitch_rad, request.roll_rad])?;
        some_columns(request.columns)?;
        let how = PanoramaRequest {
            pitch_rad: request.pitch_rad,
            roll_rad: request.roll_rad,
            first_yaw_rad: request.first_yaw_rad,
            yaw_step_columns: request.yaw_step_columns,
            yaw_count: request.yaw_count,
            columns: request.columns,
            ignored_in_photo: ClassSet(request.ignored_in_photo),
            ignored_in_view: ClassSet(request.ignored_in_view),
        };
        let (slots, yaws) = (class_slots(self.services.classes()), request.yaw_count as usize);
        let mut counts = counts(&[positions.len(), yaws, slots])?;
        self.services.compare_panoramas(&how, &positions, &mut counts)?;
        values(lending, &[positions.len(), yaws, slots, COUNTS], &counts)
    }

    fn cast_rays(&self, lending: &mut Lending, request: &CastRaysRequest) -> Answer {
        let directions = read::<[f64; 3]>(lending, &request.directions)?;
        finite(directions.as_flattened())?;
        let limit_m = request.limit_m.unwrap_or(f64::INFINITY);
        let found = self.services.cast_rays(grid(request.origin)?, &directions, limit_m, request.with_descriptors)?;
        let hit = |hit: &Option<_>| hit.as_ref().map_or(abi::RayHit::MISS, crate::plugin::lend::ray_hit);
        let hits: Vec<abi::RayHit> = found.iter().map(hit).collect();
        values(lending, &[directions.len()], &hits)
    }

    fn descriptors_near(&self, point: [f64; 3], radius_m: f64) -> Answer {
        let point = grid(point)?;
        finite(&[radius_m])?;
        let found = self.services.descriptors_near(point, radius_m)?;
        let near = |(fid, descriptor)| NearFeature { fid, descriptor: translate::wire_descriptor(&descriptor) };
        Ok(Served { features: Some(found.into_iter().map(near).collect()), ..Served::default() })
    }

    /// Takes results; after the first that breaks a rule no more are taken.
    fn take(&mut self, lending: &Lending, body: impl FnOnce(&mut Self, &Lending) -> Result<(), Violation>) -> Answer {
        if self.collected.violation.is_none() {
            self.collected.violation = body(self, lending).err();
        }
        match &self.collected.violation {
            None => Ok(Served::default()),
            Some(Violation { field, value, expected }) => {
                wrong(format!("the host does not take {field} = {value}; expected {expected}"))
            }
        }
    }

    /// Refuses result `index`, with so many bytes beside the result itself, when it is too much.
    fn has_room(&mut self, index: usize, what: &str, bytes: usize) -> Result<(), Violation> {
        self.taken = self.taken.saturating_add(bytes);
        if index < MOST_RESULTS && self.taken <= MOST_TAKEN {
            return Ok(());
        }
        let expected = format!("at most {MOST_RESULTS} results with {MOST_TAKEN} bytes of masks and texts");
        violation(format!("{what}[{index}]"), &"one too many", expected)
    }

    fn heat(&mut self, lending: &Lending, cells: &Array) -> Result<(), Violation> {
        match lending.sent::<[f64; 3]>(cells) {
            Some(cells) if cells.len() <= MOST_RESULTS - self.collected.heat.len() => {
                self.collected.heat.extend(cells);
                Ok(())
            }
            _ => violation("heat", &format_args!("{cells:?}"), format!("at most {MOST_RESULTS} cells in the scratch")),
        }
    }

    fn regions(&mut self, lending: &Lending, regions: &[WireRegion]) -> Result<(), Violation> {
        for region in regions {
            let index = self.collected.regions.len();
            self.has_room(index, "region", Array::packed_bytes(Dtype::U8, &region.mask.shape).unwrap_or(usize::MAX))?;
            let Some(mask) = lending.sent::<u8>(&region.mask) else {
                let value = format!("{:?}", region.mask);
                return violation(format!("region[{index}].mask"), &value, "packed bytes in the scratch");
            };
            let [left, top, right, bottom] = region.bounds;
            let region = ChangeRegion {
                class_before: ClassId(region.class_before),
                class_after: ClassId(region.class_after),
                bounds: PixelBox { left, top, right, bottom },
                mask,
                pixels: region.pixels,
            };
            self.rules.region(index, &region)?;
            self.collected.regions.push(region);
        }
        Ok(())
    }
}

/// The rows of an array of a request.
fn read<T: Plain>(lending: &Lending, array: &Array) -> Result<Vec<T>, ServiceError> {
    let values = lending.sent(array);
    values
        .ok_or_else(|| ServiceError(format!("expected packed rows of {:?} in the scratch, found {array:?}", T::DTYPE)))
}

fn points(lending: &Lending, array: &Array) -> Result<Vec<GridPoint>, ServiceError> {
    let points: Vec<GridPoint> = read::<[f64; 3]>(lending, array)?.into_iter().map(Into::into).collect();
    finite_points(&points)?;
    Ok(points)
}

fn poses(lending: &Lending, array: &Array) -> Result<Vec<Pose>, ServiceError> {
    let poses: Vec<Pose> = read::<[f64; 6]>(lending, array)?.into_iter().map(Into::into).collect();
    finite_poses(&poses)?;
    Ok(poses)
}

fn pose(values: [f64; 6]) -> Result<Pose, ServiceError> {
    let pose = values.into();
    finite_poses(&[pose])?;
    Ok(pose)
}

fn grid(values: [f64; 3]) -> Result<GridPoint, ServiceError> {
    let point = values.into();
    finite_points(&[point])?;
    Ok(point)
}

/// Zeroed counts, unless there are too many.
fn counts(shape: &[usize]) -> Result<Vec<ClassCounts>, ServiceError> {
    let bytes = Array::packed_bytes(Dtype::U32, shape).and_then(|bytes| bytes.checked_mul(COUNTS));
    match bytes {
        Some(bytes) if bytes <= MOST_ANSWERED => Ok(vec![ClassCounts::default(); shape.iter().product()]),
        _ => wrong(format!("the answer would have more than {MOST_ANSWERED} bytes; ask for fewer at a time")),
    }
}

/// An answer with `values`, the rows of `shape`.
fn values<T: Plain>(lending: &mut Lending, shape: &[usize], values: &[T]) -> Answer {
    if size_of_val(values) > MOST_ANSWERED {
        return wrong(format!("the answer would have more than {MOST_ANSWERED} bytes; ask for fewer at a time"));
    }
    let array = lending.lend(shape, values).map_err(|error| no_memory(&error))?;
    Ok(Served { values: Some(array), ..Served::default() })
}
