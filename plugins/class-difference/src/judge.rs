//! What the map knew is judged by the view as it is, what is new by a view that may have been made to fit better.

use crate::hidden::{is_hidden, unexplained};
use crate::raster::Rasters;
use crate::realign::explained;
use crate::region::{Growth, grow, most_frequent, region, sound_components};
use crate::removal::{Evidence, Seen, seen};
use crate::settings::Settings;
use crate::tolerance::Tolerance;
use crate::uncovered::is_uncovered;
use resurvey_plugin::schema::{ChangeRegion, ClassId, ClassKind, ClassTable};
use resurvey_plugin::{Comparison, Error, Host};

/// So many times the smallest region are never left to errors of the map alone.
const MUCH: usize = 5;

/// One comparison, and how far the view may be off.
pub struct Judge<'a> {
    /// The host.
    pub host: &'a dyn Host,
    /// Photo and view.
    pub comparison: &'a Comparison<'a>,
    /// The settings for this photo.
    pub settings: &'a Settings,
    /// The rasters of `comparison`.
    pub rasters: &'a Rasters,
    /// How far class edges may be off in them.
    pub tolerance: &'a Tolerance,
    /// The same per pixel.
    pub tolerance_px: &'a [u8],
}

/// The view in which new things are looked for, and how far its class edges may still be off.
pub struct Sight<'a> {
    /// Photo and view; the photo is that of the comparison.
    pub rasters: &'a Rasters,
    /// Pixels at which photo and view differ as [`different`] says.
    pub different: &'a [bool],
    /// Those of them that the tolerance explains.
    pub explained: Vec<bool>,
}

impl<'a> Sight<'a> {
    /// A sight in which a class that the view has within the tolerance of a pixel is no news there.
    pub fn new(rasters: &'a Rasters, tolerance_px: &'a [u8], different: &'a [bool]) -> Self {
        let explained = explained(&rasters.photo, &rasters.view, tolerance_px, rasters.width, different);
        Self { rasters, different, explained }
    }
}

impl Judge<'_> {
    /// Descriptors that are gone, then what is new in `sight`.
    pub fn regions(&self, sight: Sight<'_>) -> Result<Vec<ChangeRegion>, Error> {
        let shows_behind = shows_behind(self.host, self.comparison, self.rasters, self.tolerance_px)?;
        let Self { rasters, tolerance, settings, .. } = *self;
        let evidence = Evidence { rasters, tolerance, shows_behind: &shows_behind, settings };
        let descriptors = seen(&evidence);
        let new = self.new_regions(sight, &descriptors, &shows_behind)?;
        let claimed = claimed(&new, rasters);
        let unexplained = unexplained(rasters, self.host.classes(), self.tolerance_px);
        let limit_px = |seen: &Seen| limit_px(settings, self.host.classes(), rasters, rasters.view[seen.pixels[0]]);
        let gone = descriptors
            .iter()
            .filter(|seen| seen.pixels.len() >= limit_px(seen))
            .filter(|seen| seen.is_gone(&evidence, &claimed) && !is_hidden(rasters, seen, &unexplained))
            .map(|seen| {
                let shown = seen.pixels.iter().filter(|pixel| shows_behind[**pixel]).map(|pixel| rasters.photo[*pixel]);
                region(rasters, &seen.free(rasters), ClassId(most_frequent(shown).unwrap_or(ClassId::VOID.0)), 0.0)
            });
        Ok(gone.chain(new).collect())
    }

    fn new_regions(
        &self,
        sight: Sight<'_>,
        descriptors: &[Seen],
        shows_behind: &[bool],
    ) -> Result<Vec<ChangeRegion>, Error> {
        let (settings, classes) = (self.settings, self.host.classes());
        let Sight { rasters, different, explained: mut expected } = sight;
        for descriptor in descriptors.iter().filter(|descriptor| descriptor.is_still_there(settings)) {
            descriptor.account(rasters, settings.label_jitter_px as i64, &mut expected);
        }
        // What was behind a descriptor that is gone is no new material.
        let changed: Vec<bool> =
            (0..different.len()).map(|at| different[at] && !expected[at] && !shows_behind[at]).collect();
        let mut same_descriptor = same_descriptor(rasters, classes);
        // Where one that is not there any more shows its class, another of its kind stands: all of that is one region.
        for descriptor in descriptors.iter().filter(|descriptor| !descriptor.is_still_there(settings)) {
            for pixel in &descriptor.pixels {
                same_descriptor[*pixel] |= rasters.photo[*pixel] == self.rasters.view[*pixel];
            }
        }
        let growth = Growth { changed: &changed, different, same_descriptor: &same_descriptor };
        let grown = grow(rasters, self.tolerance_px, &growth);
        let limit_px = |class: u8| limit_px(settings, classes, rasters, class);
        let added = sound_components(&grown, &changed, rasters.width, settings.min_radius_px, limit_px);
        let mut new = Vec::new();
        for pixels in added {
            let class = ClassId(rasters.photo[pixels[0]]);
            let sure: Vec<usize> = pixels.iter().copied().filter(|pixel| changed[*pixel]).collect();
            // Parts of the base map move into each other's place; what a descriptor grows by is no part of it.
            let is_of_descriptor = pixels.iter().any(|pixel| same_descriptor[*pixel]);
            // Much of a façade can change between its windows: that is for the estimator to place or to refuse by name.
            let is_much = sure.len() >= MUCH * limit_px(class.0);
            let is_enough = is_much || sure.len() as f64 >= settings.min_sure_share * pixels.len() as f64;
            if classes.kind(class) == ClassKind::Material
                && (!(is_enough || is_of_descriptor)
                    || is_uncovered(self.host, self.comparison, self.rasters, self.tolerance, &sure, class)?)
            {
                continue;
            }
            new.push(region(rasters, &pixels, class, settings.max_hole_share));
        }
        Ok(new)
    }
}

