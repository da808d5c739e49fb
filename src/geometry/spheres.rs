//! Spheres in SoA arrays: centre and radius.

use glam::Vec3;

use crate::error::{BuildError, ShapeError};
use crate::geometry::Aabb;

/// Any number of spheres. All arrays have one length; entry `i` of each is sphere `i`.
#[derive(Clone, Debug, Default)]
pub struct Spheres {
    /// Centres.
    pub center_x: Vec<f32>,
    /// See [`Spheres::center_x`].
    pub center_y: Vec<f32>,
    /// See [`Spheres::center_x`].
    pub center_z: Vec<f32>,
    /// Radii, above zero.
    pub radius: Vec<f32>,
}

impl Spheres {
    /// One sphere.
    pub fn one(center: Vec3, radius: f32) -> Self {
        let mut spheres = Self::default();
        spheres.push(center, radius);
        spheres
    }

    /// Appends a sphere.
    pub fn push(&mut self, center: Vec3, radius: f32) {
        self.center_x.push(center.x);
        self.center_y.push(center.y);
        self.center_z.push(center.z);
        self.radius.push(radius);
    }

    /// How many spheres there are.
    pub fn len(&self) -> usize {
        self.radius.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The centre of sphere `index`.
    pub fn center(&self, index: usize) -> Vec3 {
        Vec3::new(self.center_x[index], self.center_y[index], self.center_z[index])
    }

    /// A box that holds sphere `index`: rounded outwards where the sum is inexact.
    pub fn bounds(&self, index: usize) -> Aabb {
        Self::bounds_of(self.center(index), self.radius[index])
    }

    /// A box that holds the sphere with this centre and radius.
    pub fn bounds_of(center: Vec3, radius: f32) -> Aabb {
        let round =
            |exact: f32, next: fn(f32) -> f32| if exact.is_finite() { next(exact) } else { exact };
        let down = |value: f32| round(value - radius, f32::next_down);
        let up = |value: f32| round(value + radius, f32::next_up);
        Aabb {
            min: Vec3::new(down(center.x), down(center.y), down(center.z)),
            max: Vec3::new(up(center.x), up(center.y), up(center.z)),
        }
    }

    /// # Errors
    /// [`BuildError`] for arrays of different lengths, a centre that is not finite, or a radius
    /// that is not a finite number above zero.
    pub fn validate(&self, geom_id: u32) -> Result<(), BuildError> {
        ShapeError::check("center_x", self.center_x.len(), "radius", self.len())?;
        ShapeError::check("center_y", self.center_y.len(), "radius", self.len())?;
        ShapeError::check("center_z", self.center_z.len(), "radius", self.len())?;
        for index in 0..self.len() {
            let (center, radius) = (self.center(index), self.radius[index]);
            if !center.is_finite() || !radius.is_finite() || radius <= 0.0 {
                return Err(BuildError::Sphere {
                    geom_id,
                    prim_id: index as u32,
                    x: center.x,
                    y: center.y,
                    z: center.z,
                    radius,
                });
            }
        }
        Ok(())
    }
}
