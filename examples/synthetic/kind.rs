//! The kinds of change.

use super::scene::Scene;
use anyhow::bail;

/// The kinds of change; the paper's six places are all among them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeKind {
    /// Nothing.
    None,
    /// A banner is hung on a wall.
    Banner,
    /// A banner the map knew is gone.
    BannerRemoved,
    /// The stone or metal of a whole building becomes glass: more than one captured rectangle, so not to be placed.
    Facade,
    /// A pedestrian stands there.
    Pedestrian,
    /// Two chairs stand there.
    TwoChairs,
    /// One of two chairs the map knew is gone.
    ChairRemoved,
}

impl ChangeKind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::None,
        Self::Banner,
        Self::BannerRemoved,
        Self::Facade,
        Self::Pedestrian,
        Self::TwoChairs,
        Self::ChairRemoved,
    ];

    /// Name in `truth.json` and in paths.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Banner => "banner",
            Self::BannerRemoved => "banner_removed",
            Self::Facade => "facade",
            Self::Pedestrian => "pedestrian",
            Self::TwoChairs => "two_chairs",
            Self::ChairRemoved => "chair_removed",
        }
    }

    /// The kinds that suit a scene.
    pub fn of(scene: &Scene) -> Vec<Self> {
        let outdoors = [Self::Banner, Self::None, Self::Pedestrian, Self::BannerRemoved, Self::Facade];
        let indoors = [Self::TwoChairs, Self::ChairRemoved, Self::Banner, Self::None];
        if scene.outdoors { outdoors.to_vec() } else { indoors.to_vec() }
    }
}

impl std::str::FromStr for ChangeKind {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        match Self::ALL.into_iter().find(|kind| kind.name() == name) {
            Some(kind) => Ok(kind),
            None => bail!("unknown change {name:?}: expected one of {}", Self::ALL.map(Self::name).join(", ")),
        }
    }
}
