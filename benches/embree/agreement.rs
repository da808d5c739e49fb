//! Whether two engines found the same hits.

use std::fmt;

use octray::workload::Workload;
use octray::{Hit, HitBatch, NO_HIT, Scene};
use serde::Serialize;

use crate::contender::Answers;

/// Hits of different primitives count as different from this relative distance on: below it they
/// are two sides of one edge.
const SAME_T: f64 = 1e-4;

/// The share of rays that may differ. Embree's fast mode rounds boxes and edges otherwise than
/// octray, so silhouettes and grazing rays do; a wrong transfer of rays or hits gives far more.
const ALLOWED: f64 = 2e-3;

/// The differences between octray's answers and Embree's.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Agreement {
    pub(crate) rays: usize,
    /// Hit by octray, missed by Embree.
    pub(crate) only_octray: usize,
    /// Hit by Embree, missed by octray.
    pub(crate) only_embree: usize,
    /// Different primitives at different `t`.
    pub(crate) different: usize,
    /// The largest relative difference of `t` where both hit the same primitive.
    pub(crate) largest_t: f64,
}

impl Agreement {
    pub(crate) fn new(octray: &Answers, embree: &Answers) -> Self {
        match (octray, embree) {
            (Answers::Hits(octray), Answers::Hits(embree)) => Self::of_hits(octray, embree),
            (Answers::Occluded(octray), Answers::Occluded(embree)) => {
                let differ = |one: &[bool], other: &[bool]| {
                    one.iter().zip(other).filter(|&(&one, &other)| one && !other).count()
                };
                Self {
                    rays: octray.len(),
                    only_octray: differ(octray, embree),
                    only_embree: differ(embree, octray),
                    ..Self::default()
                }
            }
            _ => unreachable!("both answer one query"),
        }
    }

    fn of_hits(octray: &HitBatch, embree: &HitBatch) -> Self {
        let mut result = Self { rays: octray.len(), ..Self::default() };
        for index in 0..octray.len() {
            let ids = |hits: &HitBatch| (hits.geom_id[index], hits.prim_id[index]);
            match (octray.geom_id[index] != NO_HIT, embree.geom_id[index] != NO_HIT) {
                (false, false) => {}
                (true, false) => result.only_octray += 1,
                (false, true) => result.only_embree += 1,
                (true, true) => {
                    let (ours, theirs) = (f64::from(octray.t[index]), f64::from(embree.t[index]));
                    let distance = (ours - theirs).abs() / ours.abs().max(f64::MIN_POSITIVE);
                    if ids(octray) == ids(embree) {
                        result.largest_t = result.largest_t.max(distance);
                    } else if distance > SAME_T {
                        result.different += 1;
                    }
                }
            }
        }
        result
    }

    /// True if the engines trace the same rays against the same scene.
    pub(crate) fn holds(&self) -> bool {
        let differ = self.only_octray + self.only_embree + self.different;
        differ as f64 <= ALLOWED * self.rays as f64 + 2.0
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { only_octray, only_embree, different, largest_t, .. } = self;
        out.pad(&format!("{only_octray}/{only_embree}/{different}, {largest_t:.0e}"))
    }
}

/// How a sample of the answers compares with octray's scalar reference.
pub(crate) struct ReferenceCheck {
    pub(crate) rays: usize,
    pub(crate) wrong: usize,
}

impl ReferenceCheck {
    /// Traces evenly spread rays through all primitives. With `exact` every bit must be right; else
    /// as close as another engine comes.
    pub(crate) fn new(scene: &Scene, workload: &Workload, answers: &Answers, exact: bool) -> Self {
        let count = workload.rays.len();
        // A second or so of brute force.
        let rays = (40_000_000 / scene.bvh().stats().primitives.max(1)).clamp(16, 512).min(count);
        let rays_of = workload.rays.as_rays();
        let is_wrong = |sample: &usize| {
            let index = sample * count / rays;
            let expected = scene.intersect_reference(&rays_of.get(index)).unwrap_or(Hit::MISS);
            match answers {
                Answers::Occluded(occluded) => occluded[index] != expected.is_hit(),
                Answers::Hits(hits) if exact => hits.get(index) != expected,
                Answers::Hits(hits) => {
                    let hit = hits.get(index);
                    let (t, expected_t) = (f64::from(hit.t), f64::from(expected.t));
                    hit.is_hit() != expected.is_hit()
                        || (hit.is_hit() && (t - expected_t).abs() > 1e-2 * expected_t)
                }
            }
        };
        Self { rays, wrong: (0..rays).filter(is_wrong).count() }
    }

    pub(crate) fn holds(&self, exact: bool) -> bool {
        if exact { self.wrong == 0 } else { self.wrong * 50 <= self.rays }
    }
}