/// Pixels of `regions`.
fn claimed(regions: &[ChangeRegion], rasters: &Rasters) -> Vec<bool> {
    let mut claimed = vec![false; rasters.photo.len()];
    for region in regions {
        let (left, wide) = (region.bounds.left as usize, region.bounds.width() as usize);
        for (at, _) in region.mask.iter().enumerate().filter(|(_, inside)| **inside != 0) {
            claimed[(region.bounds.top as usize + at / wide) * rasters.width + left + at % wide] = true;
        }
    }
    claimed
}

fn limit_px(settings: &Settings, classes: &ClassTable, rasters: &Rasters, class: u8) -> usize {
    let share = match classes.kind(ClassId(class)) {
        ClassKind::Dynamic => settings.min_dynamic_share,
        ClassKind::Material | ClassKind::Ignored => settings.min_material_share,
    };
    (share * rasters.photo.len() as f64).ceil() as usize
}

/// Where photo and view differ and it could mean something: not where the photo is ignored or void, and no material
/// where the view has nothing to attach it to.
pub fn different(rasters: &Rasters, classes: &ClassTable) -> Vec<bool> {
    let kinds: Vec<ClassKind> = (0..=255).map(|class| classes.kind(ClassId(class))).collect();
    let differs = |pixel: usize| {
        let (before, after) = (rasters.view[pixel], rasters.photo[pixel]);
        before != after
            && match kinds[usize::from(after)] {
                ClassKind::Ignored => false,
                ClassKind::Material => !rasters.is_sky(pixel),
                ClassKind::Dynamic => true,
            }
    };
    (0..rasters.photo.len()).map(differs).collect()
}

/// Where the view shows a material descriptor of the class that the photo has there.
fn same_descriptor(rasters: &Rasters, classes: &ClassTable) -> Vec<bool> {
    let same = |pixel: usize| {
        let class = rasters.photo[pixel];
        rasters.features[pixel] != 0
            && rasters.view[pixel] == class
            && classes.kind(ClassId(class)) == ClassKind::Material
    };
    (0..rasters.photo.len()).map(same).collect()
}

/// Where the view shows a descriptor and the photo what the map has behind it, within the tolerance.
fn shows_behind(
    host: &dyn Host,
    comparison: &Comparison<'_>,
    rasters: &Rasters,
    tolerance_px: &[u8],
) -> Result<Vec<bool>, Error> {
    let void = ClassId::VOID.0;
    let asked: Vec<bool> = (0..rasters.photo.len())
        .map(|at| {
            let class = rasters.photo[at];
            rasters.features[at] != 0 && class != void && class != rasters.view[at]
        })
        .collect();
    if !asked.contains(&true) {
        return Ok(asked);
    }
    let behind = host.render(1, false, &[comparison.estimate.pose])?;
    let labels = behind.into_iter().next().map(|view| view.labels).unwrap_or_default();
    if labels.len() != rasters.photo.len() {
        let (expected, found) = (rasters.photo.len(), labels.len());
        return Err(Error(format!("expected a rendering of {expected} pixels from the host, found {found}")));
    }
    Ok(explained(&rasters.photo, &labels, tolerance_px, rasters.width, &asked))
}
