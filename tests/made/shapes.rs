//! Made scenes: on a grid, where ties are everywhere, and chaotic ones.

use glam::Vec3;
use octray::{BuildQuality, Mesh, Quads, Scene, SceneBuilder, Spheres};

use super::Random;

/// One primitive as it is given to a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    Triangle([Vec3; 3]),
    /// Corner and edges.
    Quad([Vec3; 3]),
    Sphere(Vec3, f32),
}

/// The primitives of a scene, one geometry a kind: spheres, the mesh, quads.
#[derive(Clone, Debug, Default)]
pub struct Shapes(pub Vec<Shape>);

impl Shapes {
    pub fn triangle(&mut self, corners: [Vec3; 3]) {
        self.0.push(Shape::Triangle(corners));
    }

    /// Adds a quad; if a scene would refuse it, nothing.
    pub fn quad(&mut self, corner: Vec3, edge_u: Vec3, edge_v: Vec3) {
        if Quads::one(corner, edge_u, edge_v).validate(0).is_ok() {
            self.0.push(Shape::Quad([corner, edge_u, edge_v]));
        }
    }

    /// Adds a sphere; if a scene would refuse it, nothing.
    pub fn sphere(&mut self, center: Vec3, radius: f32) {
        if Spheres::one(center, radius).validate(0).is_ok() {
            self.0.push(Shape::Sphere(center, radius));
        }
    }

    /// The scene, with trees of every quality in turns.
    pub fn build(&self) -> Scene {
        self.build_with(BuildQuality::ALL[self.0.len() % BuildQuality::ALL.len()])
    }

    pub fn build_with(&self, quality: BuildQuality) -> Scene {
        let mut builder = self.builder();
        builder.set_quality(quality);
        builder.build().expect("made scenes are valid")
    }

    pub fn builder(&self) -> SceneBuilder {
        let (mut spheres, mut quads, mut mesh) =
            (Spheres::default(), Quads::default(), Mesh::default());
        for shape in &self.0 {
            match *shape {
                Shape::Sphere(center, radius) => spheres.push(center, radius),
                Shape::Quad([corner, edge_u, edge_v]) => quads.push(corner, edge_u, edge_v),
                Shape::Triangle(corners) => {
                    let first = mesh.positions.len() as u32;
                    mesh.positions.extend(corners);
                    mesh.indices.push([first, first + 1, first + 2]);
                }
            }
        }
        let mut builder = SceneBuilder::new();
        builder.add_spheres(spheres, 0);
        builder.add_mesh(mesh, 0);
        builder.add_quads(quads, 0);
        builder
    }

