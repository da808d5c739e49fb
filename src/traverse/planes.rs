//! The planes of one box as rays meet them, for all groups that test it.
//!
//! Which plane comes first on an axis depends on where a ray runs. Most groups of a tile run into one
//! octant: for those the planes are put in order once a box, and lie in registers from test to test. Groups
//! that run elsewhere, or several ways, find the order lane by lane.

use crate::bvh::Node;
use crate::simd::{Lanes, each};

/// Where rays run: a bit for each axis along which that is towards smaller coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Octant(u32);

impl Octant {
    /// Rays that do not run into one octant.
    pub(super) const SEVERAL: Self = Self(8);

    /// Of rays, given for each axis which of the `valid` lanes run towards smaller coordinates.
    #[inline(always)]
    pub(super) fn of(negative: [u32; 3], valid: u32) -> Self {
        let one_sign = negative.iter().all(|&lanes| lanes == 0 || lanes == valid);
        let bit = |axis: usize| u32::from(negative[axis] != 0) << axis;
        if one_sign { Self(bit(0) | bit(1) | bit(2)) } else { Self::SEVERAL }
    }

    /// The one in which most of these are, the last of them if none is in any.
    #[inline(always)]
    pub(super) fn most(octants: impl Iterator<Item = Self>) -> Self {
        let mut counts = [0; 8];
        for octant in octants.filter(|&octant| octant != Self::SEVERAL) {
            counts[octant.0 as usize & 7] += 1;
        }
        let most = (0..8).max_by_key(|&octant| counts[octant as usize]);
        Self(most.unwrap_or_default())
    }
}

/// The planes of a box in the order in which rays of one octant meet them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planes<F: Lanes> {
    /// Where those rays run, never [`Octant::SEVERAL`].
    pub(super) octant: Octant,
    /// On each axis the plane that they meet first.
    pub(super) near: [F; 3],
    /// On each axis the other one.
    pub(super) far: [F; 3],
}

impl<F: Lanes> Planes<F> {
    /// Of the box of a slot.
    #[inline(always)]
    pub(super) fn new(node: &Node, slot: usize, octant: Octant) -> Self {
        let plane = |axis: usize, upper: u32| {
            F::splat(node.bounds[axis + 3 * (upper & 1) as usize][slot & 7])
        };
        let upper = |axis: usize| octant.0 >> axis;
        Self {
            octant,
            near: each(|axis| plane(axis, upper(axis))),
            far: each(|axis| plane(axis, !upper(axis))),
        }
    }
}
