//! Everything that one call lends, each piece in memory of its own, with rows padded or structs of another size where a
//! trial wants that.
#![allow(unsafe_code)]

use super::super::lend;
use super::exhibit::{Exhibit, Seen};
use super::finding::Finding;
use super::guard::Block;
use crate::image::Raster;
use resurvey_schema::abi::{self, Growing};
use std::mem::offset_of;

/// How the host's structs look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Host {
    /// Like those of this program.
    #[default]
    Today,
    /// They end earlier, where the rest can be missed.
    Older,
    /// They go on with what nobody knows yet.
    Newer,
}

/// How inputs are laid out.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Layout {
    /// Sizes of structs.
    pub host: Host,
    /// Pixels behind the end of each row.
    pub padding: usize,
    /// There is no place for the text of an error.
    pub is_silent: bool,
}

/// What a newer host writes behind the structs of this version.
const UNKNOWN: [u8; 24] = [0x5A; 24];

/// The blocks of one call.
pub(super) struct Lent {
    layout: Layout,
    blocks: Vec<Block>,
}

/// The inputs of whatever call, ready to be handed in.
pub(super) struct Inputs {
    pub photo_image: *const abi::Image,
    pub photo: *const abi::Photo,
    pub picture: *const abi::Picture,
    pub view: *const abi::View,
    pub comparison: *const abi::Comparison,
    pub regions: *const abi::Region,
    pub region_count: usize,
    pub region_step: usize,
}

/// No more memory for a trial.
fn no_memory() -> Finding {
    Finding::failed("the system has no memory for the trial", "run the check again with more --memory-limit")
}

impl Lent {
    pub(super) fn new(layout: Layout) -> Self {
        Self { layout, blocks: Vec::new() }
    }

    /// Writing to what was lent so far ends the process.
    pub(super) fn seal(&self) {
        self.blocks.iter().for_each(Block::seal);
    }

    /// Using it at all does.
    pub(super) fn close(&self) {
        self.blocks.iter().for_each(Block::close);
    }

    fn bytes(&mut self, name: &'static str, bytes: &[u8], alignment: usize) -> Result<*mut u8, Finding> {
        let block = Block::new(name, bytes, alignment).ok_or_else(no_memory)?;
        let data = block.data();
        self.blocks.push(block);
        Ok(data)
    }

    /// `value`, which an older host would end at `older` (a multiple of 8).
    pub(super) fn growing<T: Growing>(
        &mut self,
        name: &'static str,
        value: T,
        older: usize,
    ) -> Result<*const T, Finding> {
        let bytes = struct_bytes(&value, self.layout.host, older);
        Ok(self.bytes(name, &bytes, align_of::<T>())?.cast_const().cast())
    }

    fn values<T: Copy>(&mut self, name: &'static str, values: &[T]) -> Result<*const T, Finding> {
        // SAFETY: the values of these types are numbers and pointers without padding between them, or with padding that
        // is copied as it comes.
        let bytes = unsafe { std::slice::from_raw_parts(values.as_ptr().cast::<u8>(), size_of_val(values)) };
        Ok(self.bytes(name, bytes, align_of::<T>())?.cast_const().cast())
    }

    fn image<T: Copy>(&mut self, name: &'static str, raster: &Raster<T>, fill: T) -> Result<abi::Image, Finding> {
        let padding = self.layout.padding;
        let rows =
            (0..raster.height()).flat_map(|v| raster.row(v).iter().copied().chain(std::iter::repeat_n(fill, padding)));
        let values: Vec<T> = rows.collect();
        let row_bytes = (raster.width() as usize + padding) * size_of::<T>();
        let data = self.values(name, &values)?;
        Ok(abi::Image { data: data.cast(), row_bytes, ..lend::image(raster) })
    }

    fn view(&mut self, seen: &Seen) -> Result<*const abi::View, Finding> {
        let (labels, range_m) =
            (self.image("view.labels", &seen.labels, 3)?, self.image("view.range_m", &seen.range_m, f32::NAN)?);
        let points = self.image("view.points", &seen.points, [f32::NAN; 3])?;
        let features = self.image("view.features", &seen.features, u32::MAX)?;
        let table: Vec<u64> = seen.feature_table.iter().flat_map(|one| [one.fid, u64::from(one.class.0)]).collect();
        // Little-endian: the class is the first byte behind the id; the padding is zero.
        let feature_table = if cfg!(target_endian = "little") {
            self.values("view.feature_table", &table)?.cast()
        } else {
            self.values("view.feature_table", &seen.feature_table)?
        };
        let view = abi::View { labels, range_m, points, features, feature_table, ..lend::view(&seen.images()) };
        self.growing("view", view, size_of::<abi::View>())
    }

    /// What says where labels go.
    pub(super) fn labels(&mut self, labels: abi::Labels) -> Result<*const abi::Labels, Finding> {
        self.values("labels record", &[labels])
    }

    /// Everything of `exhibit`.
    pub(super) fn inputs(&mut self, exhibit: &Exhibit<'_>) -> Result<Inputs, Finding> {
        let image = self.image("photo", &exhibit.photo, 3)?;
        let photo_image = self.values("photo image", &[image])?;
        let camera = self.growing("camera", lend::camera(&exhibit.camera), offset_of!(abi::Camera, distortion))?;
        let prior = self.growing("prior", lend::prior(&exhibit.prior), size_of::<abi::Prior>())?;
        let older = offset_of!(abi::PoseEstimate, has_alignment);
        let estimate = self.growing("estimate", lend::estimate(&exhibit.estimate), older)?;
        let view = self.view(&exhibit.view)?;
        let photo = abi::Photo { labels: image, camera, prior, ..abi::Photo::new() };
        let comparison = abi::Comparison { photo: image, view, camera, estimate, ..abi::Comparison::new() };
        let pixels = self.image("picture", &exhibit.picture(), [0x5A; 3])?;
        let picture = abi::Picture { pixels, ..abi::Picture::new() };
        let mut regions = Vec::new();
        for region in &exhibit.regions {
            let mask = self.values("region.mask", &region.mask)?;
            let record = abi::Region { mask, ..lend::region(region) };
            regions.extend(struct_bytes(&record, self.layout.host, size_of::<abi::Region>()));
        }
        let region_step = struct_bytes(&abi::Region::new(), self.layout.host, size_of::<abi::Region>()).len();
        Ok(Inputs {
            photo_image,
            photo: self.growing("photo", photo, size_of::<abi::Photo>())?,
            picture: self.growing("picture", picture, size_of::<abi::Picture>())?,
            view,
            comparison: self.growing("comparison", comparison, size_of::<abi::Comparison>())?,
            regions: self.bytes("regions", &regions, align_of::<abi::Region>())?.cast_const().cast(),
            region_count: exhibit.regions.len(),
            region_step,
        })
    }
}

/// The bytes of `value` as `host` would send it.
pub(super) fn struct_bytes<T: Growing>(value: &T, host: Host, older: usize) -> Vec<u8> {
    let whole = size_of::<T>();
    // SAFETY: `value` is readable; a `Growing` struct starts as zeros, so its padding is initialised too.
    let mut bytes = unsafe { std::slice::from_raw_parts(std::ptr::from_ref(value).cast::<u8>(), whole) }.to_vec();
    match host {
        Host::Today => {}
        Host::Older => bytes.truncate(older),
        Host::Newer => bytes.extend(UNKNOWN),
    }
    let size = bytes.len() as u32;
    bytes[..size_of::<u32>()].copy_from_slice(&size.to_ne_bytes());
    bytes
}
