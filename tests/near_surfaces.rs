//! Points that lie close above or below a surface, as shading points do, and what they see of a light: what
//! `occluded` says of the same rays, bit for bit, and mostly without one.

mod made;

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec3;
use made::{Random, run};
use octray::error::ShapeError;
use octray::*;

/// Samples of each point.
const SAMPLES: usize = 16;

/// Half the distance between 1 and the next float: what rounding is measured in.
const UNIT: f32 = f32::EPSILON * 0.5;

/// A large primitive, and another that is close behind the light, both at any place.
struct Setting {
    shape: usize,
    corner: Vec3,
    edges: [Vec3; 2],
    scale: f32,
}

impl Setting {
    fn new(random: &mut Random) -> Self {
        let scale = random.scale(-5, 5);
        let far = [0.0, 0.0, 1.0, 30.0][random.below(4)];
        let mut edge = || {
            let mut edge = random.vec() * scale;
            // Planes along axes have no error of their own.
            if random.once_in(3) {
                edge[random.below(3)] = 0.0;
            }
            edge
        };
        let edges = [edge(), edge()];
        let corner = random.vec() * scale * far - (edges[0] + edges[1]) * 0.5;
        Self { shape: random.below(3), corner, edges, scale }
    }

    fn normal(&self) -> Vec3 {
        let [u, v] = self.edges.map(|edge| edge.as_dvec3());
        u.cross(v).normalize_or(glam::DVec3::Y).as_vec3()
    }

    fn add(&self, builder: &mut SceneBuilder, away: Vec3) {
        let (corner, [u, v]) = (self.corner + away, self.edges);
        match self.shape {
            0 => _ = builder.add_quads(Quads::one(corner, u, v), 0),
            1 => {
                let positions = vec![corner, corner + u, corner + v];
                let mesh = Mesh { positions, indices: vec![[0, 1, 2]], normals: Vec::new() };
                builder.add_mesh(mesh, 0);
            }
            _ => _ = builder.add_spheres(Spheres::one(corner, self.scale * 0.7), 0),
        }
    }

    /// A point of the surface, and the normal there.
    fn at(&self, random: &mut Random) -> (Vec3, Vec3) {
        if self.shape == 2 {
            let out = random.dir();
            return (self.corner + out * self.scale * 0.7, out);
        }
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if self.shape == 1 && u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        (self.corner + self.edges[0] * u + self.edges[1] * v, self.normal())
    }
}

#[test]
fn points_close_to_surfaces_see_what_their_rays_do() {
    run("visibility, near surfaces", 92, 4000, |random, _| {
        let setting = Setting::new(random);
        let (middle, normal) = setting.at(random);
        if setting.normal().cross(setting.edges[0]).length() < 1e-3 * setting.scale {
            return 0;
        }
        let scale = setting.scale;
        // Above, below, and nearly in the plane.
        let height = [1.0, -1.0, 0.3, 0.01, 1e-4, 1e-6][random.below(6)] * scale;
        let aside = random.vec() * scale;
        let width = scale * [1.0, 0.1, 1e-3][random.below(3)];
        let (edge_u, edge_v) = (random.vec() * width, random.vec() * width);
        // In the plane of the primitive, now and then: then all heights are the same.
        let flat = random.once_in(2);
        let level = |v: Vec3| if flat { v - normal * v.dot(normal) } else { v };
        let (edge_u, edge_v) = (level(edge_u), level(edge_v));
        let corner = middle + normal * height + level(aside) - (edge_u + edge_v) * 0.5;
        let light = LightShape::Quad { corner, edge_u, edge_v };

        let mut builder = SceneBuilder::new();
        setting.add(&mut builder, Vec3::ZERO);
        if random.once_in(2) {
            let behind = [1.0, 1.01, 1.0 + 1e-4, 1.0 + 1e-6, 0.9999][random.below(5)];
            setting.add(&mut builder, normal * height * behind);
        }
        let Ok(scene) = builder.build() else { return 0 };

        let mut position = [const { Vec::new() }; 3];
        let (mut u, mut v) = (Vec::new(), Vec::new());
        let reach = setting.corner.abs().max_element() + scale;
        // About where kernels begin to tell both sides apart.
        let steps = [1.0, 4.0, 12.0, 100.0, 1e4][random.below(5)];
        for _ in 0..64 {
            let (on, out) = setting.at(random);
            let off = out * (random.signed() * steps * UNIT * reach);
            let point = random.vec_beside(on + off);
            (0..3).for_each(|axis| position[axis].push(point[axis]));
            for _ in 0..SAMPLES {
                u.push(if random.once_in(8) { 0.0 } else { random.unit() });
                v.push(if random.once_in(8) { 1.0 } else { random.unit() });
            }
        }
        let [x, y, z] = &position;
        let points = Points::new(x, y, z).unwrap();
        let samples = SampleArrays::new(&u, &v, SAMPLES).unwrap();
        let rays: RayBatch = (0..u.len())
            .map(|ray| {
                let origin = points.position(ray / SAMPLES);
                let dir = light.at(u[ray], v[ray]) - origin;
                Ray { origin, dir, t_min: 0.0, t_max: SHADOW_T_MAX }
            })
            .collect();
        let mut occluded = vec![false; rays.len()];
        scene.occluded_batch(rays.as_rays(), &mut occluded).unwrap();
        let mut seen = vec![false; rays.len()];
        scene.visible_samples(&points, &light, &samples, &mut seen).unwrap();
        for (ray, (seen, occluded)) in seen.iter().zip(&occluded).enumerate() {
            assert_eq!(seen, &!occluded, "{ray}: {:?}", rays.as_rays().get(ray));
        }
        rays.len() as u64
    });
}

