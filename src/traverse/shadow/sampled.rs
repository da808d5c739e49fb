//! Points of a block whose samples are traced: as volleys, or as tiles of a batch.
//!
//! A volley tests what a bundle meets with the whole bundle, a tile leaves to single rays what few rays
//! meet. Which is faster differs by a quarter in either direction, so both are timed ([`super::tempo`]). Only
//! points whose samples fill a tile are tiles at once: their rays start at one point, of which tiles
//! make most.
//!
//! Bundles hold the samples of one point, in volleys also one sample each of sixteen points
//! ([`super::crossed`]). Which is better depends on how large the primitives are before a point's view of
//! the light. So it is tried: where many rays of points' own bundles had to be tested by themselves, since
//! a leaf was met by few of them, the next groups of points go across. Tiles across points ([`super::cells`])
//! are for points that no block was made of.

use std::ops::Range;
use std::time::Instant;

use super::cells::{CELL_POINTS, Cells};
use super::crossed::Crossed;
use super::duel::Duel;
use super::group::{Aim, LANES};
use super::placed::Placed;
use super::shafts::GROUPS;
use super::tempo::Choice;
use super::tiled::Tiled;
use super::volley::Volley;
use super::{Query, Seen};
use crate::bvh::Bvh;
use crate::points::LightSamples;
use crate::simd::{F32x16, each};

/// The two ways to trace a group: with at most sixteen samples a point the first is tried first, else the second.
const VOLLEYS: usize = 0;
const TILES: usize = 1;

/// The first of two ways to trace points that no block was made of: with tiles of their own samples. The other
/// one is across points.
const OWN: usize = 0;

/// More rays of a bundle than this that are tested by themselves make its bundle too wide.
const MOST_ALONE: usize = 8;

/// How many groups of points go across before the other way is tried again.
const CROSSINGS: u32 = 7;

/// The largest spread of points that go across, in units of the light's: with all axes added.
const LARGEST_SPREAD: f32 = 0.5;

/// Points, and the samples that they see.
pub(super) struct Sampled<'a> {
    samples: usize,
    volley: Box<Volley>,
    bvh: &'a Bvh,
    /// Taken when it is first asked for.
    tiled: Option<Box<Tiled>>,
    choice: Choice,
    /// Made when it is first asked for.
    cells: Option<Cells>,
    blockless: Duel,
    placed: Placed,
    crossed: Crossed,
    /// Points that wait until there are sixteen.
    group: Vec<usize>,
    /// How many groups are still to go across.
    crossings: u32,
    /// False once the samples of one number were not close together: then they never are.
    aligned: bool,
    points: Vec<usize>,
    /// The registers of samples that wait in the volley, as places in `masks`.
    waiting: Vec<usize>,
    /// The samples that are seen: for each point as many as it takes.
    masks: Vec<u16>,
}

impl<'a> Sampled<'a> {
    /// For points of so many samples.
    pub(super) fn new(bvh: &'a Bvh, samples: usize) -> Self {
        Self {
            samples,
            volley: Volley::taken(bvh),
            bvh,
            tiled: None,
            choice: Choice::resumed(kind(samples)),
            cells: None,
            blockless: Duel::resumed(),
            placed: Placed::new(samples),
            crossed: Crossed::new(samples),
            group: Vec::with_capacity(LANES),
            crossings: 0,
            aligned: true,
            points: Vec::new(),
            waiting: Vec::new(),
            masks: Vec::new(),
        }
    }

