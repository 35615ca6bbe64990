//! The photo of a capture as a segmenter sees it.

use super::load::read_file;
use super::{CaptureError, exif};
use crate::camera::Camera;
use crate::image::{ImageError, LabelImage, RgbImage, averaged, read_picture, upright};
use crate::version::Digest;
use std::path::{Path, PathBuf};

/// A photo, upright and of the size of its capture's camera.
#[derive(Clone, Debug)]
pub struct CapturePhoto {
    /// The photo.
    pub path: PathBuf,
    /// Its colours.
    pub pixels: RgbImage,
    /// Digest of the file.
    pub digest: Digest,
}

impl CapturePhoto {
    /// Reads the JPG or PNG at `photo` for the camera of the `capture.json` at `capture`: turned as its EXIF says, and
    /// averaged down where it is larger. Its aspect ratio must be that of the camera, to half a pixel.
    pub fn read(photo: &Path, capture: &Path) -> Result<Self, CaptureError> {
        let camera = Camera::from_file(&read_file(capture)?.0.camera)
            .map_err(|source| CaptureError::Camera { path: capture.to_owned(), source })?;
        let bytes = std::fs::read(photo).map_err(|source| CaptureError::Io { path: photo.to_owned(), source })?;
        let picture = read_picture(&bytes)
            .map_err(|source| ImageError::InFile { path: photo.to_owned(), source: Box::new(source) })?;
        let orientation = exif::orientation(&bytes);
        let picture = upright(picture, orientation).ok_or_else(|| CaptureError::Value {
            path: photo.to_owned(),
            key: "EXIF Orientation",
            found: orientation.to_string(),
            expected: "1 to 8",
        })?;
        let (found, expected) = ((picture.width(), picture.height()), (camera.width(), camera.height()));
        if !fits(found, expected) {
            let (photo, capture) = (photo.to_owned(), capture.to_owned());
            return Err(CaptureError::PhotoSize { photo, capture, found, expected });
        }
        Ok(Self { path: photo.to_owned(), pixels: averaged(&picture, expected), digest: Digest::of(&bytes) })
    }

    /// The photo with the class per pixel that a segmenter found.
    pub fn labelled(self, labels: LabelImage) -> LabelledPhoto {
        LabelledPhoto { path: self.path, labels, digest: self.digest }
    }
}

/// The labels of a photo, and which photo it is.
#[derive(Clone, Debug)]
pub struct LabelledPhoto {
    /// The photo.
    pub path: PathBuf,
    /// Class per pixel; 255 is void.
    pub labels: LabelImage,
    /// Digest of the photo's file.
    pub digest: Digest,
}

/// Whether a picture can be averaged down to a camera: at least as large, and of the same aspect ratio when one side is
/// rounded to a whole pixel.
fn fits((width, height): (u32, u32), (of_width, of_height): (u32, u32)) -> bool {
    let [width, height, of_width, of_height] = [width, height, of_width, of_height].map(u64::from);
    let off = (width * of_height).abs_diff(of_width * height);
    width >= of_width && height >= of_height && (2 * off <= height || 2 * off <= width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photo_fits_a_camera_of_its_shape_that_is_no_larger() {
        for photo in [(960, 720), (4032, 3024), (4000, 3000), (1921, 1441)] {
            assert!(fits(photo, (960, 720)), "{photo:?}");
        }
        for photo in [(720, 960), (1920, 1080), (959, 719), (640, 480), (3024, 4032), (4032, 3000)] {
            assert!(!fits(photo, (960, 720)), "{photo:?}");
        }
        assert!(fits((4080, 3072), (960, 723)), "the height of the camera was rounded");
    }

    /// A TIFF directory with one entry, as section 2 of TIFF 6.0 lays it out.
    fn tiff(orientation: u16) -> Vec<u8> {
        let [high, low] = orientation.to_be_bytes();
        let entry = [0x01, 0x12, 0, 3, 0, 0, 0, 1, high, low, 0, 0];
        [&b"MM\0*"[..], &[0, 0, 0, 8, 0, 1], &entry, &[0; 4]].concat()
    }

    #[test]
    fn the_orientation_is_that_of_the_exif_and_upright_without() {
        assert_eq!([1, 6, 8, 9].map(|orientation| exif::orientation(&tiff(orientation))), [1, 6, 8, 9]);
        assert_eq!(exif::orientation(b"no picture"), 1);
    }
}
