//! What is worth a tile's step, and what is left to single rays.
//!
//! A tile tests a box with all rays of a group at once, a single ray tests all boxes of a node at
//! once. Which is cheaper depends on how many rays go the same way, so it is decided child by child:
//! see [`is_worth`]. Fans are the exception: their bounds are so sharp that no group tests a box with its
//! own rays, so nobody knows how many go there. They have a budget for the whole descent instead; one
//! that spends it gives up, and the rays of the next ones go on their own, up to [`LONGEST_PAUSE`] fans.
//!
//! All of this decides about speed alone, never about hits.

use crate::bvh::LEAF as LEAF_CHILD;

/// A node, with all its boxes against the bounds of all groups, in box tests of a group.
pub(super) const NODE: u32 = 8;
/// A leaf, likewise.
pub(super) const LEAF: u32 = 6;
/// A primitive with the rays of a group, likewise.
pub(super) const PRIMITIVE: u32 = 3;
/// What a ray on its own takes, likewise, twice over. 20, 40 and 80 were tried on camera rays of terrains:
/// 15.2, 15.5, 16.0 million a second with 1M triangles, 7.7, 8.2, 8.1 with 3M, where many share a pixel.
const SINGLE: u32 = 40;

/// The most fans that are not tried after failures.
const LONGEST_PAUSE: u32 = 7;

/// The rays that a child must be met by, less one, so that a tile goes there: a constant, and a part
/// for each box test that is to be expected. The latter are a group's share of the boxes of the last
/// node (all eight if nothing is known of the groups' bounds), for each of its groups.
///
/// Swept for nodes over 0 to 6 and 0.3 to 1, for leaves over 0 to 4 and 0.3 to 2 (a leaf has about
/// five primitives), on the bunny, the terrain, the atrium and the dense scan: between 0.5 and 1, and
/// 0.4 and 0.8, nothing moves by more than a twentieth. Leaves at 2 lose a tenth with mirrors and hard
/// shadows, nodes at 0.3 with ao.
const FEW_AT_NODE: (f32, f32) = (3.0, 0.8);
/// The same for leaves; the second one for each of a leaf's primitives.
const FEW_AT_LEAF: (f32, f32) = (2.0, 0.1);

/// Fewer groups that run alike, while others of the tile do not, go with these in one descent without bounds.
///
/// Descents of their own for one group and more, against 4, 5 and 8 groups, on bunny, atrium, terrain, dense
/// scan and sphereflake: diffuse rays 1.02 to 1.03 times as fast, ao 1.02 to 1.03, mirrors 0.99 to 1.01.
const LEAST_AIMED: u32 = 4;

/// True if the groups `aimed` of all that are `live` get bounds and a descent of their own.
#[inline(always)]
pub(super) fn is_worth_an_aim(aimed: u32, live: u32) -> bool {
    aimed == live || aimed.count_ones() >= LEAST_AIMED
}

/// True if so many rays of `groups` are enough for the tile to go to a child of that description (see
/// [`crate::bvh::Child`]), if each group tested a `share` of its node's boxes; if not, they go on their own.
#[inline(always)]
pub(super) fn is_worth(rays: u32, groups: u32, share: f32, meta: u32) -> bool {
    let tests = share * groups.count_ones() as f32;
    let (constant, each) = if meta & LEAF_CHILD == 0 {
        FEW_AT_NODE
    } else {
        (FEW_AT_LEAF.0, FEW_AT_LEAF.1 * (meta & 0xff) as f32)
    };
    rays as f32 > constant + each * tests
}

/// What the descent of a fan of so many rays may cost.
pub(super) fn budget(rays: u32) -> u32 {
    SINGLE * rays
}

/// How the tiles of a batch went lately.
pub(super) struct Pace {
    /// How many fans are still not to be tried.
    pause: u32,
    /// How many that were after the last failure.
    last_pause: u32,
}

impl Pace {
    pub(super) fn new() -> Self {
        Self { pause: 0, last_pause: 0 }
    }

    /// False if the next tile should not be tried as a fan.
    pub(super) fn takes_fans(&mut self) -> bool {
        let pauses = self.pause > 0;
        self.pause -= u32::from(pauses);
        !pauses
    }

    /// The descent of a fan ended, its budget spent or not.
    pub(super) fn fan_ended(&mut self, spent: bool) {
        self.last_pause = if spent { (2 * self.last_pause + 1).min(LONGEST_PAUSE) } else { 0 };
        self.pause = self.last_pause;
    }
}
