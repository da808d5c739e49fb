//! What points see of a light is what `occluded` says of the same rays, bit for bit.

mod made;

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use made::{Random, run};
use octray::*;

/// Points, samples and a light.
#[derive(Default)]
struct Case {
    position: [Vec<f32>; 3],
    normal: [Vec<f32>; 3],
    u: Vec<f32>,
    v: Vec<f32>,
    per_point: usize,
}

impl Case {
    fn push(&mut self, random: &mut Random, position: Vec3, normal: Vec3) {
        // Corners and edges of the light are where it matters.
        let mut at = || match random.below(8) {
            0 => 0.0,
            1 => 1.0,
            _ => random.unit(),
        };
        self.push_with(position, normal, |_| (at(), at()));
    }

    fn push_with(
        &mut self,
        position: Vec3,
        normal: Vec3,
        mut place: impl FnMut(usize) -> (f32, f32),
    ) {
        for axis in 0..3 {
            self.position[axis].push(position[axis]);
            self.normal[axis].push(normal[axis]);
        }
        for sample in 0..self.per_point {
            let (u, v) = place(sample);
            self.u.push(u);
            self.v.push(v);
        }
    }

    /// Compares every way to ask, and returns how many samples are seen and how many are not.
    fn check(&self, scene: &Scene, light: &LightShape) -> [usize; 2] {
        let [x, y, z] = &self.position;
        let [nx, ny, nz] = &self.normal;
        let all = Points::new(x, y, z).unwrap();
        let samples = SampleArrays::new(&self.u, &self.v, self.per_point).unwrap();
        let mut counts = [0; 2];
        for points in [all, all.with_normals(nx, ny, nz).unwrap()] {
            let rays: RayBatch = (0..self.u.len())
                .map(|ray| {
                    let origin = points.position(ray / self.per_point);
                    let dir = light.at(self.u[ray], self.v[ray]) - origin;
                    Ray { origin, dir, t_min: 0.0, t_max: SHADOW_T_MAX }
                })
                .collect();
            let mut occluded = vec![false; rays.len()];
            scene.occluded_batch(rays.as_rays(), &mut occluded).unwrap();
            let mut seen = vec![false; rays.len()];
            scene.visible_samples(&points, light, &samples, &mut seen).unwrap();
            for ray in 0..rays.len() {
                let point = ray / self.per_point;
                let expected = points.faces(point, rays.as_rays().get(ray).dir) && !occluded[ray];
                assert_eq!(
                    seen[ray],
                    expected,
                    "sample {ray} of point {point}: {:?} towards {light:?}",
                    rays.as_rays().get(ray)
                );
                counts[usize::from(expected)] += 1;
                if ray % 97 == 0 {
                    assert_eq!(scene.occluded(&rays.as_rays().get(ray)), occluded[ray]);
                }
            }
            let mut fraction = vec![f32::NAN; x.len()];
            scene.visibility(&points, light, &samples, &mut fraction).unwrap();
            for (seen, fraction) in seen.chunks(self.per_point).zip(&fraction) {
                let count = seen.iter().filter(|&&seen| seen).count();
                assert_eq!(*fraction, count as f32 / self.per_point as f32);
            }
            let mut again = vec![false; rays.len()];
            scene.par_visible_samples(&points, light, &samples, &mut again).unwrap();
            assert!(again == seen, "threads differ");
            let mut again = vec![f32::NAN; x.len()];
            scene.par_visibility(&points, light, &samples, &mut again).unwrap();
            assert!(again == fraction, "threads differ");
        }
        counts
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Style {
    /// Small whole numbers: corners, edges and planes meet exactly.
    Grid,
    /// Anything at any scale.
    Chaos,
    /// Long thin triangles.
    Slivers,
    /// Few and large: whole lights are covered.
    Large,
}

fn scene(random: &mut Random, style: Style, scale: f32) -> Scene {
    let mut builder = SceneBuilder::new();
    let (mut spheres, mut quads, mut mesh) =
        (Spheres::default(), Quads::default(), Mesh::default());
    let count = match style {
        Style::Large => 1 + random.below(6),
        _ => 1 + random.below(150),
    };
    for _ in 0..count {
        let (at, size) = match style {
            Style::Grid => (random.grid(4), 1.0),
            Style::Chaos => (random.vec() * scale * 2.0, 0.3 * scale * random.unit()),
            Style::Slivers => (random.vec() * scale * 2.0, scale),
            Style::Large => (random.vec() * scale, 2.0 * scale),
        };
        let edge = |random: &mut Random| match style {
            Style::Grid => random.grid(2),
            _ => random.vec() * size,
        };
        match random.below(4) {
            0 if style == Style::Grid => spheres.push(at, 0.5 * (1 + random.below(3)) as f32),
            0 => spheres.push(at, (size * 0.5 * random.unit()).max(1.0e-6 * scale)),
            1 => {
                let (u, v) = (edge(random), edge(random));
                if u.as_dvec3().cross(v.as_dvec3()).length() > 0.0 {
                    quads.push(at, u, v);
                }
            }
            _ => {
                let first = mesh.positions.len() as u32;
                let (u, mut v) = (edge(random), edge(random));
                if style == Style::Slivers {
                    v = u * random.signed() + v * 1.0e-3 * random.unit();
                }
                mesh.positions.extend([at, at + u, at + v]);
                mesh.indices.push([first, first + 1, first + 2]);
            }
        }
    }
    builder.add_spheres(spheres, 0);
    builder.add_mesh(mesh, 0);
    builder.add_quads(quads, 0);
    builder.build().unwrap()
}

/// Lights of all kinds around a scene of this size.
fn light(random: &mut Random, style: Style, scale: f32) -> LightShape {
    let grid = style == Style::Grid;
    let at = |random: &mut Random, far: f32| {
        if grid { random.grid((4.0 * far) as i32 + 1) } else { random.vec() * scale * far }
    };
    let middle = at(random, 3.0);
    let width = [0.02, 0.2, 1.0, 8.0][random.below(4)];
    let edge = |random: &mut Random| {
        if grid { random.grid(2) } else { random.vec() * scale * width }
    };
    let (edge_u, edge_v) = (edge(random), edge(random));
    match random.below(16) {
        0 => LightShape::Point(middle),
        // Edges that lie on a line, or have no length: rows of lights.
        1 => LightShape::Quad { corner: middle, edge_u, edge_v: edge_u * 2.0 },
        2 => LightShape::Quad { corner: middle, edge_u, edge_v: Vec3::ZERO },
        _ => LightShape::Quad { corner: middle - (edge_u + edge_v) * 0.5, edge_u, edge_v },
    }
}

/// Rounds that say how many samples were hidden and seen; hardly any of either would make them worth
/// little.
fn run_mixed(
    what: &str,
    test: u64,
    usual: u64,
    round: impl Fn(&mut Random, usize) -> [usize; 2] + Sync,
) {
    let hidden = AtomicU64::new(0);
    let tried = run(what, test, usual, |random, number| {
        let counts = round(random, number);
        hidden.fetch_add(counts[0] as u64, Ordering::Relaxed);
        (counts[0] + counts[1]) as u64
    });
    let hidden = hidden.into_inner();
    assert!(hidden * 20 > tried && hidden * 20 < 19 * tried, "{hidden} of {tried} are hidden");
}

/// Rounds of made scenes.
fn rounds(what: &str, test: u64, style: Style, usual: u64) {
    run_mixed(what, test, usual, |random, round| {
        let scale = if style == Style::Grid { 1.0 } else { 10_f32.powf(random.signed() * 4.0) };
        let scene = scene(random, style, scale);
        let light = light(random, style, scale);
        let per_point = [16, 4, 7, 16, 33, 1, 256, 64][round % 8];
        let mut case = Case { per_point, ..Case::default() };
        let points = (6000 / per_point).min(500);
        let (middle, spread) = (random.vec() * scale * 3.0, [0.01, 0.2, 2.0][round % 3] * scale);
        for point in 0..points {
            let on_light = light.at(random.unit() * 3.0 - 1.0, random.unit() * 3.0 - 1.0);
            let position = match random.below(64) {
                // In the light's plane, on the light, and far away.
                0 => on_light,
                1 => random.vec() * scale * 1.0e4,
                _ if style == Style::Grid => random.grid(9),
                // Near the light: it fills the view.
                _ if round % 5 == 0 => on_light + random.vec() * spread,
                _ => middle + random.vec() * spread,
            };
            let position = match point {
                7 if round % 9 == 0 => Vec3::NAN,
                8 if round % 9 == 0 => Vec3::splat(f32::INFINITY),
                9 if round % 9 == 0 => Vec3::splat(1.0e38),
                _ => position,
            };
            let normal = random.vec() * 10_f32.powf(random.signed());
            case.push(random, position, normal);
        }
        case.check(&scene, &light)
    });
}

#[test]
fn grid_scenes() {
    rounds("visibility, grid", 81, Style::Grid, 400);
}

#[test]
fn chaos_scenes() {
    rounds("visibility, chaos", 82, Style::Chaos, 400);
}

#[test]
fn slivers() {
    rounds("visibility, slivers", 83, Style::Slivers, 400);
}

#[test]
fn large_occluders() {
    rounds("visibility, large", 84, Style::Large, 800);
}

/// Points on the facets of a ball and on a floor below it, as pictures have them.
#[test]
fn pictures() {
    run("visibility, pictures", 85, 24, |random, round| {
        let mut ball = octray::geometry::shapes::icosphere(4);
        let lift = [0.3, 1.0, 1.5][round % 3];
        ball.positions.iter_mut().for_each(|p| *p += Vec3::Y * lift);
        let mut builder = SceneBuilder::new();
        builder.add_mesh(ball.clone(), 0);
        let (x, z) = (Vec3::X * 20.0, Vec3::Z * 20.0);
        builder.add_quads(Quads::one(-(x + z) * 0.5, z, x), 0);
        let scene = builder.build().unwrap();
        let size = [0.1, 1.0, 10.0][round / 3 % 3];
        let middle = Vec3::new(random.signed() * 2.0, [0.1, 4.0][round % 2], random.signed());
        let corner = middle - Vec3::new(size, 0.0, size) * 0.5;
        let light = LightShape::Quad { corner, edge_u: Vec3::X * size, edge_v: Vec3::Z * size };
        let mut case = Case { per_point: 16, ..Case::default() };
        for row in 0..64 {
            for column in 0..64 {
                let at = Vec3::new(column as f32 / 16.0 - 2.0, 6.0, row as f32 / 16.0 - 2.0);
                let ray = Ray::new(at, Vec3::new(0.1, -1.0, 0.05));
                if let Some(hit) = scene.intersect(&ray) {
                    let surface = scene.surface(&ray, &hit);
                    let normal = surface.geometric_normal;
                    case.push(random, surface.offset_origin(normal), normal);
                }
            }
        }
        case.check(&scene, &light).iter().sum::<usize>() as u64
    });
}

/// Point lights: rows of neighbours, in bundles, and points all over the scene, which go one by one.
#[test]
fn point_lights() {
    run_mixed("visibility, point lights", 88, 300, |random, round| {
        let style = [Style::Grid, Style::Chaos, Style::Slivers, Style::Large][round % 4];
        let scale = if style == Style::Grid { 1.0 } else { 10_f32.powf(random.signed() * 4.0) };
        let scene = scene(random, style, scale);
        let light = LightShape::Point(random.vec() * scale * 4.0);
        let per_point = if round % 7 == 0 { 3 } else { 1 };
        let mut case = Case { per_point, ..Case::default() };
        let spread = [0.02, 0.2, 3.0][round % 3] * scale;
        let middle = random.vec() * scale * 2.0;
        for point in 0..1300 {
            let along = (point % 64) as f32 / 64.0 - 0.5;
            let position = match random.below(90) {
                0 => Vec3::splat(f32::NAN),
                1 => light.at(0.0, 0.0),
                _ if style == Style::Grid => random.grid(6),
                _ => middle + Vec3::new(along, random.signed() * 0.1, 0.3 * along) * spread,
            };
            let normal = random.vec();
            case.push(random, position, normal);
        }
        case.check(&scene, &light)
    });
}

/// Neighbours below a ball of many small triangles, whose samples lie in strata: bundles go across
/// points.
#[test]
fn fine_meshes() {
    run_mixed("visibility, fine meshes", 89, 24, |random, round| {
        let mut ball = octray::geometry::shapes::icosphere(5);
        ball.positions.iter_mut().for_each(|p| *p *= 1.0 + 0.02 * random.unit());
        let mut builder = SceneBuilder::new();
        builder.add_mesh(ball, 0);
        let scene = builder.build().unwrap();
        let width = [0.5, 2.0, 6.0][round % 3];
        let middle = Vec3::new(random.signed(), 3.0, random.signed());
        let (edge_u, edge_v) = (Vec3::X * width, Vec3::new(0.0, 0.3, 1.0) * width);
        let corner = middle - (edge_u + edge_v) * 0.5;
        let light = LightShape::Quad { corner, edge_u, edge_v };
        let per_point = [16, 33, 64, 5, 250][round % 5];
        let side = (per_point as f32).sqrt().ceil() as usize;
        let mut case = Case { per_point, ..Case::default() };
        let start = -middle * 0.6 + random.vec() * 0.4;
        let step = [0.002, 0.01, 0.1][round / 3 % 3];
        for point in 0..300 + round {
            let (row, column) = ((point / 16) as f32, (point % 16) as f32);
            let position = start + Vec3::new(column, 0.1 * random.unit(), row) * step;
            let normal = Vec3::Y + random.vec() * 2.0;
            case.push_with(position, normal, |sample| {
                let cell =
                    |at: usize, random: &mut Random| (at as f32 + random.unit()) / side as f32;
                (cell(sample % side, random), cell(sample / side, random))
            });
        }
        case.check(&scene, &light)
    });
}

/// Points all over the scene, in no order: they are sorted, and their answers are not.
#[test]
fn points_in_no_order() {
    run_mixed("visibility, no order", 90, 32, |random, round| {
        let style = [Style::Chaos, Style::Slivers, Style::Large][round % 3];
        let scale = 10_f32.powf(random.signed() * 4.0);
        let scene = scene(random, style, scale);
        let light = match round % 4 {
            0 => LightShape::Point(random.vec() * scale * 4.0),
            _ => light(random, style, scale),
        };
        let mut case = Case { per_point: [1, 4, 16, 3][round / 2 % 4], ..Case::default() };
        for point in 0..2048 + 37 * round {
            let position = match point {
                100 if round % 5 == 0 => Vec3::NAN,
                900 if round % 5 == 1 => Vec3::splat(f32::INFINITY),
                _ => random.vec() * scale * 3.0,
            };
            let normal = random.vec();
            case.push(random, position, normal);
        }
        case.check(&scene, &light)
    });
}

/// A tilted light with a wall as tilted close behind it, and then close before it.
#[test]
fn walls_at_the_light() {
    run("visibility, walls", 86, 200, |random, round| {
        let (edge_u, edge_v) = (Vec3::new(1.0, 0.6 * random.signed(), 0.0), Vec3::Z);
        let middle = Vec3::new(random.signed(), 4.0, random.signed());
        let corner = middle - (edge_u + edge_v) * 0.5;
        let light = LightShape::Quad { corner, edge_u, edge_v };
        let away = Vec3::Y * [0.05, 0.002, -0.05, -0.6][round % 4];
        // One triangle: of a quad, the light would lie across the diagonal.
        let first = corner - (edge_u + edge_v) * 2.0 + away;
        let positions = vec![first, first + edge_u * 8.0, first + edge_v * 8.0];
        let mut builder = SceneBuilder::new();
        builder.add_mesh(Mesh { positions, indices: vec![[0, 1, 2]], normals: Vec::new() }, 0);
        let scene = builder.build().unwrap();
        let mut case = Case { per_point: 16, ..Case::default() };
        for _ in 0..300 {
            let position = Vec3::new(random.signed(), 0.2 * random.signed(), random.signed());
            case.push(random, position, Vec3::Y);
        }
        let counts = case.check(&scene, &light);
        assert_eq!(counts[usize::from(away.y < 0.0)], 0, "round {round}");
        (counts[0] + counts[1]) as u64
    });
}

/// Occluders that just touch what a point sees of the light: an edge in a side of its pyramid, with
/// the triangle outside or in the way, or a corner on an edge of the pyramid. Roundings decide then.
#[test]
fn grazing_occluders() {
    run("visibility, grazing", 87, 1500, |random, round| {
        let scale = random.scale(-4, 4);
        let middle = random.vec() * scale * 3.0;
        let (edge_u, edge_v) = if random.once_in(2) {
            (random.vec() * scale, random.vec() * scale)
        } else {
            // Along axes, so that the boxes of flat triangles only touch, too.
            (Vec3::X * scale * random.unit(), Vec3::Z * scale * random.unit())
        };
        let corner = middle - (edge_u + edge_v) * 0.5;
        let light = LightShape::Quad { corner, edge_u, edge_v };
        let corners = [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v];
        let point = random.vec() * scale;
        let (mut mesh, mut spheres) = (Mesh::default(), Spheres::default());
        for _ in 0..1 + round % 3 {
            let side = random.below(4);
            let [a, b, c, d] = [0, 1, 2, 3].map(|step| corners[(side + step) % 4]);
            // From the point towards the light: `part` of the way.
            let part = 0.1 + 0.8 * random.unit();
            let at = |target: Vec3| point + (target - point) * part;
            let (along, inwards) = (b - a, (d - a + c - b) * 0.5);
            if round % 5 == 4 {
                // Beside the side plane, which it touches.
                let normal = (a - point).cross(b - point).normalize_or(Vec3::Y);
                let out = if normal.dot(middle - point) > 0.0 { -normal } else { normal };
                let radius = scale * random.scale(-3, 0);
                spheres.push(random.vec_beside(at((a + b) * 0.5) + out * radius), radius);
                continue;
            }
            let triangle = match round % 4 {
                0 => [a - along * random.unit(), b + along * random.unit(), b - inwards],
                1 => [a - along * 4.0, b + along * 4.0, (a + b) * 0.5 + inwards * 4.0],
                2 => [a, a - along - inwards * random.unit(), a - along * random.unit() - inwards],
                _ => [a - along, b + along, b + along * random.signed() + inwards],
            };
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(triangle.map(|target| random.vec_beside(at(target))));
            mesh.indices.push([first, first + 1, first + 2]);
        }
        let mut builder = SceneBuilder::new();
        builder.add_mesh(mesh, 0);
        builder.add_spheres(spheres, 0);
        let scene = builder.build().unwrap();
        // Above sixteen samples, the sides of the pyramid are asked as well.
        let mut case = Case { per_point: [16, 20][round / 4 % 2], ..Case::default() };
        for _ in 0..100 {
            let position = random.vec_beside(point);
            // Half of the surfaces have a corner of the light in their plane.
            let normal = if random.once_in(2) {
                let across = (random.pick(&corners) - position).cross(random.vec());
                if across.dot(middle - point) < 0.0 { -across } else { across }
            } else {
                middle - point
            };
            case.push(random, position, normal);
        }
        case.check(&scene, &light).iter().sum::<usize>() as u64
    });
}

/// Points below bars that let some of the light through: nothing settles any of them, so blocks are left out
/// after a while, and tried again where points see the whole light. Without a block, points go as tiles of their
/// own samples and as tiles across points.
#[test]
fn gratings() {
    run_mixed("visibility, gratings", 91, 24, |random, round| {
        let mut builder = SceneBuilder::new();
        let mut bars = Quads::default();
        for bar in 0..60 {
            let at = Vec3::new(-8.0, 2.0 + 0.1 * random.unit(), 0.1 * bar as f32 - 3.0);
            bars.push(at, Vec3::X * 16.0, Vec3::new(0.0, 0.02 * random.signed(), 0.06));
        }
        builder.add_quads(bars, 0);
        let scene = builder.build().unwrap();
        let (edge_u, edge_v) = (Vec3::X * 2.0, Vec3::Z * 2.0);
        let corner = Vec3::Y * 5.0 - (edge_u + edge_v) * 0.5;
        let light = LightShape::Quad { corner, edge_u, edge_v };
        let mut case = Case { per_point: [16, 5, 40, 13][round % 4], ..Case::default() };
        let points = 4000 + 401 * (round / 4 % 6);
        for point in 0..points {
            let along = point as f32 / points as f32;
            let dark = random.unit() - 0.5;
            // The last ones see past the bars.
            let position =
                Vec3::new(dark, 0.0, if along < 0.7 { 2.0 * along } else { 14.0 * along });
            let normal = Vec3::Y + random.vec();
            case.push(random, position, normal);
        }
        let mut counts = case.check(&scene, &light);
        // Few at a time, so that parts that are not full go each way, too.
        for _ in 0..6 {
            let mut few = Case { per_point: case.per_point, ..Case::default() };
            for point in 0..100 {
                let position = Vec3::new(random.unit(), 0.0, 0.01 * point as f32);
                let normal = Vec3::Y + random.vec();
                few.push(random, position, normal);
            }
            let more = few.check(&scene, &light);
            counts = [counts[0] + more[0], counts[1] + more[1]];
        }
        counts
    });
}

/// Samples that ask for what points see themselves, of another scene: what a thread keeps is in use then.
#[test]
fn queries_inside_queries() {
    struct Asking<'a>(&'a Scene, LightShape);
    impl LightSamples for Asking<'_> {
        fn per_point(&self) -> usize {
            16
        }
        fn check(&self, _: usize) -> Result<(), ShapeError> {
            Ok(())
        }
        fn place(&self, point: usize, u: &mut [f32], v: &mut [f32]) {
            let position = [0.01 * point as f32, 0.0, 0.4];
            let [x, y, z] = position.each_ref().map(std::slice::from_ref);
            let points = Points::new(x, y, z).unwrap();
            let own = SampleArrays::new(&[0.1, 0.4, 0.6, 0.9], &[0.2, 0.8, 0.3, 0.7], 4).unwrap();
            let mut seen = [0.0];
            self.0.visibility(&points, &self.1, &own, &mut seen).unwrap();
            for sample in 0..16 {
                u[sample] = (0.25 * seen[0] + 0.05 * sample as f32).min(1.0);
                v[sample] = 0.0625 * sample as f32;
            }
        }
    }
    let mut random = Random::new(92, 0);
    let scenes = [scene(&mut random, Style::Chaos, 1.0), scene(&mut random, Style::Slivers, 1.0)];
    let corner = Vec3::new(-1.0, 3.0, -1.0);
    let light = LightShape::Quad { corner, edge_u: Vec3::X * 2.0, edge_v: Vec3::Z * 2.0 };
    let mut case = Case { per_point: 16, ..Case::default() };
    let asking = Asking(&scenes[1], light);
    for point in 0..600 {
        let (mut u, mut v) = ([0.0; 16], [0.0; 16]);
        asking.place(point, &mut u, &mut v);
        let position = random.vec() * 2.0;
        case.push_with(position, Vec3::Y, |sample| (u[sample], v[sample]));
    }
    case.check(&scenes[0], &light);
    let [x, y, z] = &case.position;
    let points = Points::new(x, y, z).unwrap();
    let own = SampleArrays::new(&case.u, &case.v, 16).unwrap();
    let (mut expected, mut seen) = (vec![false; case.u.len()], vec![false; case.u.len()]);
    scenes[0].visible_samples(&points, &light, &own, &mut expected).unwrap();
    scenes[0].visible_samples(&points, &light, &asking, &mut seen).unwrap();
    assert!(seen == expected);
}

