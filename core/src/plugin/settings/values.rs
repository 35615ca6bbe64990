//! Values of settings: `plugin.key=value` from the user, complete and canonical for the plugin and the evidence.

use super::super::info::Digest;
use super::schema::{SettingsError, SettingsSchema, ValueType};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::str::FromStr;

/// `plugin.key=value`, as `--set` takes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    /// Name of the plugin.
    pub plugin: String,
    /// Name of the setting.
    pub key: String,
    /// The value as typed.
    pub value: String,
}

impl FromStr for Assignment {
    type Err = SettingsError;

    fn from_str(text: &str) -> Result<Self, SettingsError> {
        let parts = text.split_once('=').and_then(|(path, value)| Some((path.split_once('.')?, value)));
        match parts {
            Some(((plugin, key), value)) if !plugin.is_empty() && !key.is_empty() => {
                Ok(Self { plugin: plugin.to_owned(), key: key.to_owned(), value: value.to_owned() })
            }
            _ => Err(SettingsError::NotAnAssignment(text.to_owned())),
        }
    }
}

/// Every setting of a plugin with a checked value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    json: String,
}

impl Settings {
    /// Settings that the host has completed and checked.
    #[cfg(target_os = "linux")]
    pub(in super::super) fn completed(json: String) -> Self {
        Self { json }
    }

    /// A JSON object with every setting, sorted by name, each number in one form.
    pub fn as_json(&self) -> &str {
        &self.json
    }

    /// Settings of `schema` that name a file, and the file.
    pub fn files(&self, schema: &SettingsSchema) -> Vec<(String, PathBuf)> {
        let values: BTreeMap<String, Value> = serde_json::from_str(&self.json).unwrap_or_default();
        let path =
            |key: &str| values.get(key).and_then(Value::as_str).filter(|path| !path.is_empty()).map(PathBuf::from);
        let files = schema.iter().filter(|(_, setting)| setting.is_file);
        files.filter_map(|(key, _)| Some((key.to_owned(), path(key)?))).collect()
    }

    /// Digest of [`as_json`](Self::as_json), for the evidence.
    pub fn sha256(&self) -> Digest {
        Digest::of(self.json.as_bytes())
    }
}

impl SettingsSchema {
    /// The defaults, overruled by `given` (name and value as typed; the last one counts).
    pub fn complete<'a>(&self, given: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Settings, SettingsError> {
        let mut values: BTreeMap<&str, Value> = BTreeMap::new();
        for (key, setting) in self.iter() {
            let default = setting.checked(&setting.default);
            values.insert(key, default.map_err(|expected| value_error(key, expected, &setting.default.to_string()))?);
        }
        for (key, text) in given {
            let setting = self.get(key)?;
            let value = typed(setting.value_type, text).ok_or_else(|| setting.expected());
            let checked = value.and_then(|value| setting.checked(&value));
            values.insert(key, checked.map_err(|expected| value_error(key, expected, text))?);
        }
        let json = Value::Object(values.into_iter().map(|(key, value)| (key.to_owned(), value)).collect());
        Ok(Settings { json: json.to_string() })
    }
}

fn typed(value_type: ValueType, text: &str) -> Option<Value> {
    match value_type {
        ValueType::String => Some(Value::String(text.to_owned())),
        _ => serde_json::from_str(text.trim()).ok(),
    }
}

