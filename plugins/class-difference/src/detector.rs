//! The detector: from photo and view to regions.

use crate::hidden::{is_hidden, unexplained};
use crate::pairs::pair_regions;
use crate::raster::Rasters;
use crate::realign::explained;
use crate::region::{Growth, grow, most_frequent, region, sound_components};
use crate::removal::{Evidence, Seen, seen};
use crate::settings::{Profile, SCHEMA, Settings};
use crate::tolerance::Tolerance;
use crate::uncovered::is_uncovered;
use resurvey_plugin::schema::{ChangeRegion, ClassId, ClassKind, ClassTable};
use resurvey_plugin::{Comparison, Detector, Error, Host, Plugin};

/// So many times the smallest region are never left to errors of the map alone.
const MUCH: usize = 5;

/// Detects changes as differences of class between photo and view.
pub struct ClassDifference {
    settings: Settings,
}

impl Plugin for ClassDifference {
    const NAME: &'static str = "class-difference";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "regions in which the photo has another class than the map, beyond the pose error";
    const SETTINGS: &'static str = SCHEMA;
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Detector for ClassDifference {
    fn detect(&mut self, host: &dyn Host, comparison: &Comparison<'_>) -> Result<Vec<ChangeRegion>, Error> {
        let rasters = Rasters::new(comparison)?;
        match self.settings.profile {
            Profile::Paper => Ok(pair_regions(&rasters, host.classes())),
            Profile::Default => self.regions(host, comparison, &rasters),
        }
    }
}

impl ClassDifference {
    fn regions(
        &self,
        host: &dyn Host,
        comparison: &Comparison<'_>,
        rasters: &Rasters,
    ) -> Result<Vec<ChangeRegion>, Error> {
        let settings = &self.settings.for_photo(&comparison.estimate);
        let classes = host.classes();
        let tolerance = Tolerance::new(comparison, settings);
        let tolerance_px = tolerance.per_pixel(rasters);
        let shows_behind = shows_behind(host, comparison, rasters, &tolerance_px)?;
        let evidence = Evidence { rasters, tolerance: &tolerance, shows_behind: &shows_behind, settings };
        let descriptors = seen(&evidence);
        let different = different(rasters, classes);
        let mut expected = explained(&rasters.photo, &rasters.view, &tolerance_px, rasters.width, &different);
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
                same_descriptor[*pixel] |= rasters.photo[*pixel] == rasters.view[*pixel];
            }
        }
        let growth = Growth { changed: &changed, different: &different, same_descriptor: &same_descriptor };
        let grown = grow(rasters, &tolerance_px, &growth);
        let limit_px = |class: u8| self.limit_px(classes, class, rasters.photo.len());
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
                    || is_uncovered(host, comparison, rasters, &tolerance, &sure, class)?)
            {
                continue;
            }
            new.push(region(rasters, &pixels, class, settings.max_hole_share));
        }
        let unexplained = unexplained(rasters, classes, &tolerance_px);
        let is_large = |seen: &&Seen| seen.pixels.len() >= limit_px(rasters.view[seen.pixels[0]]);
        let gone = descriptors
            .iter()
            .filter(is_large)
            .filter(|seen| seen.is_gone(&evidence) && !is_hidden(rasters, seen, &unexplained))
            .map(|seen| {
                let shown = seen.pixels.iter().filter(|pixel| shows_behind[**pixel]).map(|pixel| rasters.photo[*pixel]);
                region(rasters, &seen.free(rasters), ClassId(most_frequent(shown).unwrap_or(ClassId::VOID.0)), 0.0)
            });
        Ok(gone.chain(new).collect())
    }

    fn limit_px(&self, classes: &ClassTable, class: u8, image_px: usize) -> usize {
        let share = match classes.kind(ClassId(class)) {
            ClassKind::Dynamic => self.settings.min_dynamic_share,
            ClassKind::Material | ClassKind::Ignored => self.settings.min_material_share,
        };
        (share * image_px as f64).ceil() as usize
    }
}

/// Where photo and view differ and it could mean something: not where the photo is ignored or void, and no material
/// where the view has nothing to attach it to.
fn different(rasters: &Rasters, classes: &ClassTable) -> Vec<bool> {
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
