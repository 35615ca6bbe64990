//! The host's values in the words of the wire, and back.

use resurvey_schema::service::{PoseEstimate, Prior};
use resurvey_schema::wire::Number;
use resurvey_schema::wire::{
    WireAlignment, WireCamera, WireDescriptor, WireEstimate, WireLocalization, WirePrior, WireProposal, WireRejection,
    WireRunnerUp,
};
use resurvey_schema::{
    Alignment, CameraModel, ClassId, Descriptor, DynamicDescriptor, GridPoint, Intrinsics, Localization,
    MaterialDescriptor, Proposal, Rejection, RunnerUp, Uncertainty,
};

fn numbers<const N: usize>(values: [f64; N]) -> [Number; N] {
    values.map(Number)
}

fn floats<const N: usize>(values: [Number; N]) -> [f64; N] {
    values.map(f64::from)
}

fn point(values: [Number; 3]) -> GridPoint {
    floats(values).into()
}

pub(super) fn camera(camera: &Intrinsics) -> WireCamera {
    let model = match camera.model {
        CameraModel::Pinhole => "pinhole",
        CameraModel::Brown => "brown",
        CameraModel::Fisheye => "fisheye",
    };
    WireCamera {
        model: model.to_owned(),
        width: camera.width,
        height: camera.height,
        fx: camera.fx,
        fy: camera.fy,
        cx: camera.cx,
        cy: camera.cy,
        distortion: camera.distortion,
    }
}

pub(super) fn intrinsics(camera: &WireCamera) -> Intrinsics {
    Intrinsics {
        model: match camera.model.as_str() {
            "brown" => CameraModel::Brown,
            "fisheye" => CameraModel::Fisheye,
            _ => CameraModel::Pinhole,
        },
        width: camera.width,
        height: camera.height,
        fx: camera.fx,
        fy: camera.fy,
        cx: camera.cx,
        cy: camera.cy,
        distortion: camera.distortion,
    }
}

pub(super) fn wire_prior(prior: &Prior) -> WirePrior {
    WirePrior {
        pose: prior.pose.into(),
        position_sigma_m: prior.position_sigma_m,
        height_sigma_m: prior.height_sigma_m,
        yaw_sigma_rad: prior.yaw_sigma_rad,
        tilt_sigma_rad: prior.tilt_sigma_rad,
    }
}

pub(super) fn prior(prior: &WirePrior) -> Prior {
    Prior {
        pose: prior.pose.into(),
        position_sigma_m: prior.position_sigma_m,
        height_sigma_m: prior.height_sigma_m,
        yaw_sigma_rad: prior.yaw_sigma_rad,
        tilt_sigma_rad: prior.tilt_sigma_rad,
    }
}

fn wire_alignment(alignment: &Alignment) -> WireAlignment {
    WireAlignment {
        covariance: alignment.covariance.map(numbers),
        map_sigma_m: Number(alignment.map_sigma_m),
        label_sigma_px: Number(alignment.label_sigma_px),
    }
}

fn alignment(alignment: &WireAlignment) -> Alignment {
    let covariance = alignment.covariance.map(floats);
    let given = Alignment {
        covariance,
        map_sigma_m: alignment.map_sigma_m.into(),
        label_sigma_px: alignment.label_sigma_px.into(),
    };
    Alignment::from_lower_triangle(&given.lower_triangle(), given.map_sigma_m, given.label_sigma_px)
}

pub(super) fn wire_estimate(estimate: &PoseEstimate) -> WireEstimate {
    WireEstimate {
        pose: estimate.pose.into(),
        covariance: estimate.covariance,
        height_sigma_m: estimate.height_sigma_m,
        tilt_sigma_rad: estimate.tilt_sigma_rad,
        alignment: estimate.alignment.as_ref().map(wire_alignment),
    }
}

pub(super) fn estimate(estimate: &WireEstimate) -> PoseEstimate {
    PoseEstimate {
        pose: estimate.pose.into(),
        covariance: estimate.covariance,
        height_sigma_m: estimate.height_sigma_m,
        tilt_sigma_rad: estimate.tilt_sigma_rad,
        alignment: estimate.alignment.as_ref().map(alignment),
    }
}

