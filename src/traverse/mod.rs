//! Traversals: rays against the tree.
//!
//! - `batch`: rays of any number, tile by tile
//! - `pencil`, `sorted`, `run`: rays that come in no order though they share a start or an end
//! - `strewn`: how it is told that they come in no order
//! - `tile`: up to sixteen groups of rays, in one descent as long as many of them go the same way
//! - `starts`: where the rays of a tile start, which boxes there come first for any hit
//! - `rest`: what a tile leaves to single rays
//! - `stream`: rays one by one, several in turns, each step by `single`, what waits in a `stack`
//! - `alone`: one ray that comes alone
//! - `pace`: which of both is worth it
//! - `tracer`: a tile and a stream together, `kept` by the thread from query to query
//! - `packet`: eight rays that come alone
//! - `shadow`: points against an area light
//! - [`visits`]: counts for whoever tunes them
//! - [`mod@reference`]: one ray against everything, written independently
//!
//! All of them give the same bits.

mod aim;
mod alone;
pub(crate) mod batch;
mod beams;
mod cone;
mod corners;
mod cull;
mod group;
mod kept;
mod leaf;
mod open;
mod pace;
mod packet;
mod pencil;
mod planes;
pub mod reference;
mod rest;
mod run;
pub(crate) mod shadow;
mod single;
pub(crate) mod sorted;
mod stack;
mod starts;
mod stream;
mod strewn;
mod tile;
mod tracer;
pub mod visits;

use crate::bvh::{Bvh, MAX_DEPTH, WIDTH};

/// The closest hit as the traversals keep it, the primitive by its id.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Distance along the ray.
    pub t: f32,
    /// First surface coordinate.
    pub u: f32,
    /// Second surface coordinate.
    pub v: f32,
    /// The primitive, numbered over all geometries.
    pub id: u32,
}

/// The order of axes in which each axis comes last, as sheared rays have them; there is no fourth.
const SHEAR_ORDER: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];

/// How many entries a stack of waiting children needs: each node on the way leaves at most seven.
fn stack_size(bvh: &Bvh) -> usize {
    debug_assert!(bvh.depth <= MAX_DEPTH);
    (WIDTH - 1) * bvh.depth + 1
}

/// The places of the bits that are set.
#[inline(always)]
fn ones(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
        bits &= bits - 1;
        Some(place)
    })
}
