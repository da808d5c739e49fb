//! Whoever traces a workload: octray, or one of Embree's calls. All read the same rays and write
//! the same arrays.

use octray::workload::{Query, ShadowPoints, Workload};
use octray::{HitBatch, Points, RayBatch, SampleArrays, Scene};

/// The results of a workload.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Answers {
    Hits(HitBatch),
    Occluded(Vec<bool>),
}

impl Answers {
    /// Room for the answers to a workload.
    pub(crate) fn new(workload: &Workload) -> Self {
        match workload.query {
            Query::Intersect => Self::Hits(HitBatch::new(workload.rays.len())),
            Query::Occluded => Self::Occluded(vec![false; workload.rays.len()]),
        }
    }

    /// How many rays hit something.
    pub(crate) fn hit_count(&self) -> usize {
        match self {
            Self::Hits(hits) => hits.geom_id.iter().filter(|&&id| id != octray::NO_HIT).count(),
            Self::Occluded(occluded) => occluded.iter().filter(|&&occluded| occluded).count(),
        }
    }
}

/// One way to trace rays.
pub(crate) trait Contender {
    /// What is not timed: makes packets ready again.
    fn prepare(&mut self, rays: &RayBatch, query: Query);
    /// What is timed.
    fn trace(&mut self, rays: &RayBatch, answers: &mut Answers, parallel: bool);
    /// What is not timed either: copies answers that are still in packets.
    fn collect(&mut self, answers: &mut Answers);
}

/// octray's batch queries.
pub(crate) struct Octray<'a>(pub(crate) &'a Scene);

impl Contender for Octray<'_> {
    fn prepare(&mut self, _: &RayBatch, _: Query) {}

    fn trace(&mut self, rays: &RayBatch, answers: &mut Answers, parallel: bool) {
        let rays = rays.as_rays();
        let result = match (answers, parallel) {
            (Answers::Hits(hits), false) => self.0.intersect_batch(rays, hits.as_hits()),
            (Answers::Hits(hits), true) => self.0.par_intersect_batch(rays, hits.as_hits()),
            (Answers::Occluded(occluded), false) => self.0.occluded_batch(rays, occluded),
            (Answers::Occluded(occluded), true) => self.0.par_occluded_batch(rays, occluded),
        };
        result.expect("there are as many answers as rays");
    }

    fn collect(&mut self, _: &mut Answers) {}
}

/// octray's visibility query, on the points and samples that the rays of a soft shadow come from. It
/// is not told the normals, so that it traces the same rays as the others.
#[derive(Clone, Copy)]
pub(crate) struct Visibility<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) points: &'a ShadowPoints,
}

impl Contender for Visibility<'_> {
    fn prepare(&mut self, _: &RayBatch, _: Query) {}

    fn trace(&mut self, _: &RayBatch, answers: &mut Answers, parallel: bool) {
        let Answers::Occluded(seen) = answers else { unreachable!("shadows are any hits") };
        let [x, y, z] = &self.points.position;
        let points = Points::new(x, y, z).expect("one length");
        let (u, v) = (&self.points.u, &self.points.v);
        let samples = SampleArrays::new(u, v, u.len() / x.len()).expect("one length");
        for (light, seen) in self.points.lights.iter().zip(seen.chunks_exact_mut(u.len())) {
            let result = if parallel {
                self.scene.par_visible_samples(&points, light, &samples, seen)
            } else {
                self.scene.visible_samples(&points, light, &samples, seen)
            };
            result.expect("there are as many answers as samples");
        }
    }

    /// A sample is seen exactly if its ray is not occluded.
    fn collect(&mut self, answers: &mut Answers) {
        let Answers::Occluded(answers) = answers else { unreachable!("shadows are any hits") };
        answers.iter_mut().for_each(|answer| *answer = !*answer);
    }
}
