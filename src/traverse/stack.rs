//! What waits for one ray: a stack of children.
//!
//! Layout: what tells of a child (its key, its reference, its description) lies in arrays of its own, so
//! that eight children are three stores, and the one on top is known without a look at its node.
//!
//! The children of a node are sorted, the nearest on top; those of nodes below may be nearer all the same.
//! If any hit counts, distances mean nothing, and the first of a node is on top.

use super::rest::ROOM;
use crate::bvh::{MAX_DEPTH, WIDTH};
use crate::simd::{F32x8, Keys, LaneMask, Lanes, VectorMask, each};

/// Where the stack starts: below lie zeros, so that a whole register below any entry can be read, and
/// [`DONE`].
const BOTTOM: usize = WIDTH;

/// Lies below the first entry in place of a description: nothing waits.
pub(super) const DONE: u32 = 1 << 30;

/// Room for what the stack starts with; then each node on the way leaves at most seven, the last one
/// eight.
const END: usize = BOTTOM + ROOM + (WIDTH - 1) * MAX_DEPTH + WIDTH;

/// The orders in which children wait, given where rays enter those of a node each, and which they meet.
#[inline(always)]
pub(super) fn orders<const ANY: bool, const COUNT: usize>(
    boxes: [(F32x8, VectorMask<F32x8>); COUNT],
) -> [Keys; COUNT] {
    if ANY {
        each(|ray| Keys::last_first(boxes[ray].1.bits()))
    } else {
        Keys::farthest_first(boxes)
    }
}

/// The children that wait for a ray.
#[derive(Clone)]
pub(super) struct Stack {
    end: usize,
    keys: [u32; END],
    index: [u32; END],
    meta: [u32; END],
}

impl Stack {
    /// An empty one.
    pub(super) fn new() -> Self {
        let mut meta = [0; END];
        meta[BOTTOM - 1] = DONE;
        Self { end: BOTTOM, keys: [0; END], index: [0; END], meta }
    }

    /// Forgets all that waits.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.end = BOTTOM;
    }

    /// Forgets all that waits, and starts with the root.
    #[inline(always)]
    pub(super) fn start<const ANY: bool>(&mut self) {
        self.clear();
        let root = (F32x8::splat(0.0), F32x8::mask(1));
        self.push::<ANY>(root, (&[0; WIDTH], &[0; WIDTH]));
    }

    /// Forgets all that waits if `done`, without a branch.
    #[inline(always)]
    pub(super) fn clear_if(&mut self, done: bool) {
        let kept = (self.end - BOTTOM) & usize::from(done).wrapping_sub(1);
        self.end = BOTTOM + kept;
    }

    /// Adds those of eight children that are in `met`, `near` along the ray.
    #[inline(always)]
    pub(super) fn push<const ANY: bool>(
        &mut self,
        (near, met): (F32x8, VectorMask<F32x8>),
        (index, meta): (&[u32; WIDTH], &[u32; WIDTH]),
    ) {
        let [keys] = orders::<ANY, 1>([(near, met)]);
        self.put::<ANY>(keys, met, (index, meta));
    }

    /// Adds those of eight children that are in `met`, in an order of [`orders`].
    #[inline(always)]
    pub(super) fn put<const ANY: bool>(
        &mut self,
        keys: Keys,
        met: VectorMask<F32x8>,
        (index, meta): (&[u32; WIDTH], &[u32; WIDTH]),
    ) {
        let end = self.end;
        if !ANY {
            self.keys[end..][..WIDTH].copy_from_slice(&keys.to_array());
        }
        self.index[end..][..WIDTH].copy_from_slice(&keys.sort(index));
        self.meta[end..][..WIDTH].copy_from_slice(&keys.sort(meta));
        self.end = end + met.bits().count_ones() as usize;
    }

    /// Takes the reference and the description of what comes next; the latter is [`DONE`] if nothing does,
    /// and then there must be a start before anything else.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> (u32, u32) {
        self.end -= 1;
        (self.index[self.end], self.meta[self.end])
    }

    /// Drops what is on top and starts behind `distance`; eight at most.
    #[inline(always)]
    pub(super) fn drop_behind(&mut self, distance: f32) {
        let window: &[u32; WIDTH] =
            self.keys[self.end - WIDTH..self.end].try_into().expect("eight keys");
        self.end -= Keys::run_behind(window, distance);
    }
}
