//! octray: a data-oriented SIMD packet ray tracer.
//!
//! A [`Scene`] is built once, of spheres, quads and triangle meshes, and never changes. Rays go in
//! and hits come out as arrays field by field (SoA) that the caller owns; neighbours that run alike
//! are traced together, in registers of eight or sixteen. Every query gives the same bits: one ray,
//! eight, a batch, on one thread or many, and the scalar reference that tries every primitive.
//!
//! # Example
//!
//! ```
//! use octray::glam::Vec3;
//! use octray::{HitBatch, Mesh, Ray, RayBatch, SceneBuilder, Spheres};
//!
//! let mut builder = SceneBuilder::new();
//! let material = builder.add_material(Default::default());
//! let ball = builder.add_spheres(Spheres::one(Vec3::ZERO, 1.0), material);
//! let ground = builder.add_mesh(
//!     Mesh {
//!         positions: vec![
//!             Vec3::new(-9.0, -1.0, -9.0),
//!             Vec3::new(9.0, -1.0, -9.0),
//!             Vec3::new(0.0, -1.0, 9.0),
//!         ],
//!         indices: vec![[0, 1, 2]],
//!         ..Mesh::default()
//!     },
//!     material,
//! );
//! let scene = builder.build()?;
//!
//! let down = Ray::new(Vec3::new(0.0, 5.0, 0.0), Vec3::NEG_Y);
//! let hit = scene.intersect(&down).expect("the ball is below");
//! assert_eq!((hit.geom_id, hit.t), (ball, 4.0));
//!
//! let mut rays = RayBatch::default();
//! for step in 0..1000 {
//!     rays.push(&Ray::new(Vec3::new(step as f32 * 0.01, 5.0, 0.0), Vec3::NEG_Y));
//! }
//! let mut hits = HitBatch::new(rays.len());
//! scene.par_intersect_batch(rays.as_rays(), hits.as_hits())?;
//! assert_eq!(hits.get(0), hit);
//! assert_eq!(hits.get(200).geom_id, ground);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Where to look
//!
//! - [`SceneBuilder`] makes a scene from arrays, [`load`] from a TOML, OBJ or PLY file.
//! - [`Scene::intersect`] and [`Scene::occluded`] are the queries for one ray; `_packet` is for
//!   eight, `_batch` for any number on this thread, `par_.._batch` on the rayon pool.
//! - [`Scene::surface`] gives position, normals and material of a hit, and where rays that leave it
//!   start.
//! - [`render::Renderer`] makes pictures: Phong shading, shadows, mirrors.
//! - [`workload`] makes the rays that speed is measured with.
//!
//! # Layers
//!
//! A module uses only those above it in this list; `ARCHITECTURE.md` says more, and a test holds
//! the imports to it.
//!
//! [`error`], [`instruction_sets`], [`simd`], [`pages`], [`columns`], [`prefetch`], [`share_out`], [`ray`], [`rows`], [`batch_rays`], [`hit`], [`points`], [`geometry`], [`kernels`], [`bvh`],
//! [`traverse`], [`scene`], [`shading`], [`render`], [`workload`].
//!
//! # Builds
//!
//! The kernels are compiled for one target. A checkout builds for the CPU that it is on; as a
//! dependency, octray is built as its user's flags say. Without AVX2 and FMA it is slow: set
//! `RUSTFLAGS="-C target-cpu=native"`. [`InstructionSets`] tells what a build leaves unused. Hits
//! have the same bits in all builds.
//!
//! # Features
//!
//! - `stats`: counts what traversals visit, see [`traverse::visits`]. Off by default: it costs speed.

pub mod batch_rays;
pub mod bvh;
pub mod columns;
pub mod error;
pub mod geometry;
pub mod hit;
pub mod instruction_sets;
pub mod kernels;
pub mod pages;
pub mod points;
pub mod prefetch;
pub mod ray;
pub mod render;
pub mod rows;
pub mod scene;
pub mod shading;
pub mod share_out;
pub mod simd;
pub mod traverse;
pub mod workload;

pub use batch_rays::BatchRays;
pub use bvh::BuildQuality;
pub use columns::Column;
pub use error::{BuildError, ShapeError};
pub use geometry::{Aabb, Mesh, Quads, Spheres};
pub use glam;
pub use hit::{Hit, HitBatch, HitPacket, Hits, NO_HIT};
pub use instruction_sets::InstructionSets;
pub use points::{LightSamples, Points, SHADOW_T_MAX, SampleArrays};
pub use ray::{PACKET_LANES, Ray, RayBatch, RayPacket, Rays};
pub use rows::{Ends, RayRows, Rows};
pub use scene::{
    Camera, Light, LightShape, LoadError, Loaded, Material, Scene, SceneBuilder, Settings, Shading,
    load,
};

/// The example of the README, compiled and run by `cargo test`.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
