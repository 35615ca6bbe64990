//! What a segmenter gets wrong: contours that wander and blobs of a wrong class.

use super::random::Random;
use super::world::class;
use anyhow::bail;

/// How far a capture is from ideal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseLevel {
    /// Name in paths and on the command line.
    pub name: &'static str,
    /// 1σ by which contours wander, pixels.
    pub jitter_px: f64,
    /// Share of pixels with a wrong class.
    pub blobs: f64,
    /// Trees along the street.
    pub trees: usize,
    /// Vehicles along the street.
    pub cars: usize,
    /// 1σ by which real walls stand elsewhere than in the map, metres; twice that for heights.
    pub shift_m: f64,
    /// 1σ of the prior's pitch and roll, degrees.
    pub tilt_deg: f64,
    /// 1σ of the prior's height, metres.
    pub height_m: f64,
}

impl NoiseLevel {
    /// Labels without an error; the phone's attitude is still only nearly right.
    pub const IDEAL: Self = Self {
        name: "ideal",
        jitter_px: 0.0,
        blobs: 0.0,
        trees: 0,
        cars: 0,
        shift_m: 0.0,
        tilt_deg: 0.1,
        height_m: 0.02,
    };
    /// A good segmenter on a quiet street.
    pub const LIGHT: Self = Self {
        name: "light",
        jitter_px: 2.0,
        blobs: 0.01,
        trees: 4,
        cars: 1,
        shift_m: 0.0,
        tilt_deg: 0.5,
        height_m: 0.1,
    };
    /// A usual segmenter, a busy street, a map with the errors that maps have.
    pub const FIELD: Self = Self {
        name: "field",
        jitter_px: 4.0,
        blobs: 0.04,
        trees: 10,
        cars: 3,
        shift_m: 0.25,
        tilt_deg: 1.0,
        height_m: 0.3,
    };

    /// Whether the labels are free of error.
    pub fn is_ideal(&self) -> bool {
        self.name == Self::IDEAL.name
    }
}

impl std::str::FromStr for NoiseLevel {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        match [Self::IDEAL, Self::LIGHT, Self::FIELD].into_iter().find(|level| level.name == name) {
            Some(level) => Ok(level),
            None => bail!("unknown noise level {name:?}: expected ideal, light or field"),
        }
    }
}

/// Labels of `width` columns as a segmenter with this noise gives them.
pub fn disturb(labels: &[u8], width: usize, noise: &NoiseLevel, random: &mut Random) -> Vec<u8> {
    let mut disturbed = wander(labels, width, noise.jitter_px, random);
    add_blobs(&mut disturbed, width, noise.blobs, random);
    disturbed
}

/// Reads every pixel from a place displaced by a smooth random field of 1σ `jitter_px`.
fn wander(labels: &[u8], width: usize, jitter_px: f64, random: &mut Random) -> Vec<u8> {
    let height = labels.len() / width;
    let fields = [0, 1].map(|_| SmoothField::new(width, height, random));
    let mut wandered = Vec::with_capacity(labels.len());
    for v in 0..height {
        for u in 0..width {
            let [du, dv] = [0, 1].map(|i| jitter_px * fields[i].at(u as f64, v as f64));
            let from =
                |start: usize, by: f64, end: usize| (start as f64 + by).round().clamp(0.0, end as f64 - 1.0) as usize;
            wandered.push(labels[from(v, dv, height) * width + from(u, du, width)]);
        }
    }
    wandered
}

/// A smooth random field of variance about 1: a coarse octave that bends contours and a fine one that roughens them.
struct SmoothField {
    octaves: [(f64, f64, usize, Vec<f64>); 2],
}

impl SmoothField {
    /// Spacing of the lattice, pixels, and share of the variance, an octave.
    const OCTAVES: [(f64, f64); 2] = [(28.0, 0.92), (9.0, 0.08)];

    fn new(width: usize, height: usize, random: &mut Random) -> Self {
        let octaves = Self::OCTAVES.map(|(spacing, variance)| {
            let [columns, rows] = [width, height].map(|size| (size as f64 / spacing) as usize + 3);
            // Blending four nodes halves the variance on average along each axis (mean of w² + (1 − w)² is 0.74).
            let scale = (variance / (0.74 * 0.74)).sqrt();
            (spacing, scale, columns, (0..columns * rows).map(|_| random.normal()).collect())
        });
        Self { octaves }
    }

