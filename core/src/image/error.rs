//! Why an image could not be read or written.

use std::path::PathBuf;

/// Why an image could not be read as labels, or not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The file at `path` holds an image with a fault.
    #[error("{}: {source}", path.display())]
    InFile {
        /// The image file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<ImageError>,
    },
    /// The file could not be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The image file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The content is neither PNG nor JPG.
    #[error("expected a PNG or JPG image, found {found}")]
    NotAnImage {
        /// What the content looks like.
        found: String,
    },
    /// The image breaks off or contradicts itself.
    #[error("the {format} image is cut off or damaged: {reason}")]
    Damaged {
        /// `PNG` or `JPG`.
        format: &'static str,
        /// What the decoder said.
        reason: String,
    },
    /// More pixels than any sensible label image has.
    #[error("the image is {width}×{height} pixels; the limit is {limit_px} pixels in all")]
    TooLarge {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Most pixels that are read.
        limit_px: u64,
    },
    /// A pixel form that cannot be labels.
    #[error("expected 8 bits a channel (indexed, grey, RGB or RGBA), found {found}")]
    PixelForm {
        /// Colour type and bits a channel.
        found: String,
    },
    /// A colour that no class has.
    #[error(
        "pixel ({x}, {y}) has the colour {},{},{}, which no class of the table has; \
         only for lossy images give the largest colour distance with --nearest-colour", colour[0], colour[1], colour[2]
    )]
    UnknownColour {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// What the pixel shows.
        colour: [u8; 3],
    },
    /// A colour too far from every class colour.
    #[error(
        "pixel ({x}, {y}) has the colour {},{},{}, {distance:.1} from the nearest class colour ({nearest}); \
         the limit is {limit:.1}", colour[0], colour[1], colour[2]
    )]
    FarColour {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// What the pixel shows.
        colour: [u8; 3],
        /// Name of the class with the nearest colour.
        nearest: String,
        /// Distance to it in RGB, 0–441.7.
        distance: f64,
        /// Largest distance allowed.
        limit: f64,
    },
    /// A pixel that is partly transparent.
    #[error("pixel ({x}, {y}) is partly transparent (alpha {alpha}); expected 255, or 0 for unlabelled")]
    PartlyTransparent {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// Alpha, 1–254.
        alpha: u8,
    },
    /// An index that no class has.
    #[error("pixel ({x}, {y}) has index {index}; expected a class of the table ({known}) or 255 for void")]
    UnknownIndex {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// What the pixel holds.
        index: u8,
        /// Indices of the table.
        known: String,
    },
    /// A lossy image without a tolerance.
    #[error(
        "JPG changes colours, so its pixels are no exact classes; \
         use PNG, or give the largest colour distance with --nearest-colour"
    )]
    Lossy,
    /// A tolerance that is no number of at least zero, or a table without a class.
    #[error(
        "expected a colour distance of at least 0 and a table with at least one class, found {distance} and {classes} classes"
    )]
    BadTolerance {
        /// The distance.
        distance: f64,
        /// Classes in the table.
        classes: usize,
    },
    /// An image of no pixels was to be written.
    #[error("expected at least one pixel to write, found {width}×{height}")]
    Empty {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The encoder refused.
    #[error("the PNG image cannot be written: {0}")]
    Write(String),
}
