//! A setting that lists classes: their indices, separated by spaces, since settings are flat.

use resurvey_schema::ClassId;
use resurvey_schema::service::ClassSet;

/// Classes as a setting names them, such as `"4 5 7"`; an empty text is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(try_from = "String")]
pub struct ClassList(pub ClassSet);

impl ClassList {
    /// Whether the class with this index is listed.
    pub fn contains(&self, class: u8) -> bool {
        self.0.contains(ClassId(class))
    }
}

impl TryFrom<String> for ClassList {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let mut set = ClassSet::default();
        for word in text.split_whitespace() {
            let index = word.parse().ok().filter(|index| *index != ClassId::VOID.0);
            let index = index.ok_or_else(|| {
                format!("expected indices of classes from 0 to 254, separated by spaces; found {word:?} in {text:?}")
            })?;
            set.insert(ClassId(index));
        }
        Ok(Self(set))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_are_separated_by_spaces_and_anything_else_is_told() {
        let list = ClassList::try_from(" 4 5  254 ".to_owned()).unwrap();
        let listed: Vec<u8> = (0..=255).filter(|class| list.contains(*class)).collect();
        assert_eq!(listed, [4, 5, 254]);
        assert_eq!(ClassList::try_from(String::new()), Ok(ClassList::default()));
        for (text, word) in [("4,5", "\"4,5\""), ("4 sky", "\"sky\""), ("255", "\"255\""), ("-1", "\"-1\"")] {
            let error = ClassList::try_from(text.to_owned()).unwrap_err();
            assert!(error.contains("0 to 254") && error.contains(word), "{error}");
        }
    }
}