    fn at(&self, u: f64, v: f64) -> f64 {
        let sample = |(spacing, scale, columns, nodes): &(f64, f64, usize, Vec<f64>)| {
            let (x, y) = (u / spacing, v / spacing);
            let ease = |t: f64| t * t * (3.0 - 2.0 * t);
            let (s, t) = (ease(x.fract()), ease(y.fract()));
            let first = y as usize * columns + x as usize;
            let row = |start: usize| nodes[start] * (1.0 - s) + nodes[start + 1] * s;
            scale * (row(first) * (1.0 - t) + row(first + columns) * t)
        };
        self.octaves.iter().map(sample).sum()
    }
}

/// Paints blobs of a wrong class until they cover `share` of the image.
fn add_blobs(labels: &mut [u8], width: usize, share: f64, random: &mut Random) {
    let height = labels.len() / width;
    let mut left = (share * labels.len() as f64) as i64;
    let classes = [class::STONE, class::GLASS, class::METAL, class::OTHERS];
    while left > 0 {
        let centre = [random.within(0.0, width as f64), random.within(0.0, height as f64)];
        let blob = Blob::draw(centre, random);
        let wrong = classes[random.below(classes.len())];
        if labels[centre[1] as usize * width + centre[0] as usize] == wrong {
            continue;
        }
        for v in blob.span(1, height) {
            for u in blob.span(0, width) {
                if blob.holds(u as f64, v as f64) {
                    labels[v * width + u] = wrong;
                    left -= 1;
                }
            }
        }
    }
}

/// A roundish spot: a stretched circle with two waves around its edge.
struct Blob {
    centre: [f64; 2],
    radius_px: f64,
    stretch: f64,
    tilt_rad: f64,
    waves: [(f64, f64); 2],
}

impl Blob {
    const REACH: f64 = 2.4;

    fn draw(centre: [f64; 2], random: &mut Random) -> Self {
        let mut wave = |most: f64| (random.within(0.0, most), random.within(0.0, std::f64::consts::TAU));
        let waves = [wave(0.35), wave(0.2)];
        let size = random.unit();
        Self {
            centre,
            radius_px: 3.0 + 13.0 * size * size,
            stretch: random.within(1.0, 1.7),
            tilt_rad: random.within(0.0, std::f64::consts::PI),
            waves,
        }
    }

    fn span(&self, axis: usize, end: usize) -> std::ops::Range<usize> {
        let reach = self.radius_px * Self::REACH;
        (self.centre[axis] - reach).max(0.0) as usize..((self.centre[axis] + reach) as usize).min(end)
    }

    fn holds(&self, u: f64, v: f64) -> bool {
        let (x, y) = (u - self.centre[0], v - self.centre[1]);
        let (sin, cos) = self.tilt_rad.sin_cos();
        let (along, across) = ((x * cos + y * sin) / self.stretch, (y * cos - x * sin) * self.stretch);
        let angle = across.atan2(along);
        let [(two, two_at), (three, three_at)] = self.waves;
        let edge = 1.0 + two * (2.0 * angle + two_at).cos() + three * (3.0 * angle + three_at).cos();
        along.hypot(across) < self.radius_px * edge
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contours_wander_by_the_asked_pixels() {
        // A vertical edge: the column at which it is found in each row has the asked standard deviation.
        let (width, height) = (400, 4000);
        let labels: Vec<u8> = (0..width * height).map(|i| u8::from(i % width >= 200)).collect();
        let moved = wander(&labels, width, 4.0, &mut Random::new(3, "wander"));
        let edges: Vec<f64> = moved.chunks(width).map(|row| row.iter().filter(|&&x| x == 0).count() as f64).collect();
        let mean = edges.iter().sum::<f64>() / height as f64;
        let sigma = (edges.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / height as f64).sqrt();
        assert!((mean - 200.0).abs() < 1.0, "mean {mean}");
        assert!((sigma - 4.0).abs() < 0.8, "sigma {sigma}");
    }

    #[test]
    fn blobs_cover_the_asked_share() {
        let mut labels = vec![class::SKY; 960 * 720];
        add_blobs(&mut labels, 960, 0.04, &mut Random::new(5, "blobs"));
        let share = labels.iter().filter(|&&label| label != class::SKY).count() as f64 / (960.0 * 720.0);
        assert!((share - 0.04).abs() < 0.004, "share {share}");
    }

    #[test]
    fn ideal_labels_stay_as_they_are() {
        let labels: Vec<u8> = (0..64 * 48).map(|i| (i % 7) as u8).collect();
        assert_eq!(disturb(&labels, 64, &NoiseLevel::IDEAL, &mut Random::new(1, "ideal")), labels);
    }
}
