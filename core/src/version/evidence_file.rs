//! The JSON form of an observation as the map file keeps it. Its digest is that of these bytes, so they are written
//! once and never again from what was read.

use super::{Decision, Digest, Gate, LocalizationEvidence, ModelFile, Observation, PluginUse, SearchRange};
use jiff::Timestamp;
use resurvey_schema::service::Prior;
use resurvey_schema::{Alignment, CameraModel, ClassId, GridPoint, Intrinsics, Pose, Rejection, RunnerUp};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

const FORMAT: &str = "resurvey.observation/1";

/// A number that JSON may not have: not-finite ones are `null`, and come back as NaN.
#[derive(Clone, Copy)]
struct Number(f64);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.is_finite().then_some(self.0).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Option::deserialize(deserializer).map(|value| Self(value.unwrap_or(f64::NAN)))
    }
}

#[derive(Serialize, Deserialize)]
struct ObservationFile {
    format: String,
    capture: Digest,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    photo: Option<Digest>,
    taken_at: Option<String>,
    labels: Option<Digest>,
    prior: Option<PriorFile>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    camera: Option<IntrinsicsFile>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    search: Option<[Number; 2]>,
    localization: Option<LocalizationFile>,
    plugins: Vec<PluginFile>,
    gates: Vec<GateFile>,
    rejections: Vec<RejectionFile>,
    decision: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    confirmations: Vec<Digest>,
}

#[derive(Serialize, Deserialize)]
struct PoseRadians {
    position: [Number; 3],
    yaw_rad: Number,
    pitch_rad: Number,
    roll_rad: Number,
}

#[derive(Serialize, Deserialize)]
struct PriorFile {
    pose: PoseRadians,
    position_sigma_m: Number,
    height_sigma_m: Number,
    yaw_sigma_rad: Number,
    tilt_sigma_rad: Number,
}

#[derive(Serialize, Deserialize)]
struct IntrinsicsFile {
    model: String,
    width: u32,
    height: u32,
    fx: Number,
    fy: Number,
    cx: Number,
    cy: Number,
    distortion: [Number; 5],
}

#[derive(Serialize, Deserialize)]
struct LocalizationFile {
    pose: PoseRadians,
    score: Option<Number>,
    covariance: [[Number; 3]; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    alignment: Option<Alignment>,
    runner_up: Option<[Number; 2]>,
    candidates: u64,
}

#[derive(Serialize, Deserialize)]
struct PluginFile {
    kind: String,
    name: String,
    version: String,
    sha256: Option<Digest>,
    settings: serde_json::Value,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    settings_sha256: Option<Digest>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    files: Vec<ModelFile>,
}

#[derive(Serialize, Deserialize)]
struct GateFile {
    name: String,
    measured: Number,
    limit: Number,
    unit: String,
    passed: bool,
}

#[derive(Serialize, Deserialize)]
struct RejectionFile {
    class_before: u8,
    class_after: u8,
    pixels: u32,
    requirement: String,
    measured: Number,
    limit: Number,
    unit: String,
}

impl Observation {
    /// The JSON text that a map keeps; the label image is in it as a digest.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        let file = ObservationFile {
            format: FORMAT.to_owned(),
            capture: self.capture,
            photo: self.photo,
            taken_at: self.taken_at.map(|time| time.to_string()),
            labels: self.labels.as_deref().map(Digest::of),
            prior: self.prior.as_ref().map(prior_to_file),
            camera: self.camera.as_ref().map(camera_to_file),
            search: self.search.map(|range| [Number(range.radius_m), Number(range.yaw_range_deg)]),
            localization: self.localization.as_ref().map(localization_to_file),
            plugins: self.plugins.iter().map(plugin_to_file).collect(),
            gates: self.gates.iter().map(gate_to_file).collect(),
            rejections: self.rejections.iter().map(rejection_to_file).collect(),
            decision: self.decision.name().to_owned(),
            confirmations: self.confirmations.clone(),
        };
        serde_json::to_string(&file)
    }

    /// The observation in `text`, without its label image; the message says what is wrong with it.
    pub fn from_json(text: &str) -> Result<Self, String> {
        let file: ObservationFile = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if file.format != FORMAT {
            return Err(format!("expected format {FORMAT:?}, found {:?}", file.format));
        }
        let decision = Decision::ALL.into_iter().find(|decision| decision.name() == file.decision);
        let taken_at = file.taken_at.map(|text| text.parse::<Timestamp>()).transpose();
        Ok(Self {
            capture: file.capture,
            photo: file.photo,
            taken_at: taken_at.map_err(|error| format!("taken_at: {error}"))?,
            labels: None,
            prior: file.prior.as_ref().map(prior_from_file),
            camera: file.camera.as_ref().map(camera_from_file).transpose()?,
            search: file.search.map(|[radius, yaw]| SearchRange { radius_m: radius.0, yaw_range_deg: yaw.0 }),
            localization: file.localization.as_ref().map(localization_from_file),
            plugins: file.plugins.into_iter().map(plugin_from_file).collect(),
            gates: file.gates.into_iter().map(gate_from_file).collect(),
            rejections: file.rejections.into_iter().map(rejection_from_file).collect(),
            decision: decision.ok_or_else(|| format!("unknown decision {:?}", file.decision))?,
            confirmations: file.confirmations,
        })
    }
}

