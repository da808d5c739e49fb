//! What is tested: primitives and boxes, each with its kernel, and rays made ready for it.

use octray::glam::Vec3;
use octray::kernels::{
    Met, ScaledRay, Sheared, SlabRay, intersect_quad, intersect_sphere, intersect_triangle,
};
use octray::simd::{LaneMask, Lanes};
use octray::{Hit, Mesh, Quads, Ray, Scene, SceneBuilder, Spheres};

use crate::random::Random;

/// Coordinates of primitives are at most this far from zero.
const EXTENT: f32 = 4.0;

/// The axis along which all rays run most.
const MAIN: usize = 2;

/// Rays as the traversals keep them.
pub(crate) struct Ready<F: Lanes> {
    pub(crate) scaled: ScaledRay<F>,
    sheared: Sheared<F>,
    slab: SlabRay<F>,
}

impl<F: Lanes> Ready<F> {
    fn new(rays: &[Ray]) -> Self {
        let field = |of: fn(&Ray) -> f32| {
            let values: Vec<f32> = rays.iter().map(of).collect();
            F::load(&values)
        };
        let scaled = ScaledRay::new(
            [field(|r| r.origin.x), field(|r| r.origin.y), field(|r| r.origin.z)],
            [field(|r| r.dir.x), field(|r| r.dir.y), field(|r| r.dir.z)],
            field(|r| r.t_min),
            field(|r| r.t_max),
            F::mask(u32::MAX),
        );
        let every_lane = u32::MAX >> (32 - F::LANES);
        assert_eq!(scaled.axis_masks()[MAIN], every_lane, "one axis for all");
        Self { scaled, sheared: scaled.sheared(MAIN), slab: SlabRay::new(&scaled, EXTENT) }
    }

    pub(crate) fn all(rays: &[Ray]) -> Vec<Self> {
        rays.chunks_exact(F::LANES).map(Self::new).collect()
    }
}

/// A primitive or a box, with the kernel that it is tested by.
pub(crate) trait Kernel {
    /// Where rays meet it.
    fn meet<F: Lanes>(&self, rays: &Ready<F>) -> Option<Met<F>>;

    /// A scene of this alone; for a box, of what fits into it.
    fn scene(&self) -> Scene;

