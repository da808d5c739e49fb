//! A ray that comes alone.
//!
//! No other ray fills the time in which a step's outcome is unknown, so it is guessed, by branches, and the
//! next step is begun on the guess. What the ray needs on its way is kept for the thread's next one; it owns
//! nothing that a thread must free, so a ray can be traced until the thread has ended.

use std::cell::RefCell;

use super::group::Group;
use super::stack::DONE;
use super::stream::Cursor;
use crate::bvh::{Bvh, LEAF};

thread_local! {
    static CURSOR: RefCell<Cursor> = RefCell::new(Cursor::new());
}

/// Traces the ray of a group of one lane: its closest hit, or any hit if `ANY`.
pub(super) fn trace<const ANY: bool>(bvh: &Bvh, group: &mut Group<f32>) {
    if group.is_dead() || bvh.nodes.is_empty() {
        return;
    }
    group.prepare_boxes(bvh.extent);
    CURSOR.with_borrow_mut(|cursor| {
        cursor.start_whole::<ANY, _>(group);
        loop {
            let meta = cursor.next();
            if meta == DONE {
                break;
            }
            if meta & LEAF == 0 {
                cursor.enter::<ANY>(bvh);
            } else {
                cursor.meet_alone::<ANY>(bvh);
            }
        }
        group.set(0, &cursor.best);
    });
}
