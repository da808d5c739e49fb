//! Any bytes as geometry, rays and points: refused with a message, or answered as the reference does
//! by every query.

use octray::{
    Hit, HitBatch, HitPacket, LightShape, Mesh, Points, Quads, Ray, RayBatch, RayPacket,
    SHADOW_T_MAX, SampleArrays, Scene, SceneBuilder, Spheres,
};

use super::bytes::Bytes;

/// The most primitives and the most rays of an input.
const MOST: usize = 300;

/// Builds a scene of the bytes and asks it everything.
pub fn geometry(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let scene = match builder(&mut bytes).build() {
        Ok(scene) => scene,
        Err(error) => {
            let message = error.to_string();
            assert!(!message.is_empty() && !message.contains('\n'), "{message:?}");
            return;
        }
    };
    scene.bvh().validate().expect("a valid tree");
    let rays = rays(&mut bytes);
    compare(&scene, &rays);
    compare_visibility(&scene, &mut bytes, &rays);
}

fn builder(bytes: &mut Bytes<'_>) -> SceneBuilder {
    let mut builder = SceneBuilder::new();
    let mut count = 0;
    while count < MOST {
        let many = 1 + usize::from(bytes.byte() % 16);
        match bytes.byte() % 6 {
            0 | 1 => {
                let mut mesh = Mesh::default();
                for _ in 0..many {
                    let first = mesh.positions.len() as u32;
                    mesh.positions.extend([bytes.vec(), bytes.vec(), bytes.vec()]);
                    mesh.indices.push([first, first + 1, first + 2]);
                }
                builder.add_mesh(mesh, 0);
            }
            // Vertices shared, indices as they come.
            2 => {
                let vertices = 1 + usize::from(bytes.byte() % 16);
                let positions: Vec<_> = (0..vertices).map(|_| bytes.vec()).collect();
                let is_wild = bytes.byte() == 255;
                let index = |bytes: &mut Bytes<'_>| {
                    if is_wild { bytes.u32() } else { u32::from(bytes.byte()) % vertices as u32 }
                };
                let indices = (0..many).map(|_| [0; 3].map(|_| index(bytes))).collect();
                let normals = match bytes.byte() {
                    0..=99 => Vec::new(),
                    100..=250 => positions.iter().map(|_| bytes.vec()).collect(),
                    _ => vec![bytes.vec()],
                };
                builder.add_mesh(Mesh { positions, indices, normals }, 0);
            }
            3 => {
                let mut quads = Quads::default();
                for _ in 0..many {
                    let (corner, edge_u, edge_v) = (bytes.vec(), bytes.vec(), bytes.vec());
                    // One bad quad refuses the scene: rarely let it.
                    let is_valid = Quads::one(corner, edge_u, edge_v).validate(0).is_ok();
                    if is_valid || bytes.byte() == 255 {
                        quads.push(corner, edge_u, edge_v);
                    }
                }
                builder.add_quads(quads, 0);
            }
            4 => {
                let mut spheres = Spheres::default();
                for _ in 0..many {
                    let (center, radius) = (bytes.vec(), bytes.float());
                    let is_valid = Spheres::one(center, radius).validate(0).is_ok();
                    if is_valid || bytes.byte() == 255 {
                        spheres.push(center, radius);
                    }
                }
                builder.add_spheres(spheres, 0);
            }
            _ => return builder,
        }
        count += many;
    }
    builder
}

/// Rays one by one, or bundles from one point and to one point.
fn rays(bytes: &mut Bytes<'_>) -> RayBatch {
    let mut rays = RayBatch::default();
    while rays.len() < MOST && !bytes.is_empty() {
        let ray = Ray::new(bytes.vec(), bytes.vec());
        match bytes.byte() % 8 {
            // Bundles, long enough to be a tile.
            kind @ 0..=1 => {
                let step = bytes.vec() * 0.01;
                for count in 0..40 {
                    let shift = step * count as f32;
                    rays.push(&if kind == 0 {
                        Ray { dir: ray.dir + shift, ..ray }
                    } else {
                        Ray { origin: ray.origin + shift, dir: ray.dir - shift, t_max: 1.0, ..ray }
                    });
                }
            }
            2 => rays.push(&Ray { t_min: bytes.float(), t_max: bytes.float(), ..ray }),
            // To a point rather than in a direction.
            3 | 4 => rays.push(&Ray { dir: ray.dir - ray.origin, ..ray }),
            _ => rays.push(&ray),
        }
    }
    rays
}

