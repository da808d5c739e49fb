//! What the tests are made of, in one place: seeded numbers, scenes, rays and closed meshes.
//!
//! Everything follows from a seed alone and is the same on every machine: no function here calls
//! the platform's mathematical library. Each test file uses a part of it.
#![allow(dead_code, unused_imports, unreachable_pub, clippy::print_stdout)]

pub mod closed;
pub mod random;
pub mod rays;
pub mod shapes;

pub use random::{Random, run};
pub use rays::{RAY_KINDS, rays};
pub use shapes::{CHAOS_KINDS, Shapes, chaos};
