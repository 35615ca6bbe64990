//! Takes the results of a call out of the plugin's memory and checks them.
#![allow(unsafe_code)]

use super::check::{Rules, Violation, violation};
use super::lend::{read_growing, slice, text};
use resurvey_schema::abi::{self, Growing, STATUS_FAILED, STATUS_OK, Status};
use resurvey_schema::{
    Alignment, ChangeRegion, ClassId, Descriptor, DynamicDescriptor, Localization, MaterialDescriptor, PixelBox,
    Proposal, Rejection, RunnerUp, Uncertainty,
};
use std::ffi::c_void;
use std::sync::{Mutex, PoisonError};

/// More results than this from one call are a bug of the plugin, not an answer.
pub(super) const MOST_RESULTS: usize = 1 << 20;

/// Receives results of unknown length during one call.
pub(super) struct Collector<'a> {
    rules: Rules<'a>,
    // A plugin must call back on the thread of the call; the lock keeps one that does not from breaking memory.
    inner: Mutex<Collected>,
}

/// Everything a call delivered.
#[derive(Default)]
pub(super) struct Collected {
    pub heat: Vec<[f64; 3]>,
    pub regions: Vec<ChangeRegion>,
    pub proposals: Vec<Proposal>,
    pub violation: Option<Violation>,
}

impl<'a> Collector<'a> {
    pub(super) fn new(rules: Rules<'a>) -> Self {
        Self { rules, inner: Mutex::default() }
    }

    /// The callbacks, valid as long as `self` is not moved or dropped.
    pub(super) fn results(&self) -> abi::Results {
        abi::Results {
            context: std::ptr::from_ref(self).cast_mut().cast(),
            heat: Some(take_heat),
            region: Some(take_region),
            proposal: Some(take_proposal),
            ..abi::Results::new()
        }
    }

