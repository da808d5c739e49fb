//! The visibility query: how much of a light points see.
//!
//! Of each sample the answer is that of [`Scene::occluded`] for the sample's ray, bit for bit: see
//! [`crate::points`] for how it is made. A sample behind the surface of its point is unseen. The
//! results are the same for every number of threads.

use crate::error::ShapeError;
use crate::points::{LightSamples, Points};
use crate::scene::{LightShape, Scene};
use crate::share_out::share_out;
use crate::traverse::shadow::{self, AreaLight, BLOCK_POINTS, Ordered, Query, Seen};

/// How many points a thread takes at a time, if they have few samples: each part makes a tile of its own.
const LARGEST_PART: usize = 16 * BLOCK_POINTS;
/// How many, if they have many: a block that is cut in two costs a twentieth more.
const SMALLEST_PART: usize = BLOCK_POINTS / 2;
/// How many samples a thread takes at a time, within these limits: some tenths of a millisecond, so
/// that all threads end together.
const PART_SAMPLES: usize = 64 * BLOCK_POINTS;

/// How many points with so many samples a thread takes at a time.
fn part_points(samples: usize) -> usize {
    let points = PART_SAMPLES / samples.max(1);
    points.next_multiple_of(SMALLEST_PART).clamp(SMALLEST_PART, LARGEST_PART)
}

impl Scene {
    /// Writes the fraction of its samples that each point sees, from 0 to 1, on this thread. It is 0
    /// if there are no samples.
    ///
    /// Points may come in any order and number; neighbours are traced together, and points in no order
    /// are sorted before, which takes memory for a copy of them. Of a point light all
    /// samples are the same: give it one.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many fractions as points, or too few samples.
    pub fn visibility(
        &self,
        points: &Points<'_>,
        light: &LightShape,
        samples: &(impl LightSamples + ?Sized),
        fraction: &mut [f32],
    ) -> Result<(), ShapeError> {
        self.answer(points, light, samples, fraction, false)
    }

    /// As [`Scene::visibility`], on the rayon pool that it is called in.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many fractions as points, or too few samples.
    pub fn par_visibility(
        &self,
        points: &Points<'_>,
        light: &LightShape,
        samples: &(impl LightSamples + ?Sized),
        fraction: &mut [f32],
    ) -> Result<(), ShapeError> {
        self.answer(points, light, samples, fraction, true)
    }

    /// Says of each sample whether its point sees it, on this thread: all samples of the first point,
    /// then those of the second, and so on.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many results as points times samples, or too few samples.
    pub fn visible_samples(
        &self,
        points: &Points<'_>,
        light: &LightShape,
        samples: &(impl LightSamples + ?Sized),
        seen: &mut [bool],
    ) -> Result<(), ShapeError> {
        self.answer(points, light, samples, seen, false)
    }

    /// As [`Scene::visible_samples`], on the rayon pool that it is called in.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many results as points times samples, or too few samples.
    pub fn par_visible_samples(
        &self,
        points: &Points<'_>,
        light: &LightShape,
        samples: &(impl LightSamples + ?Sized),
        seen: &mut [bool],
    ) -> Result<(), ShapeError> {
        self.answer(points, light, samples, seen, true)
    }

    /// Answers for all points, whatever their order.
    fn answer<A: Answer, S: LightSamples + ?Sized>(
        &self,
        points: &Points<'_>,
        light: &LightShape,
        samples: &S,
        answers: &mut [A],
        parallel: bool,
    ) -> Result<(), ShapeError> {
        samples.check(points.len())?;
        let each = A::per_point(samples.per_point());
        let [name, counted] = A::NAMES;
        ShapeError::check(name, answers.len(), counted, points.len() * each)?;
        let query = query(points, light, samples);
        if let Some(ordered) = Ordered::new(points, parallel) {
            let samples = ordered.samples(samples);
            let mut own = vec![A::default(); answers.len()];
            self.answer_parts(&ordered.query(&query, &samples), &mut own, parallel);
            ordered.give(&own, answers, each);
        } else {
            self.answer_parts(&query, answers, parallel);
        }
        Ok(())
    }

