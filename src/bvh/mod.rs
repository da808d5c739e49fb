//! The tree over all primitives of a scene: built by boxes alone, eight children a node, leaves of
//! one kind in SoA arrays.
//!
//! `clusters` puts neighbours together, `crown` splits these, and `build` what is in them: a `binary`
//! tree of `primitive` boxes by the surface area heuristic (`binning`), once what is `outsized` is out of
//! the way, with a `plan` which of its nodes to keep. Its `quality` says how good it is: the best ends with `reinsert`, and the fastest is
//! made another way: `marks` on a `curve`, put in `order`, make a `linear` tree with a `roof`.
//! `collapse` turns either into `node`s of eight, whose `children` come in the order of their `outlook`. To
//! `lay` primitives out in leaf order makes the `leaves`. A `watch` sees how far that is. `validate`
//! checks what the traversals rely on, `stats` measures it.

mod binary;
mod binning;
mod build;
mod children;
mod clusters;
mod collapse;
mod crown;
mod curve;
mod lay;
mod leaves;
mod linear;
mod marks;
mod node;
mod order;
mod outlook;
mod outsized;
mod plan;
mod primitive;
mod quality;
mod reinsert;
mod roof;
mod stats;
#[cfg(test)]
mod tests;
mod validate;
mod watch;

pub use build::MAX_DEPTH;
pub use leaves::{
    DROPPED, Leaf, LeafArray, Leaves, MAX_PRIMITIVES, Primitive, QuadLeaves, SphereLeaves,
    TriangleLeaves,
};
pub use node::{Child, LEAF, MAX_LEAF, Node, PrimKind, WIDTH};
pub use primitive::BuildPrimitive;
pub use quality::{BuildQuality, UnknownBuild};
pub use stats::BvhStats;
pub use validate::BvhError;
pub use watch::{BuildProgress, Cancelled, Watch};

use glam::Vec3;
use rayon::prelude::*;

use primitive::PrimitiveKey;

use crate::geometry::Aabb;
use crate::pages::{Frozen, Term};
use crate::prefetch::{Shelf, Shelves};

/// Where a build gets the primitives from, by their ids. Each method is called with ids of its kind.
pub trait PrimitiveSource: Sync {
    /// A box that is probably little larger than the one around the centres of all primitives. The
    /// fastest build is sooner done if it is.
    fn guess(&self) -> Aabb {
        Aabb::EMPTY
    }
    /// The boxes of the primitives from this one on; also of those to be left out.
    fn boxes(&self, first: u32, into: &mut [BuildPrimitive]);
    /// The vertices of a triangle.
    fn triangle(&self, id: u32) -> [Vec3; 3];
    /// The corners of a quad in order around it.
    fn quad(&self, id: u32) -> [Vec3; 4];
    /// The centre and the radius of a sphere.
    fn sphere(&self, id: u32) -> (Vec3, f32);
}

/// The tree and its primitives. Immutable once built.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// The nodes; the root is the first. Empty for a scene without primitives.
    pub nodes: Frozen<Node>,
    /// The primitives, leaf by leaf.
    pub leaves: Leaves,
    /// The box around all of them.
    pub bounds: Aabb,
    /// The largest absolute coordinate of that box: the margins of the slab test grow with it.
    pub extent: f32,
    /// The number of nodes on the longest way from the root to a leaf; at most [`MAX_DEPTH`].
    pub depth: usize,
}

impl Bvh {
    /// Builds the tree over the primitives of `source`, whose ids are those below `ids`. The result
    /// does not depend on the number of threads; the build runs on the rayon pool that it is called
    /// in.
    ///
    /// # Errors
    /// [`Cancelled`] if `watch` ended it.
    pub fn build(
        ids: usize,
        source: &impl PrimitiveSource,
        quality: BuildQuality,
        watch: &Watch<'_>,
    ) -> Result<Self, Cancelled> {
        let term = if quality == BuildQuality::High { Term::Long } else { Term::Open };
        let (nodes, leaves, bounds, depth) = if quality == BuildQuality::Fast {
            let (tree, leaves, bounds) = linear::build(ids, source, watch)?;
            let (nodes, depth) = collapse::collapse_laid(&tree, watch)?;
            (nodes, leaves, bounds, depth)
        } else {
            let mut primitives = build::boxes(ids, source);
            if primitives.par_iter().any(BuildPrimitive::is_left_out) {
                primitives.retain(|one| !one.is_left_out());
            }
            let rounds = if quality == BuildQuality::High { reinsert::ROUNDS } else { 0 };
            watch.start(primitives.len() * (2 + rounds));
            let (tree, bounds) = build::build(&mut primitives, quality, watch)?;
            // Boxes are done with: their memory is needed for the leaves.
            let order: Vec<PrimitiveKey> = primitives.par_iter().map(PrimitiveKey::of).collect();
            drop(primitives);
            let (nodes, leaves, depth) =
                collapse::collapse(&tree, &order, ids, source, term, watch)?;
            (nodes, leaves, bounds, depth)
        };
        let extent = if bounds.is_empty() {
            0.0
        } else {
            bounds.min.abs().max(bounds.max.abs()).max_element()
        };
        let bvh = Self { nodes, leaves, bounds, extent, depth };
        debug_assert_eq!(bvh.validate(), Ok(()));
        Ok(bvh)
    }

    /// The nodes and the leaves with their ids, in the order of [`Child::shelf`], to be asked for ahead.
    pub fn shelves(&self) -> Shelves<4> {
        fn leaf<const FIELDS: usize>(array: &LeafArray<FIELDS>) -> Shelf {
            Shelf::new(&array.fields, FIELDS, FIELDS * MAX_LEAF).beside(&array.ids)
        }
        Shelves::new([
            Shelf::new(&self.nodes, 1, 1),
            leaf(&self.leaves.triangles),
            leaf(&self.leaves.quads),
            leaf(&self.leaves.spheres),
        ])
    }
}