    /// True if `t, u, v` of the scaled ray are, bit for bit, the reference's hit of the ray.
    fn is_right(found: Option<[f32; 3]>, scale: f32, expected: Option<Hit>) -> bool {
        let expected = expected.map(|hit| [hit.t, hit.u, hit.v].map(f32::to_bits));
        found.map(|[t, u, v]| [t * scale, u, v].map(f32::to_bits)) == expected
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Triangle([Vec3; 3]);

impl Triangle {
    pub(crate) fn seeded(random: &mut Random) -> Self {
        let at = random.place();
        Self([at, at + random.edge(), at + random.edge()])
    }
}

impl Kernel for Triangle {
    #[inline(always)]
    fn meet<F: Lanes>(&self, rays: &Ready<F>) -> Option<Met<F>> {
        let corners = self.0.map(|corner| rays.sheared.project(turned(corner)));
        intersect_triangle(&rays.sheared, corners, rays.scaled.valid)
    }

    fn scene(&self) -> Scene {
        let mesh = Mesh { positions: self.0.to_vec(), indices: vec![[0, 1, 2]], ..Mesh::default() };
        scene_of(|builder, material| builder.add_mesh(mesh, material))
    }
}

/// Corner and edges, and all corners.
#[derive(Clone, Copy)]
pub(crate) struct Quad([Vec3; 3], [Vec3; 4]);

impl Quad {
    pub(crate) fn seeded(random: &mut Random) -> Self {
        let (at, u, v) = (random.place(), random.edge(), random.edge());
        Self([at, u, v], Quads::one(at, u, v).corners(0))
    }
}

impl Kernel for Quad {
    #[inline(always)]
    fn meet<F: Lanes>(&self, rays: &Ready<F>) -> Option<Met<F>> {
        let corners = self.1.map(|corner| rays.sheared.project(turned(corner)));
        intersect_quad(&rays.sheared, corners, rays.scaled.valid)
    }

    fn scene(&self) -> Scene {
        let [at, u, v] = self.0;
        scene_of(|builder, material| builder.add_quads(Quads::one(at, u, v), material))
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Sphere(pub(crate) Vec3, pub(crate) f32);

impl Sphere {
    pub(crate) fn seeded(random: &mut Random) -> Self {
        Self(random.place(), random.range(0.2, 0.4))
    }
}

impl Kernel for Sphere {
    #[inline(always)]
    fn meet<F: Lanes>(&self, rays: &Ready<F>) -> Option<Met<F>> {
        let center = self.0.to_array().map(F::splat);
        intersect_sphere(&rays.scaled, center, F::splat(self.1), rays.scaled.valid)
    }

    fn scene(&self) -> Scene {
        scene_of(|builder, material| builder.add_spheres(Spheres::one(self.0, self.1), material))
    }
}

/// The box around a sphere, and rays whose directions agree in sign.
#[derive(Clone, Copy)]
pub(crate) struct Slab(pub(crate) Vec3, pub(crate) f32);

impl Slab {
    fn ends<F: Lanes>(&self) -> [[F; 3]; 2] {
        [self.0 - self.1, self.0 + self.1].map(|end| end.to_array().map(F::splat))
    }
}

impl Kernel for Slab {
    #[inline(always)]
    fn meet<F: Lanes>(&self, rays: &Ready<F>) -> Option<Met<F>> {
        let ([min, max], ray) = (self.ends(), &rays.scaled);
        met_within(rays.slab.interval(min, max, ray.t_min, ray.t_max))
    }

    fn scene(&self) -> Scene {
        Sphere(self.0, self.1).scene()
    }

    /// A box may be met beside its sphere, never the other way round.
    fn is_right(found: Option<[f32; 3]>, scale: f32, expected: Option<Hit>) -> bool {
        let inside = |t| found.is_some_and(|[near, far, _]| near * scale <= t && t <= far * scale);
        expected.is_none_or(|hit| inside(hit.t))
    }
}

/// The same box, by the test that asks each lane which plane comes first.
#[derive(Clone, Copy)]
pub(crate) struct SlabAnySign(pub(crate) Slab);

impl Kernel for SlabAnySign {
    #[inline(always)]
    fn meet<F: Lanes>(&self, rays: &Ready<F>) -> Option<Met<F>> {
        let ([min, max], ray) = (self.0.ends(), &rays.scaled);
        met_within(rays.slab.interval_any_sign(min, max, ray.t_min, ray.t_max))
    }

    fn scene(&self) -> Scene {
        self.0.scene()
    }

    fn is_right(found: Option<[f32; 3]>, scale: f32, expected: Option<Hit>) -> bool {
        Slab::is_right(found, scale, expected)
    }
}

/// The lanes whose interval is not empty.
#[inline(always)]
fn met_within<F: Lanes>((near, far): (F, F)) -> Option<Met<F>> {
    let mask = near.le(far);
    mask.any().then_some(Met { mask, t: near, u: far, v: F::splat(0.0) })
}

/// A point in all lanes, in the order of the sheared space.
#[inline(always)]
fn turned<F: Lanes>(point: Vec3) -> [F; 3] {
    [point[(MAIN + 1) % 3], point[(MAIN + 2) % 3], point[MAIN]].map(F::splat)
}

fn scene_of(add: impl FnOnce(&mut SceneBuilder, u32) -> u32) -> Scene {
    let mut builder = SceneBuilder::new();
    let material = builder.add_material(Default::default());
    add(&mut builder, material);
    builder.build().expect("a seeded primitive is valid")
}
