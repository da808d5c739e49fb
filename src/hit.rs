//! Hits: what the closest-hit queries write, for one ray, a packet and batches.
//!
//! A miss has `t = +infinity`, `u = v = 0` and [`NO_HIT`] for both ids, in every path.

use crate::columns::Column;
use crate::error::ShapeError;
use crate::ray::PACKET_LANES;

/// The `prim_id` and `geom_id` of a ray that hit nothing.
pub const NO_HIT: u32 = u32::MAX;

/// Where a ray met a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the origin in lengths of the ray's direction.
    pub t: f32,
    /// First surface coordinate. Triangles: weight of the second vertex. Quads: along the first
    /// edge, 0 to 1. Spheres: 0.
    pub u: f32,
    /// Second surface coordinate. Triangles: weight of the third vertex. Quads: along the second
    /// edge, 0 to 1. Spheres: 0.
    pub v: f32,
    /// Which primitive of the geometry, in the order in which they were given.
    pub prim_id: u32,
    /// Which geometry, in the order in which they were added to the scene.
    pub geom_id: u32,
}

impl Hit {
    /// What the arrays hold for a ray that hit nothing.
    pub const MISS: Self =
        Self { t: f32::INFINITY, u: 0.0, v: 0.0, prim_id: NO_HIT, geom_id: NO_HIT };

    /// True unless this is a miss.
    pub fn is_hit(&self) -> bool {
        self.geom_id != NO_HIT
    }
}

/// The hits of eight rays.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct HitPacket {
    /// See [`Hit::t`].
    pub t: [f32; PACKET_LANES],
    /// See [`Hit::u`].
    pub u: [f32; PACKET_LANES],
    /// See [`Hit::v`].
    pub v: [f32; PACKET_LANES],
    /// See [`Hit::prim_id`].
    pub prim_id: [u32; PACKET_LANES],
    /// See [`Hit::geom_id`].
    pub geom_id: [u32; PACKET_LANES],
}

impl HitPacket {
    /// Eight misses.
    pub const MISS: Self = Self {
        t: [f32::INFINITY; PACKET_LANES],
        u: [0.0; PACKET_LANES],
        v: [0.0; PACKET_LANES],
        prim_id: [NO_HIT; PACKET_LANES],
        geom_id: [NO_HIT; PACKET_LANES],
    };

    /// The packet as a batch of eight hits.
    pub fn as_hits(&mut self) -> Hits<'_> {
        Hits {
            t: &mut self.t,
            u: &mut self.u,
            v: &mut self.v,
            prim_id: &mut self.prim_id,
            geom_id: &mut self.geom_id,
        }
    }

    /// The hit of one lane.
    pub fn get(&self, lane: usize) -> Hit {
        Hit {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
            prim_id: self.prim_id[lane],
            geom_id: self.geom_id[lane],
        }
    }
}

/// Hits of any number in SoA arrays that it owns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HitBatch {
    /// See [`Hit::t`].
    pub t: Column<f32>,
    /// See [`Hit::u`].
    pub u: Column<f32>,
    /// See [`Hit::v`].
    pub v: Column<f32>,
    /// See [`Hit::prim_id`].
    pub prim_id: Column<u32>,
    /// See [`Hit::geom_id`].
    pub geom_id: Column<u32>,
}

impl HitBatch {
    /// As many misses as `len`.
    pub fn new(len: usize) -> Self {
        let mut batch = Self::default();
        batch.resize(len);
        batch
    }

    /// Makes room for `len` hits; new entries are misses, old ones stay.
    pub fn resize(&mut self, len: usize) {
        self.t.resize(len, Hit::MISS.t);
        self.u.resize(len, Hit::MISS.u);
        self.v.resize(len, Hit::MISS.v);
        self.prim_id.resize(len, Hit::MISS.prim_id);
        self.geom_id.resize(len, Hit::MISS.geom_id);
    }

