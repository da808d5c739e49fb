//! `SceneBuilder` takes geometry, materials and lights; `build` makes an immutable [`Scene`].

use std::time::Instant;

use glam::Vec3;

use crate::bvh::{BuildQuality, Bvh, MAX_PRIMITIVES, PrimKind, Watch};
use crate::error::BuildError;
use crate::geometry::{Aabb, Mesh, Quads, Spheres};
use crate::scene::source::{Parts, Source};
use crate::scene::{Light, Material};

/// Triangles that no ray can hit, and that the scene left out. They keep their `prim_id`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Two corners are one point. (Three corners on a line stay: once rounded, as a ray sees them,
    /// they may have an area, and a closed mesh would leak there.)
    pub degenerate: usize,
    /// With a coordinate that is NaN or infinite.
    pub not_finite: usize,
}

/// Collects a scene. Geometries, materials and lights are numbered in the order in which they are
/// added, each from 0.
#[derive(Clone, Debug, Default)]
pub struct SceneBuilder {
    geometries: Vec<(Source, u32)>,
    materials: Vec<Material>,
    lights: Vec<Light>,
    quality: BuildQuality,
}

impl SceneBuilder {
    /// An empty scene with nothing in it.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a material and returns its number.
    pub fn add_material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        (self.materials.len() - 1) as u32
    }

    /// Adds a light.
    pub fn add_light(&mut self, light: Light) {
        self.lights.push(light);
    }

    /// How much work goes into the tree; [`BuildQuality::Balanced`] if this is not called.
    pub fn set_quality(&mut self, quality: BuildQuality) {
        self.quality = quality;
    }

    /// Adds spheres of one material and returns their `geom_id`.
    pub fn add_spheres(&mut self, spheres: Spheres, material: u32) -> u32 {
        self.add(Source::Spheres(spheres), material)
    }

    /// Adds parallelograms of one material and returns their `geom_id`.
    pub fn add_quads(&mut self, quads: Quads, material: u32) -> u32 {
        self.add(Source::Quads(quads), material)
    }

    /// Adds a triangle mesh of one material and returns its `geom_id`.
    pub fn add_mesh(&mut self, mesh: Mesh, material: u32) -> u32 {
        self.add(Source::Mesh(mesh), material)
    }

    fn add(&mut self, source: Source, material: u32) -> u32 {
        self.geometries.push((source, material));
        (self.geometries.len() - 1) as u32
    }

    /// Checks everything and builds the tree, on the rayon pool that it is called in. A scene
    /// without materials gets the default one, with number 0.
    ///
    /// # Errors
    /// [`BuildError`] names the geometry, the primitive and what would be right. Triangles without
    /// area or with corners that are not finite are no error; see [`Scene::dropped`].
    pub fn build(self) -> Result<Scene, BuildError> {
        self.build_watched(&Watch::new())
    }

    /// As [`SceneBuilder::build`], and tells `watch` how far it is.
    ///
    /// # Errors
    /// As [`SceneBuilder::build`]; [`BuildError::Cancelled`] if `watch` ended it.
    pub fn build_watched(self, watch: &Watch<'_>) -> Result<Scene, BuildError> {
        let Self { geometries: sources, mut materials, lights, quality } = self;
        if materials.is_empty() {
            materials.push(Material::default());
        }
        for (index, material) in materials.iter().enumerate() {
            let error = |why| BuildError::Appearance { what: "material", index, why };
            material.validate().map_err(error)?;
        }
        for (index, light) in lights.iter().enumerate() {
            let error = |why| BuildError::Appearance { what: "light", index, why };
            light.validate().map_err(error)?;
        }
        let count = sources.iter().map(|(source, _)| source.len() as u64).sum();
        if count > MAX_PRIMITIVES {
            return Err(BuildError::TooMany { count, max: MAX_PRIMITIVES });
        }
        let mut first_id = 0;
        let mut first_ids = Vec::with_capacity(sources.len());
        for (geom_id, (source, material)) in sources.iter().enumerate() {
            let geom_id = geom_id as u32;
            if *material as usize >= materials.len() {
                let (material, materials) = (*material, materials.len());
                return Err(BuildError::Material { geom_id, material, materials });
            }
            source.validate(geom_id)?;
            first_ids.push(first_id);
            first_id += source.len() as u32;
        }

        let start = Instant::now();
        let parts = Parts { sources: &sources, first_ids: &first_ids };
        let bvh = Bvh::build(count as usize, &parts, quality, watch);
        let bvh = bvh.map_err(|_| BuildError::Cancelled)?;
        let dropped = parts.dropped(&bvh.leaves);
        let build_seconds = start.elapsed().as_secs_f64();
        let geometries = sources
            .into_iter()
            .map(|(source, material)| Geometry {
                kind: source.kind(),
                count: source.len() as u32,
                material,
                normals: match source {
                    Source::Mesh(Mesh { indices, normals, .. }) if !normals.is_empty() => {
                        Some(VertexNormals { indices, normals })
                    }
                    _ => None,
                },
            })
            .collect();
        Ok(Scene { bvh, first_ids, geometries, materials, lights, dropped, build_seconds })
    }
}

/// A scene: immutable, shared freely between threads.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(super) bvh: Bvh,
    /// The id of the first primitive of each geometry.
    pub(super) first_ids: Vec<u32>,
    pub(super) geometries: Vec<Geometry>,
    materials: Vec<Material>,
    lights: Vec<Light>,
    dropped: Dropped,
    build_seconds: f64,
}

/// What is kept of a geometry beside its primitives.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    pub(super) kind: PrimKind,
    pub(super) count: u32,
    pub(super) material: u32,
    pub(super) normals: Option<VertexNormals>,
}

/// The shading normals of a mesh.
#[derive(Clone, Debug)]
pub(super) struct VertexNormals {
    pub(super) indices: Vec<[u32; 3]>,
    pub(super) normals: Vec<Vec3>,
}

impl Scene {
    /// The tree.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The box around everything; empty for an empty scene.
    pub fn bounds(&self) -> Aabb {
        self.bvh.bounds
    }

    /// How many geometries there are.
    pub fn geometry_count(&self) -> usize {
        self.geometries.len()
    }

    /// How many primitives of `kind` were given, dropped ones included.
    pub fn primitive_count(&self, kind: PrimKind) -> usize {
        let of_kind = self.geometries.iter().filter(|geometry| geometry.kind == kind);
        of_kind.map(|geometry| geometry.count as usize).sum()
    }

    /// The material of a geometry. Panics if there is no such geometry.
    pub fn material(&self, geom_id: u32) -> &Material {
        &self.materials[self.geometries[geom_id as usize].material as usize]
    }

    /// All materials.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The number of the material of a geometry. Panics if there is no such geometry.
    pub fn material_id(&self, geom_id: u32) -> u32 {
        self.geometries[geom_id as usize].material
    }

    /// All lights.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// The triangles that were left out.
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// The seconds that building the tree took.
    pub fn build_seconds(&self) -> f64 {
        self.build_seconds
    }

    /// The memory of the scene in bytes: tree, primitives, normals, tables.
    pub fn bytes(&self) -> usize {
        let normals: usize = self
            .geometries
            .iter()
            .filter_map(|geometry| geometry.normals.as_ref())
            .map(|of| 12 * (of.indices.capacity() + of.normals.capacity()))
            .sum();
        let tables = self.geometries.capacity() * size_of::<Geometry>()
            + self.first_ids.capacity() * size_of::<u32>()
            + self.materials.capacity() * size_of::<Material>()
            + self.lights.capacity() * size_of::<Light>();
        self.bvh.stats().bytes + normals + tables
    }
}
