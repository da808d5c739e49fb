//! What a descent may cost: as much as its rays would cost one by one.
//!
//! Whether rays run alike enough for a tile cannot be seen from the rays alone. So a descent has a
//! budget, and a batch keeps count of what single rays took lately. A descent that spends its budget
//! gives up, and the next tiles are not even tried: one after the first failure, then three, up to
//! [`LONGEST_PAUSE`].
//!
//! Costs are in box tests of a group. They decide about speed alone, never about hits.

/// A node, with all its boxes against the bounds of all groups.
pub(super) const NODE: u32 = 8;
/// A leaf, likewise.
pub(super) const LEAF: u32 = 6;
/// A box with the rays of a group.
pub(super) const BOX: u32 = 1;
/// A primitive with the rays of a group.
pub(super) const PRIMITIVE: u32 = 3;
/// A step of a single ray: a node or a leaf.
const STEP: f32 = 2.0;

/// The most tiles that are not tried after failures.
const LONGEST_PAUSE: u32 = 7;

/// What single rays of a batch took lately, and how descents went.
pub(super) struct Pace {
    /// Steps a ray.
    steps: f32,
    /// How many tiles are still not to be tried.
    pause: u32,
    /// How many that were after the last failure.
    last_pause: u32,
}

impl Pace {
    pub(super) fn new() -> Self {
        Self { steps: 8.0, pause: 0, last_pause: 0 }
    }

    /// What a descent of so many rays may cost.
    pub(super) fn budget(&self, rays: u32) -> u32 {
        (self.steps * STEP * rays as f32) as u32
    }

    /// True if the next tile should not be tried.
    pub(super) fn pauses(&mut self) -> bool {
        let pauses = self.pause > 0;
        self.pause -= u32::from(pauses);
        pauses
    }

    /// A descent ended, its budget spent or not.
    pub(super) fn descended(&mut self, spent: bool) {
        self.last_pause = if spent { (2 * self.last_pause + 1).min(LONGEST_PAUSE) } else { 0 };
        self.pause = self.last_pause;
    }

    /// Some rays took so many steps one by one.
    pub(super) fn singles(&mut self, rays: u32, steps: u32) {
        if rays > 0 {
            self.steps += 0.25 * (steps as f32 / rays as f32 - self.steps);
        }
    }
}
