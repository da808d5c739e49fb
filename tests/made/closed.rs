//! Closed surfaces, for tests that no ray slips through: made ones, and OBJ meshes if there are any.

use std::collections::HashMap;
use std::path::PathBuf;

use glam::{DVec3, Vec3};
use octray::{Mesh, Scene, SceneBuilder};

/// A closed triangle mesh and points inside it.
#[derive(Clone, Debug)]
pub struct Closed {
    pub name: String,
    pub positions: Vec<DVec3>,
    pub indices: Vec<[u32; 3]>,
    pub inside: Vec<DVec3>,
}

impl Closed {
    /// The mesh, scaled and moved; its corners are rounded once.
    pub fn mesh(&self, scale: f64, offset: DVec3) -> Mesh {
        Mesh {
            positions: self.positions.iter().map(|&p| (p * scale + offset).as_vec3()).collect(),
            indices: self.indices.clone(),
            normals: Vec::new(),
        }
    }

    /// The edges, each once.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges: Vec<_> = self.directed_edges().filter(|[a, b]| a < b).collect();
        edges.sort_unstable();
        edges
    }

    fn directed_edges(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.indices.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
    }

    /// True if each edge has one triangle on either side, so that the surface has no border.
    pub fn is_closed(&self) -> bool {
        let mut sides: HashMap<[u32; 2], i32> = HashMap::new();
        for [a, b] in self.directed_edges() {
            *sides.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
        sides.values().all(|&side| side == 0)
    }

    /// How often the surface winds around a point: 1 inside, 0 outside (Van Oosterom and Strackee
    /// 1983, the solid angle of a triangle).
    pub fn winding(&self, point: DVec3) -> f64 {
        let angle = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize] - point);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * a.dot(b.cross(c)).atan2(below)
        };
        self.indices.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }
}

/// A scene of one mesh.
pub fn scene_of(mesh: Mesh) -> Scene {
    let mut builder = SceneBuilder::new();
    builder.add_mesh(mesh, 0);
    builder.build().expect("a mesh whose indices are right")
}

