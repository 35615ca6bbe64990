//! Counts of a view against a photo from bit planes, with the photo's side prepared once.

use super::bits::{Bits, Disk, Size, WORD};
use crate::image::LabelImage;
use pulp::{Arch, Simd, WithSimd};
use resurvey_schema::ClassId;
use resurvey_schema::service::{ClassCounts, ClassSet};

/// Up to so many classes a word of every plane is made at once; beyond, of the classes that occur in it.
const FEW_CLASSES: usize = 16;

/// A photo that is ready to be compared with many views.
#[derive(Clone, Debug)]
pub struct ComparedPhoto {
    size: Size,
    /// Pixels whose class takes part: one below the number of classes, not ignored.
    known: Bits,
    classes: Vec<PhotoClass>,
    ignored_in_view: ClassSet,
    boundaries: Option<Boundaries>,
}

#[derive(Clone, Debug)]
struct PhotoClass {
    pixels: Bits,
    count: u32,
    boundary: Bits,
    boundary_count: u32,
    /// The boundary dilated by the tolerance.
    near_boundary: Bits,
}

#[derive(Clone, Debug)]
struct Boundaries {
    disk: Disk,
    /// All pixels of the image.
    whole: Bits,
    /// Pixels where boundaries are compared whatever the view shows.
    compared: Bits,
}

/// Bit planes of a view, and scratch space for its comparison; one per thread.
#[derive(Clone, Debug)]
pub struct ViewPlanes {
    arch: Arch,
    planes: Vec<Bits>,
    known: Bits,
    boundary: Bits,
    wide: Vec<Bits>,
}

impl ComparedPhoto {
    /// Prepares `photo` for classes `0..classes`; boundaries are compared within a tolerance in the photo's own pixels,
    /// and not at all when it is 0.
    pub fn new(
        photo: &LabelImage,
        classes: usize,
        tolerance_px: f64,
        ignored_in_photo: &ClassSet,
        ignored_in_view: &ClassSet,
    ) -> Self {
        let size = Size::new(photo.width() as usize, photo.height() as usize);
        let pick = |pick: &dyn Fn(u8) -> bool| Bits::from_pixels(size, photo.values(), pick);
        let compared = |value: u8| value != ClassId::VOID.0 && !ignored_in_photo.contains(ClassId(value));
        let boundaries = (tolerance_px > 0.0).then(|| Boundaries {
            disk: Disk::new(tolerance_px),
            whole: pick(&|_| true),
            compared: pick(&compared),
        });
        let class = |class: usize| {
            let all = pick(&|value| usize::from(value) == class);
            let (mut boundary, mut near_boundary) = (Bits::new(size), Bits::new(size));
            if let Some(Boundaries { disk, whole, compared }) = &boundaries {
                all.boundary_into(whole, &mut boundary);
                boundary.and(compared);
                near_boundary = boundary.dilated(disk, whole);
            }
            let pixels = if compared(class as u8) { all } else { Bits::new(size) };
            PhotoClass { count: pixels.count(), boundary_count: boundary.count(), pixels, boundary, near_boundary }
        };
        let known = pick(&|value| compared(value) && usize::from(value) < classes);
        let classes = (0..classes.min(usize::from(ClassId::VOID.0))).map(class).collect();
        Self { size, known, classes, ignored_in_view: *ignored_in_view, boundaries }
    }

    /// Planes for views of the photo's size, for the best instruction set that the processor has.
    pub fn planes(&self) -> ViewPlanes {
        self.planes_for(Arch::new())
    }

    fn planes_for(&self, arch: Arch) -> ViewPlanes {
        let blank = Bits::new(self.size);
        let planes = vec![blank.clone(); self.classes.len()];
        ViewPlanes { arch, planes, known: blank.clone(), boundary: blank, wide: Vec::new() }
    }

    /// Sets the counts of the view in `planes`, class by class.
    ///
    /// |A|, |B| and |A∩B| are over the pixels where neither the photo's nor the view's class is void or ignored,
    /// boundaries over those where the photo's is not.
    pub fn count(&self, planes: &mut ViewPlanes, counts: &mut [ClassCounts]) {
        planes.arch.dispatch(Count { photo: self, planes, counts });
    }
}

