//! Where to split a range of primitives: binned surface area heuristic (Wald 2007, "On fast
//! construction of SAH-based bounding volume hierarchies"), all axes in one pass.
//!
//! A primitive's bin is found by one formula, in the search and in the partition, so both agree.

use glam::Vec4;

use super::primitive::{BuildPrimitive, SignedBox};

/// The most bins of an axis.
pub(super) const MAX_BINS: usize = 16;

/// Added to a float from 0 to `2^22`, this leaves the float's nearest integer in the low bits.
const INTEGER: f32 = 8_388_608.0;

/// The boxes around a range's primitives and around their centres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    pub(super) bounds: SignedBox,
    pub(super) centers: SignedBox,
}

impl Range {
    pub(super) fn empty() -> Self {
        Self { bounds: SignedBox::empty(), centers: SignedBox::empty() }
    }

    pub(super) fn of(primitives: &[BuildPrimitive]) -> Self {
        primitives.iter().fold(Self::empty(), |all, one| Self {
            bounds: all.bounds.union(one.signed_box()),
            centers: all.centers.union(SignedBox::of_point(one.center())),
        })
    }

    pub(super) fn union(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), centers: self.centers.union(other.centers) }
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

/// What lies in each bin.
#[derive(Clone)]
pub(super) struct Bins {
    boxes: [[SignedBox; MAX_BINS]; 3],
    counts: [[u32; MAX_BINS]; 3],
}

impl Bins {
    #[inline(always)]
    pub(super) fn of(primitives: &[BuildPrimitive], grid: &Grid) -> Self {
        let mut bins =
            Self { boxes: [[SignedBox::empty(); MAX_BINS]; 3], counts: [[0; MAX_BINS]; 3] };
        for one in primitives {
            let place = grid.place(one.center()).to_array();
            for (axis, place) in place.into_iter().take(3).enumerate() {
                let bin = place.to_bits() as usize % MAX_BINS;
                bins.boxes[axis][bin] = bins.boxes[axis][bin].union(one.signed_box());
                bins.counts[axis][bin] += 1;
            }
        }
        bins
    }

    pub(super) fn merged(mut self, other: Self) -> Self {
        for axis in 0..3 {
            for bin in 0..MAX_BINS {
                self.boxes[axis][bin] = self.boxes[axis][bin].union(other.boxes[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }

    /// The split with the smallest `area * count` of both sides; `None` if one bin has them all.
    #[inline(always)]
    pub(super) fn cheapest_split(&self, grid: &Grid, area_scale: f32) -> Option<Split> {
        let mut best = None;
        let mut best_cost = f32::INFINITY;
        for axis in 0..3 {
            let (boxes, counts) = (&self.boxes[axis], &self.counts[axis]);
            let mut rights = [(SignedBox::empty(), 0.0); MAX_BINS];
            let (mut right, mut right_count) = (SignedBox::empty(), 0);
            for bin in (1..grid.bins).rev() {
                right = right.union(boxes[bin]);
                right_count += counts[bin];
                let cost = right.half_area(area_scale) * right_count as f32;
                // A side without primitives is no split.
                rights[bin] = (right, if right_count == 0 { f32::INFINITY } else { cost });
            }
            let (mut left, mut left_count) = (SignedBox::empty(), 0);
            for bin in 1..grid.bins {
                left = left.union(boxes[bin - 1]);
                left_count += counts[bin - 1];
                let (right, right_cost) = rights[bin];
                let cost = left.half_area(area_scale) * left_count as f32 + right_cost;
                if cost < best_cost && left_count > 0 {
                    best_cost = cost;
                    best = Some((axis, bin, left, right));
                }
            }
        }
        let (axis, bin, left, right) = best?;
        let mut limit = [0.0; 4];
        limit[axis] = INTEGER + bin as f32;
        Some(Split { grid: *grid, limit: limit.into(), bounds: [left, right] })
    }
}

/// A plane between two bins of one axis.
#[derive(Clone, Copy)]
pub(super) struct Split {
    grid: Grid,
    /// The first bin of the right side on the plane's axis, 0 on the others.
    limit: Vec4,
    bounds: [SignedBox; 2],
}

impl Split {
    #[inline(always)]
    pub(super) fn is_left(&self, center: Vec4) -> bool {
        self.grid.place(center).cmplt(self.limit).any()
    }

    /// Moves what is left of the plane to the front. The size and the boxes of both sides.
    #[inline(always)]
    pub(super) fn partition(&self, primitives: &mut [BuildPrimitive]) -> (usize, [Range; 2]) {
        let mut left = 0;
        let mut centers = [SignedBox::empty(); 2];
        for place in 0..primitives.len() {
            let one = primitives[place];
            let center = one.center();
            let is_left = self.is_left(center);
            let side = &mut centers[usize::from(!is_left)];
            *side = side.union(SignedBox::of_point(center));
            // What stands at `left` is of the right side, so it may always change places: without a
            // branch, which would be mispredicted half of the time.
            primitives[place] = primitives[left];
            primitives[left] = one;
            left += usize::from(is_left);
        }
        (left, self.ranges(centers))
    }

    pub(super) fn ranges(&self, centers: [SignedBox; 2]) -> [Range; 2] {
        let range = |side: usize| Range { bounds: self.bounds[side], centers: centers[side] };
        [range(0), range(1)]
    }
}
