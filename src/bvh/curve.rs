//! Morton's curve through the scene, for the fastest build (Lauterbach and others 2009, "Fast BVH
//! construction on GPUs").
//!
//! A centre's place is the number of its cell on the curve. Cells are cubes; an axis along which the
//! scene is shorter has fewer bits, so that a flat scene has as many cells as another. Primitives as long
//! as half of the scene come after all others, since the boxes of their neighbours would get as large
//! (Vinkler, Bittner, Havran 2017, "Extended Morton codes for high performance bounding volume hierarchy
//! construction").

use glam::Vec4;

use super::binning::INTEGER;
use super::primitive::SignedBox;

/// The most bits of a cell's number.
pub(super) const MOST_BITS: u32 = 30;

/// The most bits of one axis.
const MOST_ALONG: u32 = 16;

/// So many centres get their places at once.
pub(super) const FEW: usize = 8;

/// The cells, and how their coordinates become places: first the bits that all axes have, in turns,
/// then those that two have, then those of one.
pub(super) struct Curve {
    origin: Vec4,
    scale: Vec4,
    last: Vec4,
    /// What is longer comes after all others, by this bit.
    long: Vec4,
    after: u32,
    /// How many bits all axes have, and how many two.
    shared: [u32; 2],
    /// For each axis which of its bits it shares with all and with one other,
    masks: [[u32; 4]; 2],
    /// and which turn it takes there.
    turns: [[u32; 4]; 2],
}

impl Curve {
    /// The curve through a box around all centres, with cells whose numbers have at most so many bits.
    pub(super) fn new(centers: SignedBox, most_bits: u32) -> Self {
        let (origin, size) = centers.min_and_size();
        let sizes = [size.x, size.y, size.z].map(|size| f64::from(size).min(1e39));
        let largest = sizes.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let bits = |along: u32| {
            let cells = sizes.map(|size| size / largest * f64::from(along).exp2());
            cells.map(|cells| cells.max(1.0).log2().ceil() as u32)
        };
        let along =
            (1..=MOST_ALONG).rev().find(|&along| bits(along).iter().sum::<u32>() <= most_bits);
        let along = along.unwrap_or(1);
        let bits = bits(along);
        let scale = (f64::from(along).exp2() / largest).min(1e37) as f32;
        let last = bits.map(|bits| INTEGER + ((1_u32 << bits) - 1) as f32);
        let last = Vec4::new(last[0], last[1], last[2], INTEGER);
        let mut sorted = bits;
        sorted.sort_unstable();
        let shared = [sorted[0], sorted[1]];
        let (mut masks, mut turns) = ([[0; 4]; 2], [[0; 4]; 2]);
        let mut seconds = 0;
        for (axis, bits) in bits.into_iter().enumerate() {
            (masks[0][axis], turns[0][axis]) = ((1 << shared[0]) - 1, axis as u32);
            // Of axes with as many bits as the shortest, none is left for the second round.
            if bits > shared[0] {
                (masks[1][axis], turns[1][axis]) = ((1 << (shared[1] - shared[0])) - 1, seconds);
                seconds = 1;
            }
        }
        let scale = Vec4::new(scale, scale, scale, 0.0);
        let long = (0.5 * largest).min(1e38) as f32;
        let long = Vec4::new(long, long, long, f32::INFINITY);
        Self { origin, scale, last, long, after: 1 << most_bits, shared, masks, turns }
    }

    /// A bit to be set in the place of a primitive with this box, if it is long.
    #[inline(always)]
    pub(super) fn after(&self, bounds: SignedBox) -> u32 {
        if bounds.min_and_size().1.cmpgt(self.long).any() { self.after } else { 0 }
    }

    /// The places of some centres, which come axis by axis.
    #[inline(always)]
    pub(super) fn places(&self, centers: &[[f32; FEW]; 3]) -> [u32; FEW] {
        let [all, two] = self.shared;
        let mut places = [0; FEW];
        for (axis, centers) in centers.iter().enumerate() {
            let (origin, scale, last) = (self.origin[axis], self.scale[axis], self.last[axis]);
            let [thirds, halves] = self.masks.map(|masks| masks[axis]);
            let [third, half] = self.turns.map(|turns| turns[axis]);
            for (place, center) in places.iter_mut().zip(centers) {
                // As in `Grid::place`: rounded down, a NaN becomes 0.
                let along = (center - origin) * scale + (INTEGER - 0.5);
                let along = if along > INTEGER { along } else { INTEGER };
                let along = if along < last { along } else { last };
                let along = along.to_bits() - INTEGER.to_bits();
                let halves = by_twos(along >> all & halves) << (3 * all + half);
                *place |= by_threes(along & thirds) << third | halves;
                *place |= along >> two << (all + 2 * two);
            }
        }
        places
    }
}

/// Two zeros after each of ten bits.
#[inline(always)]
fn by_threes(bits: u32) -> u32 {
    let bits = (bits | bits << 16) & 0x0300_00ff;
    let bits = (bits | bits << 8) & 0x0300_f00f;
    let bits = (bits | bits << 4) & 0x030c_30c3;
    (bits | bits << 2) & 0x0924_9249
}

/// A zero after each of fifteen bits.
#[inline(always)]
fn by_twos(bits: u32) -> u32 {
    let bits = (bits | bits << 8) & 0x00ff_00ff;
    let bits = (bits | bits << 4) & 0x0f0f_0f0f;
    let bits = (bits | bits << 2) & 0x3333_3333;
    (bits | bits << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;

    fn cube(side: f32) -> SignedBox {
        SignedBox::of_aabb(&Aabb { min: Vec3::ZERO, max: Vec3::splat(side) })
    }

    #[test]
    fn what_is_long_comes_after_all_others() {
        for bits in [22, MOST_BITS] {
            let curve = Curve::new(cube(1.0), bits);
            let places = curve.places(&[[1.0; FEW]; 3]);
            assert_eq!(curve.after(cube(0.4)), 0);
            assert!(curve.after(cube(0.6)) > places[0], "{bits} bits");
        }
    }
}
