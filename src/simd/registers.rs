//! Eight and sixteen lanes, over the registers of `wide`.

use std::ops::{BitAnd, BitOr, Not};

use super::scalar::power_to_one;
use super::{F32x8, F32x16, LaneMask, Lanes, Native, each};

/// A mask in the form of the vectors that compares give: all bits of a lane set, or none.
#[derive(Clone, Copy, Debug)]
pub struct VectorMask<V>(pub(super) V);

macro_rules! lanes {
    ($vector:ty, $count:literal, $ints:ty, $register:ty) => {
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
            type Register = $register;

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
            fn load_rows(rows: &[[f32; 3]]) -> [Self; 3] {
                let rows: &[f32; 3 * $count] =
                    rows[..$count].as_flattened().try_into().expect("sliced to length");
                // The compiler makes shuffles of whole registers of this.
                each(|axis| {
                    let mut lanes = [0.0; $count];
                    for lane in 0..$count {
                        lanes[lane] = rows[3 * lane + axis];
                    }
                    <$vector>::new(lanes)
                })
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
            fn set(&mut self, mask: Self::Mask, value: Self) {
                // The larger of a value and itself is itself, bit for bit, which the compiler doesn't know.
                *self = mask.0.select(value, Lanes::max(*self, *self));
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
            fn reduce_bounds(low: [Self; 2], high: [Self; 2]) -> [[f32; 2]; 2] {
                const HALF: usize = $count / 2;
                const QUARTER: usize = $count / 4;
                // Plain loops over arrays: the compiler makes one shuffle of each.
                let halves = |[x, y]: [Self; 2], pick: fn(f32, f32) -> f32| {
                    let (x, y, mut lanes) = (x.to_array(), y.to_array(), [0.0; $count]);
                    for lane in 0..HALF {
                        lanes[lane] = pick(x[lane], x[lane + HALF]);
                        lanes[lane + HALF] = pick(y[lane], y[lane + HALF]);
                    }
                    <$vector>::new(lanes)
                };
                let low = halves(low, Lanes::min).to_array();
                let high = (-halves(high, Lanes::max)).to_array();
                let quarters = |from: usize| {
                    let mut lanes = [0.0; $count];
                    for lane in 0..QUARTER {
                        for (half, lanes) in lanes.chunks_exact_mut(HALF).enumerate() {
                            let side = if half == 0 { &low } else { &high };
                            lanes[lane] = side[lane + from];
                            lanes[lane + QUARTER] = side[lane + HALF + from];
                        }
                    }
                    <$vector>::new(lanes)
                };
                let mut least = Lanes::min(quarters(0), quarters(QUARTER));
                let mut step = QUARTER / 2;
                while step > 0 {
                    let (all, mut lanes) = (least.to_array(), [0.0; $count]);
                    for lane in 0..$count {
                        lanes[lane] = all[lane ^ step];
                    }
                    least = Lanes::min(least, <$vector>::new(lanes));
                    step /= 2;
                }
                let least = least.to_array();
                [[least[0], least[QUARTER]], [-least[HALF], -least[HALF + QUARTER]]]
            }
            #[inline(always)]
            fn register(&self, index: usize) -> $register {
                let start = index * <$register>::LANES;
                Lanes::load(&self.as_array()[start..])
            }
            #[inline(always)]
            fn set_register(&mut self, index: usize, value: $register) {
                let start = index * <$register>::LANES;
                value.store(&mut self.as_mut_array()[start..]);
            }
            #[inline(always)]
            fn mask_register(mask: Self::Mask, index: usize) -> <$register as Lanes>::Mask {
                VectorMask(mask.0.register(index))
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

lanes!(F32x8, 8, wide::i32x8, F32x8);
lanes!(F32x16, 16, wide::i32x16, Native);

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds_are_the_extremes<F: Lanes>() {
        let value = |seed: usize, lane: usize| ((lane * 7 + seed * 5) % 16) as f32 - 6.5;
        let lanes =
            |seed: usize| F::load(&std::array::from_fn::<_, 16, _>(|lane| value(seed, lane)));
        for seed in 0..16 {
            let [low, high] = [[lanes(seed), lanes(seed + 3)], [lanes(seed + 1), lanes(seed + 6)]];
            let expected = [low.map(|of| of.reduce_min()), high.map(|of| of.reduce_max())];
            assert_eq!(F::reduce_bounds(low, high), expected);
        }
    }

    fn rows_are_turned<F: Lanes>() {
        let rows =
            std::array::from_fn::<_, 17, _>(|lane| [0.0, 0.25, 0.5].map(|axis| axis + lane as f32));
        for (axis, lanes) in F::load_rows(&rows).iter().enumerate() {
            for lane in 0..F::LANES {
                assert_eq!(lanes.lane(lane), lane as f32 + axis as f32 * 0.25);
            }
        }
    }

    fn only_chosen_lanes_are_set<F: Lanes>() {
        // A NaN with a payload, a signalling one, a denormal, a negative zero: ids may have any bits.
        let bits = [0x7fc1_2345, 0x7f80_0001, 1, 0x8000_0000, 0xffff_ffff];
        let before: [f32; 16] = each(|lane| f32::from_bits(bits[lane % 5]));
        for chosen in [0, 1, 0x5a5a, 0xffff] {
            let mut lanes = F::load(&before);
            lanes.set(F::mask(chosen), F::splat(2.0));
            for (lane, &before) in before[..F::LANES].iter().enumerate() {
                let expected = if chosen >> lane & 1 != 0 { 2.0 } else { before };
                assert_eq!(lanes.lane(lane).to_bits(), expected.to_bits(), "{chosen:x} {lane}");
            }
        }
    }

    #[test]
    fn lanes_are_set_where_they_are_chosen() {
        only_chosen_lanes_are_set::<f32>();
        only_chosen_lanes_are_set::<F32x8>();
        only_chosen_lanes_are_set::<F32x16>();
    }

    fn registers_are_runs_of_lanes<F: Lanes>() {
        let from: [f32; 16] = each(|lane| lane as f32 + 0.5);
        let (lanes, mut copy, bits) = (F::load(&from), F::splat(0.0), 0b1010_0110_1100_0101);
        let size = F::Register::LANES;
        assert_eq!(F::REGISTERS * size, F::LANES);
        for index in 0..F::REGISTERS {
            let register = lanes.register(index);
            let mask = F::mask_register(F::mask(bits), index);
            assert_eq!(mask.bits(), bits >> (index * size) & ((1 << size) - 1));
            for (lane, &value) in from[index * size..][..size].iter().enumerate() {
                assert_eq!(register.lane(lane), value);
            }
            copy.set_register(index, register);
        }
        assert_eq!(copy.eq(lanes).bits(), (1 << F::LANES) - 1);
    }

    #[test]
    fn lanes_are_taken_register_by_register() {
        registers_are_runs_of_lanes::<f32>();
        registers_are_runs_of_lanes::<F32x8>();
        registers_are_runs_of_lanes::<F32x16>();
    }

    #[test]
    fn rows_become_lanes() {
        rows_are_turned::<f32>();
        rows_are_turned::<F32x8>();
        rows_are_turned::<F32x16>();
    }

    #[test]
    fn four_reductions_at_once_are_those_one_by_one() {
        bounds_are_the_extremes::<f32>();
        bounds_are_the_extremes::<F32x8>();
        bounds_are_the_extremes::<F32x16>();
    }
}
