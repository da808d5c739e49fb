//! Counts of what traversals visit, in a build with the feature `stats`; nothing otherwise.
//!
//! Each thread counts for itself. Read and clear the counts of one thread with [`take`]; `octray bench`
//! prints them.

/// What the traversals of one thread visited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Visits {
    /// Tiles whose rays all run through one point.
    pub cones: u64,
    /// Tiles whose groups have bounds of their own.
    pub beams: u64,
    /// Rays that were traced one by one.
    pub singles: u64,
    /// Nodes entered, by a tile or by a single ray.
    pub nodes: u64,
    /// Box tests of a group with its own rays.
    pub box_groups: u64,
    /// Leaves entered.
    pub leaves: u64,
    /// Primitives of a leaf that a tile tested with any group.
    pub primitives: u64,
    /// Tests of a primitive with one register of a group's rays, or with a single ray.
    pub primitive_groups: u64,
    /// Such tests in which some ray met the primitive.
    pub met_groups: u64,
}

#[cfg(feature = "stats")]
thread_local! {
    static VISITS: std::cell::Cell<Visits> = const { std::cell::Cell::new(Visits {
        cones: 0, beams: 0, singles: 0, nodes: 0, box_groups: 0, leaves: 0, primitives: 0,
        primitive_groups: 0, met_groups: 0,
    }) };
}

/// Adds to this thread's counts.
#[inline(always)]
pub(super) fn count(_add: impl FnOnce(&mut Visits)) {
    #[cfg(feature = "stats")]
    VISITS.with(|visits| {
        let mut counts = visits.get();
        _add(&mut counts);
        visits.set(counts);
    });
}

/// The counts of this thread since the last call; `None` in a build without them.
pub fn take() -> Option<Visits> {
    #[cfg(feature = "stats")]
    return Some(VISITS.with(std::cell::Cell::take));
    #[cfg(not(feature = "stats"))]
    None
}
