//! The host's services in the process of a plugin: each is a request over the wire.

use super::call_log::{LONGEST_LINE, cut};
use super::memory::Plain;
use super::talk::{Ends, Talk};
use super::translate;
use super::wire::Silence;
use crate::image::{LabelImage, Raster};
use crate::plugin::error::PluginError;
use crate::plugin::input::ViewImages;
use crate::plugin::services::{ServiceError, Services, class_slots};
use resurvey_schema::abi;
use resurvey_schema::service::{ClassCounts, CompareRequest, Level, PanoramaRequest, RayHit, ViewFeature};
use resurvey_schema::wire::{
    Array, CastRaysRequest, ComparePanoramasRequest, CompareViewsRequest, Number, PixelRaysRequest, PointsRequest,
    ProjectRequest, RenderRequest, Scratch, Served, ToHost, ToPlugin, WireRegion, WireViews,
};
use resurvey_schema::{ChangeRegion, Class, ClassId, ClassTable, Descriptor, GridPoint, Pose, Proposal, Wgs84};

/// Bytes of counts that one answer should hold.
const ASKED_COUNTS: usize = 32 << 20;
/// Regions and proposals in one message: far from the longest line.
const MESSAGE_RESULTS: usize = 500;

/// The services during one call.
pub(super) struct Asking<'a> {
    talk: &'a Talk,
    scratch: Scratch,
    classes: ClassTable,
}

fn error(text: impl Into<String>) -> ServiceError {
    ServiceError(text.into())
}

fn gone() -> ServiceError {
    error("the host has gone")
}

fn not_served() -> ServiceError {
    error("the host has a bug: its answer is not in the memory")
}

impl<'a> Asking<'a> {
    pub(super) fn new(talk: &'a Talk, scratch: Scratch, classes: &[Class]) -> Result<Self, PluginError> {
        let classes = ClassTable::new(classes.to_vec()).map_err(|wrong| PluginError::InvalidInput {
            plugin: "of this process".to_owned(),
            text: wrong.to_string(),
        })?;
        Ok(Self { talk, scratch, classes })
    }

