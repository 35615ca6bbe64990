//! The toy worlds of the Rust SDK, of the Python package and of the C header are one world, written three times: they judge
//! each other.

use crate::trial::{ROOT, Trial, has};
use resurvey_plugin::Host as _;
use resurvey_plugin::schema::{ClassId, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor, Pose};
use resurvey_plugin::toy::{Paint, ToyCamera, ToyHost, ToyScene};

/// A wall, a box and both kinds of descriptor, seen from a pose with every angle: labels, features, then ranges.
const IN_PYTHON: &str = r#"
import sys
from resurvey_plugin import DynamicDescriptor, MaterialDescriptor, Pose, toy
import numpy as np
scene = toy.Scene(ground=(0.0, toy.OTHERS))
scene.add_wall((-20.0, 12.0), (15.0, 14.0), (0.0, 9.0), toy.STONE)
scene.add_box((3.0, 6.0, 0.0), (1.0, 2.0, 1.5), toy.METAL)
corners = np.array([(-2.0, 11.0, 2.0), (2.0, 11.0, 2.0), (2.0, 11.0, 4.0), (-2.0, 11.0, 4.0)])
scene.add_descriptor(MaterialDescriptor(toy.BANNER, corners, np.array([0.0, -1.0, 0.0])))
scene.add_descriptor(DynamicDescriptor(toy.CHAIR, (-1.5, 5.0, 0.0), (0.5, 0.5, 0.9), yaw_rad=0.4))
view = toy.ToyHost(scene, toy.camera(161, 121, 100.0)).view(Pose(0.3, -0.2, 1.6, 0.1, 0.05, -0.03))
for part in (view.labels, view.features.astype("u1"), view.range_m.astype("<f4")):
    sys.stdout.write(part.tobytes().hex() + "\n")
"#;

fn in_rust() -> ToyHost {
    let mut scene = ToyScene { ground: Some((0.0, ClassId(8))), ..ToyScene::default() };
    scene.add_wall([-20.0, 12.0], [15.0, 14.0], [0.0, 9.0], Paint::Plain(ClassId(0)));
    scene.add_box(GridPoint::new(3.0, 6.0, 0.0), [1.0, 2.0, 1.5], ClassId(2));
    let corner = |easting_m, height_m| GridPoint::new(easting_m, 11.0, height_m);
    let corners = [corner(-2.0, 2.0), corner(2.0, 2.0), corner(2.0, 4.0), corner(-2.0, 4.0)];
    let banner = MaterialDescriptor { class: ClassId(3), corners, normal: [0.0, -1.0, 0.0], sigma: None };
    scene.add_descriptor(Descriptor::Material(banner));
    let (position, size_m) = (GridPoint::new(-1.5, 5.0, 0.0), [0.5, 0.5, 0.9]);
    let chair = DynamicDescriptor { class: ClassId(5), position, size_m, yaw_rad: Some(0.4), sigma: None };
    scene.add_descriptor(Descriptor::Dynamic(chair));
    ToyHost::new(scene, ToyCamera::intrinsics(161, 121, 100.0))
}

#[test]
fn the_toy_worlds_of_rust_and_python_show_the_same() {
    if !has(&["python3", "numpy"]) {
        return;
    }
    let trial = Trial::bare().with_python_package();
    let shown = trial.shell(&format!("python3 -c '{IN_PYTHON}'"));
    let parts: Vec<Vec<u8>> = shown.lines().map(bytes).collect();
    let [labels, features, ranges] = &parts[..] else { panic!("three lines, found {}", parts.len()) };

    let position = GridPoint::new(0.3, -0.2, 1.6);
    let pose = Pose { position, yaw_rad: 0.1, pitch_rad: 0.05, roll_rad: -0.03 };
    let view = &in_rust().render(1, true, &[pose]).unwrap()[0];
    let mut seen = view.labels.clone();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen, [0, 2, 3, 5, 6, 8], "the view shows all of it");
    assert_eq!(labels, &view.labels);
    assert_eq!(*features, view.features.iter().map(|feature| *feature as u8).collect::<Vec<_>>());
    for (bytes, expected) in ranges.chunks_exact(4).zip(&view.range_m) {
        let found = f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let is_same = found.is_infinite() == expected.is_infinite();
        assert!(
            is_same && (found.is_infinite() || (found - expected).abs() < 1e-5 * expected),
            "{found} m, {expected} m"
        );
    }
}

/// The street of the C header and of the Python package: labels, from two places.
const STREET_IN_C: &str = r#"
#include "resurvey_toy.h"
int main(void) {
  rsv_toy street;
  rsv_toy_street(&street, 97, 61);
  rsv_pose turned = {{835001.5, 816999.0, 5.9}, 0.3, 0.05, -0.04};
  for (int i = 0; i < 2; i++) {
    rsv_view seen = rsv_toy_see(&street, i ? &turned : &rsv_toy_pose, 1, 1);
    for (size_t k = 0; k < 97 * 61; k++) printf("%02x", ((const uint8_t *)seen.labels.data)[k]);
    putchar('\n');
    rsv_toy_forget(&seen);
  }
  return 0;
}
"#;
const STREET_IN_PYTHON: &str = "
from resurvey_plugin import Pose, toy
for pose in (toy.POSE, Pose(835001.5, 816999.0, 5.9, 0.3, 0.05, -0.04)):
    print(toy.street(97, 61).view(pose).labels.tobytes().hex())
";

#[test]
fn the_toy_streets_of_c_and_python_show_the_same() {
    if !has(&["cc", "python3", "numpy"]) {
        return;
    }
    let trial = Trial::bare().with_python_package();
    trial.shell("true");
    std::fs::write(trial.path("street.c"), STREET_IN_C).unwrap();
    let include = format!("-I '{ROOT}/plugins/toy' -I '{ROOT}/schema/include'");
    let in_c = trial.shell(&format!("cc -std=c11 -Wall -Wextra -Werror {include} street.c -o street -lm && ./street"));
    assert_eq!(in_c, trial.shell(&format!("python3 -c '{STREET_IN_PYTHON}'")));
    let seen: std::collections::BTreeSet<u8> = in_c.lines().flat_map(bytes).collect();
    assert_eq!(seen, [0, 1, 2, 6, 8].into(), "the views show all of it");
}

fn bytes(hex: &str) -> Vec<u8> {
    let byte = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
    (0..hex.len()).step_by(2).map(byte).collect()
}