impl ViewPlanes {
    /// Takes row `v` of the view: its classes, padded with void to a multiple of 64 pixels.
    pub fn set_row(&mut self, v: usize, classes: &[u8]) {
        self.arch.dispatch(SetRow { planes: self, v, classes });
    }
}

struct SetRow<'a> {
    planes: &'a mut ViewPlanes,
    v: usize,
    classes: &'a [u8],
}

impl WithSimd for SetRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { planes: ViewPlanes { planes, known, .. }, v, classes } = self;
        let first = known.size().row(v);
        if planes.len() <= FEW_CLASSES && S::F32_LANES > 1 {
            for (class, plane) in planes.iter_mut().enumerate() {
                for (word, pixels) in classes.as_chunks::<WORD>().0.iter().enumerate() {
                    plane.set_word(simd, first + word, pixels, class as u8);
                }
            }
            return;
        }
        for (word, pixels) in classes.as_chunks::<WORD>().0.iter().enumerate() {
            planes.iter_mut().for_each(|plane| plane.clear_word(first + word));
            let mut left = u64::MAX;
            while left != 0 {
                let class = pixels[left.trailing_zeros() as usize];
                let found = crate::image::mask(simd, pixels, class);
                left &= !found;
                if let Some(plane) = planes.get_mut(usize::from(class)) {
                    plane.add_word(first + word, found);
                }
            }
        }
    }
}

struct Count<'a> {
    photo: &'a ComparedPhoto,
    planes: &'a mut ViewPlanes,
    counts: &'a mut [ClassCounts],
}

impl WithSimd for Count<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { photo, planes: ViewPlanes { planes, known, boundary, wide, .. }, counts } = self;
        known.clear();
        for (class, plane) in planes.iter().enumerate() {
            if !photo.ignored_in_view.contains(ClassId(class as u8)) {
                known.or(plane);
            }
        }
        for (class, ((photo_class, plane), count)) in photo.classes.iter().zip(planes).zip(counts).enumerate() {
            *count = ClassCounts::default();
            let ignored_in_view = photo.ignored_in_view.contains(ClassId(class as u8));
            if photo_class.count > 0 {
                count.photo = photo_class.pixels.count_and(known);
            }
            if ignored_in_view {
                continue;
            }
            count.view = plane.count_and(&photo.known);
            if photo_class.count > 0 && count.view > 0 {
                count.both = photo_class.pixels.count_and(plane);
            }
            if let Some(boundaries) = &photo.boundaries {
                count_boundaries(boundaries, photo_class, plane, (boundary, wide), count);
            }
        }
    }
}

