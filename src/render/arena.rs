//! Rays and hits in SoA arrays that live in a tile's arena.
//!
//! The arrays are made with room for all that will come, so none grows and leaves its old memory
//! behind in the arena.

use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;

use crate::hit::{Hit, Hits};
use crate::ray::{Ray, Rays};

/// Rays in an arena.
pub(super) struct ArenaRays<'b> {
    origin_x: ArenaVec<'b, f32>,
    origin_y: ArenaVec<'b, f32>,
    origin_z: ArenaVec<'b, f32>,
    dir_x: ArenaVec<'b, f32>,
    dir_y: ArenaVec<'b, f32>,
    dir_z: ArenaVec<'b, f32>,
    t_min: ArenaVec<'b, f32>,
    t_max: ArenaVec<'b, f32>,
}

impl<'b> ArenaRays<'b> {
    pub(super) fn with_capacity_in(capacity: usize, arena: &'b Bump) -> Self {
        let array = || ArenaVec::with_capacity_in(capacity, arena);
        Self {
            origin_x: array(),
            origin_y: array(),
            origin_z: array(),
            dir_x: array(),
            dir_y: array(),
            dir_z: array(),
            t_min: array(),
            t_max: array(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.origin_x.len()
    }

    pub(super) fn clear(&mut self) {
        self.origin_x.clear();
        self.origin_y.clear();
        self.origin_z.clear();
        self.dir_x.clear();
        self.dir_y.clear();
        self.dir_z.clear();
        self.t_min.clear();
        self.t_max.clear();
    }

    pub(super) fn push(&mut self, ray: &Ray) {
        self.origin_x.push(ray.origin.x);
        self.origin_y.push(ray.origin.y);
        self.origin_z.push(ray.origin.z);
        self.dir_x.push(ray.dir.x);
        self.dir_y.push(ray.dir.y);
        self.dir_z.push(ray.dir.z);
        self.t_min.push(ray.t_min);
        self.t_max.push(ray.t_max);
    }

    pub(super) fn as_rays(&self) -> Rays<'_> {
        Rays {
            origin_x: &self.origin_x,
            origin_y: &self.origin_y,
            origin_z: &self.origin_z,
            dir_x: &self.dir_x,
            dir_y: &self.dir_y,
            dir_z: &self.dir_z,
            t_min: &self.t_min,
            t_max: &self.t_max,
        }
    }
}

/// Hits in an arena.
pub(super) struct ArenaHits<'b> {
    t: ArenaVec<'b, f32>,
    u: ArenaVec<'b, f32>,
    v: ArenaVec<'b, f32>,
    prim_id: ArenaVec<'b, u32>,
    geom_id: ArenaVec<'b, u32>,
}

impl<'b> ArenaHits<'b> {
    pub(super) fn with_capacity_in(capacity: usize, arena: &'b Bump) -> Self {
        let floats = || ArenaVec::with_capacity_in(capacity, arena);
        let ids = || ArenaVec::with_capacity_in(capacity, arena);
        Self { t: floats(), u: floats(), v: floats(), prim_id: ids(), geom_id: ids() }
    }

    /// Makes it `len` hits long; what they hold is for a query to write.
    pub(super) fn resize(&mut self, len: usize) {
        self.t.resize(len, Hit::MISS.t);
        self.u.resize(len, Hit::MISS.u);
        self.v.resize(len, Hit::MISS.v);
        self.prim_id.resize(len, Hit::MISS.prim_id);
        self.geom_id.resize(len, Hit::MISS.geom_id);
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

    pub(super) fn as_hits(&mut self) -> Hits<'_> {
        Hits {
            t: &mut self.t,
            u: &mut self.u,
            v: &mut self.v,
            prim_id: &mut self.prim_id,
            geom_id: &mut self.geom_id,
        }
    }
}
