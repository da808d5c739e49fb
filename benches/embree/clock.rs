//! Time on the wall, or on the CPU.

#![allow(unsafe_code)]

use std::time::{Duration, Instant};

/// What a stretch of work is timed by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Clock {
    /// What a user waits.
    Wall,
    /// What the calling thread computes: fair on a machine that others use too, and only of use
    /// for one thread.
    Cpu,
    /// What all threads of the process compute: for work that one thread does, whichever it is.
    Process,
}

/// A running clock.
pub(crate) enum Running {
    Wall(Instant),
    Cpu(Duration, ClockId),
}

type ClockId = std::ffi::c_int;

/// `CLOCK_PROCESS_CPUTIME_ID`.
const PROCESS_CPU_TIME: ClockId = 2;
/// `CLOCK_THREAD_CPUTIME_ID`.
const THREAD_CPU_TIME: ClockId = 3;

impl Clock {
    pub(crate) fn start(self) -> Running {
        let id = match self {
            Self::Wall => None,
            Self::Cpu => Some(THREAD_CPU_TIME),
            Self::Process => Some(PROCESS_CPU_TIME),
        };
        match id.and_then(|id| Some((cpu_time(id)?, id))) {
            Some((time, id)) => Running::Cpu(time, id),
            None => Running::Wall(Instant::now()),
        }
    }
}

impl Running {
    pub(crate) fn seconds(&self) -> f64 {
        match self {
            Self::Wall(start) => start.elapsed(),
            Self::Cpu(start, id) => cpu_time(*id).unwrap_or(*start) - *start,
        }
        .as_secs_f64()
    }
}

/// The time for which this thread or process has run, where the system says.
#[cfg(all(target_os = "linux", target_pointer_width = "64"))]
fn cpu_time(id: ClockId) -> Option<Duration> {
    #[repr(C)]
    struct TimeSpec {
        seconds: i64,
        nanoseconds: i64,
    }
    unsafe extern "C" {
        fn clock_gettime(clock: ClockId, time: *mut TimeSpec) -> std::ffi::c_int;
    }
    let mut time = TimeSpec { seconds: 0, nanoseconds: 0 };
    // SAFETY: the struct has the layout of 64-bit Linux and lives through the call.
    let failed = unsafe { clock_gettime(id, &mut time) } != 0;
    (!failed).then(|| Duration::new(time.seconds as u64, time.nanoseconds as u32))
}

#[cfg(not(all(target_os = "linux", target_pointer_width = "64")))]
fn cpu_time(_: ClockId) -> Option<Duration> {
    None
}
