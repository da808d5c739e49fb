//! Lanes of floats: the only file that names the `wide` crate.
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

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Eight `f32` lanes.
pub type F32x8 = wide::f32x8;
/// Sixteen `f32` lanes: one register with AVX-512, two or four elsewhere.
pub type F32x16 = wide::f32x16;

/// The lane count of the widest register that this build uses: 16 with AVX-512, else 8.
pub const NATIVE_LANES: usize = if cfg!(target_feature = "avx512f") { 16 } else { 8 };

/// The lanes that fill the widest register of this build.
#[cfg(target_feature = "avx512f")]
pub type Native = F32x16;
/// The lanes that fill the widest register of this build.
#[cfg(not(target_feature = "avx512f"))]
pub type Native = F32x8;

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

    /// The same value in every lane.
    fn splat(value: f32) -> Self;
    /// The first `LANES` values of `from`. Panics if there are fewer.
    fn load(from: &[f32]) -> Self;
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
    /// The mask whose lane `i` is bit `i` of `bits`.
    fn mask(bits: u32) -> Self::Mask;
    /// The power of two `p` for which `self * p` is from 1 to 2, for a positive finite `self`; at
    /// most `2^126` and at least `2^-126`, so applied to its own result it gives the inverse.
    fn power_to_one(self) -> Self;
    /// The largest lane; of NaN nothing is promised.
    fn reduce_max(self) -> f32;
    /// The smallest lane; of NaN nothing is promised.
    fn reduce_min(self) -> f32;
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

