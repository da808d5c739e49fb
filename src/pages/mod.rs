//! Large arrays on huge pages, where the system gives them.
//!
//! A page of 4 KiB is one entry of the processor's address tables, and its first use is a call into the
//! system, which fills it with zeros. Arrays of many megabytes that are used in no order, or for the
//! time of a call, spend much of that time on both. With pages of 2 MiB rays through large trees are 1.02
//! to 1.04 times as fast.
//!
//! A [`Fresh`] array is filled. Then it is thrown away, or [`Frozen`]: read through a plain slice, as
//! cheap as a vector. [`Pages`] are fresh arrays whose memory is kept for the next call.

mod fresh;
mod frozen;
mod kept;

pub use fresh::{Fresh, Term};
pub use frozen::Frozen;
pub use kept::Pages;

use bytemuck::{Pod, Zeroable};
use memmap2::MmapMut;

/// The bytes of a line of the cache: all arrays start with one.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Line([u8; 64]);

/// The bytes of a huge page of most systems.
const HUGE: usize = 2 << 20;

/// What an array may leave of a huge page. Beyond its last one it gets small pages.
const MOST_LEFT: usize = HUGE / 4;

/// Smaller arrays would leave more.
const LEAST_BYTES: usize = HUGE - MOST_LEFT;

/// Memory of the system's, full of zeros; `None` if it gives none.
fn mapped(bytes: usize) -> Option<MmapMut> {
    // Linux starts at a huge page only what is as long as some. What is not used is never there.
    MmapMut::map_anon(bytes.next_multiple_of(HUGE)).ok()
}

/// Asks for huge pages under so many bytes of a map. A system that has none gives others.
fn ask_for_huge(map: &MmapMut, bytes: usize) {
    #[cfg(target_os = "linux")]
    let _ = map.advise_range(memmap2::Advice::HugePage, 0, (bytes + MOST_LEFT) / HUGE * HUGE);
    #[cfg(not(target_os = "linux"))]
    let _ = (map, bytes);
}
