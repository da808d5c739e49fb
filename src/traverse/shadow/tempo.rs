//! What was faster lately, and what pays.
//!
//! Points whose rays go as a volley and as a tile differ by a quarter in either direction, and nothing that is
//! known beforehand tells which is faster. So both are timed, by the clock. This decides about speed
//! alone, never about answers.

use std::cell::Cell;
use std::time::Duration;

/// How long the better way is taken before the other one is tried again: after a change, if they are near
/// to each other, and at most.
const RUNS: [u32; 3] = [31, 127, 511];

/// Ways are far from each other from this logarithm of their ratio on.
const FAR: f32 = 0.2;

/// How many times it is tried then, and how many of them count, the last ones: at first caches and what is
/// remembered are cold. With two and one, whichever came first stayed.
const TRIAL: u32 = 4;
const COUNTED: u32 = 2;

/// The largest logarithm of a ratio that counts: a thread may have had to wait.
const LARGEST: f32 = 1.4;

/// The weight of the last trial in the mean.
const WEIGHT: f32 = 0.3;

/// The logarithm of the ratio from which on the other way is taken: a change costs what was remembered.
const CLEAR: f32 = -0.08;

/// How many kinds of queries are told apart. Each begins with the way of its own number: a query may be over before a
/// trial tells, and a trial is wrong now and then.
pub(super) const KINDS: usize = 2;

/// Which of two ways to take, 0 or 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    better: usize,
    /// The mean logarithm of the other way's time over that of the better one.
    ratio: f32,
    /// What a unit of work took by the better way lately; 0 if not known.
    last: f32,
    /// How often the other way is still to be tried, and what a unit took by it.
    tries: u32,
    tried: f32,
    /// How often the better way is still to be taken, and how often it was to be.
    left: u32,
    run: u32,
}

impl Choice {
    /// To begin with the way `better`.
    const fn new(better: usize) -> Self {
        let run = RUNS[0];
        Self { better, ratio: 0.0, last: 0.0, tries: 0, tried: 0.0, left: TRIAL, run }
    }

    /// What this thread left last in a query of that kind, which is below [`KINDS`].
    pub(super) fn resumed(kind: usize) -> Self {
        Self { tries: 0, ..LATELY.get()[kind] }
    }

    /// Leaves it to the next such query of this thread.
    pub(super) fn leave(&self, kind: usize) {
        let mut lately = LATELY.get();
        lately[kind] = *self;
        LATELY.set(lately);
    }

    /// The way to take next.
    pub(super) fn next(&mut self) -> usize {
        if self.tries == 0 && self.left == 0 {
            (self.tries, self.tried) = (TRIAL, 0.0);
        }
        if self.tries > 0 {
            return 1 - self.better;
        }
        self.left -= 1;
        self.better
    }

    /// What [`Choice::next`] said took so long for so many units of work.
    pub(super) fn took(&mut self, time: Duration, work: usize) {
        // Not zero, that is not known.
        let cost = (time.as_secs_f32() / work.max(1) as f32).max(f32::MIN_POSITIVE);
        if self.tries == 0 {
            self.last = if self.last == 0.0 { cost } else { 0.5 * (self.last + cost) };
            return;
        }
        self.tries -= 1;
        if self.tries < COUNTED {
            self.tried += cost / COUNTED as f32;
        }
        if self.tries > 0 || self.last == 0.0 {
            return;
        }
        let ratio = (self.tried / self.last).ln().clamp(-LARGEST, LARGEST);
        self.ratio += WEIGHT * (ratio - self.ratio);
        self.run = if self.ratio > FAR { (2 * self.run + 1).min(RUNS[2]) } else { RUNS[1] };
        if self.ratio < CLEAR {
            (self.better, self.ratio) = (1 - self.better, -self.ratio);
            (self.last, self.run) = (self.tried, RUNS[0]);
        }
        self.left = self.run;
    }
}

thread_local! {
    /// Queries may be short, about a tile of a picture or one of many lights: trials would be most of them.
    static LATELY: Cell<[Choice; KINDS]> = const { Cell::new([Choice::new(0), Choice::new(1)]) };
}

/// How much of what was saved and spent before counts.
const KEPT: f32 = 0.75;

/// Something that is left out for a while if it did not pay lately.
#[derive(Debug, Default)]
pub(super) struct Pause {
    saved: f32,
    cost: f32,
    left: u32,
    last: u32,
}

impl Pause {
    /// False if it is to be left out this time.
    pub(super) fn is_over(&mut self) -> bool {
        let paused = self.left > 0;
        self.left -= u32::from(paused);
        !paused
    }

    /// What it saved and what it cost, in the same units. Each time that it has not paid, the next pause is
    /// longer, up to `longest`.
    pub(super) fn ended(&mut self, saved: f32, cost: f32, longest: u32) {
        self.saved = saved + KEPT * self.saved;
        self.cost = cost + KEPT * self.cost;
        let paid = self.saved >= self.cost;
        self.last = if paid { 0 } else { (2 * self.last + 1).min(longest) };
        self.left = self.last;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a thousand turns, how many went which way if they take so many microseconds.
    fn turns(choice: &mut Choice, micros: [u64; 2]) -> [usize; 2] {
        let mut turns = [0; 2];
        for _ in 0..1000 {
            let way = choice.next();
            turns[way] += 1;
            choice.took(Duration::from_micros(micros[way]), 16);
        }
        turns
    }

    #[test]
    fn the_faster_way_is_taken_and_a_change_is_seen() {
        let mut choice = Choice::new(0);
        assert!(turns(&mut choice, [10, 20])[0] > 900);
        // The longest runs are half of a thousand turns.
        (0..2).for_each(|_| _ = turns(&mut choice, [30, 20]));
        assert!(turns(&mut choice, [30, 20])[1] > 900);
        // A clock that stands still is no reason to divide by zero.
        turns(&mut choice, [0, 0]);
        assert!(choice.ratio.is_finite());
    }

    #[test]
    fn what_does_not_pay_is_left_out_ever_longer() {
        let mut pause = Pause::default();
        let mut taken = 0;
        for _ in 0..100 {
            if pause.is_over() {
                taken += 1;
                pause.ended(1.0, 2.0, 15);
            }
        }
        assert!((6..12).contains(&taken), "{taken}");
        pause.ended(100.0, 1.0, 15);
        assert!(pause.is_over() && pause.is_over());
    }
}
