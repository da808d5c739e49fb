//! The errors of the library's boundaries: building a scene and shaping a query.
//!
//! Files have their own in [`crate::scene`]; pictures in [`crate::render`].

use thiserror::Error;

/// Arrays of a query that should have one length and have not.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("`{name}` has {len} entries where `{other}` has {other_len}: give them one length")]
pub struct ShapeError {
    /// The array that differs.
    pub name: &'static str,
    /// Its length.
    pub len: usize,
    /// The array that it is compared with.
    pub other: &'static str,
    /// The length of that one.
    pub other_len: usize,
}

impl ShapeError {
    pub(crate) fn check(
        name: &'static str,
        len: usize,
        other: &'static str,
        other_len: usize,
    ) -> Result<(), Self> {
        if len == other_len { Ok(()) } else { Err(Self { name, len, other, other_len }) }
    }
}

/// What is wrong with a geometry, a material or a light.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BuildError {
    /// A sphere whose centre is not finite or whose radius is not a positive finite number.
    #[error(
        "sphere {prim_id} of geometry {geom_id} has centre ({x}, {y}, {z}) and radius {radius}: \
         the centre must be finite and the radius finite and above zero"
    )]
    Sphere {
        /// The geometry.
        geom_id: u32,
        /// The sphere in it.
        prim_id: u32,
        /// Its centre.
        x: f32,
        /// Its centre.
        y: f32,
        /// Its centre.
        z: f32,
        /// Its radius.
        radius: f32,
    },
    /// A quad with a corner that is not finite, or without area.
    #[error(
        "quad {prim_id} of geometry {geom_id} {why}: give a finite corner and two finite edges \
         that are not parallel"
    )]
    Quad {
        /// The geometry.
        geom_id: u32,
        /// The quad in it.
        prim_id: u32,
        /// What is wrong.
        why: &'static str,
    },
    /// A triangle names a vertex that is not there.
    #[error(
        "triangle {prim_id} of geometry {geom_id} names vertex {index}, and there are {vertices}: \
         indices count from 0"
    )]
    Index {
        /// The geometry.
        geom_id: u32,
        /// The triangle in it.
        prim_id: u32,
        /// The index that it has.
        index: u32,
        /// How many vertices the mesh has.
        vertices: usize,
    },
    /// SoA arrays of different lengths.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A material id that no `add_material` returned.
    #[error("geometry {geom_id} has material {material}, and there are {materials}")]
    Material {
        /// The geometry.
        geom_id: u32,
        /// The material that it names.
        material: u32,
        /// How many materials there are.
        materials: usize,
    },
    /// A material or light with a number that is out of its range.
    #[error("{what} {index}: {why}")]
    Appearance {
        /// `material` or `light`.
        what: &'static str,
        /// Which one, from 0.
        index: usize,
        /// What is wrong and what would be right.
        why: String,
    },
    /// More primitives than ids.
    #[error("{count} primitives: one scene holds at most {max}; split it")]
    TooMany {
        /// How many there are.
        count: u64,
        /// How many fit.
        max: u64,
    },
    /// Whoever watched the build ended it.
    #[error("the build was cancelled")]
    Cancelled,
}
