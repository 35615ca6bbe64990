//! The C header and its Rust mirror are one: a C program prints every size and offset, and Rust's must be the same.

use resurvey_schema::{GridPoint, Pose, Wgs84, abi, service};
use std::fmt::Write as _;
use std::io::Write as _;
use std::mem::offset_of;
use std::process::Command;

/// One line per size and offset: what a C expression must give.
type Facts = Vec<(String, usize)>;

/// The fields of a struct in both languages, all of them: the pattern does not compile when Rust has one more, the C
/// program not when C lacks one, and the size tells when C has one more.
macro_rules! facts {
    ($facts:ident, $c:literal, $rust:path { $($field:ident $(as $c_field:ident)?),* $(,)? }) => {
        $facts.push((format!("sizeof({})", $c), size_of::<$rust>()));
        $facts.push((format!("_Alignof({})", $c), align_of::<$rust>()));
        $(
            #[allow(unused_mut, unused_assignments)]
            let mut name = stringify!($field);
            $(name = stringify!($c_field);)?
            $facts.push((format!("offsetof({}, {name})", $c), offset_of!($rust, $field)));
        )*
        let _ = |value: $rust| {
            let $rust { $($field: _),* } = value;
        };
    };
}

fn records() -> Facts {
    let mut facts = Facts::new();
    facts!(facts, "rsv_text", abi::Text { data, length });
    facts!(facts, "rsv_image", abi::Image { data, width, height, row_bytes });
    facts!(facts, "rsv_labels", abi::Labels { data, width, height, row_bytes });
    facts!(facts, "rsv_point", GridPoint { easting_m, northing_m, height_m });
    facts!(facts, "rsv_pose", Pose { position, yaw_rad, pitch_rad, roll_rad });
    facts!(facts, "rsv_wgs84", Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m });
    facts!(facts, "rsv_class", abi::ClassRecord { name, size_m, index, kind, colour, reserved });
    facts!(facts, "rsv_view_feature", service::ViewFeature { fid, class as class_index });
    facts!(
        facts,
        "rsv_class_counts",
        service::ClassCounts {
            photo,
            view,
            both,
            photo_boundary,
            photo_boundary_matched,
            view_boundary,
            view_boundary_matched
        }
    );
    facts!(facts, "rsv_ray_hit", abi::RayHit {
        point, range_m, normal, fid, hit, has_fid, class as class_index, reserved
    });
    facts
}

fn calls() -> Facts {
    let mut facts = Facts::new();
    facts!(facts, "rsv_error", abi::ErrorText { size, capacity, length, reserved, data });
    facts!(facts, "rsv_host_info", abi::HostInfo { size, abi_major, abi_minor, version });
    facts!(facts, "rsv_camera", abi::Camera { size, model, width, height, fx, fy, cx, cy, distortion });
    facts!(
        facts,
        "rsv_prior",
        abi::Prior { size, reserved, pose, position_sigma_m, height_sigma_m, yaw_sigma_rad, tilt_sigma_rad }
    );
    facts!(
        facts,
        "rsv_pose_estimate",
        abi::PoseEstimate {
            size,
            reserved,
            pose,
            covariance,
            height_sigma_m,
            tilt_sigma_rad,
            has_alignment,
            reserved_2,
            alignment_covariance,
            map_sigma_m,
            label_sigma_px
        }
    );
    facts!(
        facts,
        "rsv_view",
        abi::View { size, reserved, origin, labels, range_m, points, features, feature_table, feature_count }
    );
    facts!(facts, "rsv_photo", abi::Photo { size, reserved, labels, camera, prior });
    facts!(facts, "rsv_picture", abi::Picture { size, reserved, pixels });
    facts!(facts, "rsv_comparison", abi::Comparison { size, reserved, photo, view, camera, estimate });
    facts!(facts, "rsv_render_request", abi::RenderRequest { size, stride, with_descriptors, reserved });
    facts!(
        facts,
        "rsv_compare_request",
        abi::CompareRequest { size, stride, ignored_in_photo, ignored_in_view, boundary_tolerance_px }
    );
    facts!(
        facts,
        "rsv_panorama_request",
        abi::PanoramaRequest {
            size,
            columns,
            yaw_step_columns,
            yaw_count,
            first_yaw_rad,
            pitch_rad,
            roll_rad,
            ignored_in_photo,
            ignored_in_view
        }
    );
    facts
}

fn results() -> Facts {
    let mut facts = Facts::new();
    facts!(facts, "rsv_results", abi::Results { size, reserved, context, heat, region, proposal });
    facts!(
        facts,
        "rsv_localization",
        abi::Localization {
            size,
            has_runner_up,
            pose,
            score,
            covariance,
            runner_up_distance_m,
            runner_up_score_ratio,
            candidates,
            skipped,
            has_alignment,
            reserved_2,
            alignment_covariance,
            map_sigma_m,
            label_sigma_px
        }
    );
    facts!(
        facts,
        "rsv_region",
        abi::Region {
            size,
            class_before,
            class_after,
            reserved,
            left,
            top,
            right,
            bottom,
            pixels,
            reserved_2,
            mask,
            mask_length
        }
    );
    facts!(facts, "rsv_descriptor", abi::Descriptor {
        size, kind, class as class_index, has, reserved, corners, normal, position, size_m, yaw_rad, sigma_position_m,
        sigma_size_m, sigma_area_m2
    });
    facts!(facts, "rsv_proposal", abi::Proposal {
        size, kind, region, pixels, descriptor, near as near_point, sigma_m, measured, limit, requirement, unit,
        class as class_index, class_before, class_after, reserved
    });
    facts
}

