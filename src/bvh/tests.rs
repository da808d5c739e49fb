//! Trees over points: valid whatever the points, the same for every number of threads.

use super::*;

/// Boxes of spheres: any kind's box will do, and a sphere has one number less to invent.
struct Points(Vec<(PrimKind, Vec3)>);

impl PrimitiveSource for Points {
    fn boxes(&self, first: u32, into: &mut [BuildPrimitive]) {
        for (one, id) in into.iter_mut().zip(first..) {
            let (kind, at) = self.0[id as usize];
            let bounds = match kind {
                PrimKind::Sphere => crate::geometry::Spheres::one(at, 0.0).bounds(0),
                _ => Aabb::of_points(&[at]),
            };
            *one = BuildPrimitive::new(bounds, kind, id);
        }
    }
    fn triangle(&self, id: u32) -> [Vec3; 3] {
        [self.0[id as usize].1; 3]
    }
    fn quad(&self, id: u32) -> [Vec3; 4] {
        [self.0[id as usize].1; 4]
    }
    fn sphere(&self, id: u32) -> (Vec3, f32) {
        (self.0[id as usize].1, 0.0)
    }
}

impl Points {
    /// Trees of all qualities, the usual one returned.
    fn tree(&self) -> Bvh {
        self.tree_of(BuildQuality::Fast);
        self.tree_of(BuildQuality::High);
        self.tree_of(BuildQuality::Balanced)
    }

    fn tree_of(&self, quality: BuildQuality) -> Bvh {
        let bvh = Bvh::build(self.0.len(), self, quality, &Watch::new()).unwrap();
        assert_eq!(bvh.validate(), Ok(()));
        assert!(bvh.depth <= MAX_DEPTH);
        bvh
    }
}

/// `count` points from a generator of numbers (Vigna 2015, splitmix64), laid out by `place`.
fn points(count: usize, kinds: u64, place: impl Fn(&mut dyn FnMut() -> f32) -> Vec3) -> Points {
    let mut state = count as u64;
    let mut next = move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    let point = |_| {
        let kind = PrimKind::ALL[(next() % kinds) as usize];
        (kind, place(&mut || (next() >> 40) as f32 / (1 << 24) as f32))
    };
    Points((0..count).map(point).collect())
}

#[test]
fn odd_inputs_make_valid_trees() {
    for count in [0, 1, 2, 3, 7, 8, 9, 17, 64, 65, 300, 5_000] {
        for kinds in 1..=3 {
            points(count, kinds, |random| Vec3::new(random(), random(), random())).tree();
            // All in one point, on a few points, on a line.
            points(count, kinds, |_| Vec3::ONE).tree();
            points(count, kinds, |random| Vec3::splat((random() * 3.0).floor())).tree();
            points(count, kinds, |random| Vec3::new(0.0, random(), 0.0)).tree();
            // Near the largest float, near the smallest, and spaced by powers of two.
            points(count, kinds, |random| (Vec3::new(random(), random(), random()) - 0.5) * 1e30)
                .tree();
            points(count, kinds, |random| {
                Vec3::new(random() - 0.5, random() - 0.5, 0.1) * f32::MAX
            })
            .tree();
            points(count, kinds, |random| Vec3::new(random(), random(), 0.0) * 1e-40).tree();
            points(count, kinds, |random| {
                Vec3::new((random() * 250.0 - 125.0).exp2(), random(), -(random() * 120.0).exp2())
            })
            .tree();
        }
    }
}

#[test]
fn threads_do_not_change_the_tree() {
    let points = points(100_000, 3, |random| Vec3::new(random(), random() * random(), random()));
    let trees = [1, 2, 3, 8].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| points.tree())
    });
    let bits = |bvh: &Bvh| {
        let bounds = bvh.nodes.iter().map(|node| node.bounds.map(|row| row.map(f32::to_bits)));
        let refers = bvh.nodes.iter().map(|node| (node.index, node.meta));
        (bounds.zip(refers).collect::<Vec<_>>(), bvh.leaves.slot_of.clone(), bvh.depth)
    };
    assert!(trees.iter().all(|tree| bits(tree) == bits(&trees[0])), "trees differ");
}

/// Small triangles side by side, and amid them, with ids between theirs, seven that are larger than all.
struct Town;

impl Town {
    const SIDE: u32 = 512;
    const PER_GROUND: u32 = 40_000;
    const LEN: u32 = Self::SIDE * Self::SIDE;
}

impl PrimitiveSource for Town {
    fn boxes(&self, first: u32, into: &mut [BuildPrimitive]) {
        for (one, id) in into.iter_mut().zip(first..) {
            *one = BuildPrimitive::of_triangle(&self.triangle(id), id);
        }
    }
    fn triangle(&self, id: u32) -> [Vec3; 3] {
        if id % Self::PER_GROUND == 9 {
            let by = 0.1 * (id / Self::PER_GROUND) as f32;
            return [(-1.0, -1.0), (2.0, -1.0), (-1.0, 2.0)]
                .map(|(x, z)| Vec3::new(x + by, 0.0, z - by));
        }
        // At heights among which no plane parts the ground from them.
        let height = (id * 7919 % 101) as f32 - 50.0;
        let at = Vec3::new((id % Self::SIDE) as f32, height, (id / Self::SIDE) as f32);
        [Vec3::ZERO, Vec3::X, Vec3::Y].map(|corner| (at + corner) / Self::SIDE as f32)
    }
    fn quad(&self, _: u32) -> [Vec3; 4] {
        unreachable!("all are triangles")
    }
    fn sphere(&self, _: u32) -> (Vec3, f32) {
        unreachable!("all are triangles")
    }
}

#[test]
fn no_box_is_large_for_few_primitives_in_it() {
    let large = BuildQuality::ALL.map(|quality| {
        let bvh = Bvh::build(Town::LEN as usize, &Town, quality, &Watch::new()).unwrap();
        assert_eq!(bvh.validate(), Ok(()));
        let slots = bvh.nodes.iter().flat_map(|node| (0..WIDTH).map(move |slot| (node, slot)));
        slots
            .filter(|&(node, slot)| {
                let area = node.child_bounds(slot).half_area();
                matches!(node.child(slot), Child::Inner(_)) && area > 0.5 * bvh.bounds.half_area()
            })
            .count()
    });
    assert_eq!(large, [0; 3], "large boxes in trees of each quality");
}