    /// Asks, waits, and reads the answer before anyone else asks.
    fn ask<T>(
        &self,
        write: impl FnOnce(&Writer<'_>) -> Option<ToHost>,
        read: impl FnOnce(&Ends, Served) -> Option<T>,
    ) -> Result<T, ServiceError> {
        let mut ends = self.talk.lock();
        let message = write(&Writer { ends: &ends, scratch: self.scratch });
        let message = message.ok_or_else(|| error("the request is larger than the memory for it"))?;
        ends.wire.send(&message, || true).map_err(|_| gone())?;
        let mut answer = ends.wire.receive::<ToPlugin>();
        // A signal that the plugin handles interrupts the waiting.
        while matches!(answer, Err(Silence::Waiting)) {
            answer = ends.wire.receive();
        }
        match answer {
            Ok(ToPlugin::Served(served)) => {
                ends.memory.follow(served.memory).map_err(|failure| error(failure.to_string()))?;
                read(&ends, served).ok_or_else(not_served)
            }
            Ok(ToPlugin::Error { text }) => Err(error(text)),
            _ => Err(gone()),
        }
    }

    /// Asks with `rows` in pieces that fit; `request` makes the message, and the values of all answers are joined.
    fn ask_rows<R: Plain, T: Plain>(
        &self,
        rows: &[R],
        most: usize,
        request: impl Fn(Array) -> ToHost,
    ) -> Result<Vec<T>, ServiceError> {
        let mut all = Vec::new();
        for piece in rows.chunks(self.most::<R>().min(most)) {
            let values = self.ask(
                |writer| Some(request(writer.rows(piece)?)),
                |ends, served| ends.memory.array::<T>(&served.values?),
            )?;
            all.extend(values);
        }
        Ok(all)
    }

    /// Rows that fit into the scratch.
    fn most<R>(&self) -> usize {
        (self.scratch.bytes / size_of::<R>()).max(1)
    }

    /// Hands the heat map of a search to the host.
    pub(super) fn deliver_heat(&self, heat: &[[f64; 3]]) -> Result<(), PluginError> {
        for cells in heat.chunks(self.most::<[f64; 3]>()) {
            self.deliver(|writer| Some(ToHost::Heat { cells: writer.rows(cells)? }))?;
        }
        Ok(())
    }

    /// Hands regions to the host.
    pub(super) fn deliver_regions(&self, regions: &[ChangeRegion]) -> Result<(), PluginError> {
        let mut left = regions;
        while !left.is_empty() {
            let mut bytes = 0;
            let fitting = left.iter().take(MESSAGE_RESULTS).take_while(|region| {
                bytes += region.mask.len();
                bytes <= self.scratch.bytes
            });
            let count = fitting.count().max(1);
            let (now, later) = left.split_at(count);
            self.deliver(|writer| writer.regions(now).map(ToHost::Regions))?;
            left = later;
        }
        Ok(())
    }

    /// Hands proposals to the host.
    pub(super) fn deliver_proposals(&self, proposals: &[Proposal]) -> Result<(), PluginError> {
        for piece in proposals.chunks(MESSAGE_RESULTS) {
            let piece: Vec<_> = piece.iter().map(translate::wire_proposal).collect();
            self.deliver(|_| Some(ToHost::Proposals(piece)))?;
        }
        Ok(())
    }

    fn deliver(&self, write: impl FnOnce(&Writer<'_>) -> Option<ToHost>) -> Result<(), PluginError> {
        self.ask(write, |_, _| Some(()))
            .map_err(|ServiceError(text)| PluginError::InvalidInput { plugin: "of this process".to_owned(), text })
    }

    fn note(&self, message: &ToHost) {
        // Without a host the end of the wire is noticed soon enough.
        let _ = self.talk.say(message);
    }
}

/// Writes what a request needs into the scratch.
struct Writer<'a> {
    ends: &'a Ends,
    scratch: Scratch,
}

impl Writer<'_> {
    fn at<T: Plain>(&self, offset: usize, shape: &[usize], values: &[T]) -> Option<Array> {
        let end = offset.checked_add(size_of_val(values))?;
        let fits = end <= self.scratch.bytes && self.ends.memory.write(self.scratch.offset + offset, values);
        fits.then(|| Array::packed(T::DTYPE, shape, self.scratch.offset + offset))
    }

    /// Rows of numbers.
    fn rows<R: Plain>(&self, rows: &[R]) -> Option<Array> {
        self.at(0, &[rows.len(), size_of::<R>() / R::DTYPE.bytes()], rows)
    }

    fn regions(&self, regions: &[ChangeRegion]) -> Option<Vec<WireRegion>> {
        let mut offset = 0;
        let one = |region: &ChangeRegion| {
            let bounds = region.bounds;
            let shape = [bounds.height() as usize, bounds.width() as usize];
            let mask = self.at(offset, &shape, &region.mask)?;
            offset += region.mask.len();
            Some(WireRegion {
                class_before: region.class_before.0,
                class_after: region.class_after.0,
                bounds: [bounds.left, bounds.top, bounds.right, bounds.bottom],
                pixels: region.pixels,
                mask,
            })
        };
        regions.iter().map(one).collect()
    }
}

/// A view that was copied out of the memory.
struct Copied {
    origin: GridPoint,
    labels: LabelImage,
    range_m: Raster<f32>,
    points: Raster<[f32; 3]>,
    features: Raster<u32>,
}

