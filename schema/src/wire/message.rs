//! Every message of the wire, in both directions.

use super::answer::{WireLocalization, WireProposal, WireRegion};
use super::array::{Array, Number};
use super::call::{DetectCall, EstimateCall, ScoreCall, SearchCall, SegmentCall};
use super::request::{
    CastRaysRequest, ComparePanoramasRequest, CompareViewsRequest, PixelRaysRequest, PointsRequest, ProjectRequest,
    RenderRequest, Served,
};
use serde::{Deserialize, Serialize};

/// What the host says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ToPlugin {
    /// Make the instance.
    Create {
        /// JSON object with every setting, checked, sorted by name, without spaces.
        settings: String,
    },
    /// Score views of a photo.
    Score(ScoreCall),
    /// Find the pose of a photo.
    Search(Box<SearchCall>),
    /// Find the regions in which photo and view differ.
    Detect(Box<DetectCall>),
    /// Say what each region means.
    Estimate(Box<EstimateCall>),
    /// Say which class each pixel of a photo is.
    Segment(Box<SegmentCall>),
    /// End the instance.
    Destroy {},
    /// The answer to a request of the plugin.
    Served(Served),
    /// A request of the plugin that has no answer.
    Error {
        /// Why.
        text: String,
    },
}

/// What the plugin says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ToHost {
    /// The first line.
    Hello(Hello),
    /// Instead of `hello`, from the process that opens a library for the host.
    Refused(Refused),
    /// The call ended with an answer.
    Done {
        /// Of a search alone.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        localization: Option<Box<WireLocalization>>,
    },
    /// The call ended without an answer.
    Failed {
        /// What was expected, what was found.
        text: String,
    },
    /// A bug; the instance is not used again.
    Panicked {
        /// Message, file and line.
        text: String,
    },
    /// The call ended early because the host asked for it.
    Cancelled {},
    /// The answer breaks a rule, as the process that opens a library found out.
    Invalid(Invalid),
    /// Render views.
    Render(RenderRequest),
    /// Compare views with the photo.
    CompareViews(CompareViewsRequest),
    /// Compare panoramas with the photo.
    ComparePanoramas(ComparePanoramasRequest),
    /// Which points lie inside solid buildings.
    InsideSolid(PointsRequest),
    /// Directions of the rays through pixels.
    PixelRays(PixelRaysRequest),
    /// Pixels of points.
    Project(ProjectRequest),
    /// What rays hit.
    CastRays(CastRaysRequest),
    /// Descriptors around a point.
    DescriptorsNear {
        /// Easting, northing, height, metres.
        point: [f64; 3],
        /// Metres.
        radius_m: f64,
    },
    /// Height of the ground below a point.
    GroundHeight {
        /// Easting, northing, height, metres.
        point: [f64; 3],
    },
    /// Grid position of a WGS84 position.
    GridFromWgs84 {
        /// Latitude and longitude in degrees, ellipsoidal height in metres.
        position: [f64; 3],
    },
    /// WGS84 position of a grid position.
    Wgs84FromGrid {
        /// Easting, northing, height, metres.
        point: [f64; 3],
    },
    /// Take cells of the heat map of a search.
    Heat {
        /// `<f8`, cells × 3: easting m, northing m, score.
        cells: Array,
    },
    /// Take regions of a detector.
    Regions(Vec<WireRegion>),
    /// Take proposals of an estimator.
    Proposals(Vec<WireProposal>),
    /// A line for the log; it has no answer.
    Log {
        /// `warning`, `info` or `debug`.
        level: String,
        /// The line.
        text: String,
    },
    /// How far the call is, 0–1; it has no answer.
    Progress(Number),
}

/// What a plugin says of itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hello {
    /// [`WIRE_VERSION`](super::WIRE_VERSION).
    pub wire: u32,
    /// `a`–`z`, `0`–`9` and dashes.
    pub name: String,
    /// Its own version.
    pub version: String,
    /// `matcher`, `detector`, `estimator` or `segmenter`.
    pub kind: String,
    /// One sentence.
    pub summary: String,
    /// Of a matcher: `score` or `search`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<String>,
    /// JSON Schema of the settings as a text; empty where there are none.
    #[serde(default)]
    pub settings_schema: String,
}

/// Why a library was not opened.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Refused {
    /// The gate, as messages name it.
    pub stage: String,
    /// What was expected and found.
    pub reason: String,
    /// What to do next.
    pub advice: String,
}

/// A value that breaks a rule.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Invalid {
    /// Which value.
    pub field: String,
    /// What it was.
    pub value: String,
    /// The rule.
    pub expected: String,
}
