//! Every way to trace a batch with Embree: 1, 8 or 16 rays a call, coherent or incoherent, with
//! rays copied from and hits to SoA arrays in the timed loop, or packed into Embree's own structs
//! beforehand and left there.

#![allow(unsafe_code)]

use std::fmt;
use std::marker::PhantomData;

use octray::RayBatch;
use octray::workload::Query;
use rayon::prelude::*;

use crate::api::{Align16, Align32, Align64, Api, Arguments, Handle};
use crate::api::{INVALID_ID, QUERY_COHERENT, QUERY_INCOHERENT, RayHitPacket, RayPacket};
use crate::contender::{Answers, Contender};
use crate::engine::{BuildMode, EmbreeScene};
use crate::packets::{CHUNK, HitSlices, Valid, load, par_hit_chunks, store};

/// One of the ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Call {
    pub(crate) mode: BuildMode,
    pub(crate) width: usize,
    pub(crate) coherent: bool,
    pub(crate) packed: bool,
}

impl Call {
    /// All ways to trace a scene.
    pub(crate) fn all(mode: BuildMode) -> impl Iterator<Item = Self> {
        [1, 8, 16].into_iter().flat_map(move |width| {
            [(false, false), (true, false), (false, true), (true, true)]
                .map(|(coherent, packed)| Self { mode, width, coherent, packed })
        })
    }

    /// The contender that traces `scene` in this way.
    pub(crate) fn contender<'a>(self, scene: &'a EmbreeScene<'a>) -> Box<dyn Contender + 'a> {
        match self.width {
            1 => Box::new(EmbreeCall::<One, Align16, 1>::new(scene, self)),
            8 => Box::new(EmbreeCall::<Eight, Align32, 8>::new(scene, self)),
            _ => Box::new(EmbreeCall::<Sixteen, Align64, 16>::new(scene, self)),
        }
    }

    /// Such as `16c`.
    pub(crate) fn short(self) -> String {
        format!("{}{}", self.width, if self.coherent { 'c' } else { 'i' })
    }
}

impl fmt::Display for Call {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let packed = if self.packed { " packed" } else { "" };
        out.pad(&format!("{} {}{packed}", self.short(), self.mode.name()))
    }
}

/// The two functions of one width.
trait Kernel<A, const N: usize> {
    /// # Safety
    /// The scene is committed; as many lanes of the packet as `valid` says hold rays.
    unsafe fn intersect(
        api: &Api,
        valid: &Valid,
        scene: Handle,
        packet: &mut RayHitPacket<A, N>,
        arguments: &mut Arguments,
    );

    /// # Safety
    /// As for `intersect`.
    unsafe fn occluded(
        api: &Api,
        valid: &Valid,
        scene: Handle,
        packet: &mut RayPacket<A, N>,
        arguments: &mut Arguments,
    );
}

macro_rules! kernel {
    ($name:ident, $align:ty, $width:literal, $intersect:ident, $occluded:ident $(, $valid:ident)?) => {
        struct $name;

        impl Kernel<$align, $width> for $name {
            #[inline(always)]
            unsafe fn intersect(
                api: &Api,
                _valid: &Valid,
                scene: Handle,
                packet: &mut RayHitPacket<$align, $width>,
                arguments: &mut Arguments,
            ) {
                $(let $valid = _valid.0.as_ptr();)?
                // SAFETY: the caller's promise; packet and mask are aligned by their types.
                unsafe { (api.$intersect)($($valid,)? scene, packet, arguments) }
            }

            #[inline(always)]
            unsafe fn occluded(
                api: &Api,
                _valid: &Valid,
                scene: Handle,
                packet: &mut RayPacket<$align, $width>,
                arguments: &mut Arguments,
            ) {
                $(let $valid = _valid.0.as_ptr();)?
                // SAFETY: the caller's promise; packet and mask are aligned by their types.
                unsafe { (api.$occluded)($($valid,)? scene, packet, arguments) }
            }
        }
    };
}

