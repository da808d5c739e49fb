//! Measures how many rays a second the queries make on a workload.
//!
//! Every measurement checks its answers first: the batch query against the scalar reference on a
//! sample of the rays, the packet query against the batch query on all of them, bit for bit.

use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

use super::{Query, Workload};
use crate::hit::{Hit, HitBatch, HitPacket};
use crate::ray::{PACKET_LANES, Ray, RayPacket};
use crate::scene::Scene;
use crate::traverse::visits::{self, Visits};

/// Which queries trace the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Path {
    /// The scalar reference, a loop over all primitives, on a sample of the rays.
    Reference,
    /// The packet queries, eight rays each, on packets made beforehand.
    Packet,
    /// The batch queries.
    Batch,
}

impl Path {
    /// All of them, slow ones first.
    pub const ALL: [Self; 3] = [Self::Reference, Self::Packet, Self::Batch];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reference => "reference",
            Self::Packet => "packet",
            Self::Batch => "batch",
        }
    }
}

/// How long to measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Runs go on until they have taken so many seconds.
    pub seconds: f64,
    /// There are at least so many, after one to warm up.
    pub runs: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Self { seconds: 0.5, runs: 5 }
    }
}

/// What was measured. Rates are in million rays a second.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measurement {
    /// The workload's name.
    pub workload: String,
    /// The queries.
    pub path: Path,
    /// How many threads traced.
    pub threads: usize,
    /// How many rays a run had.
    pub rays: usize,
    /// How many of them hit something.
    pub hits: usize,
    /// How many runs were timed.
    pub runs: usize,
    /// The median over the runs.
    pub median: f64,
    /// The slowest run.
    pub low: f64,
    /// The fastest run.
    pub high: f64,
    /// What one run visited: of the batch queries on one thread, in a build with the feature `stats`.
    pub visits: Option<Visits>,
}

/// Answers of two queries differ where they must be the same: a fault of the library.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error(
    "the {path} query and the {other} disagree about ray {ray} of workload `{workload}`: \
     nothing was measured; please report this with the scene"
)]
pub struct Disagreement {
    /// The workload.
    pub workload: String,
    /// The query that was to be measured.
    pub path: &'static str,
    /// What it was compared with.
    pub other: &'static str,
    /// The first ray that differs.
    pub ray: usize,
}

/// About so many primitives are tested for a sample through the reference.
const REFERENCE_TESTS: usize = 20_000_000;

/// Measures one path on the rayon pool that it is called in; with a pool of one thread through the
/// queries that use no pool.
///
/// # Errors
/// [`Disagreement`] if the answers are wrong.
pub fn measure(
    scene: &Scene,
    workload: &Workload,
    path: Path,
    effort: Effort,
) -> Result<Measurement, Disagreement> {
    let parallel = rayon::current_num_threads() > 1;
    let disagreement = |other, ray| Disagreement {
        workload: workload.name.clone(),
        path: path.name(),
        other,
        ray,
    };
    let mut batch = Answers::new(workload);
    let _ = visits::take();
    batch.trace(scene, workload, parallel);
    // Each thread counts for itself.
    let visits = visits::take().filter(|_| path == Path::Batch && !parallel);
    let sample = Sample::new(scene, workload);
    let expected = sample.trace(scene, parallel);
    if let Some(place) =
        (0..expected.len()).find(|&at| !batch.is(sample.indices[at], &expected[at]))
    {
        return Err(disagreement(Path::Reference.name(), sample.indices[place]));
    }
    let hits = (0..workload.rays.len()).filter(|&ray| batch.is_hit(ray)).count();
    let (rays, hits, rates) = match path {
        Path::Reference => {
            let hits = expected.iter().filter(|hit| hit.is_hit()).count();
            let rays = sample.rays.len();
            (rays, hits, rates(rays, effort, || drop(sample.trace(scene, parallel))))
        }
        Path::Packet => {
            let mut packets = Packets::new(workload);
            packets.trace(scene, parallel);
            if let Some(ray) = (0..workload.rays.len()).find(|&ray| !packets.agree(ray, &batch)) {
                return Err(disagreement(Path::Batch.name(), ray));
            }
            let count = workload.rays.len();
            (count, hits, rates(count, effort, || packets.trace(scene, parallel)))
        }
        Path::Batch => {
            let count = workload.rays.len();
            (count, hits, rates(count, effort, || batch.trace(scene, workload, parallel)))
        }
    };
    Ok(Measurement {
        workload: workload.name.clone(),
        path,
        threads: rayon::current_num_threads(),
        rays,
        hits,
        runs: rates.len(),
        median: median(&rates),
        low: rates.first().copied().unwrap_or(0.0),
        high: rates.last().copied().unwrap_or(0.0),
        visits,
    })
}

