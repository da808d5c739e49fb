//! The kernels give the same bits on 1, 8 and 16 lanes; the slab test never turns away a box whose
//! primitive a kernel meets, nor does an outline a ray.

mod made;

use glam::Vec3;
use made::shapes::Shape;
use made::{CHAOS_KINDS, RAY_KINDS, Random, chaos, rays, run};
use octray::geometry::Aabb;
use octray::kernels::{
    Met, Outlines, ScaledRay, SlabRay, intersect_quad, intersect_sphere, intersect_triangle,
    occluded_by_sphere,
};
use octray::simd::{F32x8, F32x16, LaneMask, Lanes};
use octray::{Quads, Ray, Spheres};

/// The numbers of a primitive in one lane: corners, or centre and radius.
#[derive(Clone, Copy)]
enum Numbers {
    Triangle([Vec3; 3]),
    Quad([Vec3; 4]),
    Sphere(Vec3, f32),
}

impl Numbers {
    fn of(shape: &Shape) -> Self {
        match *shape {
            Shape::Triangle(corners) => Self::Triangle(corners),
            Shape::Quad([corner, u, v]) => Self::Quad(Quads::one(corner, u, v).corners(0)),
            Shape::Sphere(center, radius) => Self::Sphere(center, radius),
        }
    }

    fn bounds(&self) -> Aabb {
        match self {
            Self::Triangle(corners) => Aabb::of_points(corners),
            Self::Quad(corners) => Aabb::of_points(corners),
            Self::Sphere(center, radius) => Spheres::one(*center, *radius).bounds(0),
        }
    }
}

/// What one lane met: `t, u, v` as bits.
type Lane = Option<[u32; 3]>;

fn lanes<F: Lanes>(values: impl Fn(usize) -> f32) -> F {
    let mut lanes = [0.0; 16];
    for (lane, value) in lanes[..F::LANES].iter_mut().enumerate() {
        *value = values(lane);
    }
    F::load(&lanes)
}

fn scaled<F: Lanes>(rays: &[Ray], active: u32) -> ScaledRay<F> {
    let field = |of: fn(&Ray) -> f32| lanes::<F>(|lane| of(&rays[lane]));
    ScaledRay::new(
        [field(|r| r.origin.x), field(|r| r.origin.y), field(|r| r.origin.z)],
        [field(|r| r.dir.x), field(|r| r.dir.y), field(|r| r.dir.z)],
        field(|r| r.t_min),
        field(|r| r.t_max),
        F::mask(active),
    )
}

/// `F::LANES` rays against as many primitives of one kind, lane by lane.
fn meet<F: Lanes>(rays: &[Ray], numbers: &[Numbers], active: u32) -> Vec<Lane> {
    let ray = scaled::<F>(rays, active);
    let mut found = vec![None; F::LANES];
    let mut note = |met: Option<Met<F>>| {
        let Some(met) = met else { return };
        assert_ne!(met.mask.bits(), 0, "nothing met is None");
        for lane in (0..F::LANES).filter(|lane| met.mask.bits() >> lane & 1 != 0) {
            assert_eq!(found[lane], None);
            found[lane] = Some([met.t, met.u, met.v].map(|value| value.lane(lane).to_bits()));
        }
    };
    if let Numbers::Sphere(..) = numbers[0] {
        let field = |of: fn(&Vec3, f32) -> f32| {
            lanes::<F>(|lane| match &numbers[lane] {
                Numbers::Sphere(center, radius) => of(center, *radius),
                _ => f32::NAN,
            })
        };
        let center = [field(|c, _| c.x), field(|c, _| c.y), field(|c, _| c.z)];
        note(intersect_sphere(&ray, center, field(|_, radius| radius), ray.valid));
        return found;
    }
    for main in 0..3 {
        let active = F::mask(ray.axis_masks()[main]);
        let sheared = ray.sheared(main);
        let corner = |place: usize| {
            sheared.project([(main + 1) % 3, (main + 2) % 3, main].map(|axis| {
                lanes(|lane| match &numbers[lane] {
                    Numbers::Triangle(corners) => corners[place][axis],
                    Numbers::Quad(corners) => corners[place][axis],
                    Numbers::Sphere(..) => f32::NAN,
                })
            }))
        };
        note(match numbers[0] {
            Numbers::Triangle(_) => {
                intersect_triangle(&sheared, [corner(0), corner(1), corner(2)], active)
            }
            _ => intersect_quad(&sheared, [corner(0), corner(1), corner(2), corner(3)], active),
        });
    }
    found
}

