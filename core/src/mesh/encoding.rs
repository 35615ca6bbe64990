//! The stored form of a mesh: its bytes for content-addressed storage.
//!
//! ```text
//! "RSVMESH1"  u64 length of the body   LZ4 block of the body
//! body: f64×3 origin · u32 vertices · u32 uvs · u32 triangles · u32 surfaces
//!       f32×3 each vertex · f32×2 each uv · u32×3 each triangle · u16 surface of each triangle
//!       each surface: u8 0, u8 class  |  u8 1, u16 name length, name (UTF-8), u8 wrap u, u8 wrap v, u32 width,
//!                     u32 height, u8 each texel
//! ```
//! Little endian. Equal meshes have equal bytes: negative zero is stored as zero, and nothing else has two forms.

use super::{LabelTexture, Mesh, Surface, Wrap};
use crate::crs::LOCAL_LIMIT_M;
use crate::image::Raster;
use resurvey_schema::{ClassId, GridPoint};

const MAGIC: [u8; 8] = *b"RSVMESH1";

/// LZ4 stores at most this many bytes for each byte of its input: a larger claim is a lie.
const MOST_EXPANSION: u64 = 255;

/// Longest texture name, bytes.
const MAX_NAME_BYTES: usize = u16::MAX as usize;

/// Why bytes are not a stored mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodingError {
    /// The bytes begin otherwise.
    #[error("expected a mesh of form RSVMESH1, found bytes that begin with {0:02x?}")]
    Magic(Vec<u8>),
    /// The compressed part is damaged.
    #[error("the compressed mesh is damaged: {0}")]
    Compression(String),
    /// The content breaks off or contradicts itself.
    #[error("the stored mesh is damaged at byte {offset} of its body: {reason}")]
    Body {
        /// Position in the uncompressed body.
        offset: usize,
        /// Expected and found.
        reason: String,
    },
}

/// The stored form of `mesh`, the same bytes for equal meshes.
pub fn encode_mesh(mesh: &Mesh) -> Vec<u8> {
    let mut body = Vec::new();
    let origin = mesh.origin;
    for value in [origin.easting_m, origin.northing_m, origin.height_m] {
        body.extend_from_slice(&(value + 0.0).to_le_bytes());
    }
    for count in [mesh.vertices.len(), mesh.uvs.len(), mesh.triangles.len(), mesh.surfaces.len()] {
        body.extend_from_slice(&(count as u32).to_le_bytes());
    }
    // Adding zero turns −0 into 0.
    let floats = mesh.vertices.as_flattened().iter().chain(mesh.uvs.as_flattened());
    body.extend(floats.flat_map(|value| (value + 0.0).to_le_bytes()));
    body.extend(mesh.triangles.as_flattened().iter().flat_map(|index| index.to_le_bytes()));
    body.extend(mesh.triangle_surfaces.iter().flat_map(|index| index.to_le_bytes()));
    for surface in &mesh.surfaces {
        encode_surface(surface, &mut body);
    }
    let mut bytes = MAGIC.to_vec();
    bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&lz4_flex::block::compress(&body));
    bytes
}

fn encode_surface(surface: &Surface, body: &mut Vec<u8>) {
    match surface {
        Surface::Class(class) => body.extend_from_slice(&[0, class.0]),
        Surface::Texture(texture) => {
            let most =
                (0..=MAX_NAME_BYTES.min(texture.name.len())).rev().find(|&end| texture.name.is_char_boundary(end));
            let name = &texture.name[..most.unwrap_or(0)];
            body.push(1);
            body.extend_from_slice(&(name.len() as u16).to_le_bytes());
            body.extend_from_slice(name.as_bytes());
            body.extend_from_slice(&[wrap_code(texture.wrap_u), wrap_code(texture.wrap_v)]);
            body.extend_from_slice(&texture.labels.width().to_le_bytes());
            body.extend_from_slice(&texture.labels.height().to_le_bytes());
            body.extend_from_slice(texture.labels.values());
        }
    }
}

fn wrap_code(wrap: Wrap) -> u8 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Clamp => 1,
        Wrap::Mirror => 2,
    }
}

/// The mesh that [`encode_mesh`] stored, with everything checked that an import checks.
pub fn decode_mesh(bytes: &[u8]) -> Result<Mesh, EncodingError> {
    let start = || EncodingError::Magic(bytes.iter().take(8).copied().collect());
    let rest = bytes.strip_prefix(&MAGIC).ok_or_else(start)?;
    let (length, compressed) = rest.split_first_chunk::<8>().ok_or_else(start)?;
    let length = u64::from_le_bytes(*length);
    if length > (compressed.len() as u64).saturating_mul(MOST_EXPANSION) {
        let reason = format!("{length} bytes cannot come out of {}", compressed.len());
        return Err(EncodingError::Compression(reason));
    }
    let body = lz4_flex::block::decompress(compressed, length as usize)
        .map_err(|error| EncodingError::Compression(error.to_string()))?;
    if body.len() as u64 != length {
        return Err(EncodingError::Compression(format!("expected {length} bytes, found {}", body.len())));
    }
    let mut body = Body { bytes: &body, at: 0 };
    let mesh = body.mesh()?;
    match body.bytes.len() - body.at {
        0 => Ok(mesh),
        more => Err(body.damaged(format!("expected the end, found {more} more bytes"))),
    }
}

struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Body<'_> {
    fn damaged(&self, reason: String) -> EncodingError {
        EncodingError::Body { offset: self.at, reason }
    }

    fn take(&mut self, count: usize) -> Result<&[u8], EncodingError> {
        let left = self.bytes.len() - self.at;
        if count > left {
            return Err(self.damaged(format!("expected {count} more bytes, found {left}")));
        }
        self.at += count;
        Ok(&self.bytes[self.at - count..self.at])
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], EncodingError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// `count` groups of `K` numbers of `N` bytes; the bytes are there before memory is taken.
    fn groups<const N: usize, const K: usize, T>(
        &mut self,
        count: u32,
        number: impl Fn([u8; N]) -> T,
    ) -> Result<Vec<[T; K]>, EncodingError> {
        let bytes = self.take((count as usize).saturating_mul(N * K))?;
        let (numbers, _) = bytes.as_chunks::<N>();
        let (groups, _) = numbers.as_chunks::<K>();
        Ok(groups.iter().map(|group| group.map(&number)).collect())
    }

    fn u8(&mut self) -> Result<u8, EncodingError> {
        self.array().map(|[value]| value)
    }

    fn u32(&mut self) -> Result<u32, EncodingError> {
        self.array().map(u32::from_le_bytes)
    }

    fn mesh(&mut self) -> Result<Mesh, EncodingError> {
        let [easting, northing, height] = [self.array()?, self.array()?, self.array()?].map(f64::from_le_bytes);
        let [vertices, uvs, triangles, surfaces] = [self.u32()?, self.u32()?, self.u32()?, self.u32()?];
        let mut mesh = Mesh {
            origin: GridPoint::new(easting, northing, height),
            vertices: self.groups(vertices, f32::from_le_bytes)?,
            uvs: self.groups(uvs, f32::from_le_bytes)?,
            triangles: self.groups(triangles, u32::from_le_bytes)?,
            triangle_surfaces: self.groups::<2, 1, _>(triangles, u16::from_le_bytes)?.into_iter().flatten().collect(),
            surfaces: Vec::new(),
        };
        for _ in 0..surfaces {
            mesh.surfaces.push(self.surface()?);
        }
        match fault(&mesh) {
            None => Ok(mesh),
            Some(reason) => Err(self.damaged(reason)),
        }
    }

    fn surface(&mut self) -> Result<Surface, EncodingError> {
        match self.u8()? {
            0 => Ok(Surface::Class(ClassId(self.u8()?))),
            1 => {
                let length = usize::from(u16::from_le_bytes(self.array()?));
                let name = std::str::from_utf8(self.take(length)?).map(str::to_owned);
                let name = name.map_err(|error| self.damaged(format!("expected a name in UTF-8: {error}")))?;
                let (wrap_u, wrap_v) = (self.wrap()?, self.wrap()?);
                let (width, height) = (self.u32()?, self.u32()?);
                let texels = (width as usize).saturating_mul(height as usize);
                let labels = Raster::from_values(width, height, self.take(texels)?.to_vec());
                let labels = labels.filter(|labels| !labels.values().is_empty());
                let labels = labels.ok_or_else(|| self.damaged(format!("expected texels, found {width}×{height}")))?;
                Ok(Surface::Texture(LabelTexture { name, labels, wrap_u, wrap_v }))
            }
            kind => Err(self.damaged(format!("expected a surface of kind 0 or 1, found {kind}"))),
        }
    }

    fn wrap(&mut self) -> Result<Wrap, EncodingError> {
        match self.u8()? {
            0 => Ok(Wrap::Repeat),
            1 => Ok(Wrap::Clamp),
            2 => Ok(Wrap::Mirror),
            code => Err(self.damaged(format!("expected a wrap of 0, 1 or 2, found {code}"))),
        }
    }
}

/// What breaks a promise of [`Mesh`], if anything does.
fn fault(mesh: &Mesh) -> Option<String> {
    let is_far = |value: &f32| value.is_nan() || f64::from(value.abs()) > LOCAL_LIMIT_M;
    let has_textures = mesh.surfaces.iter().any(|surface| matches!(surface, Surface::Texture(_)));
    let uvs = if has_textures { mesh.vertices.len() } else { 0 };
    let is_wild = |index: &u32| *index as usize >= mesh.vertices.len();
    let is_unmade = |index: &u16| usize::from(*index) >= mesh.surfaces.len();
    if !mesh.origin.is_finite() {
        return Some(format!("expected a finite origin, found {:?}", mesh.origin));
    }
    if let Some(value) = mesh.vertices.as_flattened().iter().find(|value| is_far(value)) {
        return Some(format!("expected offsets of at most {LOCAL_LIMIT_M} m, found {value}"));
    }
    if mesh.uvs.len() != uvs || !mesh.uvs.as_flattened().iter().all(|value| value.is_finite()) {
        return Some(format!("expected {uvs} finite texture coordinates, found {} or not finite", mesh.uvs.len()));
    }
    if let Some(index) = mesh.triangles.as_flattened().iter().find(|index| is_wild(index)) {
        return Some(format!("expected vertex indices below {}, found {index}", mesh.vertices.len()));
    }
    let index = mesh.triangle_surfaces.iter().find(|index| is_unmade(index))?;
    Some(format!("expected surface indices below {}, found {index}", mesh.surfaces.len()))
}
