//! Large arrays on huge pages, where the system gives them, whose memory is kept for the next ones.
//!
//! A page of 4 KiB is one entry of the processor's address tables, and its first use is a call into the
//! system, which fills it with zeros. Arrays of many megabytes that are used in no order and for the
//! time of a call spend much of that time on both.

use std::ops::{Deref, DerefMut};
use std::sync::Mutex;

use bytemuck::Pod;
use memmap2::MmapMut;

/// Smaller arrays would hardly fill one huge page.
const LEAST_BYTES: usize = 4 << 20;

/// How many arrays that nobody uses are kept, and how large they are at most: what two calls with a
/// million rays need.
const MOST_SPARE: usize = 8;
const LARGEST_SPARE: usize = 64 << 20;

/// Memory that waits to be used again.
static SPARE: Mutex<Vec<MmapMut>> = Mutex::new(Vec::new());

/// An array of a fixed length, on a boundary of 64 bytes at least if it is large.
#[derive(Debug)]
pub struct Pages<T> {
    memory: Memory<T>,
    len: usize,
}

#[derive(Debug)]
enum Memory<T> {
    Mapped(MmapMut),
    Owned(Vec<T>),
}

impl<T: Pod> Pages<T> {
    /// So many values, whatever they are.
    pub fn new(len: usize) -> Self {
        let bytes = len * size_of::<T>();
        let map = if bytes < LEAST_BYTES { None } else { spare(bytes).or_else(|| mapped(bytes)) };
        Self {
            memory: map.map_or_else(|| Memory::Owned(vec![T::zeroed(); len]), Memory::Mapped),
            len,
        }
    }
}

/// A spare array that is large enough, and not much too large.
fn spare(bytes: usize) -> Option<MmapMut> {
    // Nobody panics while they have the lock; if somebody did, there are no spare ones.
    let mut spare = SPARE.lock().ok()?;
    let fitting = (0..spare.len()).filter(|&at| (bytes..=2 * bytes).contains(&spare[at].len()));
    let best = fitting.min_by_key(|&at| spare[at].len())?;
    Some(spare.swap_remove(best))
}

fn mapped(bytes: usize) -> Option<MmapMut> {
    let map = MmapMut::map_anon(bytes).ok()?;
    // A system without huge pages says so, and gives others.
    #[cfg(target_os = "linux")]
    let _ = map.advise(memmap2::Advice::HugePage);
    Some(map)
}

impl<T> Drop for Pages<T> {
    fn drop(&mut self) {
        if let Memory::Mapped(map) = std::mem::replace(&mut self.memory, Memory::Owned(Vec::new()))
            && map.len() <= LARGEST_SPARE
            && let Ok(mut spare) = SPARE.lock()
        {
            // The oldest goes first.
            if spare.len() >= MOST_SPARE {
                spare.remove(0);
            }
            spare.push(map);
        }
    }
}

impl<T: Pod> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        match &self.memory {
            Memory::Mapped(map) => bytemuck::cast_slice(&map[..self.len * size_of::<T>()]),
            Memory::Owned(values) => values,
        }
    }
}

impl<T: Pod> DerefMut for Pages<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.memory {
            Memory::Mapped(map) => bytemuck::cast_slice_mut(&mut map[..self.len * size_of::<T>()]),
            Memory::Owned(values) => values,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_of_all_sizes_keep_what_is_written() {
        for len in [0, 1, 1000, LEAST_BYTES / 4 - 1, LEAST_BYTES / 4, LEAST_BYTES, LEAST_BYTES / 4]
        {
            let (mut pages, other) = (Pages::<u32>::new(len), Pages::<[f32; 2]>::new(len));
            assert_eq!((pages.len(), other.len()), (len, len));
            pages.iter_mut().zip(1..).for_each(|(value, number)| *value = number);
            assert!(pages.iter().zip(1..).all(|(&value, number)| value == number));
        }
    }

    #[test]
    fn memory_is_used_again_but_not_for_two_at_once() {
        let all: Vec<Pages<u8>> = (0..3 * MOST_SPARE).map(|_| Pages::new(LEAST_BYTES)).collect();
        let mut starts: Vec<_> = all.iter().map(|pages| pages.as_ptr()).collect();
        starts.sort_unstable();
        starts.dedup();
        assert_eq!(starts.len(), all.len());
        drop(all);
        assert!(SPARE.lock().expect("nobody panicked").len() <= MOST_SPARE);
    }
}
