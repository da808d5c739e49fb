//! The keys of a scene file, as serde reads them: names and types, no ranges.
//!
//! Every value that can be wrong carries its span, so that an error found later still has a line
//! and a column. `docs/scene-files.md` documents each key; a test holds it to this file.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use super::values::{Matrix, Number, OneOrThree, Rotation, Triple, Whole};

/// A key that may be left out.
pub(super) type Key<T> = Option<Spanned<T>>;

/// A whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a scene file")]
pub(super) struct SceneKeys {
    pub(super) camera: Key<CameraKeys>,
    #[serde(default)]
    pub(super) render: RenderKeys,
    #[serde(default)]
    pub(super) materials: BTreeMap<String, MaterialKeys>,
    #[serde(default)]
    pub(super) lights: Vec<Spanned<LightKeys>>,
    #[serde(default)]
    pub(super) spheres: Vec<SphereKeys>,
    #[serde(default)]
    pub(super) quads: Vec<Spanned<QuadKeys>>,
    #[serde(default)]
    pub(super) meshes: Vec<Spanned<MeshKeys>>,
}

/// `[camera]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table [camera]")]
pub(super) struct CameraKeys {
    pub(super) eye: Spanned<Triple>,
    pub(super) target: Spanned<Triple>,
    pub(super) up: Key<Triple>,
    pub(super) vertical_fov: Key<Number>,
}

/// `[render]`
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table [render]")]
pub(super) struct RenderKeys {
    pub(super) width: Key<Whole>,
    pub(super) height: Key<Whole>,
    pub(super) spp: Key<Whole>,
    pub(super) shadow_samples: Key<Whole>,
    pub(super) max_bounces: Key<Whole>,
    pub(super) seed: Key<Whole>,
    pub(super) background: Key<OneOrThree>,
    pub(super) shading: Option<ShadingName>,
    pub(super) build: Option<BuildName>,
}

/// `build`
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum BuildName {
    Fast,
    Balanced,
    High,
}

/// `shading`
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ShadingName {
    Phong,
    Flat,
}

/// `[materials.NAME]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table [materials.NAME]")]
pub(super) struct MaterialKeys {
    pub(super) color: Key<OneOrThree>,
    pub(super) ambient: Key<OneOrThree>,
    pub(super) diffuse: Key<OneOrThree>,
    pub(super) specular: Key<OneOrThree>,
    pub(super) shininess: Key<Number>,
    pub(super) mirror: Key<Number>,
}

/// `[[lights]]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table [[lights]]")]
pub(super) struct LightKeys {
    #[serde(rename = "type")]
    pub(super) kind: LightName,
    pub(super) position: Key<Triple>,
    pub(super) corner: Key<Triple>,
    pub(super) edge_u: Key<Triple>,
    pub(super) edge_v: Key<Triple>,
    pub(super) intensity: Key<OneOrThree>,
    pub(super) ambient: Key<OneOrThree>,
    pub(super) diffuse: Key<OneOrThree>,
    pub(super) specular: Key<OneOrThree>,
}

/// `type` of a light
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum LightName {
    Point,
    Area,
}

/// `[[spheres]]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table [[spheres]]")]
pub(super) struct SphereKeys {
    pub(super) center: Spanned<Triple>,
    pub(super) radius: Spanned<Number>,
    pub(super) material: Key<String>,
}

/// `[[quads]]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table [[quads]]")]
pub(super) struct QuadKeys {
    pub(super) corner: Spanned<Triple>,
    pub(super) edge_u: Spanned<Triple>,
    pub(super) edge_v: Spanned<Triple>,
    pub(super) material: Key<String>,
}

/// `[[meshes]]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table [[meshes]]")]
pub(super) struct MeshKeys {
    pub(super) path: Key<String>,
    pub(super) generate: Key<MeshName>,
    pub(super) material: Key<String>,
    pub(super) scale: Key<OneOrThree>,
    pub(super) rotate: Key<Rotation>,
    pub(super) translate: Key<Triple>,
    pub(super) matrix: Key<Matrix>,
    pub(super) p: Key<Whole>,
    pub(super) q: Key<Whole>,
    pub(super) radius: Key<Number>,
    pub(super) spread: Key<Number>,
    pub(super) tube: Key<Number>,
    pub(super) segments: Key<Whole>,
    pub(super) sides: Key<Whole>,
    pub(super) subdivisions: Key<Whole>,
    pub(super) size: Key<OneOrThree>,
}

/// `generate`
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum MeshName {
    Knot,
    Icosphere,
    Cuboid,
}
