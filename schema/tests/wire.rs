//! The words of the plugin wire as `docs/plugin-wire.md` writes them.

use resurvey_schema::abi::RayHit;
use resurvey_schema::service::ViewFeature;
use resurvey_schema::wire::{Array, Dtype, ToHost, ToPlugin, WireDescriptor, WireProposal};
use serde_json::json;

#[test]
fn an_array_is_said_in_the_words_of_numpy() {
    let array = Array::packed(Dtype::F32, &[2, 3, 4, 3], 4096);
    let expected = json!({"dtype": "<f4", "shape": [2, 3, 4, 3], "strides": [144, 48, 12, 4], "offset": 4096});
    assert_eq!(serde_json::to_value(&array).unwrap(), expected);
    assert_eq!(serde_json::from_value::<Array>(expected).unwrap(), array);
}

#[test]
fn records_are_as_long_as_their_dtype_says() {
    assert_eq!((size_of::<ViewFeature>(), Dtype::ViewFeature.bytes()), (16, 16));
    assert_eq!((size_of::<RayHit>(), Dtype::RayHit.bytes()), (72, 72));
}

#[test]
fn the_lines_of_a_short_conversation_read_back() {
    for line in [
        r#"{"hello":{"wire":1,"name":"agreement","version":"1.0.0","kind":"matcher","summary":"One","form":"score"}}"#,
        r#"{"done":{}}"#,
        r#"{"cancelled":{}}"#,
        r#"{"progress":0.5}"#,
        r#"{"descriptors_near":{"point":[1,2,3],"radius_m":4}}"#,
        r#"{"regions":[]}"#,
        r#"{"failed":{"text":"no sky in the photo"}}"#,
        r#"{"done":{"localization":{"pose":[1,2,3,4,5,6],"score":null,"covariance":[[1,0,0],[0,1,0],[0,0,1]]}}}"#,
    ] {
        serde_json::from_str::<ToHost>(line).unwrap_or_else(|error| panic!("{error}: {line}"));
    }
    for line in [r#"{"create":{"settings":"{}"}}"#, r#"{"destroy":{}}"#, r#"{"served":{"memory":8192}}"#] {
        serde_json::from_str::<ToPlugin>(line).unwrap_or_else(|error| panic!("{error}: {line}"));
    }
    let two = r#"{"done":{},"log":{"level":"info","text":""}}"#;
    assert!(serde_json::from_str::<ToHost>(two).is_err());
    assert!(serde_json::from_str::<ToHost>(r#"{"done":{"localisation":null}}"#).is_err());
}

#[test]
fn a_proposal_is_said_by_what_it_does() {
    let chair = json!({"place": {"region": 0, "descriptor": {"dynamic": {
        "class": 5, "position": [1, 2, 3], "size_m": [0.5, 0.5, 0.9], "yaw_rad": 1.25, "sigma": [0.25, null, null]}}}});
    let WireProposal::Place { descriptor, .. } = serde_json::from_value(chair).unwrap() else {
        panic!("expected a place")
    };
    let WireDescriptor::Dynamic { sigma, yaw_rad, .. } = descriptor else { panic!("expected a dynamic one") };
    assert_eq!((sigma, yaw_rad), (Some([Some(0.25), None, None]), Some(1.25)));
}
