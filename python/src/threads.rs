//! Work on many threads for a caller that holds the interpreter: one pool, and Ctrl-C.
//!
//! The calling thread works too, and between two pieces of work it looks whether the user wants to
//! stop: only the main thread of Python can tell. It waits for the pool alone where the library shares
//! the work out ([`run`]).

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// How long Ctrl-C may go unnoticed.
pub(crate) const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// The most items that a thread takes at a time. Three arrays made of them are 48 KB: they stay in the
/// cache.
const CHUNK: usize = 4096;

/// The fewest items that are worth waking a thread for: whole tiles of the library.
const SMALLEST_CHUNK: usize = 512;

/// Pools, and the process that started their threads.
struct Pools {
    process: u32,
    all: Arc<ThreadPool>,
    /// The one of fewer threads that was asked for last.
    fewer: Option<Arc<ThreadPool>>,
}

/// Locked only by a thread that holds the interpreter, and so does one that forks: a child never finds it
/// locked.
static POOLS: Mutex<Option<Pools>> = Mutex::new(None);

/// The pool of this process, with a thread for each core, or as many as `RAYON_NUM_THREADS` says.
pub(crate) fn pool(py: Python<'_>) -> PyResult<Arc<ThreadPool>> {
    pool_of(py, usize::MAX)
}

/// That pool, or one of fewer threads.
fn pool_of(_py: Python<'_>, threads: usize) -> PyResult<Arc<ThreadPool>> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    let own = pools.take().and_then(|pools| {
        if pools.process == process {
            return Some(pools);
        }
        // A fork takes no threads along; to drop their pool would wait for them.
        std::mem::forget(pools);
        None
    });
    let own = match own {
        Some(own) => own,
        None => Pools { process, all: start(0)?, fewer: None },
    };
    let own = pools.insert(own);
    if threads >= own.all.current_num_threads() {
        return Ok(own.all.clone());
    }
    if let Some(fewer) = own.fewer.as_ref().filter(|pool| pool.current_num_threads() == threads) {
        return Ok(fewer.clone());
    }
    Ok(own.fewer.insert(start(threads)?).clone())
}

/// Starts threads: as many as rayon chooses if `threads` is 0.
fn start(threads: usize) -> PyResult<Arc<ThreadPool>> {
    let name = |index| format!("octray-{index}");
    let pool = ThreadPoolBuilder::new().num_threads(threads).thread_name(name).build();
    pool.map(Arc::new)
        .map_err(|error| PyRuntimeError::new_err(format!("no threads could be started: {error}")))
}

/// How many threads the argument `threads` asks for: 0 and -1 mean all, a number is a cap.
pub(crate) fn thread_count(py: Python<'_>, threads: i64) -> PyResult<usize> {
    match threads {
        1 => Ok(1),
        0 | -1 => Ok(pool(py)?.current_num_threads()),
        2.. => Ok(pool(py)?.current_num_threads().min(threads as usize)),
        _ => Err(PyValueError::new_err(format!(
            "threads is {threads}: give 0 or -1 for all cores, or how many to use at most"
        ))),
    }
}

/// Takes the items of `items` one by one to `work`, on up to `threads` threads, each with a state
/// of its own that `start` makes, without the interpreter.
///
/// # Errors
/// What a signal handler raised, `KeyboardInterrupt` above all. Some items are then left out.
pub(crate) fn for_each<T, S>(
    py: Python<'_>,
    threads: usize,
    items: impl Iterator<Item = T> + Send,
    start: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, T) + Sync,
) -> PyResult<()> {
    let pool = if threads > 1 { Some(pool(py)?) } else { None };
    py.detach(|| {
        let items = Mutex::new(items);
        let stop = AtomicBool::new(false);
        let run = |mut go_on: Box<dyn FnMut() -> PyResult<()> + '_>| {
            let mut state = start();
            while !stop.load(Ordering::Relaxed) {
                let next = items.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some(item) = next else { break };
                work(&mut state, item);
                go_on()?;
            }
            Ok(())
        };
        let mut last = Instant::now();
        let watch = Box::new(|| {
            if last.elapsed() > SIGNAL_INTERVAL {
                last = Instant::now();
                check_signals().inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
            }
            Ok(())
        });
        let Some(pool) = pool else { return run(watch) };
        pool.in_place_scope(|scope| {
            for _ in 1..threads {
                // Without a watch nothing can fail.
                scope.spawn(|_| drop(run(Box::new(|| Ok(())))));
            }
            run(watch)
        })
    })
}

/// Calls `work` with whether it is to use the pool that it is called in, and what it has to ask now and then
/// whether to go on; on `threads` threads, without the interpreter. `work` says whether it came to its end.
///
/// # Errors
/// As [`for_each`].
pub(crate) fn run(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce(bool, &(dyn Fn() -> bool + Sync)) -> bool + Send,
) -> PyResult<()> {
    if threads == 1 {
        return py.detach(|| {
            let watch = Mutex::new((Instant::now(), Ok(())));
            work(false, &|| {
                let mut watch = watch.lock().unwrap_or_else(PoisonError::into_inner);
                if watch.0.elapsed() > SIGNAL_INTERVAL {
                    *watch = (Instant::now(), check_signals());
                }
                watch.1.is_ok()
            });
            watch.into_inner().unwrap_or_else(PoisonError::into_inner).1
        });
    }
    let pool = pool_of(py, threads)?;
    py.detach(|| {
        let stop = AtomicBool::new(false);
        let (done, wait) = mpsc::channel();
        pool.in_place_scope(|scope| {
            scope.spawn(|_| {
                work(true, &|| !stop.load(Ordering::Relaxed));
                // Nobody waits any more if a signal has ended it.
                let _ = done.send(());
            });
            // A sender that is dropped has panicked, which the scope passes on.
            while let Err(RecvTimeoutError::Timeout) = wait.recv_timeout(SIGNAL_INTERVAL) {
                check_signals().inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
            }
            Ok(())
        })
    })
}

/// How many items of `len` a thread is to take at a time, so that all have something to do.
pub(crate) fn chunk(len: usize, threads: usize) -> usize {
    len.div_ceil(4 * threads).next_multiple_of(SMALLEST_CHUNK).clamp(SMALLEST_CHUNK, CHUNK)
}

/// The chunks of so many items.
pub(crate) fn ranges(len: usize, chunk: usize) -> impl Iterator<Item = Range<usize>> + Send {
    (0..len).step_by(chunk).map(move |start| start..(start + chunk).min(len))
}

/// Runs the handlers of signals that have arrived. For a thread without the interpreter.
pub(crate) fn check_signals() -> PyResult<()> {
    Python::try_attach(|py| py.check_signals()).unwrap_or(Ok(()))
}
