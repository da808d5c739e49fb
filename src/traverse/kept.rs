//! What a thread keeps from query to query.
//!
//! A tile, a volley and the views of a block are arrays of some 10 to 200 KB. Queries may be short, about a
//! tile of a picture or one of many lights: to make them anew took a fifth of the time of a thousand camera
//! rays, and an eighth of that of 256 points with sixteen samples.
//!
//! What is kept refers to no scene. A query takes it out, so one that is made inside another makes its own.

use std::cell::Cell;
use std::thread::LocalKey;

/// Room for what one thread keeps.
pub(super) type Kept<T> = Cell<Option<Box<T>>>;

/// What the thread kept, or a new one.
pub(super) fn take<T>(kept: &'static LocalKey<Kept<T>>, new: impl FnOnce() -> T) -> Box<T> {
    // A thread that ends keeps nothing.
    kept.try_with(Cell::take).ok().flatten().unwrap_or_else(|| Box::new(new()))
}

/// Keeps it for the thread's next query.
pub(super) fn keep<T>(kept: &'static LocalKey<Kept<T>>, value: Box<T>) {
    _ = kept.try_with(|kept| kept.set(Some(value)));
}