/// Sixteen lanes at once, twice eight, and sixteen times one.
fn compare(rays: &[Ray; 16], numbers: &[Numbers; 16], active: u32) -> Vec<Lane> {
    let sixteen = meet::<F32x16>(rays, numbers, active);
    for half in [0, 8] {
        let eight = meet::<F32x8>(&rays[half..], &numbers[half..], active >> half & 0xff);
        assert_eq!(eight, sixteen[half..half + 8], "8 and 16 lanes, active {active:#x}");
    }
    for lane in 0..16 {
        let one = meet::<f32>(&rays[lane..], &numbers[lane..], active >> lane & 1);
        assert_eq!(one[0], sixteen[lane], "1 and 16 lanes: {:?}, lane {lane}", rays[lane]);
    }
    sixteen
}

/// Sixteen primitives of the kind of the first one that `kind` names, and rays towards them.
fn sixteen(random: &mut Random, number: usize) -> Option<([Ray; 16], [Numbers; 16])> {
    let mut shapes = chaos(random, number % CHAOS_KINDS, 64);
    let kind = random.below(3);
    shapes.0.retain(|shape| match shape {
        Shape::Triangle(_) => kind == 0,
        Shape::Quad(_) => kind == 1,
        Shape::Sphere(..) => kind == 2,
    });
    shapes.0.truncate(16);
    let numbers: Vec<Numbers> = shapes.0.iter().map(Numbers::of).collect();
    let batch = rays(random, &shapes, random_kind(number), 16);
    let rays = std::array::from_fn(|lane| batch.as_rays().get(lane));
    Some((rays, numbers.try_into().ok()?))
}

fn random_kind(number: usize) -> usize {
    number / CHAOS_KINDS % RAY_KINDS
}

#[test]
fn lane_counts_agree() {
    run("lanes", 11, 60_000, |random, number| {
        let Some((rays, numbers)) = sixteen(random, number) else { return 0 };
        compare(&rays, &numbers, 0xffff);
        compare(&rays, &numbers, random.next() as u32 & 0xffff);
        32
    });
}

/// Every set of active lanes, with rays that all hit: exactly the active ones do.
#[test]
fn active_lanes_alone_hit() {
    let rays: [Ray; 16] = std::array::from_fn(|lane| {
        let x = lane as f32 * 0.25;
        Ray::new(Vec3::new(x, 0.25, -1.0), Vec3::new(0.125, 0.0, 1.0 + x))
    });
    let at = Vec3::new(-40.0, -40.0, 2.0);
    let (u, v) = (Vec3::X * 100.0, Vec3::Y * 100.0);
    for numbers in [
        Numbers::Triangle([at, at + u, at + v]),
        Numbers::Quad(Quads::one(at, u, v).corners(0)),
        Numbers::Sphere(Vec3::ZERO, 9.0),
    ] {
        for active in 0..=0xff {
            for active in [active, active << 8, active | active << 8] {
                let found = compare(&rays, &[numbers; 16], active);
                for (lane, found) in found.iter().enumerate() {
                    assert_eq!(found.is_some(), active >> lane & 1 != 0, "{active:#x}");
                }
            }
        }
    }
}

/// Wherever a kernel meets a primitive, the slab test of its box includes that `t`.
#[test]
fn slabs_never_contradict_kernels() {
    let tried = run("slabs", 12, 400_000, |random, number| {
        let shapes = chaos(random, number % CHAOS_KINDS, 4);
        let batch = rays(random, &shapes, random_kind(number), 16);
        let mut met = 0;
        for shape in &shapes.0 {
            let numbers = [Numbers::of(shape)];
            let bounds = numbers[0].bounds();
            if !bounds.min.is_finite() || !bounds.max.is_finite() {
                continue;
            }
            let extent = bounds.min.abs().max(bounds.max.abs()).max_element();
            for index in 0..batch.len() {
                let ray = batch.as_rays().get(index);
                let Some([t, ..]) = meet::<f32>(&[ray], &numbers, 1)[0] else { continue };
                met += 1;
                let t = f32::from_bits(t);
                let scaled = scaled::<f32>(&[ray], 1);
                let slab = SlabRay::new(&scaled, extent);
                let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
                let ends = |axis: usize| {
                    if slab.inverse[axis] < 0.0 {
                        (max[axis], min[axis])
                    } else {
                        (min[axis], max[axis])
                    }
                };
                let near_planes = [ends(0).0, ends(1).0, ends(2).0];
                let far_planes = [ends(0).1, ends(1).1, ends(2).1];
                for (near, far) in [
                    slab.interval(near_planes, far_planes, scaled.t_min, scaled.t_max),
                    slab.interval_any_sign(min, max, scaled.t_min, scaled.t_max),
                ] {
                    assert!(near <= t && t <= far, "{t} outside {near}..{far}: {ray:?} {shape:?}");
                }
            }
        }
        met
    });
    assert!(tried > 1_000_000, "only {tried} hits");
}

