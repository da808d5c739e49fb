//! The node of the tree: eight children side by side.
//!
//! Layout, 256 bytes on a 64-byte boundary: the six bounds as eight lanes each, then a reference
//! and a description for each child.
//!
//! Invariants:
//! - The children of a node are in the order that is best for any-hit queries: see `outlook`. Empty
//!   slots come last.
//! - An empty slot has the bounds `+inf .. -inf`, which no ray meets, and is a leaf of nothing.
//! - A leaf holds primitives of one kind.

use bytemuck::{Pod, Zeroable};

use crate::geometry::Aabb;

/// How many children a node has.
pub const WIDTH: usize = 8;
/// The most primitives that a leaf holds: one register of eight lanes.
pub const MAX_LEAF: usize = 8;

/// What a leaf holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum PrimKind {
    /// Triangles.
    Triangle = 0,
    /// Parallelograms.
    Quad = 1,
    /// Spheres.
    Sphere = 2,
}

impl PrimKind {
    /// All kinds, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Triangle, Self::Quad, Self::Sphere];
}

/// What one child slot of a node refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// Node number `0`.
    Inner(u32),
    /// `count` primitives of one kind from slot `first` of that kind's leaf array.
    Leaf {
        /// Their kind.
        kind: PrimKind,
        /// The slot of the first.
        first: u32,
        /// How many there are, 0 in an empty slot.
        count: u32,
    },
}

impl Child {
    /// What an empty slot holds.
    pub const EMPTY: Self = Self::Leaf { kind: PrimKind::Triangle, first: 0, count: 0 };

    /// The reference and the description as a node stores them.
    pub fn pack(self) -> (u32, u32) {
        match self {
            Self::Inner(node) => (node, 0),
            Self::Leaf { kind, first, count } => (first, LEAF | (kind as u32) << 8 | count),
        }
    }

    /// The same child once the nodes that it refers to have moved on by `places`.
    pub(super) fn moved(self, places: u32) -> Self {
        match self {
            Self::Inner(node) => Self::Inner(node + places),
            leaf => leaf,
        }
    }

    /// Where what a description belongs to lies: 0 for nodes, 1 and more for the kinds of leaves.
    #[inline(always)]
    pub fn shelf(meta: u32) -> usize {
        ((meta >> 31) + ((meta >> 8) & 3)) as usize
    }

    /// The inverse of [`Child::pack`].
    #[inline(always)]
    pub fn unpack(index: u32, meta: u32) -> Self {
        if meta & LEAF == 0 {
            Self::Inner(index)
        } else {
            let kind = match (meta >> 8) & 3 {
                0 => PrimKind::Triangle,
                1 => PrimKind::Quad,
                _ => PrimKind::Sphere,
            };
            Self::Leaf { kind, first: index, count: meta & 0xff }
        }
    }
}

/// The bit of a description that tells a leaf from an inner node.
pub const LEAF: u32 = 1 << 31;

/// Eight children: their boxes and what they refer to.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Node {
    /// `min.x, min.y, min.z, max.x, max.y, max.z` of the children, one lane a child.
    pub bounds: [[f32; WIDTH]; 6],
    /// A node number, or the first slot of a leaf.
    pub index: [u32; WIDTH],
    /// 0 for an inner node, else [`LEAF`], the kind and the count: see [`Child`].
    pub meta: [u32; WIDTH],
}

const _: () = assert!(size_of::<Node>() == 256 && align_of::<Node>() == 64);

impl Node {
    /// A node without children.
    pub fn empty() -> Self {
        let (index, meta) = Child::EMPTY.pack();
        let (inf, neg) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Self { bounds: [inf, inf, inf, neg, neg, neg], index: [index; WIDTH], meta: [meta; WIDTH] }
    }

    /// Fills slot `slot`.
    pub fn set(&mut self, slot: usize, bounds: &Aabb, child: Child) {
        for axis in 0..3 {
            self.bounds[axis][slot] = bounds.min[axis];
            self.bounds[3 + axis][slot] = bounds.max[axis];
        }
        (self.index[slot], self.meta[slot]) = child.pack();
    }

    /// The same node once the nodes that it refers to have moved on by `places`.
    pub(super) fn moved(&self, places: u32) -> Self {
        let mut node = *self;
        for (index, meta) in node.index.iter_mut().zip(node.meta) {
            *index += if meta & LEAF == 0 { places } else { 0 };
        }
        node
    }

    /// What slot `slot` refers to.
    #[inline(always)]
    pub fn child(&self, slot: usize) -> Child {
        Child::unpack(self.index[slot], self.meta[slot])
    }

    /// The box of slot `slot`.
    pub fn child_bounds(&self, slot: usize) -> Aabb {
        Aabb {
            min: std::array::from_fn(|axis| self.bounds[axis][slot]).into(),
            max: std::array::from_fn(|axis| self.bounds[3 + axis][slot]).into(),
        }
    }
}