    /// A point on one of the primitives, or near it; often a corner or on an edge.
    pub fn point(&self, random: &mut Random) -> Vec3 {
        let weights = match random.below(4) {
            0 => random.pick(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            1 => {
                let part = random.unit();
                random.pick(&[[1.0 - part, part, 0.0], [0.0, part, 1.0 - part]])
            }
            _ => {
                let (u, v) = (random.unit(), random.unit());
                [1.0 - u.max(v), u.min(v), u.max(v) - u.min(v)]
            }
        };
        self.combination(random, weights)
    }

    /// A point in the plane of one of the primitives, inside it or not.
    pub fn plane_points(&self, random: &mut Random) -> (Vec3, Vec3) {
        let seed = random.next();
        let one = |random: &mut Random| {
            let (u, v) = (3.0 * random.signed(), 3.0 * random.signed());
            self.combination(&mut Random::new(seed, 0), [1.0 - u - v, u, v])
        };
        (one(random), one(random))
    }

    fn combination(&self, random: &mut Random, [a, b, c]: [f32; 3]) -> Vec3 {
        if self.0.is_empty() {
            return random.vec();
        }
        match self.0[random.below(self.0.len())] {
            Shape::Triangle(corners) => corners[0] * a + corners[1] * b + corners[2] * c,
            Shape::Quad([corner, edge_u, edge_v]) => corner + edge_u * b + edge_v * c,
            Shape::Sphere(center, radius) => center + random.dir() * radius,
        }
    }

    /// The size of the scene: the largest finite coordinate that is no outlier of bit-random ones.
    pub fn size(&self) -> f32 {
        let points = self.0.iter().map(|shape| match *shape {
            Shape::Triangle([a, ..]) | Shape::Quad([a, ..]) | Shape::Sphere(a, _) => a,
        });
        let size = points.fold(0.0, |size: f32, p| size.max(p.abs().max_element()));
        if size.is_finite() && size > 0.0 { size } else { 1.0 }
    }
}

/// Primitives with small whole coordinates: the same depth, corner and edge again and again.
pub fn grid(random: &mut Random, count: usize) -> Shapes {
    let mut shapes = Shapes::default();
    while shapes.0.len() < count {
        let at = random.grid(4);
        match random.below(4) {
            0 => shapes.sphere(at, 0.5 * (1 + random.below(3)) as f32),
            1 => shapes.quad(at, random.grid(4), random.grid(4)),
            _ => shapes.triangle([at, at + random.grid(4), at + random.grid(4)]),
        }
    }
    shapes
}

/// The kinds of chaotic scenes.
pub const CHAOS_KINDS: usize = 9;

/// Chaotic primitives; `kind` says in which way.
pub fn chaos(random: &mut Random, kind: usize, count: usize) -> Shapes {
    let mut shapes = Shapes::default();
    let scale = random.scale(-4, 4);
    let away = random.dir() * scale * random.scale(0, 6);
    let base = [random.vec() * scale, random.vec() * scale, random.vec() * scale];
    for _ in 0..count {
        let at = random.vec() * scale;
        match kind {
            // Of one size.
            0 => any(&mut shapes, random, at, 0.5 * scale),
            // All sizes mixed in one scene.
            1 => {
                let (far, size) = (random.scale(-8, 8), random.scale(-8, 8));
                let at = random.vec() * far;
                any(&mut shapes, random, at, size);
            }
            // Slivers: the third corner beside the line through the others.
            2 => {
                let other = at + random.vec() * scale * random.scale(-3, 1);
                let middle = at + (other - at) * (2.0 * random.unit() - 0.5);
                shapes.triangle([at, other, random.vec_beside(middle)]);
                shapes.quad(at, other - at, random.vec_beside(middle) - at);
            }
            // Needles: two corners beside each other, the third far away.
            3 => {
                let far = random.vec() * scale * 10.0;
                shapes.triangle([at, random.vec_beside(at), far]);
                shapes.sphere(at, scale * random.scale(-6, 0));
            }
            // One primitive again and again, and nested ones.
            4 => match random.below(4) {
                0 => shapes.triangle(base),
                1 => shapes.quad(base[0], base[1] - base[0], base[2] - base[0]),
                2 => shapes.sphere(base[0], scale),
                _ => {
                    shapes.sphere(base[0], scale * random.unit());
                    let part = random.unit();
                    shapes.triangle(base.map(|p| p * part));
                }
            },
            // Overlapping and almost in one plane.
            5 => {
                let mut in_plane = || {
                    let (u, v) = (random.signed(), random.signed());
                    let p = base[0] + (base[1] - base[0]) * u + (base[2] - base[0]) * v;
                    random.vec_beside(p)
                };
                let corners = [in_plane(), in_plane(), in_plane()];
                shapes.triangle(corners);
                let [a, b, c] = corners;
                shapes.quad(a, b - a, c - a);
            }
            // Far away from zero.
            6 => any(&mut shapes, random, away + at, 0.5 * scale),
            // Flat boxes: corners that agree in a coordinate.
            7 => {
                let axis = random.below(3);
                let flat = |mut p: Vec3| {
                    p[axis] = base[0][axis];
                    p
                };
                let size = scale * random.scale(-2, 0);
                let corners = [at, at + random.vec() * size, at + random.vec() * size].map(flat);
                shapes.triangle(corners);
                shapes.quad(corners[0], corners[1] - corners[0], corners[2] - corners[0]);
            }
            // Any bits.
            _ => {
                let mut any = || Vec3::new(random.bits(), random.bits(), random.bits());
                let (a, b, c) = (any(), any(), any());
                shapes.triangle([a, b, c]);
                shapes.quad(a, b, c);
                shapes.sphere(a, b.x.abs());
            }
        }
    }
    shapes
}

fn any(shapes: &mut Shapes, random: &mut Random, at: Vec3, size: f32) {
    match random.below(4) {
        0 => shapes.sphere(at, size * random.unit()),
        1 => shapes.quad(at, random.vec() * size, random.vec() * size),
        _ => shapes.triangle([at, at + random.vec() * size, at + random.vec() * size]),
    }
}
