//! The class map of `--map-classes`: which class a material or semantic surface of the source gets.

use resurvey_schema::{ClassId, ClassTable};

/// Classes by the name of a material or semantic surface, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClassMap {
    entries: Vec<(String, ClassId)>,
    default: Option<ClassId>,
}

/// Why a text is not a class map.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ClassMapError {
    /// The text is not TOML.
    #[error("the class map is not valid TOML: {0}")]
    Toml(String),
    /// A value is not a class name.
    #[error(
        "the class map gives {name:?} {found}; expected a class name in quotes, as in \"{name}\" = \"stone\" \
         (a name with dots or spaces must be quoted)"
    )]
    NotAName {
        /// The key.
        name: String,
        /// What its value is.
        found: String,
    },
    /// A class that the table does not have.
    #[error("the class map gives {name:?} the class {class:?}; the classes are {known}")]
    UnknownClass {
        /// The key.
        name: String,
        /// The value.
        class: String,
        /// The names of the table.
        known: String,
    },
}

/// What the parser says, and in which line.
fn not_toml(text: &str, error: &toml::de::Error) -> ClassMapError {
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    ClassMapError::Toml(format!("line {line}: {}", error.message().trim()))
}

impl ClassMap {
    /// The map in a TOML text of lines `"name" = "class"`; the key `default` is for every other name.
    pub fn parse(text: &str, classes: &ClassTable) -> Result<Self, ClassMapError> {
        let table: toml::Table = text.parse().map_err(|error| not_toml(text, &error))?;
        let mut map = Self::default();
        for (name, value) in table {
            let toml::Value::String(class) = value else {
                return Err(ClassMapError::NotAName { name, found: format!("a value of type {}", value.type_str()) });
            };
            let id = match classes.by_name(class.trim()) {
                Some(class) => class.index,
                None => return Err(ClassMapError::UnknownClass { name, class, known: known_names(classes) }),
            };
            match name.as_str() {
                "default" => map.default = Some(id),
                _ => map.entries.push((name, id)),
            }
        }
        Ok(map)
    }

    /// The class that the map gives to exactly `name`, else to `name` without regard to case.
    pub fn class_of(&self, name: &str) -> Option<ClassId> {
        let found =
            |is_same: &dyn Fn(&str) -> bool| self.entries.iter().find(|(key, _)| is_same(key)).map(|(_, id)| *id);
        found(&|key| key == name).or_else(|| found(&|key| key.to_lowercase() == name.to_lowercase()))
    }

    /// The class for every name that is not in the map.
    pub fn default_class(&self) -> Option<ClassId> {
        self.default
    }
}

/// The class that `name` itself names: without regard to case, spaces around it, and a numeric suffix such as `.001`.
pub fn class_named(name: &str, classes: &ClassTable) -> Option<ClassId> {
    let name = name.trim();
    let stem = match name.rsplit_once('.') {
        Some((stem, digits)) if !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()) => stem,
        _ => name,
    };
    classes.by_name(name).or_else(|| classes.by_name(stem)).map(|class| class.index)
}

/// The names of `classes`, for messages.
pub(super) fn known_names(classes: &ClassTable) -> String {
    classes.iter().map(|class| class.name.as_str()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<ClassMap, ClassMapError> {
        ClassMap::parse(text, &ClassTable::default())
    }

    #[test]
    fn names_are_found_exactly_then_without_case_then_by_default() {
        let map =
            parse("Wall = \"stone\"\nwall = \"glass\"\n\"1 - Default\" = \"metal\"\ndefault = \"others\"").unwrap();
        assert_eq!(map.class_of("wall"), Some(ClassId(1)));
        assert_eq!(map.class_of("Wall"), Some(ClassId(0)));
        assert_eq!(map.class_of("1 - DEFAULT"), Some(ClassId(2)));
        assert_eq!(map.class_of("door"), None);
        assert_eq!(map.default_class(), Some(ClassId(8)));
    }

    #[test]
    fn an_unknown_class_is_refused_with_the_known_ones() {
        let error = parse("roof = \"tiles\"").unwrap_err().to_string();
        assert!(error.contains("\"roof\"") && error.contains("\"tiles\"") && error.contains("stone, glass"), "{error}");
    }

    #[test]
    fn an_unquoted_dotted_name_is_explained() {
        let error = parse("wall.001 = \"stone\"").unwrap_err().to_string();
        assert!(error.contains("\"wall\"") && error.contains("must be quoted"), "{error}");
        assert!(matches!(parse("= stone"), Err(ClassMapError::Toml(_))));
    }

    #[test]
    fn a_name_stands_for_its_class_without_case_and_number() {
        let classes = ClassTable::default();
        for (name, class) in [("stone", 0), ("GLASS", 1), (" glass.001 ", 1), ("Metal.12", 2)] {
            assert_eq!(class_named(name, &classes), Some(ClassId(class)), "{name}");
        }
        for name in ["stones", "glass.", "glass.a", ".001", "", "stone.001.002"] {
            assert_eq!(class_named(name, &classes), None, "{name}");
        }
    }
}