/// Samples in the middle of the light that count who asks for them.
struct Asked(AtomicUsize);

impl LightSamples for Asked {
    fn per_point(&self) -> usize {
        SAMPLES
    }

    fn check(&self, _: usize) -> Result<(), ShapeError> {
        Ok(())
    }

    fn place(&self, _: usize, u: &mut [f32], v: &mut [f32]) {
        self.0.fetch_add(1, Ordering::Relaxed);
        u.fill(0.5);
        v.fill(0.5);
    }
}

/// A room with a lamp below its ceiling and a ball of triangles: all that shades a point is its own surface.
#[test]
fn points_of_lit_surfaces_ask_for_no_samples() {
    let mut builder = SceneBuilder::new();
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let room = [
        (Vec3::new(-1.0, 0.0, 1.0), x, -z),
        (Vec3::new(-1.0, 2.0, -1.0), x, z),
        (Vec3::new(-1.0, 0.0, -1.0), x, y),
        (Vec3::new(-1.0, 0.0, 1.0), -z, y),
        (Vec3::new(1.0, 0.0, -1.0), z, y),
    ];
    for (corner, edge_u, edge_v) in room {
        builder.add_quads(Quads::one(corner, edge_u, edge_v), 0);
    }
    builder.add_spheres(Spheres::one(Vec3::new(0.6, 0.3, 0.0), 0.3), 0);
    let mut ball = octray::geometry::shapes::icosphere(3);
    ball.positions.iter_mut().for_each(|at| *at = *at * 0.3 + Vec3::new(-0.5, 0.31, 0.2));
    builder.add_mesh(ball, 0);
    let scene = builder.build().unwrap();
    let light = LightShape::Quad {
        corner: Vec3::new(-0.35, 1.98, -0.35),
        edge_u: Vec3::X * 0.7,
        edge_v: Vec3::Z * 0.7,
    };
    let (mut position, mut normal) = ([const { Vec::new() }; 3], [const { Vec::new() }; 3]);
    for pixel in 0..256 * 256 {
        let (row, column) = (pixel / 256, pixel % 256);
        let at = |place: i32| (place as f32 + 0.5) / 128.0 - 1.0;
        let ray =
            Ray::new(Vec3::new(0.0, 1.0, 4.1), Vec3::new(at(column) * 0.35, -at(row) * 0.35, -1.0));
        let Some(hit) = scene.intersect(&ray) else { continue };
        let surface = scene.surface(&ray, &hit);
        let out = surface.geometric_normal;
        let out = if out.dot(ray.dir) > 0.0 { -out } else { out };
        let origin = surface.offset_origin(out);
        for axis in 0..3 {
            position[axis].push(origin[axis]);
            normal[axis].push(out[axis]);
        }
    }
    let [x, y, z] = &position;
    let [nx, ny, nz] = &normal;
    let points = Points::new(x, y, z).unwrap().with_normals(nx, ny, nz).unwrap();
    let asked = Asked(AtomicUsize::new(0));
    let mut fraction = vec![0.0; x.len()];
    scene.visibility(&points, &light, &asked, &mut fraction).unwrap();
    let (asked, lit) = (asked.0.into_inner(), fraction.iter().filter(|&&seen| seen > 0.0).count());
    assert!(lit > 50_000, "{lit} of {}", x.len());
    assert!(asked * 3 < x.len(), "{asked} of {} points ask", x.len());
}
