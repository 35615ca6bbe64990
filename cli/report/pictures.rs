//! The images of a page: photo, view, where they differ, and which regions were made of it.

use super::fate::Fate;
use super::sheet::Seen;
use crate::failure::Failure;
use resurvey_core::image::{LabelImage, Raster, colours_of_labels, write_label_png, write_rgb_png};
use resurvey_schema::{ClassId, ClassTable, PixelBox};

/// Images are thinned to at most this many columns: enough for a screen, and a page stays small.
const WIDEST_PX: u32 = 1280;
/// Shares of grey and of white in what stands in the background, so that no colour there is taken for a finding.
const GREY: f64 = 0.85;
const FADE: f64 = 0.7;
/// Where photo and view differ and no region was made of it.
pub const LEFT_ALONE: [u8; 3] = [122, 132, 190];
/// Regions that changed the map.
pub const KEPT: [u8; 3] = [0, 150, 95];
/// Regions that were dropped.
pub const DROPPED: [u8; 3] = [222, 110, 0];

/// Photo and view of one capture, thinned alike.
pub struct Pictures<'a> {
    whole: &'a LabelImage,
    photo: LabelImage,
    view: LabelImage,
    classes: &'a ClassTable,
    /// Every so many pixels of the photo one is shown.
    stride: u32,
}

impl<'a> Pictures<'a> {
    /// Pictures of `photo` and `view`, which have one size.
    pub fn new(photo: &'a LabelImage, view: &LabelImage, classes: &'a ClassTable) -> Self {
        let stride = photo.width().div_ceil(WIDEST_PX).max(1);
        Self { whole: photo, photo: thinned(photo, stride), view: thinned(view, stride), classes, stride }
    }

    /// The labels of the photo.
    pub fn photo(&self) -> Result<Vec<u8>, Failure> {
        Ok(write_label_png(&self.photo, self.classes)?)
    }

    /// The map from the pose.
    pub fn view(&self) -> Result<Vec<u8>, Failure> {
        Ok(write_label_png(&self.view, self.classes)?)
    }

    /// The photo, pale, and in full colour where the view shows another class.
    pub fn difference(&self) -> Result<Vec<u8>, Failure> {
        let full = colours_of_labels(&self.photo, self.classes);
        let mut picture = self.pale();
        for (index, colour) in picture.values_mut().iter_mut().enumerate() {
            if self.differs(index) {
                *colour = full.values()[index];
            }
        }
        Ok(write_rgb_png(&picture)?)
    }

    /// The photo, pale, under the regions in the colour of their fate; grey where it differs and is no region.
    pub fn regions(&self, seen: &Seen, fates: &[Vec<Fate>]) -> Result<Vec<u8>, Failure> {
        let owner = self.owners(seen);
        let mut picture = self.pale();
        let (width, height) = (picture.width(), picture.height());
        for v in 0..height {
            for u in 0..width {
                let index = (v * width + u) as usize;
                let region = owner.at(u, v);
                let colour = match region.checked_sub(1) {
                    Some(region) => {
                        let colour = colour_of(fates.get(region as usize).map_or(&[], Vec::as_slice));
                        let edge = [(1, 0), (-1, 0), (0, 1), (0, -1)].into_iter().any(|(du, dv)| {
                            let beside = (u.checked_add_signed(du), v.checked_add_signed(dv));
                            !matches!(beside, (Some(u), Some(v)) if u < width && v < height && owner.at(u, v) == owner_of(region))
                        });
                        if edge { mixed(colour, [0; 3], 0.35) } else { colour }
                    }
                    None if self.differs(index) => LEFT_ALONE,
                    None => continue,
                };
                picture.set(u, v, colour);
            }
        }
        Ok(write_rgb_png(&picture)?)
    }

    /// The photo in pale colours, to draw on.
    pub fn pale_photo(&self) -> Result<Vec<u8>, Failure> {
        Ok(write_rgb_png(&self.pale())?)
    }

    /// The labels of the photo inside `bounds`, at their full size.
    pub fn part(&self, bounds: PixelBox) -> Result<Vec<u8>, Failure> {
        let mut part = LabelImage::filled(bounds.width(), bounds.height(), ClassId::VOID.0);
        for v in bounds.top..bounds.bottom.min(self.whole.height()) {
            for u in bounds.left..bounds.right.min(self.whole.width()) {
                part.set(u - bounds.left, v - bounds.top, self.whole.at(u, v));
            }
        }
        Ok(write_label_png(&part, self.classes)?)
    }

    /// Classes of the table that photo or view show, each with its share of the photo's pixels.
    pub fn shares(&self) -> Vec<(ClassId, f64)> {
        let mut counts = [(0_usize, 0_usize); 256];
        for (&photo, &view) in self.photo.values().iter().zip(self.view.values()) {
            counts[usize::from(photo)].0 += 1;
            counts[usize::from(view)].1 += 1;
        }
        let pixels = self.photo.values().len().max(1) as f64;
        let present = counts.iter().enumerate().filter(|(_, (photo, view))| photo + view > 0);
        present.map(|(class, (photo, _))| (ClassId(class as u8), *photo as f64 / pixels)).collect()
    }