/// Copies the views of an answer, with their table.
fn copy(ends: &Ends, views: &WireViews) -> Option<(Vec<Copied>, Vec<ViewFeature>)> {
    let memory = &ends.memory;
    let [count, height, width] = views.labels.shape[..] else { return None };
    let pixels = height.checked_mul(width)?;
    let (width, height) = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
    let origins = memory.array::<[f64; 3]>(&views.origins)?;
    let mut labels = memory.array::<u8>(&views.labels)?.into_iter();
    let mut range_m = memory.array::<f32>(&views.range_m)?.into_iter();
    let mut points = memory.array::<[f32; 3]>(&views.points)?.into_iter();
    let mut features = memory.array::<u32>(&views.features)?.into_iter();
    let mut copied = Vec::with_capacity(count);
    for origin in origins {
        copied.push(Copied {
            origin: origin.into(),
            labels: Raster::from_values(width, height, labels.by_ref().take(pixels).collect())?,
            range_m: Raster::from_values(width, height, range_m.by_ref().take(pixels).collect())?,
            points: Raster::from_values(width, height, points.by_ref().take(pixels).collect())?,
            features: Raster::from_values(width, height, features.by_ref().take(pixels).collect())?,
        });
    }
    Some((copied, memory.array::<ViewFeature>(&views.feature_table)?))
}

fn pose_rows(poses: &[Pose]) -> Vec<[f64; 6]> {
    poses.iter().map(|pose| (*pose).into()).collect()
}

fn point_rows(points: &[GridPoint]) -> Vec<[f64; 3]> {
    points.iter().map(|point| (*point).into()).collect()
}

/// Requests of one answer, so that it stays small enough.
fn most_counts(counts: usize) -> usize {
    (ASKED_COUNTS / (counts.max(1) * size_of::<ClassCounts>())).max(1)
}

