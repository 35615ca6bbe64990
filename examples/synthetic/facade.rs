//! Façades as label textures: shop fronts, window lattices, ribbons, curtain walls, blank gables, hoardings.

use super::random::Random;
use super::world::{Block, Texture, class};

/// Side of a texel, metres.
const TEXEL_M: f64 = 0.2;

/// How the floors above the shops look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// Single windows.
    Windows,
    /// Bands of glass along each floor.
    Ribbons,
    /// Glass from pier to pier over all floors.
    Piers,
    /// Glass with thin mullions and transoms.
    Curtain,
}

/// Measures of one façade, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// Class of the wall.
    pub wall: u8,
    /// The floors above the shops.
    pub pattern: Pattern,
    /// Height of a floor.
    pub floor_m: f64,
    /// Width of a bay.
    pub bay_m: f64,
    /// Share of a bay and of a floor that is glass.
    pub glass: [f64; 2],
    /// Height of the shop floor.
    pub shop_m: f64,
    /// Distance and width of the piers between shops.
    pub shop_piers_m: [f64; 2],
    /// Height of the metal fascia over the shop windows; 0 for none.
    pub fascia_m: f64,
    /// Height of the wall above the last floor.
    pub parapet_m: f64,
    /// Whether south and north, and whether east and west walls have windows.
    pub open: [bool; 2],
    /// Hoardings that the map already has: wall, start, end, lowest and highest height.
    pub hoardings: Vec<(usize, [f64; 4])>,
}

impl Style {
    /// A style drawn at random for walls of `width_m` along the street and `height_m`.
    pub fn draw(random: &mut Random, width_m: f64, height_m: f64) -> Self {
        let patterns = [Pattern::Windows, Pattern::Windows, Pattern::Ribbons, Pattern::Piers, Pattern::Curtain];
        let pattern = patterns[random.below(patterns.len())];
        let wall = if pattern == Pattern::Curtain || random.chance(0.35) { class::METAL } else { class::STONE };
        let shop_m = random.within(3.8, 5.2);
        let mut hoardings = Vec::new();
        if random.chance(0.3) && height_m > shop_m + 14.0 {
            for wall in [0, 2] {
                let (wide, tall) = (random.within(3.0, width_m * 0.4), random.within(3.0, 9.0));
                let start = random.within(0.5, width_m - wide - 0.5);
                let low = random.within(shop_m + 1.0, height_m - tall - 2.0).min(22.0);
                hoardings.push((wall, [start, start + wide, low, low + tall]));
            }
        }
        Self {
            wall,
            pattern,
            floor_m: random.within(2.9, 4.0),
            bay_m: if pattern == Pattern::Curtain { random.within(1.5, 2.6) } else { random.within(2.2, 4.6) },
            glass: [random.within(0.35, 0.7), random.within(0.4, 0.65)],
            shop_m,
            shop_piers_m: [random.within(3.5, 7.5), random.within(0.4, 1.2)],
            fascia_m: if random.chance(0.6) { random.within(0.7, 1.2) } else { 0.0 },
            parapet_m: random.within(0.6, 1.6),
            open: [true, random.chance(0.6)],
            hoardings,
        }
    }

    /// The class at `along_m` from the left end of `wall` and `up_m` above the ground.
    fn class_at(&self, wall: usize, along_m: f64, up_m: f64, height_m: f64) -> u8 {
        let on = |&&(on, [start, end, low, high]): &&(usize, [f64; 4])| {
            on == wall && (start..end).contains(&along_m) && (low..high).contains(&up_m)
        };
        if self.hoardings.iter().find(on).is_some() {
            return class::BANNER;
        }
        if up_m < self.shop_m {
            return self.shop_class(along_m, up_m, self.open[wall % 2] || [0, 2].contains(&wall));
        }
        if !self.open[wall % 2] || up_m > height_m - self.parapet_m {
            return self.wall;
        }
        let in_floor = ((up_m - self.shop_m) / self.floor_m).fract();
        let in_bay = (along_m / self.bay_m).fract();
        let [wide, tall] = self.glass;
        let inside = |x: f64, share: f64| (x - 0.5).abs() < share / 2.0;
        let is_glass = match self.pattern {
            Pattern::Windows => inside(in_bay, wide) && inside(in_floor, tall),
            Pattern::Ribbons => inside(in_floor, tall),
            Pattern::Piers => inside(in_bay, wide),
            Pattern::Curtain => inside(in_bay, 1.0 - 0.25 / self.bay_m) && inside(in_floor, 1.0 - 0.5 / self.floor_m),
        };
        if is_glass { class::GLASS } else { self.wall }
    }

    fn shop_class(&self, along_m: f64, up_m: f64, has_shops: bool) -> u8 {
        let [pitch, pier] = self.shop_piers_m;
        let is_frame = up_m < 0.4 || up_m > self.shop_m - 0.4 || along_m % pitch < pier;
        match () {
            () if !has_shops || is_frame => class::STONE,
            () if up_m > self.shop_m - 0.4 - self.fascia_m => class::METAL,
            () => class::GLASS,
        }
    }

    /// The strip around `block`.
    pub fn texture(&self, block: &Block) -> Texture {
        let height_m = block.top - block.bottom;
        let around_m = 4.0 * (block.half[0] + block.half[1]);
        let (width, height) = ((around_m / TEXEL_M).round() as usize, (height_m / TEXEL_M).round() as usize);
        let mut labels = Vec::with_capacity(width * height);
        for row in (0..height).rev() {
            for column in 0..width {
                let u = (column as f64 + 0.5) / width as f64;
                let up_m = (row as f64 + 0.5) / height as f64 * height_m;
                let wall = (0..4).rfind(|&wall| block.strip_start(wall) <= u).unwrap_or(0);
                let along_m = (u - block.strip_start(wall)) * around_m;
                labels.push(self.class_at(wall, along_m, up_m, height_m));
            }
        }
        Texture { width, height, labels }
    }
}
