//! Meshes that the project makes itself: closed, wound outwards, vertices shared by index.
//!
//! No vertex is there twice, so neighbours meet in the very same points: there is no seam for a ray
//! to slip through. Tests of watertightness rely on that. Parameters out of range are clamped;
//! positions are computed in doubles and rounded once.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use crate::geometry::Mesh;

/// A tube along a torus knot around the y axis; see [`torus_knot`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorusKnot {
    /// How often the knot runs around the y axis, at least 1.
    pub p: u32,
    /// How often it runs through the hole meanwhile; without a common divisor with `p`.
    pub q: u32,
    /// The radius of the circle in the xz plane that the knot winds around.
    pub radius: f32,
    /// How far from that circle the middle of the tube stays.
    pub spread: f32,
    /// The radius of the tube.
    pub tube: f32,
    /// Rings along the tube, 3 to 32,768.
    pub segments: u32,
    /// Vertices a ring, 3 to 1,024.
    pub sides: u32,
}

impl Default for TorusKnot {
    /// A trefoil of 16,384 triangles within 1.65 of the origin, 1.3 high.
    fn default() -> Self {
        Self { p: 2, q: 3, radius: 1.0, spread: 0.4, tube: 0.25, segments: 256, sides: 32 }
    }
}

/// A closed tube with vertex normals, `2 segments sides` triangles. Vertex `ring * sides + side`
/// lies on ring `ring`.
pub fn torus_knot(knot: &TorusKnot) -> Mesh {
    let (segments, sides) = (knot.segments.clamp(3, 32_768), knot.sides.clamp(3, 1_024));
    let (p, q) = (f64::from(knot.p.max(1)), f64::from(knot.q));
    let (radius, spread, tube) =
        (f64::from(knot.radius), f64::from(knot.spread), f64::from(knot.tube));
    let mut mesh = Mesh::default();
    for ring in 0..segments {
        let turn = TAU * f64::from(ring) / f64::from(segments);
        let (sin_p, cos_p) = (p * turn).sin_cos();
        let (sin_q, cos_q) = (q * turn).sin_cos();
        // The curve lies on a torus, whose own normal is across it everywhere: a frame that closes
        // without a twist.
        let outwards = DVec3::new(cos_q * cos_p, sin_q, cos_q * sin_p);
        let around = DVec3::new(-sin_p, 0.0, cos_p);
        let across = DVec3::new(-sin_q * cos_p, cos_q, -sin_q * sin_p);
        let middle = DVec3::new(cos_p, 0.0, sin_p) * radius + outwards * spread;
        let tangent = around * (p * (radius + spread * cos_q)) + across * (q * spread);
        let side_axis = tangent.normalize_or(around).cross(outwards);
        for side in 0..sides {
            let (sin, cos) = (TAU * f64::from(side) / f64::from(sides)).sin_cos();
            let normal = outwards * cos + side_axis * sin;
            mesh.positions.push((middle + normal * tube).as_vec3());
            mesh.normals.push(normal.as_vec3());
        }
    }
    for ring in 0..segments {
        let next_ring = (ring + 1) % segments;
        for side in 0..sides {
            let next_side = (side + 1) % sides;
            let (a, b) = (ring * sides + side, ring * sides + next_side);
            let (c, d) = (next_ring * sides + next_side, next_ring * sides + side);
            mesh.indices.extend([[a, b, d], [b, c, d]]);
        }
    }
    mesh
}

/// A sphere of radius 1 around the origin with vertex normals: an icosahedron whose triangles are
/// split into four `subdivisions` times (at most 9), `20 * 4^subdivisions` triangles.
pub fn icosphere(subdivisions: u32) -> Mesh {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut points = Vec::new();
    // Three golden rectangles, one in each coordinate plane.
    for (one, long) in [(-1.0, -golden), (-1.0, golden), (1.0, -golden), (1.0, golden)] {
        points.push(DVec3::new(0.0, one, long).normalize());
        points.push(DVec3::new(one, long, 0.0).normalize());
        points.push(DVec3::new(long, 0.0, one).normalize());
    }
    let mut indices = icosahedron_faces(&points);
    for _ in 0..subdivisions.min(9) {
        let mut middles = HashMap::with_capacity(indices.len() * 3 / 2);
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                (points.len() - 1) as u32
            })
        };
        let mut split = Vec::with_capacity(indices.len() * 4);
        for [a, b, c] in indices {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            split.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        indices = split;
    }
    let positions: Vec<Vec3> = points.iter().map(|point| point.as_vec3()).collect();
    Mesh { normals: positions.clone(), positions, indices }
}

