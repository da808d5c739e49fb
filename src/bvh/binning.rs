//! Where to split a range of primitives: binned surface area heuristic (Wald 2007, "On fast
//! construction of SAH-based bounding volume hierarchies"), all axes in one pass.
//!
//! A primitive's bin is found by one formula, in the search and in the partition, so both agree.

use glam::Vec4;
use rayon::prelude::*;

use super::build::CHUNK;
use super::primitive::SignedBox;
use crate::simd::F32x8;

/// Added to a float from 0 to `2^22`, this leaves the float's nearest integer in the low bits.
pub(super) const INTEGER: f32 = 8_388_608.0;

/// What can be binned: a primitive, or some together.
pub(super) trait Binned: Copy + Send + Sync {
    /// The box around it.
    fn signed_box(&self) -> SignedBox;
    /// Where it is.
    fn center(&self) -> Vec4;
    /// How many primitives it stands for.
    fn weight(&self) -> u32;
    /// Half the surface of its box, scaled; 0 if it stands for things that can be parted.
    #[inline(always)]
    fn lone_area(&self, area_scale: f32) -> f32 {
        if self.weight() == 1 { self.signed_box().half_area(area_scale) } else { 0.0 }
    }
}

/// What is known of a range's primitives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    /// The box around them,
    pub(super) bounds: SignedBox,
    /// and the one around their centres.
    pub(super) centers: SignedBox,
    /// None of them has a [`Binned::lone_area`] above this; infinite as long as nobody has looked.
    pub(super) largest: f32,
}

impl Range {
    pub(super) fn empty() -> Self {
        Self { bounds: SignedBox::empty(), centers: SignedBox::empty(), largest: f32::INFINITY }
    }

    #[inline(always)]
    pub(super) fn of(primitives: &[impl Binned]) -> Self {
        // Each step on a box waits for the one before, so there are four of them.
        let (fours, others) = primitives.as_chunks::<4>();
        let few = others.iter().fold(Self::empty(), Self::with);
        if fours.is_empty() {
            return few;
        }
        let mut all = [few, Self::empty(), Self::empty(), Self::empty()];
        for four in fours {
            for (all, one) in all.iter_mut().zip(four) {
                *all = all.with(one);
            }
        }
        let [a, b, c, d] = all;
        a.union(b).union(c.union(d))
    }

    #[inline(always)]
    fn with(self, one: &impl Binned) -> Self {
        Self {
            bounds: self.bounds.union(one.signed_box()),
            centers: self.centers.union(SignedBox::of_point(one.center())),
            ..self
        }
    }

    pub(super) fn union(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            centers: self.centers.union(other.centers),
            largest: self.largest.max(other.largest),
        }
    }
}

/// The bins of a range: slices between its outermost centres on each axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    bins: usize,
    origin: Vec4,
    scale: Vec4,
}

impl Grid {
    pub(super) fn new(centers: SignedBox, bins: usize) -> Self {
        let (origin, size) = centers.min_and_size();
        let scale = Vec4::splat(bins as f32 * 0.999_99) / size;
        // An axis on which all centres are one gets one bin.
        let scale = Vec4::from_array(scale.to_array().map(|s| if s.is_finite() { s } else { 0.0 }));
        Self { bins, origin, scale }
    }

    /// The bin of a centre on each axis, as [`INTEGER`] plus its number.
    #[inline(always)]
    fn place(&self, center: Vec4) -> Vec4 {
        // Rounding to nearest half a bin lower is rounding down. A NaN becomes bin 0.
        let place = (center - self.origin) * self.scale + Vec4::splat(INTEGER - 0.5);
        place.max(Vec4::splat(INTEGER)).min(Vec4::splat(INTEGER + (self.bins - 1) as f32))
    }
}

/// What lies in each of `N` bins, a power of two: few are quickly searched.
#[derive(Clone)]
pub(super) struct Bins<const N: usize> {
    boxes: [[SignedBox; N]; 3],
    counts: [[u32; N]; 3],
}

impl<const N: usize> Bins<N> {
    #[inline(always)]
    pub(super) fn of(primitives: &[impl Binned], grid: &Grid) -> Self {
        let mut bins = Self { boxes: [[SignedBox::empty(); N]; 3], counts: [[0; N]; 3] };
        for one in primitives {
            let place = grid.place(one.center()).to_array();
            for (axis, place) in place.into_iter().take(3).enumerate() {
                let bin = place.to_bits() as usize % N;
                bins.boxes[axis][bin] = bins.boxes[axis][bin].union(one.signed_box());
                bins.counts[axis][bin] += one.weight();
            }
        }
        bins
    }

