//! Semantic classes and the class table that every map carries.

use serde::{Deserialize, Serialize};

/// Index of a class in a map's class table; a pixel of a label image holds exactly this.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
#[repr(transparent)]
pub struct ClassId(pub u8);

impl ClassId {
    /// Unlabelled: never compared, never a change.
    pub const VOID: Self = Self(255);
}

/// What the map does with pixels of a class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ClassKind {
    /// A surface: its changes become material descriptors.
    Material,
    /// An object that stands on the ground: its changes become dynamic descriptors.
    Dynamic,
    /// Never becomes a descriptor (sky, foliage, everything else).
    Ignored,
}

/// One row of a class table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Class {
    /// Value in label images, 0–254.
    pub index: ClassId,
    /// Lower-case name, unique in its table.
    pub name: String,
    /// sRGB colour in palette images, unique in its table.
    pub colour: [u8; 3],
    /// How changes of this class are treated.
    pub kind: ClassKind,
    /// Predefined size of a dynamic object: along, across, up, metres. `None` for other kinds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_m: Option<[f64; 3]>,
}

/// The classes of one map, ordered by index.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ClassTable {
    classes: Vec<Class>,
}

/// Why a list of classes is not a class table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InvalidClassTable(pub String);

impl std::fmt::Display for InvalidClassTable {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl std::error::Error for InvalidClassTable {}

impl ClassTable {
    /// A table of `classes`; fails when an index is 255 or an index, name or colour occurs twice.
    pub fn new(mut classes: Vec<Class>) -> Result<Self, InvalidClassTable> {
        classes.sort_by_key(|class| class.index);
        for (position, class) in classes.iter().enumerate() {
            if class.index == ClassId::VOID {
                return Err(InvalidClassTable(format!(
                    "class {:?} has index 255, which is reserved for void",
                    class.name
                )));
            }
            if class.name.is_empty() || class.name != class.name.to_lowercase() {
                return Err(InvalidClassTable(format!("class name {:?} must be lower case and not empty", class.name)));
            }
            for other in &classes[..position] {
                if other.index == class.index || other.name == class.name || other.colour == class.colour {
                    let (a, b) = (&other.name, &class.name);
                    return Err(InvalidClassTable(format!("classes {a:?} and {b:?} share an index, name or colour")));
                }
            }
            if (class.kind == ClassKind::Dynamic) != class.size_m.is_some() {
                let name = &class.name;
                return Err(InvalidClassTable(format!(
                    "class {name:?}: size_m is for dynamic classes, and needed there"
                )));
            }
        }
        Ok(Self { classes })
    }

    /// All classes, by rising index.
    pub fn iter(&self) -> impl Iterator<Item = &Class> {
        self.classes.iter()
    }

    /// The class with index `id`.
    pub fn get(&self, id: ClassId) -> Option<&Class> {
        self.classes.iter().find(|class| class.index == id)
    }

    /// The class called `name`, without regard to case.
    pub fn by_name(&self, name: &str) -> Option<&Class> {
        self.classes.iter().find(|class| class.name.eq_ignore_ascii_case(name))
    }

    /// The class drawn in exactly `colour`.
    pub fn by_colour(&self, colour: [u8; 3]) -> Option<&Class> {
        self.classes.iter().find(|class| class.colour == colour)
    }

    /// The name of class `id`; `"void"` for 255 and `"unknown"` for an index that is not in the table.
    pub fn name(&self, id: ClassId) -> &str {
        match self.get(id) {
            Some(class) => &class.name,
            None if id == ClassId::VOID => "void",
            None => "unknown",
        }
    }

    /// The kind of class `id`; ignored for void and for an index that is not in the table.
    pub fn kind(&self, id: ClassId) -> ClassKind {
        self.get(id).map_or(ClassKind::Ignored, |class| class.kind)
    }
}

impl Default for ClassTable {
    /// The nine classes of Lee & Hsu.
    fn default() -> Self {
        use ClassKind::{Dynamic, Ignored, Material};
        let class = |index, name: &str, colour, kind, size_m| Class {
            index: ClassId(index),
            name: name.to_owned(),
            colour,
            kind,
            size_m,
        };
        Self {
            classes: vec![
                class(0, "stone", [0, 0, 255], Material, None),
                class(1, "glass", [0, 255, 0], Material, None),
                class(2, "metal", [255, 165, 0], Material, None),
                class(3, "banner", [165, 42, 42], Material, None),
                class(4, "pedestrian", [255, 0, 0], Dynamic, Some([0.5, 0.5, 1.7])),
                class(5, "chair", [255, 192, 203], Dynamic, Some([0.5, 0.5, 0.9])),
                class(6, "sky", [0, 0, 0], Ignored, None),
                class(7, "foliage", [255, 255, 0], Ignored, None),
                class(8, "others", [173, 216, 230], Ignored, None),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_table_is_valid() {
        let table = ClassTable::default();
        assert_eq!(ClassTable::new(table.classes.clone()).unwrap(), table);
        assert_eq!(table.by_name("GLASS").unwrap().index, ClassId(1));
        assert_eq!(table.name(ClassId::VOID), "void");
    }

    #[test]
    fn a_table_with_a_colour_twice_is_refused() {
        let mut classes = ClassTable::default().classes;
        classes[1].colour = classes[0].colour;
        assert!(ClassTable::new(classes).unwrap_err().0.contains("\"stone\" and \"glass\""));
    }
}