fn pose_to_file(pose: &Pose) -> PoseRadians {
    PoseRadians {
        position: <[f64; 3]>::from(pose.position).map(Number),
        yaw_rad: Number(pose.yaw_rad),
        pitch_rad: Number(pose.pitch_rad),
        roll_rad: Number(pose.roll_rad),
    }
}

fn pose_from_file(file: &PoseRadians) -> Pose {
    Pose {
        position: GridPoint::from(file.position.map(|number| number.0)),
        yaw_rad: file.yaw_rad.0,
        pitch_rad: file.pitch_rad.0,
        roll_rad: file.roll_rad.0,
    }
}

fn prior_to_file(prior: &Prior) -> PriorFile {
    PriorFile {
        pose: pose_to_file(&prior.pose),
        position_sigma_m: Number(prior.position_sigma_m),
        height_sigma_m: Number(prior.height_sigma_m),
        yaw_sigma_rad: Number(prior.yaw_sigma_rad),
        tilt_sigma_rad: Number(prior.tilt_sigma_rad),
    }
}

fn prior_from_file(file: &PriorFile) -> Prior {
    Prior {
        pose: pose_from_file(&file.pose),
        position_sigma_m: file.position_sigma_m.0,
        height_sigma_m: file.height_sigma_m.0,
        yaw_sigma_rad: file.yaw_sigma_rad.0,
        tilt_sigma_rad: file.tilt_sigma_rad.0,
    }
}

const MODELS: [CameraModel; 3] = [CameraModel::Pinhole, CameraModel::Brown, CameraModel::Fisheye];

fn camera_to_file(camera: &Intrinsics) -> IntrinsicsFile {
    IntrinsicsFile {
        model: camera.model.name().to_owned(),
        width: camera.width,
        height: camera.height,
        fx: Number(camera.fx),
        fy: Number(camera.fy),
        cx: Number(camera.cx),
        cy: Number(camera.cy),
        distortion: camera.distortion.map(Number),
    }
}

fn camera_from_file(file: &IntrinsicsFile) -> Result<Intrinsics, String> {
    let model = MODELS.into_iter().find(|model| model.name() == file.model);
    Ok(Intrinsics {
        model: model.ok_or_else(|| format!("unknown camera model {:?}", file.model))?,
        width: file.width,
        height: file.height,
        fx: file.fx.0,
        fy: file.fy.0,
        cx: file.cx.0,
        cy: file.cy.0,
        distortion: file.distortion.map(|number| number.0),
    })
}

fn localization_to_file(localization: &LocalizationEvidence) -> LocalizationFile {
    LocalizationFile {
        pose: pose_to_file(&localization.pose),
        score: localization.score.map(Number),
        covariance: localization.covariance.map(|row| row.map(Number)),
        alignment: localization.alignment,
        runner_up: localization.runner_up.map(|other| [Number(other.distance_m), Number(other.score_ratio)]),
        candidates: localization.candidates,
    }
}

fn localization_from_file(file: &LocalizationFile) -> LocalizationEvidence {
    LocalizationEvidence {
        pose: pose_from_file(&file.pose),
        score: file.score.map(|number| number.0),
        covariance: file.covariance.map(|row| row.map(|number| number.0)),
        alignment: file.alignment,
        runner_up: file.runner_up.map(|[distance, ratio]| RunnerUp { distance_m: distance.0, score_ratio: ratio.0 }),
        candidates: file.candidates,
    }
}

fn plugin_to_file(plugin: &PluginUse) -> PluginFile {
    let PluginUse { kind, name, version, sha256, settings, settings_sha256, files } = plugin.clone();
    PluginFile { kind, name, version, sha256, settings, settings_sha256, files }
}

fn plugin_from_file(file: PluginFile) -> PluginUse {
    let PluginFile { kind, name, version, sha256, settings, settings_sha256, files } = file;
    PluginUse { kind, name, version, sha256, settings, settings_sha256, files }
}

fn gate_to_file(gate: &Gate) -> GateFile {
    let Gate { name, measured, limit, unit, passed } = gate.clone();
    GateFile { name, measured: Number(measured), limit: Number(limit), unit, passed }
}

fn gate_from_file(file: GateFile) -> Gate {
    let GateFile { name, measured, limit, unit, passed } = file;
    Gate { name, measured: measured.0, limit: limit.0, unit, passed }
}

fn rejection_to_file(rejection: &Rejection) -> RejectionFile {
    RejectionFile {
        class_before: rejection.class_before.0,
        class_after: rejection.class_after.0,
        pixels: rejection.pixels,
        requirement: rejection.requirement.clone(),
        measured: Number(rejection.measured),
        limit: Number(rejection.limit),
        unit: rejection.unit.clone(),
    }
}

fn rejection_from_file(file: RejectionFile) -> Rejection {
    Rejection {
        class_before: ClassId(file.class_before),
        class_after: ClassId(file.class_after),
        pixels: file.pixels,
        requirement: file.requirement,
        measured: file.measured.0,
        limit: file.limit.0,
        unit: file.unit,
    }
}
