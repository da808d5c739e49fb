//! Rays of any number: cut into tiles, each traced as one if its rays run alike, else one by one.

use super::group::Group;
use super::kept::{self, Kept};
use super::tile::Tile;
use super::tracer::Tracer;
use super::{Closest, alone, ones, packet};
use crate::batch_rays::BatchRays;
use crate::bvh::Bvh;
use crate::hit::{Hits, NO_HIT};
use crate::kernels::ScaledRay;
use crate::prefetch::Ahead;
use crate::ray::{Ray, RayPacket, Rays};
use crate::rows::RayRows;
use crate::simd::{F32x8, F32x16, Lanes, each};

/// The rays that one step of a batch takes: also the unit in which threads share a batch.
pub(crate) const TILE_RAYS: usize = Tile::<F32x16>::RAYS;

/// Batches up to this length take the thread's own tracer, longer ones make one. On the stack it traces camera rays
/// 1.04 to 1.07 times as fast as in the memory that a thread keeps, for whatever reason: where in a page it lies is not
/// it. To make it takes as much of 4,096 rays.
const SHORT: usize = 4096;

/// Writes the closest hit of each ray. `name` turns the ids over all geometries of some hits into
/// `prim_id` and `geom_id`.
pub(crate) fn intersect(
    bvh: &Bvh,
    rays: BatchRays<'_>,
    hits: &mut Hits<'_>,
    name: impl Fn(&[u32; F32x16::LANES]) -> [[u32; F32x16::LANES]; 2],
) {
    trace::<false>(bvh, rays, Ahead::new(hits.arrays()), |start, group, count| {
        let range = start..start + count;
        store(group.t(), &mut hits.t[range.clone()]);
        store(group.u, &mut hits.u[range.clone()]);
        store(group.v, &mut hits.v[range.clone()]);
        // Named before they are written: to read them again would wait for the memory.
        let [prim_ids, geom_ids] = name(&group.ids());
        store_ids(&prim_ids, &mut hits.prim_id[range.clone()]);
        store_ids(&geom_ids, &mut hits.geom_id[range]);
    });
}

/// Registers in memory, each in one line of the cache: what lies in two can't be read before it is written
/// there, and that waits for all that was written before.
#[repr(align(64))]
struct Lines([[f32; F32x16::LANES]; 3]);

/// Gives the closest hit of each ray, by the ray's number: the bits of `t`, `u` and `v`, and the id over all
/// geometries.
pub(crate) fn intersect_each(
    bvh: &Bvh,
    rays: BatchRays<'_>,
    mut give: impl FnMut(usize, [u32; 4]),
) {
    trace::<false>(bvh, rays, Ahead::new([&[]; 5]), |start, group, count| {
        let mut hits = Lines([[0.0; F32x16::LANES]; 3]);
        group.t().store(&mut hits.0[0]);
        group.u.store(&mut hits.0[1]);
        group.v.store(&mut hits.0[2]);
        for lane in 0..count {
            let [t, u, v]: [u32; 3] = each(|field| hits.0[field][lane].to_bits());
            give(start + lane, [t, u, v, group.id(lane)]);
        }
    });
}

/// Says for each ray whether it hits anything.
pub(crate) fn occluded<'a>(bvh: &Bvh, rays: impl Into<BatchRays<'a>>, occluded: &mut [bool]) {
    say_occluded(bvh, rays.into(), occluded);
}

fn say_occluded(bvh: &Bvh, rays: BatchRays<'_>, occluded: &mut [bool]) {
    trace::<true>(bvh, rays, Ahead::new([&[]; 5]), |start, group, count| {
        for (lane, occluded) in occluded[start..start + count].iter_mut().enumerate() {
            *occluded = group.id(lane) != NO_HIT;
        }
    });
}

/// The first lanes, as many as there are places.
#[inline(always)]
fn store<F: Lanes>(lanes: F, to: &mut [f32]) {
    if to.len() == F::LANES {
        lanes.store(to);
    } else {
        for (lane, to) in to.iter_mut().enumerate() {
            *to = lanes.lane(lane);
        }
    }
}

/// Likewise.
#[inline(always)]
fn store_ids<const COUNT: usize>(ids: &[u32; COUNT], to: &mut [u32]) {
    match to.first_chunk_mut() {
        Some(all) => *all = *ids,
        None => store_some(ids, to),
    }
}

// Apart, or the compiler makes one copy of any length of both.
#[cold]
#[inline(never)]
fn store_some(ids: &[u32], to: &mut [u32]) {
    to.copy_from_slice(&ids[..to.len()]);
}

/// Traces the rays and gives each group with the place of its first ray and their number, for it to be
/// noted in `writes`.
fn trace<const ANY: bool>(
    bvh: &Bvh,
    rays: BatchRays<'_>,
    writes: Ahead<5>,
    done: impl FnMut(usize, &Group<F32x16>, usize),
) {
    if rays.len() > SHORT {
        return trace_with::<ANY>(&mut Tracer::new(bvh), bvh, rays, writes, done);
    }
    let mut tracer = taken(bvh);
    trace_with::<ANY>(&mut tracer, bvh, rays, writes, done);
    kept::keep(&KEPT, tracer);
}

