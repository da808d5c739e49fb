//! Work on many threads for a caller that holds the interpreter: one pool, and Ctrl-C.
//!
//! The calling thread always works too, and between two pieces of work it looks whether the user
//! wants to stop: only the main thread of Python can tell.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// How long Ctrl-C may go unnoticed.
pub(crate) const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// The pool and the process that started its threads. It is locked only by a thread that holds the
/// interpreter, and so does one that forks: a child never finds it locked.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// The pool of this process, with a thread for each core, or as many as `RAYON_NUM_THREADS` says.
pub(crate) fn pool(_py: Python<'_>) -> PyResult<Arc<ThreadPool>> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    match pool.take() {
        Some((owner, threads)) if owner == process => {
            *pool = Some((owner, threads.clone()));
            return Ok(threads);
        }
        // A fork takes no threads along; to drop their pool would wait for them.
        Some(inherited) => std::mem::forget(inherited),
        None => {}
    }
    let threads =
        ThreadPoolBuilder::new().thread_name(|index| format!("octray-{index}")).build().map_err(
            |error| PyRuntimeError::new_err(format!("no threads could be started: {error}")),
        )?;
    let threads = Arc::new(threads);
    *pool = Some((process, threads.clone()));
    Ok(threads)
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

/// Runs the handlers of signals that have arrived. For a thread without the interpreter.
pub(crate) fn check_signals() -> PyResult<()> {
    Python::try_attach(|py| py.check_signals()).unwrap_or(Ok(()))
}
