//! Models: plain geometry with a camera and a light, before any engine has built a tree of it.

use glam::Vec3;

use crate::bvh::{PrimKind, Primitive};
use crate::error::BuildError;
use crate::geometry::{Aabb, Mesh, Quads, Spheres};
use crate::scene::{Camera, LightShape, Scene, SceneBuilder};

/// Where rays come from and where shadow rays go to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// The camera of the primary rays.
    pub camera: Camera,
    /// The light of the soft shadows; hard shadows go to its middle.
    pub light: LightShape,
    /// The size of the model in scene units: offsets and distances are fractions of it.
    pub diagonal: f32,
}

impl Stage {
    /// The stage for a model of these bounds: the camera 1.1 diagonals from the middle in the
    /// direction (0.35, 0.35, 1), 40 degrees high; a horizontal light, a quarter diagonal wide, at
    /// (0.3, 1.2, 0.5) diagonals from the middle.
    pub fn framing(bounds: &Aabb) -> Self {
        let diagonal = bounds.diagonal();
        let light_center = bounds.center() + Vec3::new(0.3, 1.2, 0.5) * diagonal;
        Self {
            camera: Camera::framing(bounds),
            light: horizontal_light(light_center, 0.25 * diagonal),
            diagonal,
        }
    }

    /// The stage of a scene that has a camera: its first area light, or one as in
    /// [`Stage::framing`] if it has none.
    pub fn of_scene(scene: &Scene, camera: Camera) -> Self {
        let framing = Self::framing(&scene.bounds());
        let mut lights = scene.lights().iter().map(|light| light.shape);
        let light = lights.find(|shape| matches!(shape, LightShape::Quad { .. }));
        Self { camera, light: light.unwrap_or(framing.light), ..framing }
    }
}

/// A square light around `center`, across the y axis.
pub(super) fn horizontal_light(center: Vec3, width: f32) -> LightShape {
    LightShape::Quad {
        corner: center - Vec3::new(0.5 * width, 0.0, 0.5 * width),
        edge_u: Vec3::new(width, 0.0, 0.0),
        edge_v: Vec3::new(0.0, 0.0, width),
    }
}

/// One geometry of a model.
#[derive(Clone, Debug)]
pub enum Part {
    /// Triangles.
    Mesh(Mesh),
    /// Spheres.
    Spheres(Spheres),
    /// Parallelograms.
    Quads(Quads),
}

impl Part {
    /// How many primitives it has.
    pub fn len(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.len(),
            Self::Spheres(spheres) => spheres.len(),
            Self::Quads(quads) => quads.len(),
        }
    }

    /// True if it has none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Geometry with a stage. The number of a part is its `geom_id`.
#[derive(Clone, Debug)]
pub struct Model {
    /// What tables call it.
    pub name: String,
    /// Its geometries.
    pub parts: Vec<Part>,
    /// Its camera and light.
    pub stage: Stage,
}

impl Model {
    /// A mesh on a ground quad, which is four diagonals wide and lies under the lowest point.
    pub fn on_ground(name: &str, mesh: Mesh) -> Self {
        let bounds = Aabb::of_points(&mesh.positions);
        let ground = ground_under(&bounds);
        let parts = vec![Part::Mesh(mesh), Part::Quads(ground)];
        Self { name: name.into(), parts, stage: Stage::framing(&bounds) }
    }

    /// As [`Model::on_ground`] with the triangles of a scene, each with vertices of its own: for
    /// meshes that were loaded as a scene. Panics if the scene has spheres or quads as well.
    pub fn triangles_on_ground(name: &str, scene: &Scene) -> Self {
        let others = [PrimKind::Sphere, PrimKind::Quad].map(|kind| scene.primitive_count(kind));
        assert_eq!(others, [0, 0], "only triangles can be put on the ground");
        let mut mesh = Mesh::default();
        for id in 0..scene.primitive_count(PrimKind::Triangle) as u32 {
            if let Some(Primitive::Triangle(corners)) =
                scene.bvh().leaves.primitive(PrimKind::Triangle, id)
            {
                let first = mesh.positions.len() as u32;
                mesh.positions.extend(corners);
                mesh.indices.push([first, first + 1, first + 2]);
            }
        }
        Self::on_ground(name, mesh)
    }

    /// How many primitives there are.
    pub fn primitive_count(&self) -> usize {
        self.parts.iter().map(Part::len).sum()
    }

    /// A copy of the geometry, ready to build.
    pub fn builder(&self) -> SceneBuilder {
        let mut builder = SceneBuilder::new();
        for part in self.parts.iter().cloned() {
            match part {
                Part::Mesh(mesh) => builder.add_mesh(mesh, 0),
                Part::Spheres(spheres) => builder.add_spheres(spheres, 0),
                Part::Quads(quads) => builder.add_quads(quads, 0),
            };
        }
        builder
    }

    /// Builds the scene, on the rayon pool that it is called in.
    ///
    /// # Errors
    /// See [`SceneBuilder::build`].
    pub fn scene(&self) -> Result<Scene, BuildError> {
        self.builder().build()
    }
}

/// The ground below `bounds`: its normal is up.
pub(super) fn ground_under(bounds: &Aabb) -> Quads {
    let width = 4.0 * bounds.diagonal();
    let (center, low) = (bounds.center(), bounds.min.y);
    let corner = Vec3::new(center.x - 0.5 * width, low, center.z - 0.5 * width);
    Quads::one(corner, Vec3::new(0.0, 0.0, width), Vec3::new(width, 0.0, 0.0))
}
