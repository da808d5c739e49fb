//! Workloads: the rays that speed is measured with, and scenes to send them into.
//!
//! A [`Model`] is geometry with a [`Stage`], which is a camera and a light. Out of a scene and a
//! stage a [`Viewpoint`] makes each kind of [`Workload`], deterministically by seed. The set-up is
//! always the same, so that figures of different machines, engines and versions compare.
//!
//! This is a client of the queries: nothing else in the library knows of it.

mod chart;
mod lamps;
mod look;
mod measure;
mod model;
mod random;
mod rays;
pub mod scenes;
mod viewpoint;

pub use chart::{Bar, BarChart};
pub use lamps::Lamp;
pub use look::{Look, UnknownLook};
pub use measure::{Disagreement, Effort, Measurement, Path, measure};
pub use model::{Model, Part, Stage};
pub use rays::{Kind, Query, UnknownKind, Workload};
pub use viewpoint::{ShadowPoints, TILE, Viewpoint};
