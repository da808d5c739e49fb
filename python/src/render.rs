//! `render`: a picture of a scene file as an array, with progress and Ctrl-C.
//!
//! The renderer works on threads of its own; the calling thread only waits, looks for signals and
//! tells the progress.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;

use numpy::{IntoPyArray, PyArray3, PyArrayMethods};
use octray::render::{Image, Progress, RenderError, Renderer};
use octray::scene::Problem;
use octray::{LoadError, Loaded};
use pyo3::exceptions::{PyMemoryError, PyRuntimeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;

use crate::threads::{SIGNAL_INTERVAL, check_signals, pool, thread_count};

/// Renders a scene file (.toml), or a mesh alone (.obj, .ply), to an array of linear RGB:
/// float32, (height, width, 3), rows from the top.
///
/// What is None is as the file says. threads is 0 or -1 for all cores, or the most to use; the
/// picture is the same for every number. `progress(done, total)` is called now and then with
/// counts of tiles; what it raises ends the rendering, as Ctrl-C does.
#[pyfunction]
#[pyo3(signature = (scene_file, *, width=None, height=None, spp=None, shadow_samples=None,
    max_bounces=None, seed=None, threads=0, progress=None))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn render<'py>(
    py: Python<'py>,
    scene_file: PathBuf,
    width: Option<i64>,
    height: Option<i64>,
    spp: Option<i64>,
    shadow_samples: Option<i64>,
    max_bounces: Option<i64>,
    seed: Option<u64>,
    threads: i64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let threads = thread_count(py, threads)?;
    let mut loaded = load(py, &scene_file)?;
    for warning in &loaded.warnings {
        let text = std::ffi::CString::new(warning.replace('\0', " "))?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    let settings = &mut loaded.settings;
    for (name, value, setting) in [
        ("width", width, &mut settings.width),
        ("height", height, &mut settings.height),
        ("spp", spp, &mut settings.spp),
        ("shadow_samples", shadow_samples, &mut settings.shadow_samples),
        ("max_bounces", max_bounces, &mut settings.max_bounces),
    ] {
        if let Some(value) = value {
            let error = |_| PyValueError::new_err(format!("{name} is {value}: out of range"));
            *setting = u32::try_from(value).map_err(error)?;
        }
    }
    settings.seed = seed.unwrap_or(settings.seed);
    let image = picture(py, &loaded, threads, progress)?;
    let shape = [image.height as usize, image.width as usize, 3];
    image.pixels.into_flattened().into_pyarray(py).reshape(shape)
}

fn load(py: Python<'_>, file: &Path) -> PyResult<Loaded> {
    let pool = pool(py)?;
    py.detach(|| pool.install(|| octray::load(file))).map_err(|error: LoadError| {
        let text = error.to_string();
        match error.problem {
            Problem::Unreadable(why) => std::io::Error::new(why.kind(), text).into(),
            _ => PyValueError::new_err(text),
        }
    })
}

fn picture(
    py: Python<'_>,
    loaded: &Loaded,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Image> {
    let (done, total, cancel) = (AtomicU32::new(0), AtomicU32::new(0), AtomicBool::new(false));
    let count = |progress: &Progress| {
        total.store(progress.tiles, Ordering::Relaxed);
        done.store(progress.tiles_done, Ordering::Relaxed);
    };
    let tell = || {
        let (done, total) = (done.load(Ordering::Relaxed), total.load(Ordering::Relaxed));
        match &progress {
            Some(progress) if total > 0 => {
                Python::attach(|py| progress.call1(py, (done, total)).map(drop))
            }
            _ => Ok(()),
        }
    };
    let all = pool(py)?;
    let threads = if threads == all.current_num_threads() { 0 } else { threads };
    let renderer = Renderer::new(&loaded.scene, &loaded.camera, loaded.settings)
        .threads(threads)
        .on_progress(&count)
        .cancel(&cancel);
    let rendered = py.detach(|| {
        let (send, finished) = sync_channel(1);
        let (all, renderer) = (&all, &renderer);
        thread::scope(|scope| {
            scope.spawn(move || {
                let rendered = all.install(|| renderer.render());
                // The receiver may have left.
                let _ = send.send(rendered);
            });
            loop {
                match finished.recv_timeout(SIGNAL_INTERVAL) {
                    Ok(rendered) => return tell().and_then(|()| rendered.map_err(error)),
                    Err(RecvTimeoutError::Timeout) => {
                        let told = check_signals().and_then(|()| tell());
                        told.inspect_err(|_| cancel.store(true, Ordering::Relaxed))?;
                    }
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(PyRuntimeError::new_err(
                            "the renderer ended without a picture",
                        ));
                    }
                }
            }
        })
    })?;
    Ok(rendered.image)
}

fn error(error: RenderError) -> PyErr {
    let text = error.to_string();
    match error {
        RenderError::Memory { .. } => PyMemoryError::new_err(text),
        RenderError::Threads { .. } => PyRuntimeError::new_err(text),
        _ => PyValueError::new_err(text),
    }
}
