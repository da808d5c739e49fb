//! What the visibility query reads: points, and where on the light the samples of each point lie.
//!
//! The shadow ray of a point and a sample is `origin = point`, `dir = light.at(u, v) - point`,
//! `t` from 0 to [`SHADOW_T_MAX`]. A point is where rays start, so it already lies off its surface:
//! see [`crate::scene::Surface::offset_origin`].

use glam::Vec3;

use crate::error::ShapeError;

/// The end of shadow rays, which run from the surface at 0 to the light at 1. It is a little short
/// of the light, so that a lamp's own geometry, modelled in the plane of its light, lets it shine.
pub const SHADOW_T_MAX: f32 = 1.0 - 1.0e-4;

/// Points in SoA arrays that somebody else owns.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    pub(crate) position: [&'a [f32]; 3],
    pub(crate) normal: Option<[&'a [f32]; 3]>,
}

impl<'a> Points<'a> {
    /// Points over three arrays of one length. They look to all sides: every ray is traced.
    ///
    /// # Errors
    /// [`ShapeError`] names the first array whose length differs from that of `x`.
    pub fn new(x: &'a [f32], y: &'a [f32], z: &'a [f32]) -> Result<Self, ShapeError> {
        ShapeError::check("y", y.len(), "x", x.len())?;
        ShapeError::check("z", z.len(), "x", x.len())?;
        Ok(Self { position: [x, y, z], normal: None })
    }

    /// The same points on surfaces with these geometric normals, of any length: a sample whose `dir`
    /// has no positive product with the normal lies behind the surface, is unseen and is not traced.
    ///
    /// # Errors
    /// [`ShapeError`] names the first array that has not one entry a point.
    pub fn with_normals(
        self,
        x: &'a [f32],
        y: &'a [f32],
        z: &'a [f32],
    ) -> Result<Self, ShapeError> {
        for (name, array) in [("normal_x", x), ("normal_y", y), ("normal_z", z)] {
            ShapeError::check(name, array.len(), "x", self.len())?;
        }
        Ok(Self { normal: Some([x, y, z]), ..self })
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.position[0].len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where the rays of point `index` start. Panics if there is none.
    pub fn position(&self, index: usize) -> Vec3 {
        Vec3::from(self.position.map(|array| array[index]))
    }

    /// True if `dir` leaves the surface of point `index` on its outer side; always true without
    /// normals.
    pub fn faces(&self, index: usize, dir: Vec3) -> bool {
        self.normal.is_none_or(|normal| dir.dot(Vec3::from(normal.map(|array| array[index]))) > 0.0)
    }

    /// The points from `start` up to `end`. Panics if they are out of range.
    pub fn range(&self, start: usize, end: usize) -> Points<'a> {
        let part = |arrays: [&'a [f32]; 3]| arrays.map(|array| &array[start..end]);
        Points { position: part(self.position), normal: self.normal.map(part) }
    }
}

/// Where on a light the samples of each point lie: two coordinates from 0 to 1 along its edges.
/// Values outside are moved to the nearer end; NaN counts as 0.
///
/// A query asks only for points whose samples it has to trace, in any order and from any thread.
pub trait LightSamples: Sync {
    /// How many samples each point has.
    fn per_point(&self) -> usize;

    /// # Errors
    /// [`ShapeError`] if there are samples for fewer points than this.
    fn check(&self, points: usize) -> Result<(), ShapeError>;

    /// Writes the coordinates of all samples of point `point`, numbered over all points of the
    /// query. Both arrays are [`LightSamples::per_point`] long. Neighbours in number should be
    /// neighbours on the light: sixteen are traced together.
    fn place(&self, point: usize, u: &mut [f32], v: &mut [f32]);
}

/// Samples in arrays: those of the first point, then those of the second, and so on.
#[derive(Clone, Copy, Debug)]
pub struct SampleArrays<'a> {
    u: &'a [f32],
    v: &'a [f32],
    per_point: usize,
}

impl<'a> SampleArrays<'a> {
    /// Samples over two arrays, `per_point` for each point.
    ///
    /// # Errors
    /// [`ShapeError`] if the arrays differ in length.
    pub fn new(u: &'a [f32], v: &'a [f32], per_point: usize) -> Result<Self, ShapeError> {
        ShapeError::check("v", v.len(), "u", u.len())?;
        Ok(Self { u, v, per_point })
    }
}

impl LightSamples for SampleArrays<'_> {
    fn per_point(&self) -> usize {
        self.per_point
    }

    fn check(&self, points: usize) -> Result<(), ShapeError> {
        ShapeError::check("u", self.u.len(), "points times samples", points * self.per_point)
    }

    fn place(&self, point: usize, u: &mut [f32], v: &mut [f32]) {
        let own = point * self.per_point..(point + 1) * self.per_point;
        u.copy_from_slice(&self.u[own.clone()]);
        v.copy_from_slice(&self.v[own]);
    }
}