    /// How many hits there are, misses included.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Hit `index`, which may be [`Hit::MISS`]. Panics if it is out of range.
    pub fn get(&self, index: usize) -> Hit {
        Hit {
            t: self.t[index],
            u: self.u[index],
            v: self.v[index],
            prim_id: self.prim_id[index],
            geom_id: self.geom_id[index],
        }
    }

    /// All of it, for a query to write. Panics if the public arrays were given different lengths.
    pub fn as_hits(&mut self) -> Hits<'_> {
        Hits::new(&mut self.t, &mut self.u, &mut self.v, &mut self.prim_id, &mut self.geom_id)
            .expect("the arrays of a HitBatch have one length")
    }
}

/// Hits in SoA arrays that somebody else owns: what the batch queries write.
#[derive(Debug)]
pub struct Hits<'a> {
    pub(crate) t: &'a mut [f32],
    pub(crate) u: &'a mut [f32],
    pub(crate) v: &'a mut [f32],
    pub(crate) prim_id: &'a mut [u32],
    pub(crate) geom_id: &'a mut [u32],
}

impl<'a> Hits<'a> {
    /// Hits over five arrays of one length, best if they start at a multiple of 64 bytes.
    ///
    /// # Errors
    /// [`ShapeError`] names the first array whose length differs from that of `t`.
    pub fn new(
        t: &'a mut [f32],
        u: &'a mut [f32],
        v: &'a mut [f32],
        prim_id: &'a mut [u32],
        geom_id: &'a mut [u32],
    ) -> Result<Self, ShapeError> {
        let len = t.len();
        ShapeError::check("u", u.len(), "t", len)?;
        ShapeError::check("v", v.len(), "t", len)?;
        ShapeError::check("prim_id", prim_id.len(), "t", len)?;
        ShapeError::check("geom_id", geom_id.len(), "t", len)?;
        Ok(Self { t, u, v, prim_id, geom_id })
    }

    /// The five arrays, ids by their bits.
    pub(crate) fn arrays(&self) -> [&[f32]; 5] {
        let bits = |ids| bytemuck::cast_slice::<u32, f32>(ids);
        [&*self.t, &*self.u, &*self.v, bits(&*self.prim_id), bits(&*self.geom_id)]
    }

    /// How many entries there are.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Entry `index`, which may be [`Hit::MISS`]. Panics if it is out of range.
    pub fn get(&self, index: usize) -> Hit {
        Hit {
            t: self.t[index],
            u: self.u[index],
            v: self.v[index],
            prim_id: self.prim_id[index],
            geom_id: self.geom_id[index],
        }
    }

    /// Writes entry `index`. Panics if it is out of range.
    pub fn set(&mut self, index: usize, hit: &Hit) {
        self.t[index] = hit.t;
        self.u[index] = hit.u;
        self.v[index] = hit.v;
        self.prim_id[index] = hit.prim_id;
        self.geom_id[index] = hit.geom_id;
    }

    /// The first `at` entries and the rest. Panics if there are fewer.
    pub fn split_at(self, at: usize) -> (Hits<'a>, Hits<'a>) {
        let (t0, t1) = self.t.split_at_mut(at);
        let (u0, u1) = self.u.split_at_mut(at);
        let (v0, v1) = self.v.split_at_mut(at);
        let (prim0, prim1) = self.prim_id.split_at_mut(at);
        let (geom0, geom1) = self.geom_id.split_at_mut(at);
        (
            Hits { t: t0, u: u0, v: v0, prim_id: prim0, geom_id: geom0 },
            Hits { t: t1, u: u1, v: v1, prim_id: prim1, geom_id: geom1 },
        )
    }

    /// The same entries for a shorter time.
    pub fn reborrow(&mut self) -> Hits<'_> {
        Hits { t: self.t, u: self.u, v: self.v, prim_id: self.prim_id, geom_id: self.geom_id }
    }
}