    fn answer_parts<A: Answer, S: LightSamples + ?Sized>(
        &self,
        query: &Query<'_, S>,
        answers: &mut [A],
        parallel: bool,
    ) {
        if !parallel {
            return A::write(self, query, 0, answers);
        }
        let samples = query.samples.per_point();
        let points = part_points(samples);
        let part = (points * A::per_point(samples)).max(1);
        let parallel = answers.len() > part;
        share_out(answers.chunks_mut(part).enumerate(), parallel, |(part, answers)| {
            A::write(self, query, part * points, answers)
        });
    }
}

/// What is asked about each point.
trait Answer: Copy + Default + Send {
    /// The names of the answers and of what there must be as many of, for messages.
    const NAMES: [&'static str; 2];

    /// How many answers a point with so many samples has.
    fn per_point(samples: usize) -> usize;

    /// Writes the answers about the points from `first`.
    fn write<S: LightSamples + ?Sized>(
        scene: &Scene,
        query: &Query<'_, S>,
        first: usize,
        answers: &mut [Self],
    );
}

/// The fraction of its samples that a point sees.
impl Answer for f32 {
    const NAMES: [&'static str; 2] = ["fraction", "points"];

    fn per_point(_: usize) -> usize {
        1
    }

    fn write<S: LightSamples + ?Sized>(
        scene: &Scene,
        query: &Query<'_, S>,
        first: usize,
        fractions: &mut [Self],
    ) {
        let count = query.samples.per_point();
        if count == 0 {
            return fractions.fill(0.0);
        }
        let range = first..first + fractions.len();
        shadow::visibility(&scene.bvh, query, range, |point, seen| {
            let own = &mut fractions[point - first..];
            match seen {
                Seen::Wholly { points, seen } => {
                    for (lane, fraction) in own.iter_mut().take(16).enumerate() {
                        if points >> lane & 1 != 0 {
                            *fraction = (seen >> lane & 1) as f32;
                        }
                    }
                }
                Seen::Masks(masks) => {
                    let seen: u32 = masks.iter().map(|mask| mask.count_ones()).sum();
                    own[0] = seen as f32 / count as f32;
                }
            }
        });
    }
}

/// Whether a point sees a sample, for each of them.
impl Answer for bool {
    const NAMES: [&'static str; 2] = ["seen", "points times samples"];

    fn per_point(samples: usize) -> usize {
        samples
    }

    fn write<S: LightSamples + ?Sized>(
        scene: &Scene,
        query: &Query<'_, S>,
        first: usize,
        seen: &mut [Self],
    ) {
        let count = query.samples.per_point();
        if count == 0 {
            return;
        }
        let range = first..first + seen.len() / count;
        shadow::visibility(&scene.bvh, query, range, |point, which| {
            let own = &mut seen[(point - first) * count..];
            match which {
                Seen::Wholly { points, seen } if count == 1 => {
                    for (lane, own) in own.iter_mut().take(16).enumerate() {
                        *own = if points >> lane & 1 != 0 { seen >> lane & 1 != 0 } else { *own };
                    }
                }
                Seen::Wholly { points, seen } => {
                    for (lane, own) in own.chunks_exact_mut(count).take(16).enumerate() {
                        if points >> lane & 1 != 0 {
                            own.fill(seen >> lane & 1 != 0);
                        }
                    }
                }
                Seen::Masks(masks) => {
                    let (whole, rest) = own[..count].as_chunks_mut::<16>();
                    for (own, &mask) in whole.iter_mut().zip(masks) {
                        *own = std::array::from_fn(|sample| mask >> sample & 1 != 0);
                    }
                    for (sample, own) in rest.iter_mut().enumerate() {
                        *own = masks[masks.len() - 1] >> sample & 1 != 0;
                    }
                }
            }
        });
    }
}

fn query<'a, S: ?Sized>(points: &Points<'a>, light: &LightShape, samples: &'a S) -> Query<'a, S> {
    let light = match *light {
        LightShape::Point(position) => {
            AreaLight { corner: position, edge_u: glam::Vec3::ZERO, edge_v: glam::Vec3::ZERO }
        }
        LightShape::Quad { corner, edge_u, edge_v } => AreaLight { corner, edge_u, edge_v },
    };
    Query { points: *points, light, samples }
}