/// The rates of the runs, slowest first.
fn rates(rays: usize, effort: Effort, mut run: impl FnMut()) -> Vec<f64> {
    let (mut rates, mut total) = (Vec::new(), 0.0);
    while rates.len() < effort.runs.max(1) || total < effort.seconds {
        let start = Instant::now();
        run();
        let seconds = start.elapsed().as_secs_f64().max(1e-9);
        total += seconds;
        rates.push(rays as f64 / seconds / 1e6);
    }
    rates.sort_by(f64::total_cmp);
    rates
}

/// The middle of sorted values.
fn median(sorted: &[f64]) -> f64 {
    match sorted.len() {
        0 => 0.0,
        len if len % 2 == 1 => sorted[len / 2],
        len => 0.5 * (sorted[len / 2 - 1] + sorted[len / 2]),
    }
}

/// What the batch queries answered.
enum Answers {
    Hits(HitBatch),
    Occluded(Vec<bool>),
}

impl Answers {
    fn new(workload: &Workload) -> Self {
        match workload.query {
            Query::Intersect => Self::Hits(HitBatch::new(workload.rays.len())),
            Query::Occluded => Self::Occluded(vec![false; workload.rays.len()]),
        }
    }

    fn trace(&mut self, scene: &Scene, workload: &Workload, parallel: bool) {
        let rays = workload.rays.as_rays();
        match (self, parallel) {
            (Self::Hits(hits), false) => scene.intersect_batch(rays, hits.as_hits()),
            (Self::Hits(hits), true) => scene.par_intersect_batch(rays, hits.as_hits()),
            (Self::Occluded(occluded), false) => scene.occluded_batch(rays, occluded),
            (Self::Occluded(occluded), true) => scene.par_occluded_batch(rays, occluded),
        }
        .expect("there are as many answers as rays");
    }

    fn is_hit(&self, ray: usize) -> bool {
        match self {
            Self::Hits(hits) => hits.get(ray).is_hit(),
            Self::Occluded(occluded) => occluded[ray],
        }
    }

    fn is(&self, ray: usize, expected: &Hit) -> bool {
        match self {
            Self::Hits(hits) => hits.get(ray) == *expected,
            Self::Occluded(occluded) => occluded[ray] == expected.is_hit(),
        }
    }
}

/// Evenly spread rays of a workload, few enough for the reference.
struct Sample {
    indices: Vec<usize>,
    rays: Vec<Ray>,
}

impl Sample {
    fn new(scene: &Scene, workload: &Workload) -> Self {
        let count = workload.rays.len();
        let primitives = scene.bvh().stats().primitives.max(1);
        let len = (REFERENCE_TESTS / primitives).clamp(8, 256).min(count);
        let indices: Vec<usize> = (0..len).map(|sample| sample * count / len).collect();
        let rays = indices.iter().map(|&index| workload.rays.as_rays().get(index)).collect();
        Self { indices, rays }
    }

    fn trace(&self, scene: &Scene, parallel: bool) -> Vec<Hit> {
        let trace = |ray: &Ray| scene.intersect_reference(ray).unwrap_or(Hit::MISS);
        if parallel {
            self.rays.par_iter().map(trace).collect()
        } else {
            self.rays.iter().map(trace).collect()
        }
    }
}

/// The rays of a workload in packets, with what the packet queries answered.
struct Packets {
    query: Query,
    packets: Vec<Packet>,
}

struct Packet {
    rays: RayPacket,
    active: u8,
    hits: HitPacket,
    occluded: u8,
}

impl Packets {
    fn new(workload: &Workload) -> Self {
        let (rays, count) = (workload.rays.as_rays(), workload.rays.len());
        let packets = (0..count).step_by(PACKET_LANES).map(|start| {
            let lanes = PACKET_LANES.min(count - start);
            let ray = |lane| rays.get(start + usize::min(lane, lanes - 1));
            Packet {
                rays: RayPacket::new(&std::array::from_fn(ray)),
                active: (0xff_u16 >> (PACKET_LANES - lanes)) as u8,
                hits: HitPacket::MISS,
                occluded: 0,
            }
        });
        Self { query: workload.query, packets: packets.collect() }
    }

    fn trace(&mut self, scene: &Scene, parallel: bool) {
        let query = self.query;
        let trace = |packet: &mut Packet| match query {
            Query::Intersect => {
                scene.intersect_packet(&packet.rays, packet.active, &mut packet.hits);
            }
            Query::Occluded => {
                packet.occluded = scene.occluded_packet(&packet.rays, packet.active);
            }
        };
        if parallel {
            self.packets.par_iter_mut().with_min_len(256).for_each(trace);
        } else {
            self.packets.iter_mut().for_each(trace);
        }
    }

    fn agree(&self, ray: usize, batch: &Answers) -> bool {
        let (packet, lane) = (&self.packets[ray / PACKET_LANES], ray % PACKET_LANES);
        match batch {
            Answers::Hits(hits) => packet.hits.get(lane) == hits.get(ray),
            Answers::Occluded(occluded) => (packet.occluded >> lane & 1 != 0) == occluded[ray],
        }
    }
}
