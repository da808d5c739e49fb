//! Where the rays of a tile start: boxes there come first for rays that look for any hit.
//!
//! Rays to an area light from a point that faces away from it, or that lies behind a small feature, end at
//! the surface at which they start. Found first, that saves the descent through all that lies between
//! the point and the light. This decides about speed alone, never about answers.

use super::group::Group;
use super::ones;
use super::tile::GROUPS;
use crate::kernels::Bounds;
use crate::simd::{F32x8, LaneMask, Lanes};

/// How far off a start a box may lie, in units of the largest coordinate: rays start beside their surface.
const BESIDE: f32 = 1.0 / (1 << 17) as f32;

/// The box around all starts.
pub(super) struct Starts {
    /// In the scene's axes, if rays share their starts.
    bounds: Option<Bounds<F32x8>>,
}

impl Starts {
    /// Of rays whose order nothing is known about.
    pub(super) const NONE: Self = Self { bounds: None };

    /// Of the rays of these groups, if all of the first group start at one point. Where each ray starts
    /// elsewhere the box around them holds too much: hard shadows 0.96, ambient occlusion 0.98.
    pub(super) fn new<F: Lanes>(groups: &[Group<F>; GROUPS], live: u32, extent: f32) -> Self {
        let (inf, neg) = (F::splat(f32::INFINITY), F::splat(f32::NEG_INFINITY));
        let (mut low, mut high) = ([inf; 3], [neg; 3]);
        for (count, index) in ones(live).enumerate() {
            let ray = &groups[index].ray;
            for axis in 0..3 {
                low[axis] = F::select(ray.valid, ray.origin[axis], inf).min(low[axis]);
                high[axis] = F::select(ray.valid, ray.origin[axis], neg).max(high[axis]);
            }
            let spread = |axis: usize| high[axis].reduce_max() > low[axis].reduce_min();
            if count == 0 && (0..3).any(spread) {
                return Self::NONE;
            }
        }
        let beside = F32x8::splat(BESIDE * extent);
        let bounds = Bounds {
            min: low.map(|lanes| F32x8::splat(lanes.reduce_min()) - beside),
            max: high.map(|lanes| F32x8::splat(lanes.reduce_max()) + beside),
        };
        Self { bounds: Some(bounds) }
    }

    /// True if the rays of a group start at one point.
    #[inline(always)]
    pub(super) fn are_shared(&self) -> bool {
        self.bounds.is_some()
    }

    /// A bit for each box (`min.x .. max.z`) that rays may start in.
    #[inline(always)]
    pub(super) fn near(&self, boxes: &[F32x8; 6]) -> u32 {
        let Some(bounds) = &self.bounds else { return 0 };
        let [a, b, c, d, e, f] = *boxes;
        bounds.touches(&Bounds { min: [a, b, c], max: [d, e, f] }).bits()
    }
}