fn bits(hit: Option<Hit>) -> Option<[u32; 5]> {
    hit.map(|hit| [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.prim_id, hit.geom_id])
}

/// Every query gives what the reference gives.
fn compare(scene: &Scene, rays: &RayBatch) {
    let mut hits = HitBatch::new(rays.len());
    let mut occluded = vec![false; rays.len()];
    scene.intersect_batch(rays.as_rays(), hits.as_hits()).expect("as many hits as rays");
    scene.occluded_batch(rays.as_rays(), &mut occluded).expect("as many bits as rays");
    for (index, &occluded) in occluded.iter().enumerate() {
        let ray = rays.as_rays().get(index);
        let expected = scene.intersect_reference(&ray);
        assert_eq!(bits(scene.intersect(&ray)), bits(expected), "single {ray:?}");
        assert_eq!(scene.occluded(&ray), expected.is_some(), "single occluded {ray:?}");
        let found = Some(hits.get(index)).filter(Hit::is_hit);
        assert_eq!(bits(found), bits(expected), "batch {ray:?}");
        assert_eq!(occluded, expected.is_some(), "batch occluded {ray:?}");
        let packet = RayPacket::new(
            &[0, 1, 2, 3, 4, 5, 6, 7].map(|lane| rays.as_rays().get((index + lane) % rays.len())),
        );
        let mut of_packet = HitPacket::MISS;
        scene.intersect_packet(&packet, 1, &mut of_packet);
        let found = Some(of_packet.get(0)).filter(Hit::is_hit);
        assert_eq!(bits(found), bits(expected), "packet {ray:?}");
        if let Some(hit) = expected {
            // Anything but a panic: what it says of extreme surfaces is not promised.
            let surface = scene.surface(&ray, &hit);
            let _ = surface.offset_origin(-ray.dir);
        }
    }
}

/// The visibility query gives what any-hit rays give, from the origins of the rays.
fn compare_visibility(scene: &Scene, bytes: &mut Bytes<'_>, rays: &RayBatch) {
    let light = LightShape::Quad { corner: bytes.vec(), edge_u: bytes.vec(), edge_v: bytes.vec() };
    let per_point = [1, 4, 16, 17][usize::from(bytes.byte() % 4)];
    let origins: Vec<_> = (0..rays.len())
        .step_by(1 + rays.len() / 64)
        .map(|i| rays.as_rays().get(i).origin)
        .collect();
    let axis = |axis: usize| origins.iter().map(|origin| origin[axis]).collect::<Vec<_>>();
    let (x, y, z) = (axis(0), axis(1), axis(2));
    let points = Points::new(&x, &y, &z).expect("three arrays of one length");
    let count = origins.len() * per_point;
    let u: Vec<f32> = (0..count).map(|sample| (sample * 5 % 16) as f32 / 15.0).collect();
    let v: Vec<f32> = (0..count).map(|sample| (sample * 11 % 17) as f32 / 16.0).collect();
    let samples = SampleArrays::new(&u, &v, per_point).expect("two arrays of one length");
    let mut seen = vec![false; count];
    scene.visible_samples(&points, &light, &samples, &mut seen).expect("shapes that agree");
    for (sample, seen) in seen.into_iter().enumerate() {
        let origin = origins[sample / per_point];
        let dir = light.at(u[sample], v[sample]) - origin;
        let ray = Ray { origin, dir, t_min: 0.0, t_max: SHADOW_T_MAX };
        assert_eq!(seen, scene.intersect_reference(&ray).is_none(), "{ray:?} to {light:?}");
    }
}