    pub(super) fn merged(mut self, other: Self) -> Self {
        for axis in 0..3 {
            for bin in 0..N {
                self.boxes[axis][bin] = self.boxes[axis][bin].union(other.boxes[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }

    /// The split with the smallest `area * count` of both sides; `None` if one bin has them all.
    #[inline(always)]
    pub(super) fn cheapest_split(
        &self,
        grid: &Grid,
        largest: f32,
        area_scale: f32,
    ) -> Option<Split> {
        let mut best = (0, 0);
        let mut best_cost = f32::INFINITY;
        let mut best_left = SignedBox::empty();
        let mut best_right = SignedBox::empty();
        for axis in 0..3 {
            let (boxes, counts) = (&self.boxes[axis], &self.counts[axis]);
            let (mut rights, mut right_costs) = ([SignedBox::empty(); N], [0.0; N]);
            let (mut right, mut right_count) = (SignedBox::empty(), 0);
            for bin in (1..N).rev() {
                right = right.union(boxes[bin]);
                right_count += counts[bin];
                let cost = right.half_area(area_scale) * right_count as f32;
                rights[bin] = right;
                // A side without primitives is no split.
                right_costs[bin] = if right_count == 0 { f32::INFINITY } else { cost };
            }
            let (mut left, mut left_count) = (SignedBox::empty(), 0);
            for bin in 1..N {
                left = left.union(boxes[bin - 1]);
                left_count += counts[bin - 1];
                let cost = left.half_area(area_scale) * left_count as f32 + right_costs[bin];
                if cost < best_cost && left_count > 0 {
                    best_cost = cost;
                    best = (axis, bin);
                    (best_left, best_right) = (left, rights[bin]);
                }
            }
        }
        if best_cost == f32::INFINITY {
            return None;
        }
        let mut limit = [0.0; 4];
        limit[best.0] = INTEGER + best.1 as f32;
        let bounds = [best_left, best_right];
        Some(Split { grid: *grid, limit: limit.into(), bounds, largest })
    }
}

/// Below this count a range has half as many bins: the search of the bins is most of its time.
const FEW: usize = 64;

/// Below this count a quarter.
const VERY_FEW: usize = 24;

/// Where it is cheapest to split a range, with coordinates scaled for areas; `None` if all centres are
/// in one bin.
#[inline(always)]
pub(super) fn cheapest_split<B: Binned>(
    primitives: &[B],
    range: Range,
    area_scale: f32,
) -> Option<Split> {
    match primitives.len() {
        ..VERY_FEW => binned::<B, 4>(primitives, range, area_scale),
        VERY_FEW..FEW => binned::<B, 8>(primitives, range, area_scale),
        _ => binned::<B, 16>(primitives, range, area_scale),
    }
}

#[inline(always)]
fn binned<B: Binned, const N: usize>(
    primitives: &[B],
    range: Range,
    area_scale: f32,
) -> Option<Split> {
    let grid = Grid::new(range.centers, N);
    let bins = if primitives.len() > CHUNK {
        let chunks = primitives.par_chunks(CHUNK).map(|chunk| Bins::<N>::of(chunk, &grid));
        chunks.reduce_with(Bins::merged).expect("not empty")
    } else {
        Bins::of(primitives, &grid)
    };
    bins.cheapest_split(&grid, range.largest, area_scale)
}

/// A plane between two bins of one axis.
#[derive(Clone, Copy)]
pub(super) struct Split {
    grid: Grid,
    /// The first bin of the right side on the plane's axis, 0 on the others.
    limit: Vec4,
    bounds: [SignedBox; 2],
    /// The [`Range::largest`] of the whole.
    largest: f32,
}

impl Split {
    #[inline(always)]
    pub(super) fn is_left(&self, center: Vec4) -> bool {
        self.grid.place(center).cmplt(self.limit).any()
    }

    /// Moves what is left of the plane to the front. The size and the boxes of both sides.
    #[inline(always)]
    pub(super) fn partition(&self, primitives: &mut [impl Binned]) -> (usize, [Range; 2]) {
        let mut left = 0;
        let mut centers = [SignedBox::empty(); 2];
        // Both sides' boxes stay in registers: a centre that is of the other side is moved away.
        let (stay, away) = (F32x8::splat(0.0), F32x8::splat(f32::INFINITY));
        let offsets = [[away, stay], [stay, away]];
        for place in 0..primitives.len() {
            let one = primitives[place];
            let center = one.center();
            let is_left = self.is_left(center);
            let (point, offsets) = (SignedBox::of_point(center), &offsets[usize::from(is_left)]);
            centers[0] = centers[0].union(point.plus(offsets[0]));
            centers[1] = centers[1].union(point.plus(offsets[1]));
            // What stands at `left` is of the right side, so it may always change places: without a
            // branch, which would be mispredicted half of the time.
            primitives[place] = primitives[left];
            primitives[left] = one;
            left += usize::from(is_left);
        }
        (left, self.ranges(centers))
    }

    pub(super) fn ranges(&self, centers: [SignedBox; 2]) -> [Range; 2] {
        let range = |side: usize| Range {
            bounds: self.bounds[side],
            centers: centers[side],
            largest: self.largest,
        };
        [range(0), range(1)]
    }
}
