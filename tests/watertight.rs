//! No ray that starts inside a closed surface leaves it without a hit: through faces, edges and
//! vertices, small and large, near zero and far from it. And surfaces are crossed as often as they
//! should be.

// What `--nocapture` shows.
#![allow(clippy::print_stdout)]

mod made;

use glam::{DVec3, Vec3};
use made::closed::{Closed, cuboid, found, icosphere, scene_of, torus_knot};
use made::{Random, run};
use octray::{HitBatch, Quads, Ray, RayBatch, Scene, SceneBuilder};

const FAR: DVec3 = DVec3::new(148376.0, 1234.0, -223423.0);

fn surfaces() -> Vec<Closed> {
    let mut all = vec![cuboid(), icosphere(2), icosphere(5), torus_knot(2.0, 3.0, 800, 12)];
    all.extend(found());
    all
}

/// A surface at one place, ready to be traced: its scene, corners, edges and points inside.
struct Placed {
    name: String,
    scene: Scene,
    corners: Vec<Vec3>,
    edges: Vec<[u32; 2]>,
    inside: Vec<Vec3>,
    /// How many rays a round tries: few where the mesh is smaller than the margins of the boxes,
    /// which are then no help.
    rays: usize,
}

/// The surface at all scales and places where floats can hold it: with its corners rounded, it
/// still winds once around one of its points inside. Triangles that collapse are no excuse.
fn placed(closed: &Closed) -> Vec<Placed> {
    assert!(closed.is_closed(), "{}", closed.name);
    let mut all = Vec::new();
    for offset in [DVec3::ZERO, FAR] {
        for power in -4..=4 {
            let scale = 10_f64.powi(power);
            let mesh = closed.mesh(scale, offset);
            let corners = mesh.positions.clone();
            let rounded = Closed {
                positions: corners.iter().map(|corner| corner.as_dvec3()).collect(),
                ..closed.clone()
            };
            let round = |&point: &DVec3| (point * scale + offset).as_vec3();
            let mut inside: Vec<Vec3> = closed.inside.iter().map(round).collect();
            let step = f64::from(f32::EPSILON) * (scale + offset.abs().max_element());
            inside.retain(|point| is_well_inside(&rounded, point.as_dvec3(), 2.0 * step));
            let scene = scene_of(mesh);
            let dropped = scene.dropped().degenerate;
            let name = format!("{} at {offset}, scale {scale:e}, {dropped} dropped", closed.name);
            if inside.is_empty() {
                println!("{name}: floats cannot hold it, left out");
                continue;
            }
            let rays = if scale < 4096.0 * step { 20 } else { 1000 };
            all.push(Placed { name, scene, corners, edges: closed.edges(), inside, rays });
        }
    }
    all
}

/// True if the surface winds once around the point and around all points `step` beside it.
fn is_well_inside(surface: &Closed, point: DVec3, step: f64) -> bool {
    let beside = DVec3::AXES.into_iter().flat_map(|axis| [axis * step, axis * -step]);
    std::iter::once(DVec3::ZERO)
        .chain(beside)
        .all(|beside| (surface.winding(point + beside) - 1.0).abs() < 1e-3)
}

/// A box of six quads whose corners are the same floats where they meet.
fn quad_box(scale: f64, offset: DVec3) -> Option<Placed> {
    // Whole numbers of a step that floats have here, so that corner and edges sum up exactly.
    let step = f64::from(f32::EPSILON) * (scale + offset.abs().max_element());
    let size = (DVec3::new(1.0, 0.7, 0.4) * scale / step).round() * step;
    let center = (offset / step).round() * step;
    if scale < 8.0 * step {
        return None;
    }
    let mut quads = Quads::default();
    let corner = |bits: usize| {
        let sign = |axis: usize| if bits >> axis & 1 == 0 { -1.0 } else { 1.0 };
        (center + size * DVec3::new(sign(0), sign(1), sign(2))).as_vec3()
    };
    for axis in 0..3 {
        for side in [0, 1 << axis] {
            let [a, b, d] =
                [0, 1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3)].map(|v| corner(side + v));
            quads.push(a, b - a, d - a);
        }
    }
    let corners: Vec<Vec3> = (0..8).map(corner).collect();
    for index in 0..6 {
        for point in quads.corners(index) {
            assert!(corners.contains(&point), "the quads of the box share their corners");
        }
    }
    let mut builder = SceneBuilder::new();
    builder.add_quads(quads, 0);
    let edges = (0..8_u32).flat_map(|v| (0..3).map(move |axis| [v, v ^ (1 << axis)]));
    Some(Placed {
        name: format!("box of 6 quads at {offset}, scale {scale:e}"),
        scene: builder.build().expect("valid quads"),
        corners,
        edges: edges.filter(|[a, b]| a < b).collect(),
        inside: vec![center.as_vec3(), (center + size * 0.8).as_vec3()],
        rays: 1000,
    })
}