    /// Adds a point that has a shaft in `aim`.
    pub(super) fn add<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        aim: &Aim,
        point: usize,
    ) {
        if self.placed.registers() >= GROUPS {
            return self.trace_alone(query, point);
        }
        self.group.push(point);
        if self.group.len() == LANES {
            self.trace_group(query, aim);
        }
    }

    /// Traces all that waits and gives the points. To be called before another aim is used.
    pub(super) fn finish<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        aim: &Aim,
        done: &mut impl FnMut(usize, Seen<'_>),
    ) {
        if !self.group.is_empty() {
            self.trace_group(query, aim);
        }
        self.give(done);
    }

    /// As [`Sampled::finish`], if all points went alone.
    pub(super) fn give(&mut self, done: &mut impl FnMut(usize, Seen<'_>)) {
        self.trace_tile();
        let registers = self.placed.registers();
        for (&point, masks) in self.points.iter().zip(self.masks.chunks(registers)) {
            done(point, Seen::Masks(masks));
        }
        self.points.clear();
        self.masks.clear();
    }

    /// Takes a point into the tile, whether it has a shaft or not.
    pub(super) fn trace_alone<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        point: usize,
    ) {
        self.points.push(point);
        let origin = each(|axis| F32x16::splat(query.points.position[axis][point]));
        let Self { tiled, placed, masks, bvh, .. } = self;
        let tiled = tiled.get_or_insert_with(|| Tiled::taken(bvh));
        placed.each(query, point, |dir, active| {
            masks.push(0);
            if active != 0 {
                tiled.push(origin, dir, active, masks.len() - 1);
            }
            if tiled.is_full() {
                tiled.trace(bvh, |place, seen| masks[place] = seen as u16);
            }
        });
    }

    /// Takes points that no block was made of: as tiles of their own samples, or across them, as is faster.
    pub(super) fn trace_all<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        points: Range<usize>,
    ) {
        for start in points.clone().step_by(CELL_POINTS) {
            let part = start..(start + CELL_POINTS).min(points.end);
            let (whole, way) = (part.len() == CELL_POINTS, self.blockless.next());
            let clock = Instant::now();
            if way == OWN {
                part.for_each(|point| self.trace_alone(query, point));
                self.trace_tile();
            } else {
                self.trace_cells(query, part);
            }
            if whole {
                self.blockless.took(clock.elapsed());
            }
        }
    }

    /// Takes at most [`CELL_POINTS`] points into tiles across them.
    fn trace_cells<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        points: Range<usize>,
    ) {
        let Self { tiled, cells, bvh, masks, samples, .. } = self;
        let tiled = tiled.get_or_insert_with(|| Tiled::taken(bvh));
        let cells = cells.get_or_insert_with(|| Cells::new(*samples));
        cells.trace(bvh, query, points.clone(), tiled, masks);
        self.points.extend(points);
    }

    /// Ends a query: what was learnt stays.
    pub(super) fn leave(self) {
        self.choice.leave(kind(self.samples));
        self.blockless.leave();
        self.volley.leave();
        if let Some(tiled) = self.tiled {
            tiled.leave();
        }
    }

    /// Traces what waits in the tile.
    fn trace_tile(&mut self) {
        if let Some(tiled) = &mut self.tiled {
            tiled.trace(self.bvh, |place, seen| self.masks[place] = seen as u16);
        }
    }

    /// Traces the group, in the way that is faster.
    fn trace_group<S: LightSamples + ?Sized>(&mut self, query: &Query<'_, S>, aim: &Aim) {
        let way = self.choice.next();
        let (start, count) = (Instant::now(), self.group.len());
        if way == TILES || !self.cross(query, aim) {
            for place in 0..count {
                let point = self.group[place];
                if way == VOLLEYS {
                    self.trace_point(query, aim, point);
                } else {
                    self.trace_alone(query, point);
                }
            }
            self.trace_tile();
            trace(&mut self.volley, (self.bvh, aim), &mut self.waiting, &mut self.masks);
            let alone = self.volley.take_alone();
            if alone > MOST_ALONE * count * self.placed.registers() && self.aligned {
                self.crossings = CROSSINGS;
            }
        }
        self.group.clear();
        // Of fewer points, more is set up than traced.
        if count == LANES {
            self.choice.took(start.elapsed(), count * self.samples);
        }
    }

    /// Traces the group across its points. False if it is not to go across.
    fn cross<S: LightSamples + ?Sized>(&mut self, query: &Query<'_, S>, aim: &Aim) -> bool {
        let crosses = self.crossings > 0 && is_close(query, &self.group);
        self.crossings = if crosses { self.crossings - 1 } else { 0 };
        if crosses {
            self.aligned = self.crossed.place(query, &self.group);
        }
        if !crosses || !self.aligned {
            self.crossings = 0;
            return false;
        }
        self.points.extend(&self.group);
        let Self { crossed, volley, group, masks, bvh, .. } = self;
        crossed.trace(query, (bvh, aim), volley, group, masks);
        volley.take_alone();
        true
    }

    fn trace_point<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        aim: &Aim,
        point: usize,
    ) {
        let Self { volley, placed, points, waiting, masks, bvh, .. } = self;
        points.push(point);
        let origin: [f32; 3] = each(|axis| query.points.position[axis][point]);
        let lanes = each(|axis| F32x16::splat(origin[axis]));
        let around = [aim.axes.turn(origin); 2];
        placed.each(query, point, |dir, active| {
            masks.push(0);
            if active != 0 {
                waiting.push(masks.len() - 1);
                volley.push(aim, lanes, dir, active, Some(around));
            }
            if volley.is_full() {
                trace(volley, (bvh, aim), waiting, masks);
            }
        });
    }
}

/// Queries are told apart by how many points fill a tile: sixteen, or fewer.
fn kind(samples: usize) -> usize {
    usize::from(samples > LANES)
}

/// True if points are close together, seen from the light.
fn is_close<S: ?Sized>(query: &Query<'_, S>, points: &[usize]) -> bool {
    let spread = |axis: usize| {
        let parts = points.iter().map(|&point| query.points.position[axis][point]);
        let largest = parts.clone().fold(f32::NEG_INFINITY, f32::max);
        largest - parts.fold(f32::INFINITY, f32::min)
    };
    let light = (query.light.edge_u.abs() + query.light.edge_v.abs()).element_sum();
    (0..3).map(spread).sum::<f32>() < LARGEST_SPREAD * light
}

fn trace(
    volley: &mut Volley,
    (bvh, aim): (&Bvh, &Aim),
    waiting: &mut Vec<usize>,
    masks: &mut [u16],
) {
    let mut places = waiting.drain(..);
    volley.trace(bvh, aim, |seen| {
        if let Some(place) = places.next() {
            masks[place] = seen as u16;
        }
    });
}