/// The kernel for shadow rays says of a sphere what the one for hits says.
#[test]
fn spheres_occlude_where_they_are_met() {
    fn occluded<F: Lanes>(rays: &[Ray], center: Vec3, radius: f32, active: u32) -> u32 {
        let ray = scaled::<F>(rays, active);
        occluded_by_sphere(&ray, center.to_array().map(F::splat), F::splat(radius), ray.valid)
    }
    let met = run("occluding spheres", 13, 200_000, |random, number| {
        let shapes = chaos(random, number % CHAOS_KINDS, 16);
        let batch = rays(random, &shapes, random_kind(number), 16);
        let mut rays: [Ray; 16] = std::array::from_fn(|lane| batch.as_rays().get(lane));
        let mut hits = 0;
        for shape in &shapes.0 {
            let Shape::Sphere(center, radius) = *shape else { continue };
            // Ends within a hair of the sphere are where floats can't tell.
            if random.once_in(2) {
                for ray in &mut rays {
                    let length = ray.dir.length();
                    let distance = (center - ray.origin).length() + radius * random.signed();
                    ray.t_max = distance / length * (1.0 + 1.0e-6 * random.signed());
                }
            }
            let active = random.next() as u32 & 0xffff;
            let numbers = [Numbers::Sphere(center, radius); 16];
            let found = meet::<F32x16>(&rays, &numbers, active);
            let lanes = found.iter().enumerate();
            let expected = lanes.fold(0, |bits, (at, met)| bits | u32::from(met.is_some()) << at);
            let at = format!("{rays:?} {center} {radius}");
            assert_eq!(occluded::<F32x16>(&rays, center, radius, active), expected, "{at}");
            for half in [0, 8] {
                let (rays, active) = (&rays[half..], active >> half & 0xff);
                let found = occluded::<F32x8>(rays, center, radius, active);
                assert_eq!(found, expected >> half & 0xff, "{at}");
            }
            hits += u64::from(expected.count_ones());
        }
        hits
    });
    assert!(met > 500_000, "only {met} hits");
}

/// Rays of one start through corners, edges, insides and besides: an outline keeps those that the
/// triangle's own test says meet it, and turns others away.
#[test]
fn outlines_keep_every_ray_that_meets() {
    let turned_away = std::sync::atomic::AtomicU64::new(0);
    let missed = std::sync::atomic::AtomicU64::new(0);
    run("outlines", 9, 4000, |random, number| {
        let shapes = chaos(random, number % CHAOS_KINDS, 40);
        let triangles: Vec<[Vec3; 3]> = shapes
            .0
            .iter()
            .filter_map(|shape| match shape {
                Shape::Triangle(corners) => Some(*corners),
                _ => None,
            })
            .collect();
        let mut tried = 0;
        for eight in triangles.chunks_exact(8) {
            let [a, b, c] = random.pick(eight);
            let start = a + (b - a) * random.signed() + random.vec() * (c - a) * random.scale(0, 4);
            let corner = |field: usize| {
                let part = |lane: usize| eight[lane][field / 3][field % 3] - start[field % 3];
                F32x8::new(std::array::from_fn(part))
            };
            let outlines = Outlines::new(&std::array::from_fn(corner));
            for (place, &corners) in eight.iter().enumerate() {
                for kind in 0..8 {
                    let [a, b, c] = corners;
                    let (u, v) = match kind {
                        0 => (0.0, 0.0),
                        1 => (1.0, 0.0),
                        2 | 3 => (random.unit(), 0.0),
                        4 => (random.unit() * 0.5, random.unit() * 0.5),
                        5 => (random.unit() * 1e-6, random.unit()),
                        _ => (random.signed() * 2.0, random.signed() * 2.0),
                    };
                    let target = a + (b - a) * u + (c - a) * v;
                    let ray = Ray::new(start, (target - start) * random.scale(-3, 3));
                    let scaled = scaled::<f32>(&[ray], 1);
                    let met = meet::<f32>(&[ray], &[Numbers::Triangle(corners)], 1)[0].is_some();
                    let kept = outlines.may_meet(place, &scaled.dir);
                    assert!(kept || !met, "{corners:?}, {ray:?}");
                    let one = std::sync::atomic::Ordering::Relaxed;
                    missed.fetch_add(u64::from(!met), one);
                    turned_away.fetch_add(u64::from(!kept), one);
                    tried += 1;
                }
            }
        }
        tried
    });
    let (turned_away, missed) = (turned_away.into_inner(), missed.into_inner());
    assert!(10 * turned_away > missed, "{turned_away} of {missed} misses turned away");
}
