//! One lane: a plain float, the reference for the others.

use super::{LaneMask, Lanes};

/// [`Lanes::power_to_one`] of one float.
#[inline(always)]
pub(super) fn power_to_one(value: f32) -> f32 {
    let exponent = (value.to_bits() & 0x7f80_0000).clamp(0x0080_0000, 0x7e80_0000);
    f32::from_bits(0x7f00_0000 - exponent)
}

impl LaneMask for bool {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
}

impl Lanes for f32 {
    const LANES: usize = 1;
    type Mask = bool;
    type Register = Self;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        value
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        from[0]
    }
    #[inline(always)]
    fn load_rows(rows: &[[f32; 3]]) -> [Self; 3] {
        rows[0]
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[0] = self;
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        f32::mul_add(self, factor, term)
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        f32::mul_add(-self, factor, term)
    }
    #[inline(always)]
    fn mul_add_fast(self, factor: Self, term: Self) -> Self {
        if cfg!(target_feature = "fma") {
            f32::mul_add(self, factor, term)
        } else {
            self * factor + term
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn gt(self, other: Self) -> bool {
        self > other
    }
    #[inline(always)]
    fn ge(self, other: Self) -> bool {
        self >= other
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn set(&mut self, mask: bool, value: Self) {
        if mask {
            *self = value;
        }
    }
    #[inline(always)]
    fn register(&self, _: usize) -> Self {
        *self
    }
    #[inline(always)]
    fn set_register(&mut self, _: usize, value: Self) {
        *self = value;
    }
    #[inline(always)]
    fn mask_register(mask: bool, _: usize) -> bool {
        mask
    }
    #[inline(always)]
    fn mask(bits: u32) -> bool {
        bits & 1 != 0
    }
    #[inline(always)]
    fn power_to_one(self) -> Self {
        power_to_one(self)
    }
    #[inline(always)]
    fn reduce_max(self) -> f32 {
        self
    }
    #[inline(always)]
    fn reduce_min(self) -> f32 {
        self
    }
    #[inline(always)]
    fn reduce_bounds(low: [Self; 2], high: [Self; 2]) -> [[f32; 2]; 2] {
        [low, high]
    }
    #[inline(always)]
    fn lane(&self, _lane: usize) -> f32 {
        *self
    }
    #[inline(always)]
    fn set_lane(&mut self, _lane: usize, value: f32) {
        *self = value;
    }
}
