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
    /// Where the map knew a banner hangs a panel of another material of nearly the same size.
    BannerReplaced,
    /// A banner the map knew is 30 to 60 % wider or higher now, one edge as before.
    BannerGrown,
    /// A chair the map knew stands 0.4 to 1.5 m elsewhere.
    ChairMoved,
    /// Two pedestrians, indoors chairs, that touch or overlap a little in the image.
    Touching,
    /// A banner and a pedestrian, indoors a chair, are new, and a banner the map knew is gone.
    Several,
    /// A new pedestrian or chair whose foot or side the image border cuts: nothing that can be measured.
    CutByBorder,
    /// A new banner that the image border cuts: nothing that can be measured.
    BannerCut,
    /// A banner or chair the map knew is still there behind a box that hides it.
    Hidden,
    /// A banner and a chair the map knew are still there and well seen.
    Known,
}

impl ChangeKind {
    /// All of them.
    pub const ALL: [Self; 16] = [
        Self::None,
        Self::Banner,
        Self::BannerRemoved,
        Self::Facade,
        Self::Pedestrian,
        Self::TwoChairs,
        Self::ChairRemoved,
        Self::BannerReplaced,
        Self::BannerGrown,
        Self::ChairMoved,
        Self::Touching,
        Self::Several,
        Self::CutByBorder,
        Self::BannerCut,
        Self::Hidden,
        Self::Known,
    ];

    /// Those on which a map has to be read with care: changes on changes, several at once, things cut or hidden.
    pub const HARD: [Self; 9] = [
        Self::BannerReplaced,
        Self::BannerGrown,
        Self::ChairMoved,
        Self::Touching,
        Self::Several,
        Self::CutByBorder,
        Self::BannerCut,
        Self::Hidden,
        Self::Known,
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
            Self::BannerReplaced => "banner_replaced",
            Self::BannerGrown => "banner_grown",
            Self::ChairMoved => "chair_moved",
            Self::Touching => "touching",
            Self::Several => "several",
            Self::CutByBorder => "cut_by_border",
            Self::BannerCut => "banner_cut",
            Self::Hidden => "hidden",
            Self::Known => "known",
        }
    }

    /// The simple kinds that suit a scene.
    pub fn of(scene: &Scene) -> Vec<Self> {
        let outdoors = [Self::Banner, Self::None, Self::Pedestrian, Self::BannerRemoved, Self::Facade];
        let indoors = [Self::TwoChairs, Self::ChairRemoved, Self::Banner, Self::None];
        if scene.outdoors { outdoors.to_vec() } else { indoors.to_vec() }
    }

    /// All kinds that suit a scene, the hard ones last.
    pub fn every(scene: &Scene) -> Vec<Self> {
        [Self::of(scene), Self::HARD.to_vec()].concat()
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
