//! Lanes of floats: the only folder that names the `wide` crate.
//!
//! Every kernel is written once, generic over [`Lanes`], and runs on 1, 8 or 16 lanes. The three
//! instances give the same bits lane by lane, because each operation here is either exact in
//! IEEE-754 (`+ - * /`, `sqrt`, the fused [`Lanes::mul_add`]) or a selection.
//!
//! Invariants:
//! - [`Lanes::mul_add`] is always fused: one rounding, in every build. Where the target has no
//!   fused instruction it is computed lane by lane (slow and right), so a hit has the same bits in
//!   the baseline build and in the native one.
//! - [`Lanes::mul_add_fast`] is fused where that is free, and is meant for culling alone, whose
//!   margins cover both roundings.
//! - [`Lanes::min`] and [`Lanes::max`] return their *second* argument when either is NaN, on every
//!   target. A slab test that passes its accumulator second so ignores a NaN.

mod keys;
mod registers;
mod scalar;

pub use keys::Keys;
pub use registers::VectorMask;

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Eight `f32` lanes.
pub type F32x8 = wide::f32x8;
/// Sixteen `f32` lanes: one register with AVX-512, two or four elsewhere.
pub type F32x16 = wide::f32x16;

/// The lanes that fill the widest register of this build.
#[cfg(target_feature = "avx512f")]
type Native = F32x16;
/// The lanes that fill the widest register of this build.
#[cfg(not(target_feature = "avx512f"))]
type Native = F32x8;

/// A truth value for each lane.
pub trait LaneMask:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// One bit a lane, lane 0 in bit 0; the bits above the lane count are zero.
    fn bits(self) -> u32;
    /// True if any lane is.
    fn any(self) -> bool {
        self.bits() != 0
    }
}

/// `LANES` floats that are computed on side by side.
pub trait Lanes:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// How many lanes there are.
    const LANES: usize;
    /// The truth values that comparisons give.
    type Mask: LaneMask;
    /// The lanes of the widest register of this build, if these are more. What has many values on its way goes
    /// register by register, or half of those values would have to be put aside.
    type Register: Lanes<Register = Self::Register>;
    /// How many registers the lanes take.
    const REGISTERS: usize = Self::LANES / Self::Register::LANES;

    /// The same value in every lane.
    fn splat(value: f32) -> Self;
    /// The first `LANES` values of `from`. Panics if there are fewer.
    fn load(from: &[f32]) -> Self;
    /// The first `LANES` rows of `rows`, axis by axis. Panics if there are fewer.
    fn load_rows(rows: &[[f32; 3]]) -> [Self; 3];
    /// Writes the lanes to the first `LANES` places of `to`. Panics if there are fewer.
    fn store(self, to: &mut [f32]);
    /// `self * factor + term` with one rounding, in every build.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `term - self * factor` with one rounding, in every build.
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;
    /// `self * factor + term`, fused or not, whichever is fast: for culling alone.
    fn mul_add_fast(self, factor: Self, term: Self) -> Self;
    /// The smaller; `other` when either is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger; `other` when either is NaN.
    fn max(self, other: Self) -> Self;
    /// The absolute value.
    fn abs(self) -> Self;
    /// The square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// `self < other`; false on NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`; false on NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `self > other`; false on NaN.
    fn gt(self, other: Self) -> Self::Mask;
    /// `self >= other`; false on NaN.
    fn ge(self, other: Self) -> Self::Mask;
    /// `self == other`; false on NaN.
    fn eq(self, other: Self) -> Self::Mask;
    /// Lane by lane `if mask { yes } else { no }`, bits untouched.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Writes `value` to the lanes in `mask`, bits untouched: for memory that is read again soon.
    ///
    /// Of a [`Lanes::select`] between a value and what is in memory, stored there again, the compiler makes a
    /// masked store. On AMD's Zen 3 that is some forty operations: camera rays were 1.2 to 1.4 times as fast
    /// without. Elsewhere a load that follows one may have to wait until it is in the cache; not measured.
    fn set(&mut self, mask: Self::Mask, value: Self);
    /// The mask whose lane `i` is bit `i` of `bits`.
    fn mask(bits: u32) -> Self::Mask;
    /// The power of two `p` for which `self * p` is from 1 to 2, for a positive finite `self`; at
    /// most `2^126` and at least `2^-126`, so applied to its own result it gives the inverse.
    fn power_to_one(self) -> Self;
    /// The largest lane; of NaN nothing is promised.
    fn reduce_max(self) -> f32;
    /// The smallest lane; of NaN nothing is promised.
    fn reduce_min(self) -> f32;
    /// The smallest lanes of `low` and the largest of `high`, as [`Lanes::reduce_min`] and
    /// [`Lanes::reduce_max`] give them, all four in one go: a third of the operations.
    fn reduce_bounds(low: [Self; 2], high: [Self; 2]) -> [[f32; 2]; 2];
    /// The lanes of register `index`, below [`Lanes::REGISTERS`].
    fn register(&self, index: usize) -> Self::Register;
    /// Writes the lanes of register `index`, likewise.
    fn set_register(&mut self, index: usize, value: Self::Register);
    /// The truth values of register `index`, likewise.
    fn mask_register(mask: Self::Mask, index: usize) -> <Self::Register as Lanes>::Mask;
    /// Lane `lane`.
    fn lane(&self, lane: usize) -> f32;
    /// Writes lane `lane`.
    fn set_lane(&mut self, lane: usize, value: f32);
}

/// The values `of(0), of(1), ..`: as `std::array::from_fn` and `map`, which are not always inlined. Calls
/// of them took an eighth of the time of diffuse rays, and as much of that of camera rays.
#[inline(always)]
pub fn each<T: Copy, const COUNT: usize>(of: impl Fn(usize) -> T) -> [T; COUNT] {
    let mut values = [of(0); COUNT];
    for (place, value) in values.iter_mut().enumerate().skip(1) {
        *value = of(place);
    }
    values
}