fn value_error(key: &str, expected: String, found: &str) -> SettingsError {
    SettingsError::Value { key: key.to_owned(), expected, found: found.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCHEMA: &str = r#"{
        "type": "object", "additionalProperties": false,
        "properties": {
            "radius_m": {"type": "number", "default": 40, "minimum": 1, "maximum": 200, "description": "Search radius, m."},
            "best": {"type": "integer", "default": 100, "minimum": 1},
            "profile": {"type": "string", "default": "default", "enum": ["default", "paper"]},
            "refine": {"type": "boolean", "default": true}
        }
    }"#;

    fn complete(given: &[(&str, &str)]) -> Result<Settings, SettingsError> {
        SettingsSchema::parse(SCHEMA).unwrap().complete(given.iter().copied())
    }

    #[test]
    fn what_is_not_set_has_its_default() {
        let json = r#"{"best":100,"profile":"default","radius_m":40.0,"refine":true}"#;
        assert_eq!(complete(&[]).unwrap().as_json(), json);
    }

    #[test]
    fn the_digest_does_not_depend_on_order_or_spelling() {
        let one = complete(&[("best", "7"), ("radius_m", "25")]).unwrap();
        let other = complete(&[("radius_m", "2.5e1"), ("best", "7.0"), ("refine", " true ")]).unwrap();
        assert_eq!(one.sha256(), other.sha256());
        assert_ne!(one.sha256(), complete(&[]).unwrap().sha256());
    }

    #[test]
    fn an_unknown_setting_is_refused_with_the_known_ones() {
        let message = complete(&[("radius", "3")]).unwrap_err().to_string();
        assert_eq!(message, r#"no setting is called "radius"; known are: best, profile, radius_m, refine"#);
    }

    #[test]
    fn a_value_out_of_its_range_type_or_choices_is_refused_with_what_is_allowed() {
        for (key, value, message) in [
            ("radius_m", "0.5", "setting radius_m: expected a number from 1 to 200, found 0.5"),
            ("radius_m", "NaN", "setting radius_m: expected a number from 1 to 200, found NaN"),
            ("radius_m", "1e999", "setting radius_m: expected a number from 1 to 200, found 1e999"),
            ("best", "2.5", "setting best: expected a whole number of at least 1, found 2.5"),
            ("best", "", "setting best: expected a whole number of at least 1, found "),
            ("refine", "yes", "setting refine: expected true or false, found yes"),
            ("profile", "fast", r#"setting profile: expected one of "default", "paper", found fast"#),
        ] {
            assert_eq!(complete(&[(key, value)]).unwrap_err().to_string(), message);
        }
    }

    #[test]
    fn a_schema_that_is_not_flat_or_has_no_default_is_refused() {
        for (schema, message) in [
            ("[]", "settings schema: expected an object, found []"),
            (r#"{"properties": {"a": {"type": "number"}}}"#, "settings schema: a: default is missing"),
            (r#"{"additionalProperties": true}"#, "settings schema: additionalProperties: true is not understood"),
            (
                r#"{"properties": {"a": {"type": "array", "default": []}}}"#,
                "settings schema: a: type: expected number, integer, boolean or string",
            ),
            (
                r#"{"properties": {"a": {"type": "integer", "default": 5, "maximum": 4}}}"#,
                "settings schema: a: default: expected a whole number of at most 4",
            ),
            (
                r#"{"properties": {"a": {"type": "number", "default": 5, "minimun": 4}}}"#,
                "settings schema: a: minimun is not understood; known are: type, default, enum, minimum, maximum, \
                 description, title, examples, format",
            ),
        ] {
            assert_eq!(SettingsSchema::parse(schema).unwrap_err().to_string(), message);
        }
        assert!(SettingsSchema::parse("{").is_err());
        assert_eq!(SettingsSchema::parse("").unwrap().complete([]).unwrap().as_json(), "{}");
    }

    #[test]
    fn a_setting_may_name_a_file_that_the_plugin_reads() {
        let schema = r#"{"properties": {"weights": {"type": "string", "default": "", "format": "file"},
                                        "mode": {"type": "string", "default": "fast"}}}"#;
        let schema = SettingsSchema::parse(schema).unwrap();
        assert_eq!(schema.complete([]).unwrap().files(&schema), []);
        let given = schema.complete([("weights", "models/city.onnx")]).unwrap();
        assert_eq!(given.files(&schema), [("weights".to_owned(), PathBuf::from("models/city.onnx"))]);
        let wrong = r#"{"properties": {"a": {"type": "number", "default": 1, "format": "file"}}}"#;
        let message = "settings schema: a: format: expected \"file\" on a string, found \"file\"";
        assert_eq!(SettingsSchema::parse(wrong).unwrap_err().to_string(), message);
    }

    #[test]
    fn an_assignment_names_plugin_setting_and_value() {
        let expected = Assignment { plugin: "semantic".into(), key: "a".into(), value: "b.c=d".into() };
        assert_eq!("semantic.a=b.c=d".parse(), Ok(expected));
        for text in ["semantic", "semantic=3", "a.b", ".a=3", "semantic.=3", ""] {
            assert_eq!(text.parse::<Assignment>(), Err(SettingsError::NotAnAssignment(text.to_owned())));
        }
    }
}