fn tables() -> Facts {
    let mut facts = Facts::new();
    facts!(
        facts,
        "rsv_services",
        abi::Services {
            size,
            class_slots,
            context,
            classes,
            class_count,
            render,
            compare_views,
            compare_panoramas,
            inside_solid,
            pixel_rays,
            project,
            cast_rays,
            descriptors_near,
            ground_height,
            grid_from_wgs84,
            wgs84_from_grid,
            parallel_for,
            log,
            progress,
            cancelled
        }
    );
    facts!(
        facts,
        "rsv_table",
        abi::Table { size, reserved, settings_schema, create, destroy, score, search, detect, estimate, segment }
    );
    facts!(
        facts,
        "rsv_header",
        abi::Header { magic, abi_major, abi_minor, size, min_host_minor, kind, flags, reserved }
    );
    facts!(facts, "rsv_declaration", abi::Declaration { header, entry, name, version, summary });
    facts
}

fn constants() -> Facts {
    let numbers = [
        ("RSV_ABI_MAJOR", abi::ABI_MAJOR as usize),
        ("RSV_ABI_MINOR", abi::ABI_MINOR as usize),
        ("RSV_OK", abi::STATUS_OK as usize),
        ("RSV_FAILED", abi::STATUS_FAILED as usize),
        ("RSV_PANICKED", abi::STATUS_PANICKED as usize),
        ("RSV_CANCELLED", abi::STATUS_CANCELLED as usize),
        ("RSV_UNSUPPORTED", abi::STATUS_UNSUPPORTED as usize),
        ("RSV_KIND_MATCHER", abi::KIND_MATCHER as usize),
        ("RSV_KIND_DETECTOR", abi::KIND_DETECTOR as usize),
        ("RSV_KIND_ESTIMATOR", abi::KIND_ESTIMATOR as usize),
        ("RSV_KIND_SEGMENTER", abi::KIND_SEGMENTER as usize),
        ("RSV_MATERIAL", abi::Descriptor::MATERIAL as usize),
        ("RSV_DYNAMIC", abi::Descriptor::DYNAMIC as usize),
        ("RSV_HAS_YAW", abi::Descriptor::HAS_YAW as usize),
        ("RSV_HAS_SIGMA", abi::Descriptor::HAS_SIGMA as usize),
        ("RSV_HAS_SIGMA_SIZE", abi::Descriptor::HAS_SIGMA_SIZE as usize),
        ("RSV_HAS_SIGMA_AREA", abi::Descriptor::HAS_SIGMA_AREA as usize),
        ("RSV_PLACE", abi::Proposal::PLACE as usize),
        ("RSV_REMOVE", abi::Proposal::REMOVE as usize),
        ("RSV_REJECT", abi::Proposal::REJECT as usize),
    ];
    numbers.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

#[test]
fn every_size_offset_and_number_is_the_same_in_c_and_rust() {
    if Command::new("cc").arg("--version").output().is_err() {
        // Past the capture of the test harness: a skipped test should be seen.
        let _ = writeln!(std::io::stderr(), "SKIPPED: no C compiler cc; the header was not compared with its mirror");
        return;
    }
    let facts = [records(), calls(), results(), tables(), constants()].concat();
    let mut source = String::from("#include \"resurvey_plugin.h\"\n#include <stdio.h>\nint main(void) {\n");
    for (expression, _) in &facts {
        writeln!(source, "  printf(\"%zu\\n\", (size_t)({expression}));").unwrap();
    }
    source.push_str("  return 0;\n}\n");
    let directory = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (c, program) = (directory.join("layout.c"), directory.join("layout"));
    std::fs::write(&c, source).unwrap();
    let include = concat!(env!("CARGO_MANIFEST_DIR"), "/include");
    let flags = ["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I", include, "-o"];
    let built = Command::new("cc").args(flags).arg(&program).arg(&c).output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let printed = String::from_utf8(Command::new(&program).output().unwrap().stdout).unwrap();
    let numbers: Vec<usize> = printed.lines().map(|line| line.parse().unwrap()).collect();
    assert_eq!(numbers.len(), facts.len());
    for ((expression, rust), c) in facts.iter().zip(numbers) {
        assert_eq!(*rust, c, "{expression}");
    }
}

#[test]
fn the_frozen_header_has_32_bytes_and_the_entry_follows_it() {
    assert_eq!(size_of::<abi::Header>(), abi::HEADER_BYTES);
    assert_eq!(offset_of!(abi::Declaration, entry), abi::ENTRY_OFFSET);
    assert_eq!(abi::HEADER_BYTES, 32);
}

#[test]
fn a_growing_struct_begins_with_its_own_size() {
    use abi::Growing;
    assert_eq!(abi::View::new().size as usize, size_of::<abi::View>());
    assert_eq!(offset_of!(abi::View, size), 0);
    assert_eq!(abi::Table::new().size as usize, size_of::<abi::Table>());
}
