//! Rays that run every way: nothing is known of their groups as wholes.

use super::cull::Cull;
use crate::kernels::ScaledRay;
use crate::simd::{F32x8, LaneMask, Lanes};

/// Culls nothing but empty slots.
pub(super) struct Open;

impl Cull for Open {
    type Boxes = ();
    const LOOSE: bool = true;
    const BOUNDED: bool = false;
    const FAN: bool = false;

    #[inline(always)]
    fn boxes(&self, bounds: [F32x8; 6]) -> ((), u32) {
        ((), Lanes::le(bounds[0], bounds[3]).bits())
    }

    #[inline(always)]
    fn groups(&self, (): &(), _: usize) -> (u32, f32) {
        (u32::MAX, 0.0)
    }

    #[inline(always)]
    fn reach(&self, _: f32) -> u32 {
        u32::MAX
    }

    #[inline(always)]
    fn draw_in<F: Lanes>(&mut self, _: usize, _: &ScaledRay<F>) {}

    #[inline(always)]
    fn settle(&mut self) {}
}
