//! A region as a filled mask with its outer contour.

use nalgebra::Vector2;
use resurvey_plugin::schema::{ChangeRegion, PixelBox};

/// A region without holes.
pub struct Outline {
    /// Its bounds.
    pub bounds: PixelBox,
    inside: Vec<bool>,
}

/// A place where the region ends: midway between the centre of a pixel inside and of one outside.
#[derive(Clone, Copy, Debug)]
pub struct ContourPoint {
    /// Pixel coordinates.
    pub at: Vector2<f64>,
    /// Unit step from the pixel inside to the one outside.
    pub outward: [i64; 2],
    /// Column and row of the pixel inside.
    pub inside: [i64; 2],
}

impl Outline {
    /// The outline of `region`, all holes filled; `None` when its mask does not fit its bounds or is empty.
    pub fn new(region: &ChangeRegion) -> Option<Self> {
        let bounds = region.bounds;
        let fits = bounds.right > bounds.left && bounds.bottom > bounds.top;
        if !fits || region.mask.len() != bounds.width() as usize * bounds.height() as usize {
            return None;
        }
        let (width, height) = (bounds.width() as usize, bounds.height() as usize);
        let mut outside = vec![false; region.mask.len()];
        let on_border = |index: &usize| {
            let (column, row) = (index % width, index / width);
            column == 0 || row == 0 || column + 1 == width || row + 1 == height
        };
        let mut open: Vec<usize> = (0..outside.len()).filter(|at| on_border(at) && region.mask[*at] == 0).collect();
        open.iter().for_each(|at| outside[*at] = true);
        while let Some(at) = open.pop() {
            let (column, row) = (at % width, at / width);
            let near = [
                (column > 0).then(|| at - 1),
                (column + 1 < width).then(|| at + 1),
                (row > 0).then(|| at - width),
                (row + 1 < height).then(|| at + width),
            ];
            for near in near.into_iter().flatten() {
                if region.mask[near] == 0 && !outside[near] {
                    outside[near] = true;
                    open.push(near);
                }
            }
        }
        let inside: Vec<bool> = outside.into_iter().map(|outside| !outside).collect();
        inside.contains(&true).then_some(Self { bounds, inside })
    }

    /// The part of the outline in columns `left..right`; `None` when there is none.
    pub fn columns(&self, left: u32, right: u32) -> Option<Self> {
        let (left, right) = (left.max(self.bounds.left), right.min(self.bounds.right));
        let rows: Vec<u32> = (self.bounds.top..self.bounds.bottom)
            .filter(|v| (left..right).any(|u| self.contains(i64::from(u), i64::from(*v))))
            .collect();
        let bounds = PixelBox { left, right, top: *rows.first()?, bottom: rows.last()? + 1 };
        let inside = (bounds.top..bounds.bottom)
            .flat_map(|v| (left..right).map(move |u| (i64::from(u), i64::from(v))))
            .map(|(u, v)| self.contains(u, v))
            .collect();
        Some(Self { bounds, inside })
    }

    /// Whether pixel `u`, `v` belongs to the region or one of its holes.
    pub fn contains(&self, u: i64, v: i64) -> bool {
        let bounds = &self.bounds;
        let within = (i64::from(bounds.left)..i64::from(bounds.right)).contains(&u)
            && (i64::from(bounds.top)..i64::from(bounds.bottom)).contains(&v);
        within && {
            let (column, row) = (u - i64::from(bounds.left), v - i64::from(bounds.top));
            self.inside[(row * i64::from(bounds.width()) + column) as usize]
        }
    }

    /// Pixels of the region and its holes, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = [u32; 2]> {
        let (bounds, width) = (self.bounds, self.bounds.width());
        self.inside
            .iter()
            .enumerate()
            .filter(|(_, inside)| **inside)
            .map(move |(index, _)| [bounds.left + index as u32 % width, bounds.top + index as u32 / width])
    }

    /// The outer contour.
    pub fn contour(&self) -> Vec<ContourPoint> {
        let mut points = Vec::new();
        for [u, v] in self.pixels() {
            let [u, v] = [i64::from(u), i64::from(v)];
            for outward in [[-1, 0], [1, 0], [0, -1], [0, 1]] {
                if !self.contains(u + outward[0], v + outward[1]) {
                    let middle = |pixel: i64, step: i64| pixel as f64 + 0.5 + step as f64 / 2.0;
                    let at = Vector2::new(middle(u, outward[0]), middle(v, outward[1]));
                    points.push(ContourPoint { at, outward, inside: [u, v] });
                }
            }
        }
        points
    }

    /// Pixels of the region on the border of an image of `width` × `height`.
    pub fn border_pixels(&self, width: u32, height: u32) -> usize {
        self.pixels().filter(|[u, v]| *u == 0 || *v == 0 || u + 1 == width || v + 1 == height).count()
    }
}