/// All triples of neighbours, wound outwards: with twelve points a search is shorter than a table.
fn icosahedron_faces(points: &[DVec3]) -> Vec<[u32; 3]> {
    // Neighbours are 1.05 apart, all others 1.7 and more.
    let near = |a: usize, b: usize| points[a].distance(points[b]) < 1.2;
    let mut faces = Vec::with_capacity(20);
    for a in 0..points.len() {
        for b in (a + 1..points.len()).filter(|&b| near(a, b)) {
            for c in (b + 1..points.len()).filter(|&c| near(a, c) && near(b, c)) {
                let outwards = points[a].dot(points[b].cross(points[c])) > 0.0;
                let face = if outwards { [a, b, c] } else { [a, c, b] };
                faces.push(face.map(|point| point as u32));
            }
        }
    }
    faces
}

/// A box of this size around the origin: 8 vertices, 12 triangles, no vertex normals.
pub fn cuboid(size: Vec3) -> Mesh {
    // Bit 0 of a vertex's number is its side on x, bit 1 on y, bit 2 on z.
    let side = |vertex: u32, bit: u32| if vertex >> bit & 1 == 1 { 0.5 } else { -0.5 };
    let corner = |vertex| Vec3::new(side(vertex, 0), side(vertex, 1), side(vertex, 2));
    let faces =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    Mesh {
        positions: (0..8).map(|vertex| corner(vertex) * size).collect(),
        indices: faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        normals: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Every edge once in each direction, no point twice, volume above zero.
    fn assert_closed_and_outwards(mesh: &Mesh) {
        let mut edges = HashSet::new();
        for &[a, b, c] in &mesh.indices {
            for edge in [(a, b), (b, c), (c, a)] {
                assert!(edges.insert(edge), "edge {edge:?} is there twice");
            }
        }
        for &(a, b) in &edges {
            assert!(edges.contains(&(b, a)), "edge {:?} has no other side", (a, b));
        }
        let points: HashSet<[u32; 3]> =
            mesh.positions.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        assert_eq!(points.len(), mesh.positions.len(), "a vertex is there twice");
        let used: HashSet<u32> = mesh.indices.iter().flatten().copied().collect();
        assert_eq!(used.len(), mesh.positions.len());
        let volume = |i| {
            let [a, b, c] = mesh.triangle(i).map(|p| p.as_dvec3());
            a.dot(b.cross(c)) / 6.0
        };
        assert!((0..mesh.len()).map(volume).sum::<f64>() > 0.0, "wound inwards");
        assert_eq!(mesh.validate(0), Ok(()));
        for (i, triangle) in mesh.indices.iter().enumerate() {
            let [a, b, c] = mesh.triangle(i);
            let normal = (b - a).cross(c - a);
            assert!(normal.length() > 0.0, "triangle {i} has no area");
            if !mesh.normals.is_empty() {
                assert!(triangle.iter().all(|&v| mesh.normals[v as usize].dot(normal) > 0.0));
            }
        }
    }

    #[test]
    fn knots_are_closed() {
        let default = torus_knot(&TorusKnot::default());
        assert_eq!(default.len(), 16_384);
        assert_closed_and_outwards(&default);
        let other = TorusKnot { p: 3, q: 5, spread: 0.5, tube: 0.1, ..TorusKnot::default() };
        assert_closed_and_outwards(&torus_knot(&other));
        // One turn and no winding: a plain torus.
        let torus = TorusKnot { p: 1, q: 0, segments: 24, sides: 12, ..TorusKnot::default() };
        assert_closed_and_outwards(&torus_knot(&torus));
        let fewest = TorusKnot { segments: 0, sides: 0, ..TorusKnot::default() };
        assert_eq!(torus_knot(&fewest).len(), 18);
    }

    #[test]
    fn icospheres_are_closed() {
        for subdivisions in 0..5 {
            let mesh = icosphere(subdivisions);
            assert_eq!(mesh.len(), 20 * 4_usize.pow(subdivisions));
            assert_closed_and_outwards(&mesh);
            assert!(mesh.positions.iter().all(|p| (p.length() - 1.0).abs() < 1e-6));
        }
    }

    #[test]
    fn cuboids_are_closed() {
        let mesh = cuboid(Vec3::new(1.0, 2.0, 3.0));
        assert_eq!((mesh.len(), mesh.positions.len()), (12, 8));
        assert_closed_and_outwards(&mesh);
        assert_eq!(mesh.positions[7], Vec3::new(0.5, 1.0, 1.5));
    }
}
