//! Lights: points, and parallelograms that are sampled. Neither is seen by rays itself.

use glam::{DVec3, Vec3};

/// Where a light's rays start from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightShape {
    /// A point: hard shadows.
    Point(Vec3),
    /// A parallelogram: soft shadows.
    Quad {
        /// One corner.
        corner: Vec3,
        /// The edge along the first sample coordinate.
        edge_u: Vec3,
        /// The edge along the second sample coordinate.
        edge_v: Vec3,
    },
}

impl LightShape {
    /// The point of the light at `(u, v)`, both from 0 to 1; a point light has just one.
    pub fn at(&self, u: f32, v: f32) -> Vec3 {
        match *self {
            Self::Point(position) => position,
            Self::Quad { corner, edge_u, edge_v } => corner + edge_u * u + edge_v * v,
        }
    }
}

/// A light with separate intensities for each term of the Phong model, linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Where it is.
    pub shape: LightShape,
    /// Its part of `Ia`, which reaches every point.
    pub ambient: Vec3,
    /// `Ild`.
    pub diffuse: Vec3,
    /// `Ils`.
    pub specular: Vec3,
}

impl Light {
    /// A light of this shape whose diffuse and specular intensities are `intensity`, with no
    /// ambient part.
    pub fn new(shape: LightShape, intensity: Vec3) -> Self {
        Self { shape, ambient: Vec3::ZERO, diffuse: intensity, specular: intensity }
    }

    /// What is out of range, if anything is.
    pub fn validate(&self) -> Result<(), String> {
        match self.shape {
            LightShape::Point(position) if !position.is_finite() => {
                return Err(format!("its position is {position}: it must be finite"));
            }
            LightShape::Quad { corner, edge_u, edge_v } => {
                if !(corner.is_finite() && edge_u.is_finite() && edge_v.is_finite()) {
                    return Err("its corner and edges must be finite".into());
                }
                if edge_u.as_dvec3().cross(edge_v.as_dvec3()) == DVec3::ZERO {
                    return Err("its edges are parallel: an area light needs an area".into());
                }
            }
            LightShape::Point(_) => {}
        }
        for (name, color) in
            [("ambient", self.ambient), ("diffuse", self.diffuse), ("specular", self.specular)]
        {
            if !(color.is_finite() && color.min_element() >= 0.0) {
                return Err(format!(
                    "`{name}` is {color}: its parts must be finite and at least 0"
                ));
            }
        }
        Ok(())
    }
}