impl Services for Asking<'_> {
    fn classes(&self) -> &ClassTable {
        &self.classes
    }

    fn render(
        &self,
        stride: u32,
        with_descriptors: bool,
        poses: &[Pose],
        receive: &mut dyn FnMut(&ViewImages<'_>),
    ) -> Result<(), ServiceError> {
        let (rows, mut done) = (pose_rows(poses), 0);
        while done < rows.len() {
            let piece = &rows[done..rows.len().min(done + self.most::<[f64; 6]>())];
            let write = |writer: &Writer<'_>| {
                Some(ToHost::Render(RenderRequest { stride, with_descriptors, poses: writer.rows(piece)? }))
            };
            // The plugin may ask for more while it receives: the views are copied, and nothing is held.
            let (views, table) = self.ask(write, |ends, served| copy(ends, &served.views?))?;
            if views.is_empty() {
                return Err(not_served());
            }
            done += views.len();
            for view in &views {
                receive(&ViewImages {
                    origin: view.origin,
                    labels: &view.labels,
                    range_m: &view.range_m,
                    points: &view.points,
                    features: &view.features,
                    feature_table: &table,
                });
            }
        }
        Ok(())
    }

    fn compare_views(
        &self,
        request: &CompareRequest,
        poses: &[Pose],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError> {
        let found = self.ask_rows(&pose_rows(poses), most_counts(class_slots(&self.classes)), |poses| {
            ToHost::CompareViews(CompareViewsRequest {
                stride: request.stride,
                ignored_in_photo: request.ignored_in_photo.0,
                ignored_in_view: request.ignored_in_view.0,
                boundary_tolerance_px: request.boundary_tolerance_px,
                poses,
            })
        })?;
        fill(counts, &found)
    }

    fn compare_panoramas(
        &self,
        request: &PanoramaRequest,
        positions: &[GridPoint],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError> {
        let of_one = class_slots(&self.classes).saturating_mul(request.yaw_count as usize);
        let found = self.ask_rows(&point_rows(positions), most_counts(of_one), |positions| {
            ToHost::ComparePanoramas(ComparePanoramasRequest {
                pitch_rad: request.pitch_rad,
                roll_rad: request.roll_rad,
                first_yaw_rad: request.first_yaw_rad,
                yaw_step_columns: request.yaw_step_columns,
                yaw_count: request.yaw_count,
                columns: request.columns,
                ignored_in_photo: request.ignored_in_photo.0,
                ignored_in_view: request.ignored_in_view.0,
                positions,
            })
        })?;
        fill(counts, &found)
    }

    fn inside_solid(&self, positions: &[GridPoint]) -> Result<Vec<bool>, ServiceError> {
        let request = |points| ToHost::InsideSolid(PointsRequest { points });
        let inside: Vec<u8> = self.ask_rows(&point_rows(positions), usize::MAX, request)?;
        Ok(inside.into_iter().map(|inside| inside != 0).collect())
    }

    fn pixel_rays(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, ServiceError> {
        let pose = (*pose).into();
        self.ask_rows(pixels, usize::MAX, |pixels| ToHost::PixelRays(PixelRaysRequest { pose, pixels }))
    }

    fn project(&self, pose: &Pose, points: &[GridPoint]) -> Result<Vec<Option<[f64; 2]>>, ServiceError> {
        let pose = (*pose).into();
        let request = |points| ToHost::Project(ProjectRequest { pose, points });
        let pixels: Vec<[f64; 2]> = self.ask_rows(&point_rows(points), usize::MAX, request)?;
        Ok(pixels.into_iter().map(|[u, v]| (u.is_finite() && v.is_finite()).then_some([u, v])).collect())
    }

    fn cast_rays(
        &self,
        origin: GridPoint,
        directions: &[[f64; 3]],
        limit_m: f64,
        with_descriptors: bool,
    ) -> Result<Vec<Option<RayHit>>, ServiceError> {
        let (origin, limit_m) = (origin.into(), limit_m.is_finite().then_some(limit_m));
        let request = |directions| ToHost::CastRays(CastRaysRequest { origin, directions, limit_m, with_descriptors });
        let hits: Vec<abi::RayHit> = self.ask_rows(directions, usize::MAX, request)?;
        let hit = |hit: abi::RayHit| {
            (hit.hit != 0).then_some(RayHit {
                point: hit.point,
                range_m: hit.range_m,
                normal: hit.normal,
                class: ClassId(hit.class),
                fid: (hit.has_fid != 0).then_some(hit.fid),
            })
        };
        Ok(hits.into_iter().map(hit).collect())
    }

    fn descriptors_near(&self, point: GridPoint, radius_m: f64) -> Result<Vec<(u64, Descriptor)>, ServiceError> {
        let request = ToHost::DescriptorsNear { point: point.into(), radius_m };
        let near = self.ask(|_| Some(request), |_, served| served.features)?;
        Ok(near.iter().map(|feature| (feature.fid, translate::descriptor(&feature.descriptor))).collect())
    }

    fn ground_height(&self, point: GridPoint) -> Result<Option<f64>, ServiceError> {
        self.ask(|_| Some(ToHost::GroundHeight { point: point.into() }), |_, served| Some(served.height_m))
    }

    fn grid_from_wgs84(&self, position: Wgs84) -> Result<GridPoint, ServiceError> {
        let position = [position.latitude_deg, position.longitude_deg, position.ellipsoidal_height_m];
        let found = self.ask(|_| Some(ToHost::GridFromWgs84 { position }), |_, served| served.position)?;
        Ok(found.into())
    }

    fn wgs84_from_grid(&self, point: GridPoint) -> Result<Wgs84, ServiceError> {
        let request = ToHost::Wgs84FromGrid { point: point.into() };
        let found = self.ask(|_| Some(request), |_, served| served.position)?;
        let [latitude_deg, longitude_deg, ellipsoidal_height_m] = found;
        Ok(Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m })
    }

    fn log(&self, level: Level, text: &str) {
        let level = match level {
            Level::Warning => "warning",
            Level::Info => "info",
            Level::Debug => "debug",
        };
        self.note(&ToHost::Log { level: level.to_owned(), text: cut(text, LONGEST_LINE).to_owned() });
    }

    fn progress(&self, fraction: f64) {
        self.note(&ToHost::Progress(Number(fraction)));
    }

    fn cancelled(&self) -> bool {
        self.talk.cancelled()
    }
}

/// Copies an answer to where the plugin wants it.
fn fill(counts: &mut [ClassCounts], found: &[ClassCounts]) -> Result<(), ServiceError> {
    if counts.len() != found.len() {
        return Err(not_served());
    }
    counts.copy_from_slice(found);
    Ok(())
}
