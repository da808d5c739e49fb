//! Arrays whose memory is kept for the next ones.

use std::ops::{Deref, DerefMut};
use std::sync::Mutex;

use bytemuck::Pod;
use memmap2::MmapMut;

use super::fresh::{Fresh, Memory};
use super::{LEAST_BYTES, ask_for_huge, mapped};

/// How many arrays that nobody uses are kept, how large each is and all are at most: what a sort and the
/// results of two calls with two million rays need.
const MOST_SPARE: usize = 16;
const LARGEST_SPARE: usize = 64 << 20;
const MOST_BYTES: usize = 512 << 20;

/// Memory that waits to be used again.
static SPARE: Mutex<Vec<MmapMut>> = Mutex::new(Vec::new());

/// A [`Fresh`] array for a short time.
#[derive(Debug)]
pub struct Pages<T: Pod>(Fresh<T>);

impl<T: Pod> Pages<T> {
    /// So many values, whatever they are.
    pub fn new(len: usize) -> Self {
        let bytes = len * size_of::<T>();
        let fresh = || mapped(bytes).inspect(|map| ask_for_huge(map, bytes));
        let map = if bytes < LEAST_BYTES { None } else { spare(bytes).or_else(fresh) };
        Self(Fresh::on(map, len))
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

impl<T: Pod> Drop for Pages<T> {
    fn drop(&mut self) {
        if let Memory::Mapped(map) = std::mem::replace(&mut self.0.memory, Memory::none())
            && map.len() <= LARGEST_SPARE
            && let Ok(mut spare) = SPARE.lock()
        {
            spare.push(map);
            let mut bytes: usize = spare.iter().map(|map| map.len()).sum();
            // The oldest goes first.
            while spare.len() > MOST_SPARE || bytes > MOST_BYTES {
                bytes -= spare.remove(0).len();
            }
        }
    }
}

impl<T: Pod> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T: Pod> DerefMut for Pages<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.0
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
