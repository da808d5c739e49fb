//! Rays into Embree's packets, and hits out of them into SoA arrays.

use octray::{HitBatch, RayBatch};
use rayon::prelude::*;

use crate::api::{INVALID_ID, RayHitPacket, RayPacket};

/// How many rays a task of the thread pool has.
pub(crate) const CHUNK: usize = 4096;

/// Which lanes of a packet have rays, as Embree wants it.
#[repr(C, align(64))]
pub(crate) struct Valid(pub(crate) [i32; 16]);

impl Valid {
    pub(crate) fn first(count: usize) -> Self {
        Self(std::array::from_fn(|lane| if lane < count { -1 } else { 0 }))
    }
}

/// Fills the first `lanes` lanes with the rays from `start`.
#[inline(always)]
pub(crate) fn load<A, const N: usize>(
    packet: &mut RayPacket<A, N>,
    rays: &RayBatch,
    start: usize,
    lanes: usize,
) {
    for (to, from) in [
        (&mut packet.origin_x, &rays.origin_x),
        (&mut packet.origin_y, &rays.origin_y),
        (&mut packet.origin_z, &rays.origin_z),
        (&mut packet.t_near, &rays.t_min),
        (&mut packet.dir_x, &rays.dir_x),
        (&mut packet.dir_y, &rays.dir_y),
        (&mut packet.dir_z, &rays.dir_z),
        (&mut packet.t_far, &rays.t_max),
    ] {
        match from[start..].first_chunk::<N>() {
            Some(from) if lanes == N => *to = *from,
            _ => to[..lanes].copy_from_slice(&from[start..start + lanes]),
        }
    }
}

/// Gives the lanes that hit nothing octray's miss.
#[inline(always)]
pub(crate) fn store<A, const N: usize>(packet: &mut RayHitPacket<A, N>) {
    for lane in 0..N {
        let miss = packet.geom_id[lane] == INVALID_ID;
        packet.ray.t_far[lane] = if miss { f32::INFINITY } else { packet.ray.t_far[lane] };
        packet.u[lane] = if miss { 0.0 } else { packet.u[lane] };
        packet.v[lane] = if miss { 0.0 } else { packet.v[lane] };
        packet.prim_id[lane] = if miss { INVALID_ID } else { packet.prim_id[lane] };
    }
}

/// A part of the arrays of a [`HitBatch`].
pub(crate) struct HitSlices<'a> {
    pub(crate) t: &'a mut [f32],
    pub(crate) u: &'a mut [f32],
    pub(crate) v: &'a mut [f32],
    pub(crate) prim_id: &'a mut [u32],
    pub(crate) geom_id: &'a mut [u32],
}

impl<'a> HitSlices<'a> {
    pub(crate) fn all(hits: &'a mut HitBatch) -> Self {
        let HitBatch { t, u, v, prim_id, geom_id } = hits;
        Self { t, u, v, prim_id, geom_id }
    }
}

pub(crate) fn par_hit_chunks(
    hits: &mut HitBatch,
) -> impl IndexedParallelIterator<Item = HitSlices<'_>> {
    let HitBatch { t, u, v, prim_id, geom_id } = hits;
    let floats = t.par_chunks_mut(CHUNK).zip(u.par_chunks_mut(CHUNK)).zip(v.par_chunks_mut(CHUNK));
    let ids = prim_id.par_chunks_mut(CHUNK).zip(geom_id.par_chunks_mut(CHUNK));
    floats.zip(ids).map(|(((t, u), v), (prim_id, geom_id))| HitSlices { t, u, v, prim_id, geom_id })
}
