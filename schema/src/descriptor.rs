//! Descriptors: what a photo adds to the map. A material descriptor is a rectangle on a surface, a dynamic descriptor
//! an object on the ground (Lee & Hsu, §3.9).

use crate::class::ClassId;
use crate::position::GridPoint;

/// 1σ of what was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertainty {
    /// Of the centre or ground contact, metres, in 3D.
    pub position_m: f64,
    /// Of width and height, metres; `None` where the size is predefined or was given without one.
    pub size_m: Option<f64>,
    /// Of the area, m²; `None` likewise.
    pub area_m2: Option<f64>,
}

/// A rectangle of one class on a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialDescriptor {
    /// Its class; of kind material.
    pub class: ClassId,
    /// Bottom-left, bottom-right, top-right, top-left as seen from outside.
    pub corners: [GridPoint; 4],
    /// Unit normal that points away from the surface: E, N, H.
    pub normal: [f64; 3],
    /// 1σ; `None` when the source did not say.
    pub sigma: Option<Uncertainty>,
}

/// An object of predefined size that stands on the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct DynamicDescriptor {
    /// Its class; of kind dynamic.
    pub class: ClassId,
    /// Centre of its contact with the ground.
    pub position: GridPoint,
    /// Along, across, up, metres.
    pub size_m: [f64; 3],
    /// Heading of its front, radians clockwise from grid north; `None` when unknown.
    pub yaw_rad: Option<f64>,
    /// 1σ; `None` when the source did not say.
    pub sigma: Option<Uncertainty>,
}

/// Either kind of descriptor.
#[derive(Clone, Debug, PartialEq)]
pub enum Descriptor {
    /// A rectangle on a surface.
    Material(MaterialDescriptor),
    /// An object on the ground.
    Dynamic(DynamicDescriptor),
}

impl Descriptor {
    /// Its class.
    pub fn class(&self) -> ClassId {
        match self {
            Self::Material(descriptor) => descriptor.class,
            Self::Dynamic(descriptor) => descriptor.class,
        }
    }

    /// The point that stands for it: the centre of a rectangle, the ground contact of an object.
    pub fn anchor(&self) -> GridPoint {
        match self {
            Self::Material(descriptor) => descriptor.centre(),
            Self::Dynamic(descriptor) => descriptor.position,
        }
    }

    /// Its 1σ, where known.
    pub fn sigma(&self) -> Option<Uncertainty> {
        match self {
            Self::Material(descriptor) => descriptor.sigma,
            Self::Dynamic(descriptor) => descriptor.sigma,
        }
    }
}

impl MaterialDescriptor {
    /// Mean of the four corners.
    pub fn centre(&self) -> GridPoint {
        let mean = |pick: fn(&GridPoint) -> f64| self.corners.iter().map(pick).sum::<f64>() / 4.0;
        GridPoint::new(
            mean(|corner| corner.easting_m),
            mean(|corner| corner.northing_m),
            mean(|corner| corner.height_m),
        )
    }
}