    pub(super) fn finish(self) -> Collected {
        self.inner.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    fn deliver(&self, deliver: impl FnOnce(&mut Collected, &Rules<'_>) -> Result<(), Violation>) -> Status {
        let mut collected = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        if collected.violation.is_some() {
            return STATUS_FAILED;
        }
        match deliver(&mut collected, &self.rules) {
            Ok(()) => STATUS_OK,
            Err(violation) => {
                collected.violation = Some(violation);
                STATUS_FAILED
            }
        }
    }
}

/// The collector behind the context that [`Collector::results`] gave out.
///
/// # Safety
/// `context` came from [`Collector::results`] and the collector still lives.
unsafe fn collector<'a>(context: *mut c_void) -> &'a Collector<'a> {
    // SAFETY: the caller's promise.
    unsafe { &*context.cast_const().cast::<Collector<'a>>() }
}

unsafe extern "C" fn take_heat(context: *mut c_void, cells: *const [f64; 3], count: usize) -> Status {
    // SAFETY: the plugin passes our own context back, during the call: the header asks for both.
    let collector = unsafe { collector(context) };
    // SAFETY: the plugin lends `count` cells, as the header asks.
    let cells = unsafe { slice(cells, count) };
    collector.deliver(|collected, _| match cells {
        Some(cells) if cells.len() <= MOST_RESULTS - collected.heat.len() => {
            collected.heat.extend_from_slice(cells);
            Ok(())
        }
        _ => violation("heat", &format_args!("{count} cells"), format!("at most {MOST_RESULTS} readable cells")),
    })
}

unsafe extern "C" fn take_region(context: *mut c_void, region: *const abi::Region) -> Status {
    // SAFETY: as in `take_heat`.
    let collector = unsafe { collector(context) };
    // SAFETY: the plugin lends a region that starts with its size, as the header asks.
    let region = unsafe { read_growing(region) };
    collector.deliver(|collected, rules| {
        let index = collected.regions.len();
        let Some(region) = region.filter(|_| index < MOST_RESULTS) else {
            return violation(format!("region[{index}]"), &"null", format!("at most {MOST_RESULTS} regions"));
        };
        // SAFETY: the plugin lends `mask_length` bytes, as the header asks.
        let Some(mask) = (unsafe { slice(region.mask, region.mask_length) }) else {
            return violation(format!("region[{index}].mask"), &"null", "a mask");
        };
        let region = ChangeRegion {
            class_before: ClassId(region.class_before),
            class_after: ClassId(region.class_after),
            bounds: PixelBox { left: region.left, top: region.top, right: region.right, bottom: region.bottom },
            mask: mask.to_vec(),
            pixels: region.pixels,
        };
        rules.region(index, &region)?;
        collected.regions.push(region);
        Ok(())
    })
}

unsafe extern "C" fn take_proposal(context: *mut c_void, proposal: *const abi::Proposal) -> Status {
    // SAFETY: as in `take_heat`.
    let collector = unsafe { collector(context) };
    // SAFETY: the plugin lends a proposal that starts with its size, as the header asks.
    let proposal = unsafe { read_growing(proposal) };
    collector.deliver(|collected, rules| {
        let index = collected.proposals.len();
        let Some(proposal) = proposal.filter(|_| index < MOST_RESULTS) else {
            return violation(format!("proposal[{index}]"), &"null", format!("at most {MOST_RESULTS} proposals"));
        };
        // SAFETY: what the proposal points to is lent with it, as the header asks.
        let mut proposal = unsafe { read_proposal(index, &proposal) }?;
        rules.proposal(index, &mut proposal)?;
        collected.proposals.push(proposal);
        Ok(())
    })
}

/// # Safety
/// What `proposal` points to can be read.
unsafe fn read_proposal(index: usize, proposal: &abi::Proposal) -> Result<Proposal, Violation> {
    let region = proposal.region;
    let broken = |field: &str, value: String, expected: &str| Violation {
        field: format!("proposal[{index}].{field}"),
        value,
        expected: expected.to_owned(),
    };
    match proposal.kind {
        abi::Proposal::PLACE => {
            // SAFETY: the caller's promise.
            let descriptor = unsafe { read_growing(proposal.descriptor) };
            let descriptor = descriptor.ok_or_else(|| broken("descriptor", "null".to_owned(), "a descriptor"))?;
            let kind = || broken("descriptor.kind", descriptor.kind.to_string(), "1 (material) or 2 (dynamic)");
            Ok(Proposal::Place { region, descriptor: read_descriptor(&descriptor).ok_or_else(kind)? })
        }
        abi::Proposal::REMOVE => Ok(Proposal::Remove {
            region,
            class: ClassId(proposal.class),
            near: proposal.near.into(),
            sigma_m: proposal.sigma_m,
        }),
        abi::Proposal::REJECT => {
            // SAFETY: the caller's promise.
            let requirement = unsafe { text(proposal.requirement) };
            // SAFETY: the caller's promise.
            let unit = unsafe { text(proposal.unit) };
            let not_text = |field| broken(field, "bytes".to_owned(), "UTF-8");
            let rejection = Rejection {
                class_before: ClassId(proposal.class_before),
                class_after: ClassId(proposal.class_after),
                pixels: proposal.pixels,
                requirement: requirement.ok_or_else(|| not_text("requirement"))?.to_owned(),
                measured: proposal.measured,
                limit: proposal.limit,
                unit: unit.ok_or_else(|| not_text("unit"))?.to_owned(),
            };
            Ok(Proposal::Reject { region, rejection })
        }
        kind => Err(broken("kind", kind.to_string(), "1 (place), 2 (remove) or 3 (reject)")),
    }
}

fn read_descriptor(from: &abi::Descriptor) -> Option<Descriptor> {
    let has = |bit, value| (from.has & bit != 0).then_some(value);
    let sigma = has(abi::Descriptor::HAS_SIGMA, from.sigma_position_m).map(|position_m| Uncertainty {
        position_m,
        size_m: has(abi::Descriptor::HAS_SIGMA_SIZE, from.sigma_size_m),
        area_m2: has(abi::Descriptor::HAS_SIGMA_AREA, from.sigma_area_m2),
    });
    let class = ClassId(from.class);
    match from.kind {
        abi::Descriptor::MATERIAL => Some(Descriptor::Material(MaterialDescriptor {
            class,
            corners: from.corners.map(Into::into),
            normal: from.normal,
            sigma,
        })),
        abi::Descriptor::DYNAMIC => Some(Descriptor::Dynamic(DynamicDescriptor {
            class,
            position: from.position.into(),
            size_m: from.size_m,
            yaw_rad: has(abi::Descriptor::HAS_YAW, from.yaw_rad),
            sigma,
        })),
        _ => None,
    }
}

pub(super) fn localization(from: &abi::Localization, heat: Vec<[f64; 3]>) -> Localization {
    let [a, b, c, d, e, f, g, h, i] = from.covariance;
    Localization {
        pose: from.pose.into(),
        score: from.score,
        covariance: [[a, b, c], [d, e, f], [g, h, i]],
        alignment: (from.has_alignment != 0)
            .then(|| Alignment::from_lower_triangle(&from.alignment_covariance, from.map_sigma_m, from.label_sigma_px)),
        runner_up: (from.has_runner_up != 0)
            .then_some(RunnerUp { distance_m: from.runner_up_distance_m, score_ratio: from.runner_up_score_ratio }),
        candidates: from.candidates,
        skipped: from.skipped,
        heat,
    }
}
