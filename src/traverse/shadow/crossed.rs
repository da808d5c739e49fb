//! Bundles across points: sixteen neighbours, one sample each.
//!
//! Samples of one number lie close together on the light if the sets of all points are stratified
//! alike. A bundle of sixteen neighbours that look at one spot of the light is much thinner than one of
//! all samples of a point: before small primitives fewer leaves are met by few of its rays.

use super::Query;
use super::group::Aim;
use super::placed::{LANES, facing};
use super::shafts::GROUPS;
use super::volley::{Recent, Volley};
use crate::bvh::Bvh;
use crate::points::LightSamples;
use crate::simd::{F32x16, Lanes, each};
use crate::traverse::ones;

/// The samples of one number are close together if they are spread by less than this share of the
/// light, both axes added. Strata of sixteen samples are spread by half of it, samples in no order by
/// nearly twice as much as the light.
const CLOSE: f32 = 0.75;

/// Up to sixteen points, and where their samples lie.
pub(super) struct Crossed {
    samples: usize,
    /// Those of one point side by side.
    own: [Vec<f32>; 2],
    /// Those of one number side by side.
    across: [Vec<f32>; 2],
    /// The samples that wait in the volley.
    waiting: Vec<usize>,
    /// The points that see each sample, one bit each; padded to whole registers.
    seen: Vec<u16>,
    /// For each volley of a group, where that of the group before met something.
    recent: Vec<Recent>,
}

impl Crossed {
    /// For points of so many samples.
    pub(super) fn new(samples: usize) -> Self {
        let padded = samples.next_multiple_of(LANES);
        let arrays = |len: usize| [vec![0.0; len], vec![0.0; len]];
        Self {
            samples,
            own: arrays(samples),
            across: arrays(samples * LANES),
            waiting: Vec::with_capacity(GROUPS),
            seen: vec![0; padded],
            recent: vec![Recent::default(); samples.div_ceil(GROUPS)],
        }
    }

    /// Places the samples of up to sixteen points. True if those of one number are close together.
    pub(super) fn place<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        points: &[usize],
    ) -> bool {
        let Self { own: [u, v], across, .. } = self;
        for (lane, &point) in points.iter().enumerate() {
            query.samples.place(point, u, v);
            for (across, own) in across.iter_mut().zip([&*u, &*v]) {
                for (to, &from) in across.iter_mut().skip(lane).step_by(LANES).zip(own) {
                    *to = from;
                }
            }
        }
        let spread = |array: &Vec<f32>, sample: usize| {
            let own = &array[sample * LANES..][..points.len()];
            let largest = own.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            largest - own.iter().copied().fold(f32::INFINITY, f32::min)
        };
        // Three of them tell.
        [0, self.samples / 2, self.samples - 1]
            .into_iter()
            .all(|sample| spread(&self.across[0], sample) + spread(&self.across[1], sample) < CLOSE)
    }

    /// Traces the samples of the points that were placed last, and appends the samples that each sees,
    /// sixteen in a number.
    pub(super) fn trace<S: LightSamples + ?Sized>(
        &mut self,
        query: &Query<'_, S>,
        (bvh, aim): (&Bvh, &Aim),
        volley: &mut Volley,
        points: &[usize],
        masks: &mut Vec<u16>,
    ) {
        // Lanes without a point repeat the first.
        let gather = |array: &[f32]| {
            let mut lanes = [array[points[0]]; LANES];
            for (lane, &point) in lanes.iter_mut().zip(points) {
                *lane = array[point];
            }
            F32x16::load(&lanes)
        };
        let origin: [F32x16; 3] = each(|axis| gather(query.points.position[axis]));
        let turned = aim.axes.turn(origin);
        let around =
            [each(|axis| turned[axis].reduce_min()), each(|axis| turned[axis].reduce_max())];
        let normal = query.points.normal.map(|normal| each(|axis| gather(normal[axis])));
        let all = (1_u32 << points.len()) - 1;
        self.seen.fill(0);
        for first in (0..self.samples).step_by(GROUPS) {
            for sample in first..(first + GROUPS).min(self.samples) {
                let at = |array: &Vec<f32>| F32x16::load(&array[sample * LANES..]);
                let dir = query.light.directions(origin, at(&self.across[0]), at(&self.across[1]));
                let active = facing(normal, &dir) & all;
                if active != 0 {
                    self.waiting.push(sample);
                    volley.push(aim, origin, dir, active, Some(around));
                }
            }
            let (seen, mut waiting) = (&mut self.seen, self.waiting.drain(..));
            volley.swap_recent(&mut self.recent[first / GROUPS]);
            volley.trace(bvh, aim, |lanes| {
                if let Some(sample) = waiting.next() {
                    seen[sample] = lanes as u16;
                }
            });
            volley.swap_recent(&mut self.recent[first / GROUPS]);
        }
        let registers = self.samples.div_ceil(LANES);
        let first = masks.len();
        masks.resize(first + registers * points.len(), 0);
        for (register, seen) in self.seen.as_chunks::<LANES>().0.iter().enumerate() {
            let turned = transposed(*seen);
            for point in ones(all) {
                masks[first + point * registers + register] = turned[point];
            }
        }
    }
}

/// Bit `j` of number `i` to bit `i` of number `j`: halves are swapped, then quarters and so on (Warren,
/// "Hacker's Delight", section 7-3).
pub(super) fn transposed(mut rows: [u16; LANES]) -> [u16; LANES] {
    let (mut step, mut mask) = (LANES / 2, 0x00ff_u16);
    while step != 0 {
        for row in (0..LANES).filter(|row| row & step == 0) {
            let swap = (rows[row] >> step ^ rows[row + step]) & mask;
            rows[row] ^= swap << step;
            rows[row + step] ^= swap;
        }
        step /= 2;
        mask ^= mask << step;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_change_places() {
        let rows: [u16; LANES] = std::array::from_fn(|row| (row * 0x3a71 + 0x1234) as u16);
        let turned = transposed(rows);
        for (row, column) in (0..LANES).flat_map(|row| (0..LANES).map(move |column| (row, column)))
        {
            assert_eq!(rows[row] >> column & 1, turned[column] >> row & 1);
        }
    }
}
