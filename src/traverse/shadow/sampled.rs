//! Points of a block whose samples go as volleys.
//!
//! Bundles hold the samples of one point, or one sample each of sixteen points ([`super::crossed`]).
//! Which is better depends on how large the primitives are before a point's view of the light. So it is
//! tried: where many rays of points' own bundles had to be tested by themselves, since a leaf was met
//! by few of them, the next groups of points go across.

use super::crossed::Crossed;
use super::group::{Aim, LANES};
use super::placed::Placed;
use super::shafts::GROUPS;
use super::volley::{Apex, Volley};
use super::{Query, Seen};
use crate::bvh::Bvh;
use crate::points::LightSamples;
use crate::simd::{F32x16, each};

/// More rays of a bundle than this that are tested by themselves make its bundle too wide.
const MOST_ALONE: usize = 8;

/// How many groups of points go across before the other way is tried again.
const CROSSINGS: u32 = 7;

/// The largest spread of points that go across, in units of the light's: with all axes added.
const LARGEST_SPREAD: f32 = 0.5;

/// Points, and the samples that they see.
pub(super) struct Sampled<'a> {
    volley: Volley<'a>,
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
            volley: Volley::new(bvh),
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
        trace(&mut self.volley, aim, Apex::None, &mut self.waiting, &mut self.masks);
        let registers = self.placed.registers();
        for (&point, masks) in self.points.iter().zip(self.masks.chunks(registers)) {
            done(point, Seen::Masks(masks));
        }
        self.points.clear();
        self.masks.clear();
    }

    fn trace_group<S: LightSamples + ?Sized>(&mut self, query: &Query<'_, S>, aim: &Aim) {
        if self.crossings > 0 && is_close(query, &self.group) {
            self.aligned = self.crossed.place(query, &self.group);
            if self.aligned {
                self.crossings -= 1;
                trace(&mut self.volley, aim, Apex::None, &mut self.waiting, &mut self.masks);
                self.points.extend(&self.group);
                let Self { crossed, volley, group, masks, .. } = self;
                crossed.trace(query, aim, volley, group, masks);
                volley.take_alone();
                return group.clear();
            }
        }
        self.crossings = 0;
        for place in 0..self.group.len() {
            self.trace_point(query, aim, self.group[place]);
        }
        // What still waits in the volley counts for the next group.
        let bundles = self.group.len() * self.placed.registers();
        if self.volley.take_alone() > MOST_ALONE * bundles && self.aligned {
            self.crossings = CROSSINGS;
        }
        self.group.clear();
    }

    fn trace_point<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        aim: &Aim,
        point: usize,
    ) {
        // A point that fills volleys has them for itself.
        let alone = self.placed.registers() >= GROUPS;
        let Self { volley, placed, points, waiting, masks, .. } = self;
        points.push(point);
        let origin: [f32; 3] = each(|axis| query.points.position[axis][point]);
        let apex = if alone { Apex::Start(origin) } else { Apex::None };
        let lanes = each(|axis| F32x16::splat(origin[axis]));
        let around = [aim.axes.turn(origin); 2];
        placed.each(query, point, |dir, active| {
            masks.push(0);
            if active != 0 {
                waiting.push(masks.len() - 1);
                volley.push(aim, lanes, dir, active, Some(around));
            }
            if volley.is_full() {
                trace(volley, aim, apex, waiting, masks);
            }
        });
        if alone {
            trace(volley, aim, apex, waiting, masks);
        }
    }
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
    volley: &mut Volley<'_>,
    aim: &Aim,
    apex: Apex,
    waiting: &mut Vec<usize>,
    masks: &mut [u16],
) {
    let mut places = waiting.drain(..);
    volley.trace(aim, apex, |seen| {
        if let Some(place) = places.next() {
            masks[place] = seen as u16;
        }
    });
}
