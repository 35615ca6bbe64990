//! The estimator: what each region means for the map.

use crate::outline::Outline;
use crate::removal::{Gone, Verdict, judge};
use crate::requirement::{Stop, Unmet};
use crate::settings::{Profile, SCHEMA, Settings};
use crate::sight::Sight;
use crate::{dynamic, material, paper};
use resurvey_plugin::schema::{ChangeRegion, ClassKind, Descriptor, DynamicDescriptor, Proposal};
use resurvey_plugin::{Comparison, Error, Estimator, Host, Plugin};
use std::collections::BTreeSet;

/// Estimates material and dynamic descriptors, and removals.
pub struct Descriptors {
    settings: Settings,
}

impl Plugin for Descriptors {
    const NAME: &'static str = "descriptors";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "rectangles on walls, objects on the ground, and descriptors that are gone";
    const SETTINGS: &'static str = SCHEMA;
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Estimator for Descriptors {
    fn estimate(
        &mut self,
        host: &dyn Host,
        comparison: &Comparison<'_>,
        regions: &[ChangeRegion],
    ) -> Result<Vec<Proposal>, Error> {
        let settings = self.settings.for_photo(&comparison.estimate);
        let sight = Sight::new(host, comparison, &settings)?;
        let outlines = outlines(&sight, regions)?;
        let mut gone = BTreeSet::new();
        let mut proposals = Vec::new();
        for (number, (region, outline)) in (0u32..).zip(regions.iter().zip(&outlines)) {
            if host.cancelled() {
                return Err(Error("cancelled".to_owned()));
            }
            match meaning(&sight, region, outline, &outlines) {
                Ok(Meaning::Gone(one)) => proposals.push(removal(number, region, &one, gone.insert(one.fid))),
                Ok(Meaning::Place(answers)) => proposals.extend(answers.into_iter().map(|answer| match answer {
                    Ok(descriptor) => Proposal::Place { region: number, descriptor },
                    Err(unmet) => Proposal::Reject { region: number, rejection: unmet.rejection(region) },
                })),
                Err(Stop::Unmet(unmet)) => {
                    proposals.push(Proposal::Reject { region: number, rejection: unmet.rejection(region) });
                }
                Err(Stop::Host(error)) => return Err(error),
            }
        }
        Ok(proposals)
    }
}

/// What a region means.
enum Meaning {
    /// Descriptors to place, or why not.
    Place(Vec<Result<Descriptor, Unmet>>),
    /// A descriptor to remove.
    Gone(Gone),
}

fn meaning(sight: &Sight<'_>, region: &ChangeRegion, outline: &Outline, all: &[Outline]) -> Result<Meaning, Stop> {
    if let Verdict::Gone(gone) = judge(sight, region)? {
        return Ok(Meaning::Gone(gone));
    }
    let [width, height] = sight.size();
    let on_border = || all.iter().map(|outline| outline.border_pixels(width, height)).sum();
    let dynamics = |found: Vec<Result<DynamicDescriptor, Unmet>>| {
        found.into_iter().map(|answer| answer.map(Descriptor::Dynamic)).collect()
    };
    let place = match (sight.host.classes().kind(region.class_after), sight.settings.profile) {
        (ClassKind::Material, Profile::Default) => {
            vec![Ok(Descriptor::Material(material::measure(sight, region, outline)?))]
        }
        (ClassKind::Material, Profile::Paper) => {
            vec![Ok(Descriptor::Material(paper::material(sight, region, outline, on_border())?))]
        }
        (ClassKind::Dynamic, Profile::Default) => dynamics(dynamic::measure(sight, region, outline)?),
        (ClassKind::Dynamic, Profile::Paper) => {
            dynamics(vec![Ok(paper::dynamic(sight, region, outline, on_border())?)])
        }
        (ClassKind::Ignored, _) => {
            return Err(Unmet { requirement: "class", measured: 0.0, limit: 1.0, unit: "descriptor kinds" }.into());
        }
    };
    Ok(Meaning::Place(place))
}

/// The removal of what is gone; a second region on the same descriptor must not take its neighbour as well.
fn removal(number: u32, region: &ChangeRegion, gone: &Gone, is_first: bool) -> Proposal {
    if is_first {
        let Gone { near, sigma_m, .. } = *gone;
        return Proposal::Remove { region: number, class: region.class_before, near, sigma_m };
    }
    let twice = Unmet { requirement: "removed-once", measured: 2.0, limit: 1.0, unit: "regions" };
    Proposal::Reject { region: number, rejection: twice.rejection(region) }
}

fn outlines(sight: &Sight<'_>, regions: &[ChangeRegion]) -> Result<Vec<Outline>, Error> {
    let [width, height] = sight.size();
    let outline = |(number, region): (usize, &ChangeRegion)| {
        let fits = region.bounds.right <= width && region.bounds.bottom <= height;
        Outline::new(region).filter(|_| fits).ok_or_else(|| {
            let (bounds, found) = (region.bounds, region.mask.len());
            Error(format!(
                "region {number}: expected a mask with pixels that fits {bounds:?} in an image of {width}×{height}, \
                 found {found} values"
            ))
        })
    };
    regions.iter().enumerate().map(outline).collect()
}
