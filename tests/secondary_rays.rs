//! Rays that leave a surface do not meet the primitive that they leave, at any scale and place.

use glam::Vec3;
use octray::{Mesh, Quads, Ray, Scene, SceneBuilder, Spheres};
use proptest::prelude::*;

fn direction() -> impl Strategy<Value = Vec3> {
    // Axes and planes through the origin are where error bounds by magnitude vanish.
    let part = prop_oneof![1 => Just(0.0_f32), 4 => -1.0_f32..1.0];
    [part.clone(), part.clone(), part]
        .prop_map(Vec3::from)
        .prop_filter("a direction has a length", |dir| dir.length() > 0.05)
}

fn scene_of(shape: u8, center: Vec3, edge_u: Vec3, edge_v: Vec3) -> Option<Scene> {
    let mut scene = SceneBuilder::new();
    let corner = center - edge_u * 0.5 - edge_v * 0.5;
    match shape {
        0 => scene.add_quads(Quads::one(corner, edge_u, edge_v), 0),
        1 => scene.add_mesh(
            Mesh {
                positions: vec![corner, corner + edge_u, corner + edge_v],
                indices: vec![[0, 1, 2]],
                normals: Vec::new(),
            },
            0,
        ),
        _ => scene.add_spheres(Spheres::one(center, edge_u.length()), 0),
    };
    scene.build().ok()
}

proptest! {
    // A twentieth of the cases is nothing to test: as many as there are may be, or one run in a hundred fails.
    #![proptest_config(ProptestConfig {
        max_global_rejects: 20_000,
        ..ProptestConfig::with_cases(20_000)
    })]

    #[test]
    fn leaving_rays_do_not_come_back(
        shape in 0_u8..3,
        place in direction(),
        distance in prop_oneof![Just(0.0_f32), -1.0_f32..3.0],
        scale in -4.0_f32..6.0,
        edges in [direction(), direction()],
        (u, v) in (0.05_f32..0.45, 0.05_f32..0.45),
        from in direction(),
        towards in direction(),
        grazing in prop_oneof![Just(1.0_f32), 1.0e-6_f32..1.0],
    ) {
        let scale = 10_f32.powf(scale);
        let center = if distance == 0.0 { Vec3::ZERO } else { place * scale * 10_f32.powf(distance) };
        let [edge_u, edge_v] = edges.map(|edge| edge * scale);
        prop_assume!(edge_u.cross(edge_v).length() > 0.05 * scale * scale);
        let Some(scene) = scene_of(shape, center, edge_u, edge_v) else { return Ok(()) };
        let target = center + edge_u * (u - 0.5) + edge_v * (v - 0.5);
        let ray = Ray::new(target + from * scale * 3.0, -from);
        let Some(hit) = scene.intersect(&ray) else { return Ok(()) };
        let surface = scene.surface(&ray, &hit);
        let up = surface.geometric_normal;
        let up = if up.dot(ray.dir) > 0.0 { -up } else { up };
        // From a right angle to one that nearly runs along the surface.
        let along = towards - up * towards.dot(up);
        let dir = up * grazing + along;
        prop_assume!(dir.dot(up) > 0.0);
        // From inside, a sphere's far wall is in the way.
        prop_assume!(shape < 2 || up == surface.geometric_normal);
        for dir in [dir, dir * scale] {
            let leaving = Ray::new(surface.offset_origin(up), dir);
            prop_assert_eq!(scene.intersect(&leaving), None, "{:?} leaves {:?}", leaving, surface);
        }
    }
}
