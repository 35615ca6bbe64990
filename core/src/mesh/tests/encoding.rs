//! The stored form: round trips, damage.

use super::*;
use proptest::prelude::*;

fn sample() -> Mesh {
    let folder = three_ds_files::folder_with_labels();
    import_in(folder.path(), &three_ds_files::two_walls(), &origin(835_600.5, 817_800.25, 4.5))
        .unwrap()
        .objects
        .remove(0)
        .mesh
}

#[test]
fn a_mesh_with_a_texture_comes_back_as_it_was() {
    let mesh = sample();
    let bytes = encode_mesh(&mesh);
    assert_eq!(decode_mesh(&bytes).unwrap(), mesh);
    assert_eq!(encode_mesh(&mesh.clone()), bytes);
}

#[test]
fn equal_meshes_have_equal_bytes_whatever_the_sign_of_zero() {
    let mesh = sample();
    let mut negated = mesh.clone();
    for value in negated.vertices.as_flattened_mut().iter_mut().filter(|value| **value == 0.0) {
        *value = -0.0;
    }
    assert_eq!(negated, mesh);
    assert_eq!(encode_mesh(&negated), encode_mesh(&mesh));
}

#[test]
fn the_stored_form_of_version_1_stays_readable() {
    // One triangle of class 3, written out by hand from the description in encoding.rs; the LZ4 block is one run of
    // literals: token 0xF0, length 15 + 255·n + rest.
    let mut body = Vec::new();
    body.extend([1.5f64, -2.0, 3.0].map(f64::to_le_bytes).as_flattened());
    body.extend([3u32, 0, 1, 1].map(u32::to_le_bytes).as_flattened());
    body.extend([0f32, 0., 0., 1., 0., 0., 0., 1., 0.].map(f32::to_le_bytes).as_flattened());
    body.extend([0u32, 1, 2].map(u32::to_le_bytes).as_flattened());
    body.extend([0, 0, 0, 3]);
    let mut bytes = b"RSVMESH1".to_vec();
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend([0xF0, (body.len() - 15) as u8]);
    bytes.extend(&body);
    let mesh = decode_mesh(&bytes).unwrap();
    assert_eq!(mesh.origin, GridPoint::new(1.5, -2.0, 3.0));
    assert_eq!((mesh.triangles[0], &mesh.surfaces[..]), ([0, 1, 2], &[Surface::Class(ClassId(3))][..]));
}

#[test]
fn damage_is_an_error_and_never_a_panic() {
    let bytes = encode_mesh(&sample());
    for length in 0..bytes.len() {
        assert!(decode_mesh(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
    }
    let mut longer = bytes.clone();
    longer[8..16].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(matches!(decode_mesh(&longer), Err(EncodingError::Compression(_))));
    assert!(matches!(decode_mesh(b"RSVMESH2........"), Err(EncodingError::Magic(_))));
}

#[test]
fn a_mesh_that_breaks_its_promises_is_not_decoded() {
    let with = |edit: &dyn Fn(&mut Mesh)| {
        let mut mesh = sample();
        edit(&mut mesh);
        decode_mesh(&encode_mesh(&mesh)).unwrap_err().to_string()
    };
    assert!(with(&|mesh| mesh.triangles[0][1] = 4).contains("vertex indices below 4, found 4"));
    assert!(with(&|mesh| mesh.triangle_surfaces[0] = 1).contains("surface indices below 1, found 1"));
    assert!(with(&|mesh| mesh.vertices[0][0] = 2049.0).contains("at most 2048 m, found 2049"));
    assert!(with(&|mesh| mesh.vertices[0][0] = f32::NAN).contains("NaN"));
    assert!(with(&|mesh| mesh.uvs.clear()).contains("expected 4 finite texture coordinates"));
    assert!(with(&|mesh| mesh.origin.height_m = f64::NAN).contains("finite origin"));
}

proptest! {
    #[test]
    fn any_mesh_comes_back(
        vertices in prop::collection::vec(prop::array::uniform3(-2048f32..2048.0), 1..40),
        corners in prop::collection::vec(prop::array::uniform3(0u32..1000), 0..40),
        texels in prop::collection::vec(any::<u8>(), 1..40),
        name in ".{0,20}",
    ) {
        let count = vertices.len() as u32;
        let labels = Raster::from_values(texels.len() as u32, 1, texels).unwrap();
        let texture = LabelTexture { name, labels, wrap_u: Wrap::Clamp, wrap_v: Wrap::Mirror };
        let mesh = Mesh {
            origin: GridPoint::new(8e5, 8e5, -1.0),
            uvs: vertices.iter().map(|vertex| [vertex[0], vertex[1]]).collect(),
            vertices,
            triangle_surfaces: corners.iter().map(|corner| (corner[0] % 2) as u16).collect(),
            triangles: corners.into_iter().map(|corner| corner.map(|index| index % count)).collect(),
            surfaces: vec![Surface::Class(GLASS), Surface::Texture(texture)],
        };
        prop_assert_eq!(decode_mesh(&encode_mesh(&mesh)).unwrap(), mesh);
    }

    #[test]
    fn flipped_bytes_never_panic(position in 0usize..10_000, value: u8, second in 0usize..10_000) {
        let mut bytes = encode_mesh(&sample());
        let length = bytes.len();
        bytes[position % length] = value;
        bytes[second % length] ^= value;
        let _ = decode_mesh(&bytes);
    }
}
