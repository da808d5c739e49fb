//! Which of two ways is faster where both can be tried on neighbours, by the clock.
//!
//! A trial takes one way, twice the other, and the first again: what grows or falls from one part to the next
//! counts for both alike. [`super::tempo::Choice`] compares a trial with what came before it, which may have
//! been five times as dear. This decides about speed alone, never about answers.

use std::cell::Cell;
use std::time::Duration;

/// How long the better way is taken between trials: at first and after a change, if both are near to each
/// other, and at most. With a trial these are odd: of blocks that are all one, as many lights have them, trials
/// must not meet the same quarters each time.
const RUNS: [u32; 3] = [27, 121, 487];

/// In a trial, whether a part goes the other way.
const TRIAL: [bool; 4] = [false, true, true, false];

/// Ways are far from each other from this logarithm of their ratio on.
const FAR: f32 = 0.2;

/// The largest logarithm of a ratio that counts: a thread may have had to wait, and one wait changes nothing.
const LARGEST: f32 = 0.4;

/// The weight of the last trial in the mean.
const WEIGHT: f32 = 0.3;

/// The mean logarithm of the ratio from which on the other way is taken.
const CLEAR: f32 = -0.05;

/// Which of two ways to take, 0 or 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Duel {
    better: usize,
    /// The mean logarithm of the other way's time over that of the better one.
    ratio: f32,
    /// How many parts are left until the next trial, and how many there were.
    left: u32,
    run: u32,
    /// How many parts of a trial are over, and the seconds that each way took.
    over: usize,
    spent: [f32; 2],
}

thread_local! {
    /// Queries may be short: trials would be most of them.
    static LATELY: Cell<Duel> = const { Cell::new(Duel::new()) };
}

impl Duel {
    const fn new() -> Self {
        // Some parts to warm up.
        Self { better: 0, ratio: 0.0, left: 4, run: RUNS[0], over: 0, spent: [0.0; 2] }
    }

    /// What this thread left last.
    pub(super) fn resumed() -> Self {
        LATELY.get()
    }

    /// Leaves it to the next query of this thread.
    pub(super) fn leave(&self) {
        LATELY.set(*self);
    }

    /// The way to take for the next part.
    pub(super) fn next(&self) -> usize {
        let other = self.left == 0 && TRIAL[self.over];
        if other { 1 - self.better } else { self.better }
    }

    /// What [`Duel::next`] said took so long. All parts that are told of are of one size.
    pub(super) fn took(&mut self, time: Duration) {
        if self.left > 0 {
            self.left -= 1;
            return;
        }
        self.spent[self.next()] += time.as_secs_f32();
        self.over += 1;
        if self.over < TRIAL.len() {
            return;
        }
        // Not zero, if the clock stands still.
        let [own, other] = [self.better, 1 - self.better].map(|way| self.spent[way].max(1e-9));
        let ratio = (other / own).ln().clamp(-LARGEST, LARGEST);
        self.ratio += WEIGHT * (ratio - self.ratio);
        (self.over, self.spent) = (0, [0.0; 2]);
        self.run = if self.ratio > FAR { (2 * self.run + 1).min(RUNS[2]) } else { RUNS[1] };
        if self.ratio < CLEAR {
            (self.better, self.ratio, self.run) = (1 - self.better, -self.ratio, RUNS[0]);
        }
        self.left = self.run;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a thousand parts, how many went which way if they take so many microseconds, each a percent more
    /// than the one before.
    fn parts(duel: &mut Duel, micros: [f32; 2]) -> [usize; 2] {
        let (mut parts, mut grown) = ([0; 2], 1.0);
        for part in 0..1000 {
            let way = duel.next();
            parts[way] += 1;
            grown = if part % 100 == 0 { 1.0 } else { grown * 1.01 };
            duel.took(Duration::from_secs_f32(1e-6 * grown * micros[way]));
        }
        parts
    }

    #[test]
    fn the_faster_way_is_taken_and_a_change_is_seen() {
        let mut duel = Duel::new();
        assert!(parts(&mut duel, [100.0, 120.0])[0] > 900);
        (0..3).for_each(|_| _ = parts(&mut duel, [140.0, 120.0]));
        assert!(parts(&mut duel, [140.0, 120.0])[1] > 900);
        assert_eq!(duel.better, 1);
        parts(&mut duel, [0.0, 0.0]);
        assert!(duel.ratio.is_finite());
    }

    #[test]
    fn one_wait_changes_nothing() {
        let mut duel = Duel::new();
        parts(&mut duel, [100.0, 150.0]);
        while duel.left > 0 {
            duel.took(Duration::from_micros(100));
        }
        duel.took(Duration::from_millis(10));
        (1..TRIAL.len()).for_each(|_| duel.took(Duration::from_micros(150)));
        assert_eq!(duel.better, 0);
    }
}
