//! Why a model could not be imported.

use std::path::PathBuf;

/// Why a model could not be imported. Nothing of it is imported then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A file could not be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file larger than any model that is read whole.
    #[error("{} has {bytes} bytes; the limit is {limit} bytes", path.display())]
    FileTooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
        /// Largest size that is read.
        limit: u64,
    },
    /// The content is no known format.
    #[error("expected a 3DS or glTF (.gltf, .glb) model, found {found}")]
    UnknownFormat {
        /// What the content looks like.
        found: String,
    },
    /// A format that is known but not read.
    #[error("{format} files cannot be imported yet; convert to 3DS or glTF (.gltf, .glb)")]
    UnsupportedFormat {
        /// Name of the format.
        format: &'static str,
    },
    /// A 3DS file that breaks off or contradicts itself.
    #[error("the 3DS file is cut off or damaged at byte {offset}: {reason}")]
    Damaged3ds {
        /// Where, from the start of the file.
        offset: usize,
        /// Expected and found.
        reason: String,
    },
    /// A glTF file that breaks off or contradicts itself.
    #[error("the glTF file is damaged at {at}: {reason}")]
    DamagedGltf {
        /// The JSON path or part of the file.
        at: String,
        /// Expected and found.
        reason: String,
    },
    /// glTF extensions without which the file cannot be decoded.
    #[error("the glTF file requires {}, which cannot be decoded; export it without", list(names))]
    GltfExtensions {
        /// Names of the extensions.
        names: Vec<String>,
    },
    /// Materials that are neither named after a class nor in the class map nor textured.
    #[error(
        "no class for {} of the model's materials: {}; name them after a class ({known}), or give a TOML file with \
         --map-classes that has a line such as {:?} = \"stone\" for each, or default = \"others\"",
        names.len(), list(names), names.first().map_or("", String::as_str)
    )]
    UnmappedNames {
        /// All such names, sorted.
        names: Vec<String>,
        /// The class names of the table.
        known: String,
    },
    /// Textures that cannot be read as labels.
    #[error(
        "{} of the model's textures cannot be read as labels: {}; correct them, or give the materials a class with \
         --map-classes",
        problems.len(), problems.join("; ")
    )]
    Textures {
        /// File name, material and reason of each.
        problems: Vec<String>,
    },
    /// A face that names a vertex that does not exist.
    #[error("object {object:?}, face {face}: expected vertex indices below {vertices}, found {index}")]
    VertexIndex {
        /// Object name.
        object: String,
        /// Face number in the object.
        face: usize,
        /// The index.
        index: u32,
        /// Vertices of the object.
        vertices: usize,
    },
    /// A coordinate that is no position on a map.
    #[error("object {object:?}, vertex {vertex}: expected coordinates within {limit_m:e} m, found {found}")]
    Coordinate {
        /// Object name.
        object: String,
        /// Vertex number in the object.
        vertex: usize,
        /// The coordinates.
        found: String,
        /// Largest coordinate.
        limit_m: f64,
    },
    /// A textured face without texture coordinates.
    #[error(
        "object {object:?}, face {face}: the material has a label texture, but vertex {vertex} has no finite texture coordinates"
    )]
    NoTextureCoordinates {
        /// Object name.
        object: String,
        /// Face number in the object.
        face: usize,
        /// Vertex number in the object.
        vertex: u32,
    },
    /// An object larger than its offsets can hold.
    #[error(
        "object {object:?} is {:.0} × {:.0} × {:.0} m (E, N, H); the limit is {limit_m} m: split it into smaller objects",
        size_m[0], size_m[1], size_m[2]
    )]
    ObjectTooLarge {
        /// Object name.
        object: String,
        /// East, north and height extent.
        size_m: [f64; 3],
        /// Largest extent.
        limit_m: f64,
    },
    /// More of something than fits.
    #[error("the model has more than {limit} {what}; split it into several files")]
    TooMany {
        /// Vertices, triangles, texels or surfaces.
        what: &'static str,
        /// The most that are imported.
        limit: usize,
    },
    /// An option that is no number.
    #[error("expected finite numbers for the origin and the rotation, found {found}")]
    Option {
        /// The numbers.
        found: String,
    },
    /// No triangle is left.
    #[error("the model has no triangles to import ({0})")]
    Nothing(String),
}

/// Names in quotes, at most a hundred.
fn list(names: &[String]) -> String {
    const MOST: usize = 100;
    let mut text = names.iter().take(MOST).map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
    if names.len() > MOST {
        text += &format!(" and {} more", names.len() - MOST);
    }
    text
}