kernel!(One, Align16, 1, intersect1, occluded1);
kernel!(Eight, Align32, 8, intersect8, occluded8, valid);
kernel!(Sixteen, Align64, 16, intersect16, occluded16, valid);

struct EmbreeCall<'a, K, A, const N: usize> {
    scene: &'a EmbreeScene<'a>,
    call: Call,
    hit_packets: Vec<RayHitPacket<A, N>>,
    ray_packets: Vec<RayPacket<A, N>>,
    count: usize,
    kernel: PhantomData<fn() -> K>,
}

impl<'a, K, A, const N: usize> EmbreeCall<'a, K, A, N>
where
    K: Kernel<A, N>,
    A: Copy + Send + Sync,
{
    fn new(scene: &'a EmbreeScene<'a>, call: Call) -> Self {
        let (hit_packets, ray_packets) = (Vec::new(), Vec::new());
        Self { scene, call, hit_packets, ray_packets, count: 0, kernel: PhantomData }
    }

    fn arguments(&self) -> Arguments {
        Arguments::new(if self.call.coherent { QUERY_COHERENT } else { QUERY_INCOHERENT })
    }

    /// Traces packets that lie ready; `last` says how many rays the last one of all has.
    fn trace_packed<P: Send>(
        scene: &EmbreeScene<'_>,
        packets: &mut [P],
        count: usize,
        parallel: bool,
        trace: impl Fn(&Api, &Valid, &mut P) + Sync,
    ) {
        let chunk = |(index, packets): (usize, &mut [P])| {
            let full = Valid::first(N);
            for (place, packet) in packets.iter_mut().enumerate() {
                let start = index * CHUNK + place * N;
                if count - start >= N {
                    trace(&scene.device.api, &full, packet);
                } else {
                    trace(&scene.device.api, &Valid::first(count - start), packet);
                }
            }
        };
        if parallel {
            packets.par_chunks_mut(CHUNK / N).with_max_len(1).enumerate().for_each(chunk);
        } else {
            packets.chunks_mut(CHUNK / N).enumerate().for_each(chunk);
        }
    }

    fn intersect_chunk(&self, rays: &RayBatch, start: usize, hits: HitSlices<'_>) {
        let (full, mut arguments) = (Valid::first(N), self.arguments());
        let HitSlices { t, u, v, prim_id, geom_id } = hits;
        let mut packet = RayHitPacket::<A, N>::new();
        for at in (0..t.len()).step_by(N) {
            let lanes = N.min(t.len() - at);
            load(&mut packet.ray, rays, start + at, lanes);
            packet.geom_id = [INVALID_ID; N];
            let part = (lanes < N).then(|| Valid::first(lanes));
            // SAFETY: the scene is committed, the valid lanes were just loaded.
            unsafe {
                let valid = part.as_ref().unwrap_or(&full);
                K::intersect(
                    &self.scene.device.api,
                    valid,
                    self.scene.handle,
                    &mut packet,
                    &mut arguments,
                );
            }
            store(&mut packet);
            t[at..at + lanes].copy_from_slice(&packet.ray.t_far[..lanes]);
            u[at..at + lanes].copy_from_slice(&packet.u[..lanes]);
            v[at..at + lanes].copy_from_slice(&packet.v[..lanes]);
            prim_id[at..at + lanes].copy_from_slice(&packet.prim_id[..lanes]);
            geom_id[at..at + lanes].copy_from_slice(&packet.geom_id[..lanes]);
        }
    }

    fn occluded_chunk(&self, rays: &RayBatch, start: usize, occluded: &mut [bool]) {
        let (full, mut arguments) = (Valid::first(N), self.arguments());
        let mut packet = RayPacket::<A, N>::new();
        let count = occluded.len();
        for at in (0..count).step_by(N) {
            let lanes = N.min(count - at);
            load(&mut packet, rays, start + at, lanes);
            let part = (lanes < N).then(|| Valid::first(lanes));
            // SAFETY: the scene is committed, the valid lanes were just loaded.
            unsafe {
                let valid = part.as_ref().unwrap_or(&full);
                K::occluded(
                    &self.scene.device.api,
                    valid,
                    self.scene.handle,
                    &mut packet,
                    &mut arguments,
                );
            }
            for (occluded, &t_far) in occluded[at..at + lanes].iter_mut().zip(&packet.t_far) {
                *occluded = t_far < 0.0;
            }
        }
    }
}

