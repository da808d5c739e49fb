//! Points of a block whose samples go as volleys.

use super::group::Aim;
use super::placed::Placed;
use super::shafts::GROUPS;
use super::volley::{Apex, Volley};
use super::{Query, Seen};
use crate::bvh::Bvh;
use crate::points::LightSamples;
use crate::simd::{F32x16, each};

/// Points, and the samples that they see.
pub(super) struct Sampled<'a> {
    volley: Volley<'a>,
    placed: Placed,
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
        // A point that fills volleys has them for itself.
        let alone = self.placed.registers() >= GROUPS;
        let Self { volley, placed, points, waiting, masks } = self;
        points.push(point);
        let origin: [f32; 3] = each(|axis| query.points.position[axis][point]);
        let apex = if alone { Apex::Start(origin) } else { Apex::None };
        let lanes = each(|axis| F32x16::splat(origin[axis]));
        placed.each(query, point, |dir, active| {
            masks.push(0);
            if active != 0 {
                waiting.push(masks.len() - 1);
                volley.push(aim, lanes, dir, active, Some(origin));
            }
            if volley.is_full() {
                trace(volley, aim, apex, waiting, masks);
            }
        });
        if alone {
            trace(volley, aim, apex, waiting, masks);
        }
    }

    /// Traces all that waits and gives the points. To be called before another aim is used.
    pub(super) fn finish(&mut self, aim: &Aim, done: &mut impl FnMut(usize, Seen<'_>)) {
        trace(&mut self.volley, aim, Apex::None, &mut self.waiting, &mut self.masks);
        let registers = self.placed.registers();
        for (&point, masks) in self.points.iter().zip(self.masks.chunks(registers)) {
            done(point, Seen::Masks(masks));
        }
        self.points.clear();
        self.masks.clear();
    }
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
