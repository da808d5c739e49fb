//! Distances of eight boxes, sorted without a branch.

use wide::u32x8;

use super::{F32x8, LaneMask, Lanes, VectorMask};

/// Distances with the number of their lane in the last three bits: they order as the distances do.
pub struct Keys;

impl Keys {
    /// The keys of the lanes in `mask`, the farthest first, then zeros. Distances below zero count
    /// as zero; the last three bits of a distance are lost downwards.
    ///
    /// A bitonic network: six steps without a branch.
    #[inline(always)]
    pub fn farthest_first(distances: F32x8, mask: VectorMask<F32x8>) -> [u32; 8] {
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
        let keys = u32x8::new(*keys) & u32x8::splat(!7);
        let distances: F32x8 = wide::bytemuck::cast(keys);
        let behind = Lanes::gt(distances, F32x8::splat(distance)).bits();
        (!(behind << 24)).leading_zeros() as usize
    }

    /// The key of one lane; a distance below zero counts as zero.
    #[inline(always)]
    pub fn key(distance: f32, lane: usize) -> u32 {
        (Lanes::max(distance, 0.0).to_bits() & !7) | lane as u32
    }

    /// The distance of a key, its last three bits lost downwards.
    #[inline(always)]
    pub fn distance(key: u32) -> f32 {
        f32::from_bits(key & !7)
    }

    /// The lane of a key.
    #[inline(always)]
    pub fn lane(key: u32) -> usize {
        (key & 7) as usize
    }
}
