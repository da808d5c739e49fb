//! Rays, hits and packed values in SoA arrays that live in a tile's arena.
//!
//! All arrays have places for whole registers of sixteen lanes: what lies past the end means nothing.

use bumpalo::Bump;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::hit::{Hit, Hits, NO_HIT};
use crate::pages::Line;
use crate::ray::Rays;
use crate::scene::{LANES, Vectors};
use crate::simd::{F32x16, Lanes, each};

/// An array of copies of `value`, which has four bytes, with places for `capacity` values. It starts at a
/// line of the cache, and its neighbour in the arena at another one of its page: loops go through many arrays
/// at the same pace, and lines at the same place of their pages share few places in the cache.
pub(super) fn array<T: Pod>(capacity: usize, value: T, arena: &Bump) -> &mut [T] {
    let lines = arena.alloc_slice_fill_copy(capacity.div_ceil(LANES) + 1, Line::zeroed());
    let array = bytemuck::cast_slice_mut(lines);
    array.fill(value);
    array
}

/// Writes the values of the lanes in `mask` side by side to `to`, from place `at`.
#[inline(always)]
pub(super) fn pack<T: Copy>(from: &[T; LANES], mask: u32, to: &mut [T], at: usize) {
    if mask == 0xffff {
        to[at..at + LANES].copy_from_slice(from);
        return;
    }
    let (mut rest, mut at) = (mask, at);
    while rest != 0 {
        to[at] = from[rest.trailing_zeros() as usize % LANES];
        at += 1;
        rest &= rest - 1;
    }
}

/// The rays of a round, each with its path and its weight.
pub(super) struct ArenaRays<'b> {
    len: usize,
    /// Origin, then direction.
    parts: [&'b mut [f32]; 6],
    t_min: &'b [f32],
    t_max: &'b [f32],
    /// The camera ray that it follows from.
    path: &'b mut [u32],
    /// What its colour counts for in the path's.
    weight: &'b mut [f32],
}

impl<'b> ArenaRays<'b> {
    pub(super) fn with_capacity_in(capacity: usize, arena: &'b Bump) -> Self {
        Self {
            len: 0,
            parts: std::array::from_fn(|_| array(capacity, 0.0, arena)),
            t_min: array(capacity, 0.0, arena),
            t_max: array(capacity, f32::INFINITY, arena),
            path: array(capacity, 0, arena),
            weight: array(capacity, 0.0, arena),
        }
    }

    /// `capacity` rays with one origin, each of a path of its own in their order, all of weight 1. Their
    /// directions are to be set.
    pub(super) fn from_eye(eye: Vec3, capacity: usize, arena: &'b Bump) -> Self {
        let rays = Self::with_capacity_in(capacity, arena);
        for axis in 0..3 {
            rays.parts[axis].fill(eye[axis]);
        }
        rays.path.iter_mut().zip(0..).for_each(|(path, number)| *path = number);
        rays.weight.fill(1.0);
        rays
    }

    pub(super) fn set_len(&mut self, len: usize) {
        self.len = len;
    }

    /// Sets the directions of sixteen rays.
    #[inline(always)]
    pub(super) fn set_dirs(&mut self, start: usize, dirs: &Vectors) {
        for (part, dir) in self.parts[3..].iter_mut().zip(dirs) {
            dir.store(&mut part[start..]);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends the rays of the lanes in `mask`.
    #[inline(always)]
    pub(super) fn push(
        &mut self,
        (origin, dir): (&Vectors, &Vectors),
        (path, weight): (&[u32; LANES], F32x16),
        mask: u32,
    ) {
        for axis in 0..3 {
            pack(&origin[axis].to_array(), mask, self.parts[axis], self.len);
            pack(&dir[axis].to_array(), mask, self.parts[3 + axis], self.len);
        }
        pack(path, mask, self.path, self.len);
        pack(&weight.to_array(), mask, self.weight, self.len);
        self.len += mask.count_ones() as usize;
    }

    /// The lanes from `start` that hold rays, one bit each.
    #[inline(always)]
    pub(super) fn lanes(&self, start: usize) -> u32 {
        (1 << (self.len - start).min(LANES)) - 1
    }

    #[inline(always)]
    pub(super) fn origins(&self, start: usize) -> Vectors {
        each(|axis| F32x16::load(&self.parts[axis][start..]))
    }

    #[inline(always)]
    pub(super) fn dirs(&self, start: usize) -> Vectors {
        each(|axis| F32x16::load(&self.parts[3 + axis][start..]))
    }

    #[inline(always)]
    pub(super) fn paths(&self, start: usize) -> &[u32; LANES] {
        sixteen(self.path, start)
    }

    #[inline(always)]
    pub(super) fn weights(&self, start: usize) -> F32x16 {
        F32x16::load(&self.weight[start..])
    }

    pub(super) fn as_rays(&self) -> Rays<'_> {
        let [origin_x, origin_y, origin_z, dir_x, dir_y, dir_z] =
            self.parts.each_ref().map(|part| &part[..self.len]);
        let (t_min, t_max) = (&self.t_min[..self.len], &self.t_max[..self.len]);
        Rays { origin_x, origin_y, origin_z, dir_x, dir_y, dir_z, t_min, t_max }
    }
}

/// Hits in an arena.
pub(super) struct ArenaHits<'b> {
    t: &'b mut [f32],
    u: &'b mut [f32],
    v: &'b mut [f32],
    prim_id: &'b mut [u32],
    geom_id: &'b mut [u32],
}

impl<'b> ArenaHits<'b> {
    pub(super) fn with_capacity_in(capacity: usize, arena: &'b Bump) -> Self {
        let floats = || array(capacity, 0.0, arena);
        let ids = || array(capacity, NO_HIT, arena);
        Self { t: floats(), u: floats(), v: floats(), prim_id: ids(), geom_id: ids() }
    }

    pub(super) fn get(&self, index: usize) -> Hit {
        Hit {
            t: self.t[index],
            u: self.u[index],
            v: self.v[index],
            prim_id: self.prim_id[index],
            geom_id: self.geom_id[index],
        }
    }

    /// `t`, `u` and `v` of sixteen hits.
    #[inline(always)]
    pub(super) fn places(&self, start: usize) -> [F32x16; 3] {
        let arrays = [&*self.t, &*self.u, &*self.v];
        each(|place| F32x16::load(&arrays[place][start..]))
    }

    #[inline(always)]
    pub(super) fn prim_ids(&self, start: usize) -> &[u32; LANES] {
        sixteen(self.prim_id, start)
    }

    #[inline(always)]
    pub(super) fn geom_ids(&self, start: usize) -> &[u32; LANES] {
        sixteen(self.geom_id, start)
    }

    /// The first `len` hits, for a query to write.
    pub(super) fn as_hits(&mut self, len: usize) -> Hits<'_> {
        Hits {
            t: &mut self.t[..len],
            u: &mut self.u[..len],
            v: &mut self.v[..len],
            prim_id: &mut self.prim_id[..len],
            geom_id: &mut self.geom_id[..len],
        }
    }
}

/// The sixteen values from `start`.
#[inline(always)]
pub(super) fn sixteen(array: &[u32], start: usize) -> &[u32; LANES] {
    array[start..start + LANES].try_into().expect("whole registers")
}