/// Everything but the heat, which lies in the memory.
pub(super) fn wire_localization(found: &Localization) -> WireLocalization {
    WireLocalization {
        pose: numbers(found.pose.into()),
        score: Number(found.score),
        covariance: found.covariance.map(numbers),
        alignment: found.alignment.as_ref().map(wire_alignment),
        runner_up: found
            .runner_up
            .map(|other| WireRunnerUp { distance_m: Number(other.distance_m), score_ratio: Number(other.score_ratio) }),
        candidates: found.candidates,
        skipped: found.skipped,
    }
}

pub(super) fn localization(found: &WireLocalization, heat: Vec<[f64; 3]>) -> Localization {
    Localization {
        pose: floats(found.pose).into(),
        score: found.score.into(),
        covariance: found.covariance.map(floats),
        alignment: found.alignment.as_ref().map(alignment),
        runner_up: found
            .runner_up
            .map(|other| RunnerUp { distance_m: other.distance_m.into(), score_ratio: other.score_ratio.into() }),
        candidates: found.candidates,
        skipped: found.skipped,
        heat,
    }
}

fn wire_sigma(sigma: Option<Uncertainty>) -> Option<[Option<f64>; 3]> {
    sigma.map(|sigma| [Some(sigma.position_m), sigma.size_m, sigma.area_m2])
}

fn sigma(sigma: Option<[Option<f64>; 3]>) -> Option<Uncertainty> {
    let [position_m, size_m, area_m2] = sigma?;
    Some(Uncertainty { position_m: position_m.unwrap_or(f64::NAN), size_m, area_m2 })
}

pub(super) fn wire_descriptor(descriptor: &Descriptor) -> WireDescriptor {
    let sigma = wire_sigma(descriptor.sigma());
    match descriptor {
        Descriptor::Material(material) => WireDescriptor::Material {
            class: material.class.0,
            corners: material.corners.map(|corner| numbers(corner.into())),
            normal: numbers(material.normal),
            sigma,
        },
        Descriptor::Dynamic(dynamic) => WireDescriptor::Dynamic {
            class: dynamic.class.0,
            position: numbers(dynamic.position.into()),
            size_m: numbers(dynamic.size_m),
            yaw_rad: dynamic.yaw_rad,
            sigma,
        },
    }
}

pub(super) fn descriptor(descriptor: &WireDescriptor) -> Descriptor {
    match *descriptor {
        WireDescriptor::Material { class, corners, normal, sigma: given } => Descriptor::Material(MaterialDescriptor {
            class: ClassId(class),
            corners: corners.map(point),
            normal: floats(normal),
            sigma: sigma(given),
        }),
        WireDescriptor::Dynamic { class, position, size_m, yaw_rad, sigma: given } => {
            Descriptor::Dynamic(DynamicDescriptor {
                class: ClassId(class),
                position: point(position),
                size_m: floats(size_m),
                yaw_rad,
                sigma: sigma(given),
            })
        }
    }
}

pub(super) fn wire_proposal(proposal: &Proposal) -> WireProposal {
    match proposal {
        Proposal::Place { region, descriptor } => {
            WireProposal::Place { region: *region, descriptor: wire_descriptor(descriptor) }
        }
        Proposal::Remove { region, class, near, sigma_m } => WireProposal::Remove {
            region: *region,
            class: class.0,
            near: numbers((*near).into()),
            sigma_m: Number(*sigma_m),
        },
        Proposal::Reject { region, rejection } => WireProposal::Reject(WireRejection {
            region: *region,
            class_before: rejection.class_before.0,
            class_after: rejection.class_after.0,
            pixels: rejection.pixels,
            requirement: rejection.requirement.clone(),
            measured: Number(rejection.measured),
            limit: Number(rejection.limit),
            unit: rejection.unit.clone(),
        }),
    }
}

pub(super) fn proposal(from: WireProposal) -> Proposal {
    match from {
        WireProposal::Place { region, descriptor: placed } => {
            Proposal::Place { region, descriptor: descriptor(&placed) }
        }
        WireProposal::Remove { region, class, near, sigma_m } => {
            Proposal::Remove { region, class: ClassId(class), near: point(near), sigma_m: sigma_m.into() }
        }
        WireProposal::Reject(rejected) => Proposal::Reject {
            region: rejected.region,
            rejection: Rejection {
                class_before: ClassId(rejected.class_before),
                class_after: ClassId(rejected.class_after),
                pixels: rejected.pixels,
                requirement: rejected.requirement,
                measured: rejected.measured.into(),
                limit: rejected.limit.into(),
                unit: rejected.unit,
            },
        },
    }
}