/// [`Lanes::power_to_one`] of one float.
#[inline(always)]
fn power_to_one(value: f32) -> f32 {
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

    #[inline(always)]
    fn splat(value: f32) -> Self {
        value
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        from[0]
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
    fn lane(&self, _lane: usize) -> f32 {
        *self
    }
    #[inline(always)]
    fn set_lane(&mut self, _lane: usize, value: f32) {
        *self = value;
    }
}

/// A mask in the form of the vectors that compares give: all bits of a lane set, or none.
#[derive(Clone, Copy, Debug)]
pub struct VectorMask<V>(V);

macro_rules! lanes {
    ($vector:ty, $count:literal, $ints:ty) => {
        impl BitAnd for VectorMask<$vector> {
            type Output = Self;
            #[inline(always)]
            fn bitand(self, other: Self) -> Self {
                Self(self.0 & other.0)
            }
        }

        impl BitOr for VectorMask<$vector> {
            type Output = Self;
            #[inline(always)]
            fn bitor(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
        }

        impl Not for VectorMask<$vector> {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                Self(!self.0)
            }
        }

        impl LaneMask for VectorMask<$vector> {
            #[inline(always)]
            fn bits(self) -> u32 {
                self.0.to_bitmask()
            }
        }

        impl Lanes for $vector {
            const LANES: usize = $count;
            type Mask = VectorMask<$vector>;

            #[inline(always)]
            fn splat(value: f32) -> Self {
                <$vector>::splat(value)
            }
            #[inline(always)]
            fn load(from: &[f32]) -> Self {
                let lanes: &[f32; $count] = from[..$count].try_into().expect("sliced to length");
                <$vector>::new(*lanes)
            }
            #[inline(always)]
            fn store(self, to: &mut [f32]) {
                to[..$count].copy_from_slice(&self.to_array());
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                if cfg!(target_feature = "fma") {
                    <$vector>::mul_add(self, factor, term)
                } else {
                    let (a, b, c) = (self.to_array(), factor.to_array(), term.to_array());
                    <$vector>::new(std::array::from_fn(|i| f32::mul_add(a[i], b[i], c[i])))
                }
            }
            #[inline(always)]
            fn neg_mul_add(self, factor: Self, term: Self) -> Self {
                if cfg!(target_feature = "fma") {
                    <$vector>::mul_neg_add(self, factor, term)
                } else {
                    Lanes::mul_add(-self, factor, term)
                }
            }
            #[inline(always)]
            fn mul_add_fast(self, factor: Self, term: Self) -> Self {
                <$vector>::mul_add(self, factor, term)
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if cfg!(target_arch = "x86_64") {
                    self.fast_min(other)
                } else {
                    Lanes::select(Lanes::lt(self, other), self, other)
                }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if cfg!(target_arch = "x86_64") {
                    self.fast_max(other)
                } else {
                    Lanes::select(Lanes::gt(self, other), self, other)
                }
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$vector>::abs(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$vector>::sqrt(self)
            }
            #[inline(always)]
            fn lt(self, other: Self) -> Self::Mask {
                VectorMask(self.simd_lt(other))
            }
            #[inline(always)]
            fn le(self, other: Self) -> Self::Mask {
                VectorMask(self.simd_le(other))
            }
            #[inline(always)]
            fn gt(self, other: Self) -> Self::Mask {
                VectorMask(self.simd_gt(other))
            }
            #[inline(always)]
            fn ge(self, other: Self) -> Self::Mask {
                VectorMask(self.simd_ge(other))
            }
            #[inline(always)]
            fn eq(self, other: Self) -> Self::Mask {
                VectorMask(self.simd_eq(other))
            }
            #[inline(always)]
            fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
                mask.0.select(yes, no)
            }
            #[inline(always)]
            fn mask(bits: u32) -> Self::Mask {
                let lane_bit = <$ints>::new(std::array::from_fn(|lane| 1 << lane));
                let chosen = (<$ints>::splat(bits as i32) & lane_bit).simd_eq(lane_bit);
                VectorMask(<$vector>::from_bits_of(chosen))
            }
            #[inline(always)]
            fn power_to_one(self) -> Self {
                <$vector>::new(self.to_array().map(power_to_one))
            }
            #[inline(always)]
            fn reduce_max(self) -> f32 {
                let mut lanes = self.to_array();
                let mut half = $count / 2;
                while half > 0 {
                    for lane in 0..half {
                        lanes[lane] = Lanes::max(lanes[lane], lanes[lane + half]);
                    }
                    half /= 2;
                }
                lanes[0]
            }
            #[inline(always)]
            fn reduce_min(self) -> f32 {
                let mut lanes = self.to_array();
                let mut half = $count / 2;
                while half > 0 {
                    for lane in 0..half {
                        lanes[lane] = Lanes::min(lanes[lane], lanes[lane + half]);
                    }
                    half /= 2;
                }
                lanes[0]
            }
            #[inline(always)]
            fn lane(&self, lane: usize) -> f32 {
                self.as_array()[lane]
            }
            #[inline(always)]
            fn set_lane(&mut self, lane: usize, value: f32) {
                self.as_mut_array()[lane] = value;
            }
        }
    };
}

/// Distances with the number of their lane in the last three bits: they order as the distances do.
pub struct Keys;

impl Keys {
    /// The keys of the lanes in `mask`, the farthest first, then zeros. Distances below zero count
    /// as zero; the last three bits of a distance are lost downwards.
    ///
    /// A bitonic network: six steps without a branch.
    #[inline(always)]
    pub fn farthest_first(distances: F32x8, mask: VectorMask<F32x8>) -> [u32; 8] {
        use wide::u32x8;
        let lanes = u32x8::new([0, 1, 2, 3, 4, 5, 6, 7]);
        let bits: u32x8 = wide::bytemuck::cast(Lanes::max(distances, F32x8::ZERO));
        let counts: u32x8 = wide::bytemuck::cast(mask.0);
        let keys = ((bits & u32x8::splat(!7)) | lanes) & counts;
        // Each lane meets a partner; the larger key goes to the lane with the smaller number.
        let step = |keys: u32x8, partners: [u32; 8]| {
            let first: u32x8 = u32x8::new(std::array::from_fn(|lane| {
                if (partners[lane] as usize) > lane { u32::MAX } else { 0 }
            }));
            let others = keys.shuffle(u32x8::new(partners));
            first.select(keys.max(others), keys.min(others))
        };
        let keys = step(keys, [1, 0, 3, 2, 5, 4, 7, 6]);
        let keys = step(keys, [3, 2, 1, 0, 7, 6, 5, 4]);
        let keys = step(keys, [1, 0, 3, 2, 5, 4, 7, 6]);
        let keys = step(keys, [7, 6, 5, 4, 3, 2, 1, 0]);
        let keys = step(keys, [2, 3, 0, 1, 6, 7, 4, 5]);
        step(keys, [1, 0, 3, 2, 5, 4, 7, 6]).to_array()
    }

    /// How many of the last keys, one after the other, are farther than `distance`.
    #[inline(always)]
    pub fn run_behind(keys: &[u32; 8], distance: f32) -> usize {
        let keys = wide::u32x8::new(*keys) & wide::u32x8::splat(!7);
        let distances: F32x8 = wide::bytemuck::cast(keys);
        let behind = Lanes::gt(distances, F32x8::splat(distance)).bits();
        (!(behind << 24)).leading_zeros() as usize
    }

    /// The lane of a key.
    #[inline(always)]
    pub fn lane(key: u32) -> usize {
        (key & 7) as usize
    }

    /// The distance of a key, at most that of its lane.
    #[inline(always)]
    pub fn distance(key: u32) -> f32 {
        f32::from_bits(key & !7)
    }
}

/// Reinterprets integer lanes as float lanes.
trait FromBits<I> {
    fn from_bits_of(ints: I) -> Self;
}

impl FromBits<wide::i32x8> for F32x8 {
    #[inline(always)]
    fn from_bits_of(ints: wide::i32x8) -> Self {
        wide::bytemuck::cast(ints)
    }
}

impl FromBits<wide::i32x16> for F32x16 {
    #[inline(always)]
    fn from_bits_of(ints: wide::i32x16) -> Self {
        wide::bytemuck::cast(ints)
    }
}

lanes!(F32x8, 8, wide::i32x8);
lanes!(F32x16, 16, wide::i32x16);
