//! The samples of one point, sixteen at a time: directions to the light.
//!
//! They are made with the operations of `LightShape::at` and in its order.

use super::{AreaLight, Query};
use crate::points::LightSamples;
use crate::simd::{F32x16, LaneMask, Lanes, each};

/// Samples in one register.
pub(super) const LANES: usize = 16;

/// Where the samples of a point lie on the light.
pub(super) struct Placed {
    samples: usize,
    /// Padded to whole registers.
    u: Vec<f32>,
    v: Vec<f32>,
}

impl Placed {
    /// For points of so many samples.
    pub(super) fn new(samples: usize) -> Self {
        let padded = samples.next_multiple_of(LANES);
        Self { samples, u: vec![0.0; padded], v: vec![0.0; padded] }
    }

    /// How many registers the samples of a point take.
    pub(super) fn registers(&self) -> usize {
        self.samples.div_ceil(LANES)
    }

    /// Places the samples of a point and gives, register by register, the directions to them and
    /// the lanes that lie before the point's surface.
    #[inline(always)]
    pub(super) fn each<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        point: usize,
        mut give: impl FnMut([F32x16; 3], u32),
    ) {
        let samples = self.samples;
        query.samples.place(point, &mut self.u[..samples], &mut self.v[..samples]);
        let origin = each(|axis| F32x16::splat(query.points.position[axis][point]));
        for start in (0..samples).step_by(LANES) {
            let (u, v) = (F32x16::load(&self.u[start..]), F32x16::load(&self.v[start..]));
            let dir = query.light.directions(origin, u, v);
            let active = (1_u32 << (samples - start).min(LANES)) - 1;
            let normal =
                query.points.normal.map(|normal| each(|axis| F32x16::splat(normal[axis][point])));
            give(dir, facing(normal, &dir) & active);
        }
    }
}

impl AreaLight {
    /// From points to samples of the light.
    #[inline(always)]
    pub(super) fn directions(&self, origin: [F32x16; 3], u: F32x16, v: F32x16) -> [F32x16; 3] {
        let (zero, one) = (F32x16::splat(0.0), F32x16::splat(1.0));
        // Of NaN, `max` gives the other.
        let inside = |at| Lanes::min(Lanes::max(at, zero), one);
        let (u, v) = (inside(u), inside(v));
        each(|axis| {
            let part = |of: glam::Vec3| F32x16::splat(of[axis]);
            let target = part(self.corner) + part(self.edge_u) * u + part(self.edge_v) * v;
            target - origin[axis]
        })
    }
}

/// The lanes that leave a surface on its outer side: the operations of `Points::faces`.
#[inline(always)]
pub(super) fn facing(normal: Option<[F32x16; 3]>, dir: &[F32x16; 3]) -> u32 {
    let Some(normal) = normal else { return u32::MAX };
    let part = |axis: usize| dir[axis] * normal[axis];
    Lanes::gt(part(0) + part(1) + part(2), F32x16::splat(0.0)).bits()
}
