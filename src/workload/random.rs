//! Random numbers for workloads and scenes: a function of the seed alone, the same everywhere.

use glam::Vec3;

/// A stream of random numbers (SplitMix64: Steele, Lea, Flood 2014).
#[derive(Clone, Debug)]
pub(super) struct Random(u64);

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

impl Random {
    /// The stream `stream` of `seed`. Streams are independent of one another.
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        Self(mix(seed ^ mix(stream.wrapping_add(GOLDEN))))
    }

    pub(super) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        mix(self.0)
    }

    /// From 0 to 1, 1 exclusive.
    pub(super) fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * (1.0 / (1 << 24) as f32)
    }

    /// From `low` to `high`.
    pub(super) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// From 0 to `count`, `count` exclusive.
    pub(super) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.bits()) * count as u128) >> 64) as usize
    }

    /// A unit vector around the unit vector `normal`, with the density of its cosine.
    pub(super) fn cosine_hemisphere(&mut self, normal: Vec3) -> Vec3 {
        let (radius, angle) = (self.unit().sqrt(), std::f32::consts::TAU * self.unit());
        let (x, y) = (radius * angle.cos(), radius * angle.sin());
        let z = (1.0 - radius * radius).max(0.0).sqrt();
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        (tangent * x + bitangent * y + normal * z).normalize()
    }

    /// The numbers below `count` in random order (Fisher and Yates).
    pub(super) fn permutation(&mut self, count: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..count as u32).collect();
        for last in (1..count).rev() {
            let other = self.below(last + 1);
            order.swap(last, other);
        }
        order
    }
}

/// Noise of several octaves at a point: smooth, about -1 to 1, a function of place and seed.
pub(super) fn fractal_noise(at: Vec3, octaves: u32, seed: u64) -> f32 {
    let (mut sum, mut amplitude, mut frequency) = (0.0, 0.5, 1.0);
    for octave in 0..u64::from(octaves) {
        sum += amplitude
            * lattice_noise(at * frequency, seed.wrapping_add(octave.wrapping_mul(GOLDEN)));
        amplitude *= 0.5;
        // Not 2: the lattices of the octaves must not lie on top of one another.
        frequency *= 2.03;
    }
    sum
}

/// Random values at the integer points, blended smoothly between them; -1 to 1.
fn lattice_noise(at: Vec3, seed: u64) -> f32 {
    let base = at.floor();
    let inside = at - base;
    let blend = inside * inside * (Vec3::splat(3.0) - 2.0 * inside);
    let cell = base.as_i64vec3();
    let corner = |x: i64, y: i64, z: i64| {
        let (x, y, z) = ((cell.x + x) as u64, (cell.y + y) as u64, (cell.z + z) as u64);
        let bits = mix(seed ^ mix(x ^ mix(y ^ mix(z.wrapping_add(GOLDEN)))));
        (bits >> 40) as f32 * (2.0 / (1 << 24) as f32) - 1.0
    };
    let along_x = |y, z| lerp(corner(0, y, z), corner(1, y, z), blend.x);
    let along_y = |z| lerp(along_x(0, z), along_x(1, z), blend.y);
    lerp(along_y(0), along_y(1), blend.z)
}

fn lerp(from: f32, to: f32, at: f32) -> f32 {
    from + (to - from) * at
}

fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}