impl<K, A, const N: usize> Contender for EmbreeCall<'_, K, A, N>
where
    K: Kernel<A, N>,
    A: Copy + Send + Sync,
{
    fn prepare(&mut self, rays: &RayBatch, query: Query) {
        self.count = rays.len();
        if !self.call.packed {
            return;
        }
        let starts = (0..rays.len()).step_by(N).map(|start| (start, N.min(rays.len() - start)));
        self.hit_packets.clear();
        self.ray_packets.clear();
        for (start, lanes) in starts {
            let mut packet = RayPacket::new();
            load(&mut packet, rays, start, lanes);
            match query {
                Query::Intersect => {
                    let mut with_hits = RayHitPacket::new();
                    with_hits.ray = packet;
                    self.hit_packets.push(with_hits);
                }
                Query::Occluded => self.ray_packets.push(packet),
            }
        }
    }

    fn trace(&mut self, rays: &RayBatch, answers: &mut Answers, parallel: bool) {
        let (scene, flags, count) = (self.scene, self.arguments().flags, self.count);
        match answers {
            Answers::Hits(_) if self.call.packed => {
                Self::trace_packed(
                    scene,
                    &mut self.hit_packets,
                    count,
                    parallel,
                    |api, valid, packet| {
                        // SAFETY: the scene is committed, the valid lanes were loaded in `prepare`.
                        unsafe {
                            K::intersect(
                                api,
                                valid,
                                scene.handle,
                                packet,
                                &mut Arguments::new(flags),
                            )
                        }
                    },
                );
            }
            Answers::Occluded(_) if self.call.packed => {
                Self::trace_packed(
                    scene,
                    &mut self.ray_packets,
                    count,
                    parallel,
                    |api, valid, packet| {
                        // SAFETY: the scene is committed, the valid lanes were loaded in `prepare`.
                        unsafe {
                            K::occluded(
                                api,
                                valid,
                                scene.handle,
                                packet,
                                &mut Arguments::new(flags),
                            )
                        }
                    },
                );
            }
            Answers::Hits(hits) if parallel => par_hit_chunks(hits)
                .with_max_len(1)
                .enumerate()
                .for_each(|(index, hits)| self.intersect_chunk(rays, index * CHUNK, hits)),
            Answers::Hits(hits) => self.intersect_chunk(rays, 0, HitSlices::all(hits)),
            Answers::Occluded(occluded) if parallel => {
                occluded.par_chunks_mut(CHUNK).with_max_len(1).enumerate().for_each(
                    |(index, occluded)| self.occluded_chunk(rays, index * CHUNK, occluded),
                )
            }
            Answers::Occluded(occluded) => self.occluded_chunk(rays, 0, occluded),
        }
    }

    fn collect(&mut self, answers: &mut Answers) {
        match answers {
            _ if !self.call.packed => {}
            Answers::Hits(hits) => {
                for (packet, index) in self.hit_packets.iter_mut().zip((0..).step_by(N)) {
                    store(packet);
                    for lane in 0..N.min(self.count - index) {
                        hits.t[index + lane] = packet.ray.t_far[lane];
                        hits.u[index + lane] = packet.u[lane];
                        hits.v[index + lane] = packet.v[lane];
                        hits.prim_id[index + lane] = packet.prim_id[lane];
                        hits.geom_id[index + lane] = packet.geom_id[lane];
                    }
                }
            }
            Answers::Occluded(occluded) => {
                let lanes = self.ray_packets.iter().flat_map(|packet| packet.t_far);
                occluded.iter_mut().zip(lanes).for_each(|(occluded, t)| *occluded = t < 0.0);
            }
        }
    }
}
