//! Geometry: spheres, quads and triangle meshes as the caller gives them, and their boxes.
//!
//! No ray code lives here. A scene copies what it needs out of these into its own leaf arrays
//! (see [`crate::bvh`]) and drops the rest.

mod aabb;
mod mesh;
pub(crate) mod polygon;
mod quads;
pub mod shapes;
mod spheres;

pub use aabb::Aabb;
pub use mesh::Mesh;
pub use quads::Quads;
pub use spheres::Spheres;