impl Placed {
    /// A ray from inside: anywhere, or at a corner, the middle of an edge or a point of an edge.
    fn ray(&self, random: &mut Random) -> Ray {
        let origin = random.pick(&self.inside);
        let along_edge = |random: &mut Random, part: f32| {
            let [a, b] = random.pick(&self.edges).map(|vertex| self.corners[vertex as usize]);
            a + (b - a) * part
        };
        let target = match random.below(4) {
            0 => return Ray::new(origin, random.dir()),
            1 => random.pick(&self.corners),
            2 => along_edge(random, 0.5),
            _ => {
                let part = random.unit();
                along_edge(random, part)
            }
        };
        let ray = Ray::new(origin, target - origin);
        if ray.dir == Vec3::ZERO { Ray::new(origin, Vec3::X) } else { ray }
    }

    /// How many of `rays` leave without a hit.
    fn misses(&self, rays: &RayBatch) -> usize {
        let mut hits = HitBatch::new(rays.len());
        self.scene.intersect_batch(rays.as_rays(), hits.as_hits()).unwrap();
        let missed = |&index: &usize| !hits.get(index).is_hit();
        let misses = (0..rays.len()).filter(missed);
        misses.inspect(|&index| println!("{}: {:?}", self.name, rays.as_rays().get(index))).count()
    }
}

#[test]
fn no_ray_from_inside_a_closed_surface_misses_it() {
    let mut all: Vec<Placed> = surfaces().iter().flat_map(placed).collect();
    for offset in [DVec3::ZERO, FAR] {
        all.extend((-4..=4).filter_map(|power| quad_box(10_f64.powi(power), offset)));
    }
    println!("{} surfaces at their places", all.len());
    let tried = run("watertight", 31, 13_000, |random, number| {
        let placed = &all[number % all.len()];
        let rays: RayBatch = (0..placed.rays).map(|_| placed.ray(random)).collect();
        assert_eq!(placed.misses(&rays), 0, "{}", placed.name);
        placed.rays as u64
    });
    assert!(tried >= 10_000_000);
}

/// All crossings of `ray`, walked from hit to hit; `None` if it passes within 1e-5 of an edge, where
/// two triangles are met at one place.
fn crossings(scene: &Scene, mut ray: Ray) -> Option<usize> {
    let mut count = 0;
    while let Some(hit) = scene.intersect(&ray) {
        if hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < 1e-5 {
            return None;
        }
        count += 1;
        ray.t_min = hit.t.next_up();
    }
    Some(count)
}

/// From inside a surface is crossed an odd number of times, from outside an even number.
#[test]
fn surfaces_are_crossed_as_often_as_they_should_be() {
    let all: Vec<Placed> = surfaces()
        .iter()
        .flat_map(placed)
        .filter(|placed| placed.rays == 1000 && !placed.inside.is_empty())
        .collect();
    let tried = run("parity", 32, 6000, |random, number| {
        let placed = &all[number % all.len()];
        let bounds = placed.scene.bounds();
        let mut tried = 0;
        for _ in 0..50 {
            let inside = random.pick(&placed.inside);
            let dir = random.dir();
            let outside = bounds.center() + random.dir() * bounds.diagonal();
            let through = random.vec() * bounds.diagonal() * 0.2 + bounds.center() - outside;
            for (origin, dir, odd) in [(inside, dir, 1), (outside, through, 0)] {
                let ray = Ray::new(origin, dir);
                if let Some(count) = crossings(&placed.scene, ray) {
                    assert_eq!(count % 2, odd, "{}: {count} crossings of {ray:?}", placed.name);
                    tried += 1;
                }
            }
        }
        tried
    });
    assert!(tried > 100_000, "only {tried} rays were in general position");
}
