//! Rates of rendering and of the exact search: `cargo bench -p resurvey-core --bench exhaustive`.

#[path = "../tests/support/city.rs"]
mod city;

use resurvey_core::image::LabelImage;
use resurvey_core::render::Renderer;
use resurvey_schema::Pose;
use std::hint::black_box;
use std::time::Instant;

fn main() {
    let only = std::env::var("ONLY").ok();
    for triangles in [20_000, 200_000, 2_000_000] {
        if only.as_ref().is_some_and(|o| !o.split(',').any(|x| x == triangles.to_string())) {
            continue;
        }
        let before = Instant::now();
        let scene = city::city(triangles);
        println!("{} triangles, made in {:.2} s", scene.positions().len(), before.elapsed().as_secs_f64());
        let prior = city::prior();
        let camera = city::camera().pinhole().expect("pinhole");
        let poses: Vec<Pose> =
            (-40..=40).map(|deg| Pose { yaw_rad: prior.yaw_rad + f64::from(deg).to_radians(), ..prior }).collect();
        let mut renderer = Renderer::new();
        let mut image = LabelImage::filled(960, 720, 0);
        for (name, mut renderer) in [("best", Renderer::new()), ("baseline", Renderer::baseline())] {
            let mut best = vec![f64::INFINITY; poses.len()];
            for _ in 0..std::env::var("ROUNDS").ok().map_or(12, |_| 1) {
                for (pose, best) in poses.iter().zip(&mut best) {
                    let before = Instant::now();
                    renderer.render_labels(&scene, &camera, pose, black_box(&mut image));
                    *best = best.min(before.elapsed().as_secs_f64());
                }
            }
            println!("class image {name} {:.3} ms", best.iter().sum::<f64>() / best.len() as f64 * 1e3);
        }
        renderer.render_labels(&scene, &camera, &prior, &mut image);
        let visible = renderer.visible_triangles(&scene, &camera, &prior);
        let mut best = f64::INFINITY;
        for _ in 0..std::env::var("ROUNDS").ok().map_or(100, |r| r.parse().unwrap()) {
            let before = Instant::now();
            renderer.render_labels_of((&scene, &visible), &camera, &prior, black_box(&mut image));
            best = best.min(before.elapsed().as_secs_f64());
        }
        println!("{} visible only: {:.3} ms", visible.len(), best * 1e3);
    }
}
