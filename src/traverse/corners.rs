//! The corners of one primitive, for all groups that test it.
//!
//! A sheared ray takes the parts of a corner in an order that depends on the axis along which it runs most.
//! Most groups of a tile run along one: the parts lie in registers in its order from test to test. For rays
//! that run along another one they move round, lane by lane.

use super::SHEAR_ORDER;
use crate::simd::{Lanes, each};

/// The axis along which most groups run, given a bit for each axis along which a group's rays do.
pub(super) fn most_common(groups: impl Iterator<Item = u32>) -> usize {
    let mut counts = [0; 3];
    for axes in groups {
        for (axis, count) in counts.iter_mut().enumerate() {
            *count += u32::from(axes == 1 << axis);
        }
    }
    (0..3).max_by_key(|&axis| counts[axis]).unwrap_or_default()
}

/// The corners of a primitive, each part in all lanes.
#[derive(Clone, Copy)]
pub(super) struct Corners<F: Lanes, const POINTS: usize> {
    /// The axis in whose order the parts are.
    main: usize,
    parts: [[F; 3]; POINTS],
}

impl<F: Lanes, const POINTS: usize> Corners<F, POINTS> {
    /// The fields of a primitive, `v0.x, v0.y, ..`, for rays that run along axis `main`.
    #[inline(always)]
    pub(super) fn new(main: usize, fields: impl Fn(usize) -> f32) -> Self {
        let order = SHEAR_ORDER[main & 3];
        let part = |corner: usize, place: usize| F::splat(fields(3 * corner + order[place]));
        Self { main, parts: each(|corner| each(|place| part(corner, place))) }
    }

    /// A bit for the axis in whose order the parts are.
    #[inline(always)]
    pub(super) fn axis(&self) -> u32 {
        1 << self.main
    }

    /// The parts in the order of rays that all run along that axis.
    #[inline(always)]
    pub(super) fn straight(&self) -> [[F; 3]; POINTS] {
        self.parts
    }

    /// The parts in the order of each lane, given the lanes that run along each axis.
    #[inline(always)]
    pub(super) fn turned(&self, along: &[u32; 3]) -> [[F; 3]; POINTS] {
        let [next, last, _] = SHEAR_ORDER[self.main & 3];
        let (next, last) = (F::mask(along[next]), F::mask(along[last]));
        each(|corner| {
            let part = |place: usize| self.parts[corner][place % 3];
            each(|place| {
                let other = F::select(last, part(place + 2), part(place));
                F::select(next, part(place + 1), other)
            })
        })
    }
}
