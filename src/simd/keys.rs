//! Distances of eight boxes, sorted without a branch.

use wide::u32x8;

use super::{F32x8, LaneMask, Lanes, VectorMask, each};

/// Eight lanes in the order of their distances: a key is a distance with the number of its lane in the
/// last three bits, and keys order as the distances do.
#[derive(Clone, Copy, Debug)]
pub struct Keys(u32x8);

impl Keys {
    /// The keys of the lanes in `mask`, the farthest first, then zeros. Distances below zero count as
    /// farther than all others; the last three bits of a distance are lost.
    ///
    /// A bitonic network: six steps without a branch. Each step waits for the one before, so several rays
    /// take them in turns.
    #[inline(always)]
    pub fn farthest_first<const COUNT: usize>(
        boxes: [(F32x8, VectorMask<F32x8>); COUNT],
    ) -> [Self; COUNT] {
        let lanes = u32x8::new([0, 1, 2, 3, 4, 5, 6, 7]);
        let keys: [u32x8; COUNT] = each(|ray| {
            let (distances, mask) = boxes[ray];
            let bits: u32x8 = wide::bytemuck::cast(distances);
            let counts: u32x8 = wide::bytemuck::cast(mask.0);
            ((bits & u32x8::splat(!7)) | lanes) & counts
        });
        // Each lane meets a partner; the larger key goes to the lane with the smaller number.
        let step = |keys: [u32x8; COUNT], partners: [u32; 8]| -> [u32x8; COUNT] {
            let first: u32x8 = u32x8::new(std::array::from_fn(|lane| {
                if (partners[lane] as usize) > lane { u32::MAX } else { 0 }
            }));
            let others: [u32x8; COUNT] = each(|ray| keys[ray].shuffle(u32x8::new(partners)));
            each(|ray| first.select(keys[ray].max(others[ray]), keys[ray].min(others[ray])))
        };
        let keys = step(keys, [1, 0, 3, 2, 5, 4, 7, 6]);
        let keys = step(keys, [3, 2, 1, 0, 7, 6, 5, 4]);
        let keys = step(keys, [1, 0, 3, 2, 5, 4, 7, 6]);
        let keys = step(keys, [7, 6, 5, 4, 3, 2, 1, 0]);
        let keys = step(keys, [2, 3, 0, 1, 6, 7, 4, 5]);
        let keys = step(keys, [1, 0, 3, 2, 5, 4, 7, 6]);
        each(|ray| Self(keys[ray]))
    }

    /// The lanes of `bits`, the last first, all at distance zero, then zeros.
    #[inline(always)]
    pub fn last_first(bits: u32) -> Self {
        let lanes = LAST_FIRST[bits as usize & 0xff];
        Self(u32x8::new(std::array::from_fn(|place| u32::from(lanes[place]))))
    }

    /// The keys in their order, the number of a lane in the last three bits of each.
    #[inline(always)]
    pub fn to_array(self) -> [u32; 8] {
        self.0.to_array()
    }

    /// The values of the lanes in the order of the keys.
    #[inline(always)]
    pub fn sort(self, values: &[u32; 8]) -> [u32; 8] {
        u32x8::new(*values).shuffle(self.0 & u32x8::splat(7)).to_array()
    }

    /// How many of the last keys, one after the other, are farther than `distance`, which is not below zero.
    #[inline(always)]
    pub fn run_behind(keys: &[u32; 8], distance: f32) -> usize {
        let keys = u32x8::new(*keys) & u32x8::splat(!7);
        let distances: F32x8 = wide::bytemuck::cast(keys);
        let behind = Lanes::gt(distances, F32x8::splat(distance)).bits();
        (!(behind << 24)).leading_zeros() as usize
    }
}

/// For each set of eight lanes, those in it from the last to the first, then zeros.
static LAST_FIRST: [[u8; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut bits = 0;
    while bits < 256 {
        let (mut place, mut lane) = (0, 8);
        while lane > 0 {
            lane -= 1;
            if bits >> lane & 1 != 0 {
                table[bits][place] = lane as u8;
                place += 1;
            }
        }
        bits += 1;
    }
    table
};
