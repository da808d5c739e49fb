//! The colours of a wave's paths, part by part.
//!
//! Rays and points mostly come with their paths in a row, at least in the first round; then sixteen
//! colours are added at once.

use bumpalo::Bump;
use glam::Vec3;

use crate::render::arena::array;
use crate::scene::{LANES, Vectors};
use crate::simd::{F32x16, Lanes, each};

/// All lanes of a register.
const ALL: u32 = 0xffff;

/// The colours of paths, in an arena.
pub(super) struct Colors<'b>([&'b mut [f32]; 3]);

impl<'b> Colors<'b> {
    pub(super) fn with_capacity_in(capacity: usize, arena: &'b Bump) -> Self {
        Self(std::array::from_fn(|_| array(capacity, 0.0, arena)))
    }

    /// Makes the first `len` black.
    pub(super) fn clear(&mut self, len: usize) {
        self.0.iter_mut().for_each(|part| part[..len].fill(0.0));
    }

    /// The first `len`, part by part.
    pub(super) fn parts(&self, len: usize) -> [&[f32]; 3] {
        self.0.each_ref().map(|part| &part[..len])
    }

    /// Adds a value to the black of a path: -0 becomes 0.
    pub(super) fn set(&mut self, path: usize, color: Vec3) {
        self.0.iter_mut().zip(color.to_array()).for_each(|(part, value)| part[path] = 0.0 + value);
    }

    /// Adds the first `len` of `other`, so many of each that is `count` in a row, to the colours from the one that
    /// number `first` of them all belongs to.
    pub(super) fn add_each(&mut self, other: &Self, (first, len): (usize, usize), count: usize) {
        for (sums, values) in self.0.iter_mut().zip(other.parts(len)) {
            let (mut to, mut left) = (first / count, count - first % count);
            let mut rest = values;
            while !rest.is_empty() {
                let (own, others) = rest.split_at(left.min(rest.len()));
                sums[to] = own.iter().fold(sums[to], |sum, value| sum + value);
                (rest, to, left) = (others, to + 1, count);
            }
        }
    }

    /// Divides the first `len`.
    pub(super) fn divide(&mut self, len: usize, by: f32) {
        self.0.iter_mut().for_each(|part| part[..len].iter_mut().for_each(|value| *value /= by));
    }

    /// Adds the colours of the lanes in `mask` to those of their paths, which are different ones in rising
    /// order. Lanes that are not in it may name anything.
    #[inline(always)]
    pub(super) fn add(&mut self, path: &[u32; LANES], mask: u32, color: &Vectors) {
        let first = path[0] as usize;
        if mask == ALL && path[LANES - 1] as usize - first == LANES - 1 {
            for (part, &color) in self.0.iter_mut().zip(color) {
                let part = &mut part[first..first + LANES];
                (F32x16::load(part) + color).store(part);
            }
            return;
        }
        let color: [[f32; LANES]; 3] = each(|axis| color[axis].to_array());
        let mut rest = mask;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            for (part, color) in self.0.iter_mut().zip(&color) {
                part[path[lane] as usize] += color[lane];
            }
            rest &= rest - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_in_a_row_and_others_get_the_same() {
        let arena = Bump::new();
        let mut colors = Colors::with_capacity_in(48, &arena);
        let whole = |colors: &Colors<'_>| -> [Vec3; 48] {
            let [r, g, b] = colors.parts(48);
            std::array::from_fn(|path| Vec3::new(r[path], g[path], b[path]))
        };
        let mut expected = [Vec3::ZERO; 48];
        let row = |first: u32| -> [u32; LANES] { each(|lane| first + lane as u32) };
        let (mut gaps, mut with_rest) = (row(3), row(5));
        // Still rising, with the last path where a row has it; and lanes left over from other paths.
        gaps[15] += 9;
        with_rest[1..].fill(7);
        with_rest[15] = with_rest[0] + 15;
        let turns =
            [(row(0), ALL), (row(17), ALL), (row(30), 0x7ffe), (gaps, ALL), (with_rest, 0b11)];
        for (turn, (path, mask)) in (1..).zip(turns) {
            let color = |lane: usize, axis: usize| (turn * 100 + lane * 3 + axis) as f32;
            let lanes = each(|axis| F32x16::new(each(|lane| color(lane, axis))));
            colors.add(&path, mask, &lanes);
            for lane in (0..LANES).filter(|lane| mask >> lane & 1 != 0) {
                let [r, g, b] = each(|axis| color(lane, axis));
                expected[path[lane] as usize] += Vec3::new(r, g, b);
            }
        }
        assert_eq!(whole(&colors), expected);
        colors.clear(20);
        expected[..20].fill(Vec3::ZERO);
        assert_eq!(whole(&colors), expected);
    }

    #[test]
    fn samples_are_added_to_their_pixels() {
        let arena = Bump::new();
        let (count, samples) = (3, 29);
        let value = |sample: usize, axis: usize| 1.0 / (sample * 3 + axis + 1) as f32;
        let mut sums = Colors::with_capacity_in(16, &arena);
        for (first, len) in [(0, 16), (16, 1), (17, 4), (21, samples - 21)] {
            let mut part = Colors::with_capacity_in(16, &arena);
            for path in 0..len {
                part.set(path, Vec3::from_array(each(|axis| value(first + path, axis))));
            }
            sums.add_each(&part, (first, len), count);
        }
        sums.divide(9, 3.0);
        for (axis, part) in sums.parts(10).into_iter().enumerate() {
            for (pixel, &found) in part.iter().enumerate() {
                let all = (pixel * count)..(pixel * count + count).min(samples);
                let sum = all.fold(0.0, |sum, sample| sum + value(sample, axis));
                assert_eq!(found, if pixel < 9 { sum / 3.0 } else { sum });
            }
        }
    }
}
