//! The flat part of JSON Schema that plugins describe their settings with: an object whose properties are numbers,
//! integers, booleans or strings, each with a default; nothing else is allowed in it.

use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// The settings that a plugin knows, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SettingsSchema {
    settings: BTreeMap<String, Setting>,
}

/// One setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// What its values are.
    pub value_type: ValueType,
    /// What it is when nobody sets it.
    pub default: Value,
    /// The only values allowed; empty when all are.
    pub choices: Vec<Value>,
    /// Lowest number allowed.
    pub minimum: Option<f64>,
    /// Highest number allowed.
    pub maximum: Option<f64>,
    /// Whether its text is the path of a file that the plugin reads, such as the weights of a network: then the evidence
    /// names the file's digest. Empty for none.
    pub is_file: bool,
    /// What it does, with its unit.
    pub description: String,
}

/// Type of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueType {
    /// A finite number.
    Number,
    /// A whole number.
    Integer,
    /// `true` or `false`.
    Boolean,
    /// Text.
    String,
}

/// Why a schema or a value is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// The plugin's schema is not of the flat part.
    #[error("settings schema: {0}")]
    Schema(String),
    /// Not of the form `plugin.key=value`.
    #[error("expected plugin.key=value, found {0:?}")]
    NotAnAssignment(String),
    /// The plugin has no such setting.
    #[error("no setting is called {key:?}; known are: {}", list(known))]
    Unknown {
        /// What was set.
        key: String,
        /// Every setting, sorted.
        known: Vec<String>,
    },
    /// The value is of another type, out of range or not a choice.
    #[error("setting {key}: expected {expected}, found {found}")]
    Value {
        /// The setting.
        key: String,
        /// Type, range or choices.
        expected: String,
        /// The value.
        found: String,
    },
}

fn list(known: &[String]) -> String {
    if known.is_empty() { "none".to_owned() } else { known.join(", ") }
}

impl SettingsSchema {
    /// Reads a schema; an empty text is a plugin without settings.
    pub fn parse(text: &str) -> Result<Self, SettingsError> {
        if text.trim().is_empty() {
            return Ok(Self::default());
        }
        let schema: Value = serde_json::from_str(text).map_err(|error| SettingsError::Schema(error.to_string()))?;
        let Value::Object(schema) = schema else {
            return Err(SettingsError::Schema(format!("expected an object, found {schema}")));
        };
        let mut properties = &Map::new();
        for (keyword, value) in &schema {
            match (keyword.as_str(), value) {
                ("properties", Value::Object(given)) => properties = given,
                ("type", Value::String(name)) if name == "object" => {}
                ("additionalProperties", Value::Bool(false)) => {}
                ("$schema" | "$id" | "title" | "description" | "required", _) => {}
                _ => return Err(SettingsError::Schema(format!("{keyword}: {value} is not understood"))),
            }
        }
        let read = |(key, value): (&String, &Value)| {
            let setting = Setting::parse(value).map_err(|text| SettingsError::Schema(format!("{key}: {text}")))?;
            Ok((key.clone(), setting))
        };
        Ok(Self { settings: properties.iter().map(read).collect::<Result<_, SettingsError>>()? })
    }

    /// All settings, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Setting)> {
        self.settings.iter().map(|(key, setting)| (key.as_str(), setting))
    }

    /// The setting called `key`, or an error that lists all.
    pub(super) fn get(&self, key: &str) -> Result<&Setting, SettingsError> {
        let unknown = || SettingsError::Unknown { key: key.to_owned(), known: self.settings.keys().cloned().collect() };
        self.settings.get(key).ok_or_else(unknown)
    }
}