#[inline(always)]
fn count_boundaries(
    boundaries: &Boundaries,
    photo: &PhotoClass,
    view: &Bits,
    (boundary, wide): (&mut Bits, &mut Vec<Bits>),
    count: &mut ClassCounts,
) {
    view.boundary_into(&boundaries.whole, boundary);
    boundary.and(&boundaries.compared);
    count.photo_boundary = photo.boundary_count;
    count.view_boundary = boundary.count();
    if count.photo_boundary > 0 && count.view_boundary > 0 {
        count.view_boundary_matched = boundary.count_and(&photo.near_boundary);
        count.photo_boundary_matched = boundary.count_near(&boundaries.disk, &photo.boundary, wide);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::overlap_counts;
    use proptest::prelude::*;

    const WIDTH: i64 = 75;
    const CLASSES: usize = 6;

    fn image(values: &[u8]) -> LabelImage {
        LabelImage::from_values(WIDTH as u32, (values.len() / WIDTH as usize) as u32, values.to_vec()).unwrap()
    }

    fn counts(arch: Arch, photo: &ComparedPhoto, view: &LabelImage) -> Vec<ClassCounts> {
        let mut planes = photo.planes_for(arch);
        for v in 0..view.height() {
            let mut row = view.row(v).to_vec();
            row.resize(row.len().next_multiple_of(WORD), ClassId::VOID.0);
            planes.set_row(v as usize, &row);
        }
        let mut counts = vec![ClassCounts::default(); CLASSES];
        photo.count(&mut planes, &mut counts);
        counts
    }

    /// Boundary pixels of a class where the photo is compared, by the definition.
    fn boundary(image: &LabelImage, class: u8, compared: impl Fn(i64, i64) -> bool) -> Vec<(i64, i64)> {
        let size = (i64::from(image.width()), i64::from(image.height()));
        let is = |u: i64, v: i64| image.at(u as u32, v as u32) == class;
        let pixels = (0..size.1).flat_map(|v| (0..size.0).map(move |u| (u, v)));
        let edge = |u: i64, v: i64| {
            [(u - 1, v), (u + 1, v), (u, v - 1), (u, v + 1)]
                .iter()
                .any(|&(u, v)| (0..size.0).contains(&u) && (0..size.1).contains(&v) && !is(u, v))
        };
        pixels.filter(|&(u, v)| is(u, v) && edge(u, v) && compared(u, v)).collect()
    }

    fn matched(of: &[(i64, i64)], near: &[(i64, i64)], radius: f64) -> u32 {
        let is_near =
            |a: &(i64, i64), b: &(i64, i64)| ((a.0 - b.0).pow(2) + (a.1 - b.1).pow(2)) as f64 <= radius * radius;
        of.iter().filter(|a| near.iter().any(|b| is_near(a, b))).count() as u32
    }

    fn set(classes: &[u8]) -> ClassSet {
        let mut set = ClassSet::default();
        classes.iter().for_each(|&class| set.insert(ClassId(class)));
        set
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn counts_are_those_of_the_definitions_on_every_instruction_set(
            photo_values in prop::collection::vec(prop::sample::select(vec![0_u8, 0, 0, 1, 1, 2, 3, 5, 7, 255]), 75 * 12),
            view_values in prop::collection::vec(prop::sample::select(vec![0_u8, 0, 0, 1, 2, 2, 4, 5, 9, 255]), 75 * 12),
            runs in 1_usize..12, radius in 0.5_f64..4.5,
        ) {
            // Runs of a class, so that boundaries are not everywhere.
            let runs = |values: &[u8]| image(&values.iter().flat_map(|&value| vec![value; runs]).take(values.len()).collect::<Vec<_>>());
            let (photo, view) = (runs(&photo_values), runs(&view_values));
            let (in_photo, in_view) = (set(&[3]), set(&[4]));
            let mut expected = overlap_counts(&photo, &view, CLASSES, &in_photo, &in_view);
            let compared = |u: i64, v: i64| ![3, 255].contains(&photo.at(u as u32, v as u32));
            for class in (0..CLASSES as u8).filter(|&class| class != 4) {
                let (a, b) = (boundary(&photo, class, compared), boundary(&view, class, compared));
                let count = &mut expected[usize::from(class)];
                count.photo_boundary = a.len() as u32;
                count.view_boundary = b.len() as u32;
                count.photo_boundary_matched = matched(&a, &b, radius);
                count.view_boundary_matched = matched(&b, &a, radius);
            }
            let prepared = ComparedPhoto::new(&photo, CLASSES, radius, &in_photo, &in_view);
            prop_assert_eq!(&counts(Arch::Scalar, &prepared, &view), &expected);
            prop_assert_eq!(&counts(Arch::new(), &prepared, &view), &expected);
        }
    }

    /// A vertical edge at column `edge` of a 75 × 10 image: class 0 left, class 1 right.
    fn edge_at(edge: usize) -> LabelImage {
        image(&(0..750).map(|pixel| u8::from(pixel % WIDTH as usize >= edge)).collect::<Vec<_>>())
    }

    #[test]
    fn a_boundary_counts_as_found_up_to_the_tolerance_and_not_beyond() {
        let photo = ComparedPhoto::new(&edge_at(20), CLASSES, 3.0, &ClassSet::default(), &ClassSet::default());
        for (shift, matched) in [(0, 10), (3, 10), (4, 0)] {
            let counts = counts(Arch::new(), &photo, &edge_at(20 + shift));
            assert_eq!(counts[0].photo_boundary, 10, "one column of ten pixels");
            assert_eq!((counts[0].photo_boundary_matched, counts[0].view_boundary_matched), (matched, matched));
        }
    }

    #[test]
    fn without_a_tolerance_boundaries_are_not_counted() {
        let photo = ComparedPhoto::new(&edge_at(20), CLASSES, 0.0, &ClassSet::default(), &ClassSet::default());
        let counts = counts(Arch::new(), &photo, &edge_at(20));
        assert_eq!((counts[0].both, counts[0].photo_boundary, counts[0].view_boundary), (200, 0, 0));
    }
}