#[test]
fn shapes_are_checked() {
    let scene = SceneBuilder::new().build().unwrap();
    let (one, two) = ([0.5; 1], [0.5; 2]);
    assert!(Points::new(&one, &two, &two).is_err());
    let points = Points::new(&two, &two, &two).unwrap();
    assert!(points.with_normals(&one, &two, &two).is_err());
    assert!(SampleArrays::new(&one, &two, 1).is_err());
    let light = LightShape::Quad { corner: Vec3::Y, edge_u: Vec3::X, edge_v: Vec3::Z };
    let samples = SampleArrays::new(&two, &two, 1).unwrap();
    let mut fraction = [f32::NAN; 2];
    assert!(scene.visibility(&points, &light, &samples, &mut fraction[..1]).is_err());
    assert!(scene.visible_samples(&points, &light, &samples, &mut [false; 3]).is_err());
    scene.visibility(&points, &light, &samples, &mut fraction).unwrap();
    assert_eq!(fraction, [1.0; 2]);
    // Without samples nothing is seen; too few samples are refused.
    let none = SampleArrays::new(&[], &[], 0).unwrap();
    scene.visibility(&points, &light, &none, &mut fraction).unwrap();
    assert_eq!(fraction, [0.0; 2]);
    scene.visible_samples(&points, &light, &none, &mut []).unwrap();
    let few = SampleArrays::new(&one, &one, 1).unwrap();
    assert!(few.check(points.len()).is_err());
}