/// As [`trace`], by a tracer of which nothing is known.
#[inline(never)]
fn trace_with<const ANY: bool>(
    tracer: &mut Tracer<F32x16>,
    bvh: &Bvh,
    rays: BatchRays<'_>,
    writes: Ahead<5>,
    mut done: impl FnMut(usize, &Group<F32x16>, usize),
) {
    tracer.tile.writes = writes;
    if let BatchRays::Arrays(rays) = rays {
        tracer.tile.reads = Ahead::new(rays.arrays());
    }
    for start in (0..rays.len()).step_by(TILE_RAYS) {
        let end = (start + TILE_RAYS).min(rays.len());
        let tile = &mut tracer.tile;
        match rays {
            BatchRays::Arrays(rays) => {
                tile.load(rays.range(start, end));
                tile.reads.turn_to(end..end + TILE_RAYS);
            }
            BatchRays::Rows(rays) => {
                load_rows(tile, &rays, start, end);
                tile.reads = Ahead::new(rays.pieces(end, end + TILE_RAYS));
                tile.reads.turn_to(0..3 * TILE_RAYS);
            }
        }
        tile.writes.turn_to(start..end);
        tracer.trace::<ANY>(bvh);
        for (group, start) in tracer.tile.groups.iter().zip((start..end).step_by(F32x16::LANES)) {
            done(start, group, (end - start).min(F32x16::LANES));
        }
    }
}

thread_local! {
    static KEPT: Kept<Tracer<F32x16>> = const { Kept::new(None) };
}

/// The thread's, of which nothing is known.
fn taken(bvh: &Bvh) -> Box<Tracer<F32x16>> {
    let mut tracer = kept::take(&KEPT, || Tracer::new(bvh));
    tracer.turn_to(bvh);
    tracer
}

/// Takes the rays from `start` up to `end`, at most a tile of them.
fn load_rows(tile: &mut Tile<F32x16>, rays: &RayRows<'_>, start: usize, end: usize) {
    for (group, first) in (start..end).step_by(F32x16::LANES).enumerate() {
        let count = (end - first).min(F32x16::LANES);
        let [x, y, z, dx, dy, dz, t_min, t_max] = rays.lanes::<F32x16>(first, count);
        let active = F32x16::mask((1_u32 << count) - 1);
        let ray = ScaledRay::new([x, y, z], [dx, dy, dz], t_min, t_max, active);
        tile.load_group(group, &ray);
    }
}

/// The share of the rays that tiles would leave to go on their own.
pub(super) fn share_alone(bvh: &Bvh, rays: Rays<'_>) -> f32 {
    let mut tracer = taken(bvh);
    let mut alone = 0;
    for start in (0..rays.len()).step_by(TILE_RAYS) {
        tracer.tile.load(rays.range(start, (start + TILE_RAYS).min(rays.len())));
        tracer.descend::<false>(bvh);
        let rest = &tracer.tile.rest;
        alone += ones(rest.groups()).map(|group| rest.lanes(group).count_ones()).sum::<u32>();
    }
    kept::keep(&KEPT, tracer);
    alone as f32 / rays.len() as f32
}

/// The closest hit of one ray.
pub(crate) fn intersect_one(bvh: &Bvh, ray: &Ray) -> Option<Closest> {
    trace_one::<false>(bvh, ray).closest(0)
}

/// True if one ray hits anything.
pub(crate) fn occluded_one(bvh: &Bvh, ray: &Ray) -> bool {
    trace_one::<true>(bvh, ray).id(0) != NO_HIT
}

fn trace_one<const ANY: bool>(bvh: &Bvh, ray: &Ray) -> Group<f32> {
    let scaled =
        ScaledRay::new(ray.origin.to_array(), ray.dir.to_array(), ray.t_min, ray.t_max, true);
    let mut group = Group::new();
    group.load(&scaled);
    alone::trace::<ANY>(bvh, &mut group);
    group
}

/// Gives the closest hits of the lanes in `active`.
pub(crate) fn intersect_packet(
    bvh: &Bvh,
    rays: &RayPacket,
    active: u8,
    mut give: impl FnMut(usize, Option<Closest>),
) {
    let group = trace_packet::<false>(bvh, rays, active);
    for lane in (0..F32x8::LANES).filter(|lane| active >> lane & 1 != 0) {
        give(lane, group.closest(lane));
    }
}

/// One bit for each lane in `active`: 1 if its ray hits anything.
pub(crate) fn occluded_packet(bvh: &Bvh, rays: &RayPacket, active: u8) -> u8 {
    let group = trace_packet::<true>(bvh, rays, active);
    (0..F32x8::LANES).fold(0, |bits, lane| bits | u8::from(group.id(lane) != NO_HIT) << lane)
}

fn trace_packet<const ANY: bool>(bvh: &Bvh, rays: &RayPacket, active: u8) -> Group<F32x8> {
    let ray = rays.as_rays().scaled(F32x8::load, F32x8::mask(u32::from(active)));
    let mut group = Group::new();
    group.load(&ray);
    if !group.is_dead() {
        group.prepare_boxes(bvh.extent);
        group.prepare_primitives(bvh.extent);
        packet::trace::<ANY>(bvh, &mut group);
    }
    group
}