    /// Share of the pixels on which photo and view differ, void left out.
    pub fn differing_share(&self) -> f64 {
        let count = (0..self.photo.values().len()).filter(|index| self.differs(*index)).count();
        count as f64 / self.photo.values().len().max(1) as f64
    }

    fn differs(&self, index: usize) -> bool {
        let (photo, view) = (self.photo.values()[index], self.view.values()[index]);
        photo != view && photo != ClassId::VOID.0
    }

    fn pale(&self) -> Raster<[u8; 3]> {
        let mut picture = colours_of_labels(&self.photo, self.classes);
        picture
            .values_mut()
            .iter_mut()
            .for_each(|colour| *colour = mixed(mixed(*colour, [luma(*colour); 3], GREY), [255; 3], FADE));
        picture
    }

    /// 1 + the index of the region at each pixel, 0 for none.
    fn owners(&self, seen: &Seen) -> Raster<u32> {
        let mut owners = Raster::filled(self.photo.width(), self.photo.height(), 0);
        for (index, region) in seen.regions.iter().enumerate() {
            let bounds = region.bounds;
            for v in bounds.top.div_ceil(self.stride)..bounds.bottom.div_ceil(self.stride) {
                for u in bounds.left.div_ceil(self.stride)..bounds.right.div_ceil(self.stride) {
                    let (column, row) = (u * self.stride - bounds.left, v * self.stride - bounds.top);
                    let inside = region.mask.get((row * bounds.width() + column) as usize) == Some(&1);
                    if inside && u < owners.width() && v < owners.height() {
                        owners.set(u, v, owner_of(index as u32));
                    }
                }
            }
        }
        owners
    }
}

fn owner_of(region: u32) -> u32 {
    region + 1
}

/// The colour of a region that came to `fates`.
pub fn colour_of(fates: &[Fate]) -> [u8; 3] {
    if fates.iter().any(|fate| matches!(fate, Fate::Changed(_))) { KEPT } else { DROPPED }
}

fn thinned(labels: &LabelImage, stride: u32) -> LabelImage {
    let (width, height) = (labels.width().div_ceil(stride), labels.height().div_ceil(stride));
    let mut thin = LabelImage::filled(width, height, ClassId::VOID.0);
    for v in 0..height {
        for u in 0..width {
            thin.set(u, v, labels.at(u * stride, v * stride));
        }
    }
    thin
}

/// How bright a colour is (ITU-R BT.601).
fn luma([red, green, blue]: [u8; 3]) -> u8 {
    (0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue)).round() as u8
}

/// `share` of `other` in `colour`.
fn mixed(colour: [u8; 3], other: [u8; 3], share: f64) -> [u8; 3] {
    let mix = |a: u8, b: u8| (f64::from(a) * (1.0 - share) + f64::from(b) * share).round() as u8;
    [mix(colour[0], other[0]), mix(colour[1], other[1]), mix(colour[2], other[2])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_schema::{ChangeRegion, PixelBox};

    fn labels(width: u32, values: &[u8]) -> LabelImage {
        let mut image = LabelImage::filled(width, values.len() as u32 / width, 0);
        image.values_mut().copy_from_slice(values);
        image
    }

    #[test]
    fn void_never_differs_and_shares_are_those_of_the_photo() {
        let classes = ClassTable::default();
        let photo = labels(2, &[0, 3, 255, 1]);
        let pictures = Pictures::new(&photo, &labels(2, &[0, 0, 0, 1]), &classes);
        assert!((pictures.differing_share() - 0.25).abs() < 1e-12);
        let shares = pictures.shares();
        assert_eq!(shares.len(), 4);
        assert!((shares[0].1 - 0.25).abs() < 1e-12 && shares[3].0 == ClassId::VOID);
    }

    #[test]
    fn a_region_lies_where_its_mask_says() {
        let classes = ClassTable::default();
        let photo = labels(3, &[0; 6]);
        let pictures = Pictures::new(&photo, &labels(3, &[0; 6]), &classes);
        let region = ChangeRegion {
            class_before: ClassId(0),
            class_after: ClassId(3),
            bounds: PixelBox { left: 1, top: 0, right: 3, bottom: 2 },
            mask: vec![1, 0, 1, 1],
            pixels: 3,
        };
        let view = resurvey_core::render::View {
            origin: resurvey_schema::GridPoint::new(0.0, 0.0, 0.0),
            labels: labels(3, &[0; 6]),
            range_m: Raster::filled(3, 2, 1.0),
            points: Raster::filled(3, 2, [0.0; 3]),
            features: Raster::filled(3, 2, 0),
        };
        let seen = Seen { view, regions: vec![region], proposals: Vec::new() };
        assert_eq!(pictures.owners(&seen).values(), [0, 1, 0, 0, 1, 1]);
    }
}
