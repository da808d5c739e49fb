//! Scenes: geometry, materials and lights together, and the queries over them.

mod batches;
mod builder;
mod camera;
mod file;
mod hit_primitives;
mod light;
mod material;
mod mesh_file;
mod obj;
mod ply;
mod queries;
mod settings;
mod source;
mod surface;
mod surfaces;
mod vectors;
mod visibility;

pub use builder::{Dropped, Scene, SceneBuilder};
pub use camera::{Camera, CameraError, View};
pub use file::{
    LoadError, LoadOptions, Loaded, Place, Problem, load, load_obj, load_ply, load_toml, load_with,
};
pub(crate) use hit_primitives::SharedPrimitive;
pub use light::{Light, LightShape};
pub use material::Material;
pub use settings::{
    MAX_BOUNCES, MAX_PIXELS, MAX_SAMPLES, MAX_SIDE, Settings, SettingsError, Shading,
};
pub use surface::Surface;
pub(crate) use surfaces::{HitLanes, SurfaceLanes};
pub(crate) use vectors::{LANES, Vectors, dot, normalized_or};
