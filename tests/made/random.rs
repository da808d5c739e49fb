//! Seeded numbers.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

/// The rounds of a test: `OCTRAY_SOAK` (1 if it is not set) times `usual`, after the first
/// `OCTRAY_SKIP` (0) times `usual`. So a long soak can be done in pieces.
pub fn rounds(usual: u64) -> Range<u64> {
    let number = |name: &str, default| {
        let text = std::env::var(name).ok();
        text.map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name}: {text}?")))
    };
    let skip: u64 = number("OCTRAY_SKIP", 0);
    usual * skip..usual * (skip + number("OCTRAY_SOAK", 1))
}

/// Runs the rounds of a test on all threads, `usual` times [`rounds`], each with a generator and its
/// number; prints how many rays they say to have tried. All rounds run; the first that failed is
/// named with what would run it alone: `OCTRAY_ROUND`.
pub fn run(
    what: &str,
    test: u64,
    usual: u64,
    round: impl Fn(&mut Random, usize) -> u64 + Sync,
) -> u64 {
    let start = Instant::now();
    let one = |number| round(&mut Random::new(test, number), number as usize);
    if let Ok(number) = std::env::var("OCTRAY_ROUND") {
        return one(number.parse().expect("OCTRAY_ROUND is a whole number"));
    }
    let rounds = rounds(usual);
    let results: Vec<Result<u64, u64>> = rounds
        .clone()
        .into_par_iter()
        .map(|number| catch_unwind(AssertUnwindSafe(|| one(number))).map_err(|_| number))
        .collect();
    let failed: Vec<u64> = results.iter().filter_map(|result| result.err()).collect();
    let rays = results.iter().flatten().sum();
    println!("{what}: {rays} rays in rounds {rounds:?}, {:.1?}", start.elapsed());
    assert!(failed.is_empty(), "{what}: {} rounds failed: {failed:.40?}", failed.len());
    rays
}

/// A small generator of numbers (Vigna 2015, splitmix64).
pub struct Random(u64);

impl Random {
    /// The generator of round `round` of the test `test`: rounds may run in any order.
    pub fn new(test: u64, round: u64) -> Self {
        let mut random = Self(test.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ round);
        random.next();
        random
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to `n`, exclusive.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// True once in `n`.
    pub fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for place in (1..items.len()).rev() {
            items.swap(place, self.below(place + 1));
        }
    }

    /// From 0 to 1, exclusive.
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    /// From -1 to 1.
    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }

    /// In the cube from -1 to 1.
    pub fn vec(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    /// A unit vector.
    pub fn dir(&mut self) -> Vec3 {
        loop {
            let vec = self.vec();
            let length = vec.length();
            if length > 0.1 && length <= 1.0 {
                return vec / length;
            }
        }
    }

    /// Whole coordinates from `-half` to `half`.
    pub fn grid(&mut self, half: i32) -> Vec3 {
        let mut one = || (self.below(2 * half as usize + 1) as i32 - half) as f32;
        Vec3::new(one(), one(), one())
    }

    /// About `10^low` to `10^high`, every order of magnitude alike.
    pub fn scale(&mut self, low: i32, high: i32) -> f32 {
        let power = low + self.below((high - low + 1) as usize) as i32;
        let ten = (0..power.unsigned_abs()).fold(1.0_f64, |ten, _| ten * 10.0);
        let ten = if power < 0 { 1.0 / ten } else { ten };
        (ten * f64::from(0.5 + 0.5 * self.unit())) as f32
    }

    /// Any float at all.
    pub fn bits(&mut self) -> f32 {
        f32::from_bits(self.next() as u32)
    }

    /// Any finite float.
    pub fn finite_bits(&mut self) -> f32 {
        loop {
            let value = self.bits();
            if value.is_finite() {
                return value;
            }
        }
    }

    /// A float that is a few steps beside `value`, or `value`.
    pub fn beside(&mut self, value: f32) -> f32 {
        (0..self.below(4)).fold(value, |value, _| {
            if self.once_in(2) { value.next_up() } else { value.next_down() }
        })
    }

    pub fn vec_beside(&mut self, value: Vec3) -> Vec3 {
        Vec3::new(self.beside(value.x), self.beside(value.y), self.beside(value.z))
    }
}