impl Setting {
    fn parse(schema: &Value) -> Result<Self, String> {
        let Value::Object(schema) = schema else { return Err(format!("expected an object, found {schema}")) };
        for keyword in schema.keys() {
            let known = ["type", "default", "enum", "minimum", "maximum", "description", "title", "examples", "format"];
            if !known.contains(&keyword.as_str()) {
                return Err(format!("{keyword} is not understood; known are: {}", known.join(", ")));
            }
        }
        let bound = |keyword: &str| match schema.get(keyword) {
            None => Ok(None),
            Some(value) => {
                value.as_f64().map(Some).ok_or_else(|| format!("{keyword}: expected a number, found {value}"))
            }
        };
        let value_type = schema.get("type").and_then(ValueType::parse);
        let is_file = match schema.get("format") {
            None => false,
            Some(Value::String(format)) if format == "file" && value_type == Some(ValueType::String) => true,
            Some(format) => return Err(format!("format: expected \"file\" on a string, found {format}")),
        };
        let setting = Self {
            value_type: value_type.ok_or("type: expected number, integer, boolean or string")?,
            default: schema.get("default").cloned().ok_or("default is missing")?,
            choices: match schema.get("enum") {
                None => Vec::new(),
                Some(Value::Array(choices)) if !choices.is_empty() => choices.clone(),
                Some(value) => return Err(format!("enum: expected a list, found {value}")),
            },
            minimum: bound("minimum")?,
            maximum: bound("maximum")?,
            is_file,
            description: schema.get("description").and_then(Value::as_str).unwrap_or_default().to_owned(),
        };
        setting.checked(&setting.default).map_err(|expected| format!("default: expected {expected}"))?;
        Ok(setting)
    }

    /// `value` in the one form that a type has; the error says what is allowed.
    pub(super) fn checked(&self, value: &Value) -> Result<Value, String> {
        let canonical = self.value_type.canonical(value).ok_or_else(|| self.expected())?;
        let number = canonical.as_f64();
        let in_range = number.is_none_or(|number| {
            self.minimum.is_none_or(|minimum| number >= minimum) && self.maximum.is_none_or(|maximum| number <= maximum)
        });
        let same = |choice: &Value| self.value_type.canonical(choice).as_ref() == Some(&canonical);
        let chosen = self.choices.is_empty() || self.choices.iter().any(same);
        if in_range && chosen { Ok(canonical) } else { Err(self.expected()) }
    }

    /// What is allowed, in words.
    pub fn expected(&self) -> String {
        if !self.choices.is_empty() {
            let choices: Vec<_> = self.choices.iter().map(ToString::to_string).collect();
            return format!("one of {}", choices.join(", "));
        }
        let range = match (self.minimum, self.maximum) {
            (None, None) => String::new(),
            (Some(minimum), None) => format!(" of at least {minimum}"),
            (None, Some(maximum)) => format!(" of at most {maximum}"),
            (Some(minimum), Some(maximum)) => format!(" from {minimum} to {maximum}"),
        };
        format!("{}{range}", self.value_type.name())
    }
}

impl ValueType {
    fn parse(name: &Value) -> Option<Self> {
        [Self::Number, Self::Integer, Self::Boolean, Self::String]
            .into_iter()
            .find(|value_type| name.as_str() == Some(value_type.keyword()))
    }

    /// Its name in JSON Schema.
    pub fn keyword(self) -> &'static str {
        match self {
            Self::Number => "number",
            Self::Integer => "integer",
            Self::Boolean => "boolean",
            Self::String => "string",
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Number => "a number",
            Self::Integer => "a whole number",
            Self::Boolean => "true or false",
            Self::String => "a text",
        }
    }

    /// `value` as this type is always written: 2 and 2.0 are one number.
    fn canonical(self, value: &Value) -> Option<Value> {
        match (self, value) {
            (Self::Number, Value::Number(number)) => {
                let number = number.as_f64().filter(|number| number.is_finite())?;
                serde_json::Number::from_f64(number).map(Value::Number)
            }
            (Self::Integer, Value::Number(number)) => whole(number).map(Value::from),
            (Self::Boolean, Value::Bool(_)) | (Self::String, Value::String(_)) => Some(value.clone()),
            _ => None,
        }
    }
}

fn whole(number: &serde_json::Number) -> Option<i64> {
    // 2^53: above it a float no longer names one whole number.
    const LARGEST: f64 = 9_007_199_254_740_992.0;
    number.as_i64().or_else(|| number.as_f64().filter(|n| n.fract() == 0.0 && n.abs() <= LARGEST).map(|n| n as i64))
}