/// An icosahedron whose triangles were cut into four `cuts` times, on the unit sphere.
pub fn icosphere(cuts: usize) -> Closed {
    let golden = 0.5 * (1.0 + 5_f64.sqrt());
    let mut positions = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        positions.extend([DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)]);
    }
    positions.iter_mut().for_each(|p: &mut DVec3| *p = p.normalize());
    // Its faces are the triples of nearest neighbours, turned outwards.
    let near = |a: usize, b: usize| positions[a].distance(positions[b]) < 1.1;
    let mut indices = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let out = positions[a].dot(positions[b].cross(positions[c])) > 0.0;
                    let [b, c] = if out { [b, c] } else { [c, b] };
                    indices.push([a, b, c].map(|vertex| vertex as u32));
                }
            }
        }
    }
    for _ in 0..cuts {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut finer = Vec::with_capacity(4 * indices.len());
        for &[a, b, c] in &indices {
            let mut middle = |a: u32, b: u32| {
                *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    let between = positions[a as usize] + positions[b as usize];
                    positions.push(between.normalize());
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        indices = finer;
    }
    let name = format!("icosphere of {} triangles", indices.len());
    Closed { name, positions, indices, inside: vec![DVec3::ZERO, DVec3::new(0.3, -0.5, 0.2)] }
}

/// A box of twelve triangles.
pub fn cuboid() -> Closed {
    let size = DVec3::new(1.0, 0.7, 0.4);
    let sign = |vertex: usize, axis: usize| if vertex >> axis & 1 == 0 { -1.0 } else { 1.0 };
    let corner = |vertex| size * DVec3::new(sign(vertex, 0), sign(vertex, 1), sign(vertex, 2));
    let mut indices = Vec::new();
    for axis in 0..3 {
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let far = 1 << axis;
        indices.extend([[far, far + u, far + u + v], [far, far + u + v, far + v]]);
        indices.extend([[0, u + v, u], [0, v, u + v]]);
    }
    Closed {
        name: "box of 12 triangles".into(),
        positions: (0..8).map(corner).collect(),
        indices,
        inside: vec![DVec3::ZERO, DVec3::new(0.9, 0.6, -0.3)],
    }
}

/// A tube around a torus knot that winds `p` times around the axis and `q` times around the ring.
pub fn torus_knot(p: f64, q: f64, along: usize, around: usize) -> Closed {
    let center = |step: usize| {
        let angle = step as f64 / along as f64 * std::f64::consts::TAU;
        let radius = 2.0 + (q * angle).cos();
        DVec3::new(radius * (p * angle).cos(), radius * (p * angle).sin(), (q * angle).sin()) / 3.0
    };
    let (mut positions, mut indices, mut inside) = (Vec::new(), Vec::new(), Vec::new());
    for step in 0..along {
        let ahead = (center(step + 1) - center(step + along - 1)).normalize();
        let side = ahead.cross(DVec3::new(0.3, 0.5, 0.8)).normalize();
        let up = ahead.cross(side);
        for turn in 0..around {
            let angle = turn as f64 / around as f64 * std::f64::consts::TAU;
            positions.push(center(step) + (side * angle.cos() + up * angle.sin()) * 0.12);
        }
        if step % 200 == 0 {
            inside.push(center(step));
        }
        let (row, next) = (step * around, (step + 1) % along * around);
        for turn in 0..around {
            let beside = (turn + 1) % around;
            let [a, b, c, d] = [row + turn, row + beside, next + beside, next + turn];
            indices.extend([[a, b, c], [a, c, d]].map(|face| face.map(|vertex| vertex as u32)));
        }
    }
    let name = format!("torus knot of {} triangles", indices.len());
    let mut knot = Closed { name, positions, indices, inside };
    if knot.winding(knot.inside[0]) < 0.0 {
        knot.indices.iter_mut().for_each(|face| face.swap(1, 2));
    }
    knot
}

/// The closed ones among the OBJ meshes of `OCTRAY_MESHES`, or of `../shared/meshes` beside this
/// crate; none where there is no such folder.
pub fn found() -> Vec<Closed> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/meshes");
    let folder = std::env::var_os("OCTRAY_MESHES").map_or_else(beside, PathBuf::from);
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = files.map(|file| file.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "obj"));
    paths.sort();
    paths.iter().flat_map(read).collect()
}

/// The closed mesh of an OBJ file, corners at one position merged and the box scaled to about 1.
fn read(path: &PathBuf) -> Option<Closed> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options).ok()?;
    let (mut positions, mut indices) = (Vec::<DVec3>::new(), Vec::new());
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    for model in models {
        let mut vertex = |index: &u32| {
            let at = *index as usize * 3;
            let point: [f32; 3] = std::array::from_fn(|axis| model.mesh.positions[at + axis] + 0.0);
            *known.entry(point.map(f32::to_bits)).or_insert_with(|| {
                positions.push(Vec3::from(point).as_dvec3());
                positions.len() as u32 - 1
            })
        };
        let corners: Vec<u32> = model.mesh.indices.iter().map(&mut vertex).collect();
        indices.extend(corners.chunks_exact(3).map(|face| [face[0], face[1], face[2]]));
    }
    indices.retain(|[a, b, c]| a != b && b != c && c != a);
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &point in &positions {
        (min, max) = (min.min(point), max.max(point));
    }
    let (center, size) = ((min + max) * 0.5, (max - min).max_element());
    positions.iter_mut().for_each(|point| *point = (*point - center) / size);
    let name = path.file_name()?.to_string_lossy().into_owned();
    let mut closed = Closed { name, positions, indices, inside: Vec::new() };
    if !closed.is_closed() {
        println!("{}: not closed, left out", closed.name);
        return None;
    }
    let mut random = super::Random::new(99, 0);
    for _ in 0..200 {
        let point = random.vec().as_dvec3() * 0.5;
        if closed.inside.len() < 3 && (closed.winding(point).abs() - 1.0).abs() < 1e-6 {
            closed.inside.push(point);
        }
    }
    (!closed.inside.is_empty()).then_some(closed)
}
