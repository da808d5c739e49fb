//! The renderer: workers that take tiles until none is left.
//!
//! The picture is cut into bands, as high as a tile and each behind a lock; a worker holds the lock
//! only while it copies a finished tile, so the pixels exist once.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use bumpalo::Bump;

use crate::render::codes::EightBits;
use crate::render::film::{Film, Linear};
use crate::render::frame::{Aov, Crop, Frame};
use crate::render::image::Codes;
use crate::render::stats::{Lap, RenderStats};
use crate::render::tile::{TileRenderer, Tiling};
use crate::render::unsaved::{Pixels, Unsaved};
use crate::render::{Image, PictureFile, RenderError};
use crate::scene::{Camera, Scene, Settings};

/// How far a picture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Tiles that are finished; goes up by one with each call.
    pub tiles_done: u32,
    /// Tiles of the picture.
    pub tiles: u32,
    /// Rays traced.
    pub rays: u64,
    /// Seconds since the start.
    pub seconds: f64,
}

/// A finished picture.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The pixels.
    pub image: Image,
    /// What they cost.
    pub stats: RenderStats,
}

/// Makes pictures of a scene.
///
/// ```
/// use glam::Vec3;
/// use octray::render::Renderer;
/// use octray::{Camera, Light, LightShape, SceneBuilder, Settings, Spheres};
///
/// let mut scene = SceneBuilder::new();
/// scene.add_material(Default::default());
/// scene.add_spheres(Spheres::one(Vec3::ZERO, 1.0), 0);
/// scene.add_light(Light::new(LightShape::Point(Vec3::new(2.0, 3.0, 4.0)), Vec3::ONE));
/// let scene = scene.build()?;
/// let camera = Camera::framing(&scene.bounds());
/// let settings = Settings { width: 64, height: 48, ..Settings::default() };
/// let rendered = Renderer::new(&scene, &camera, settings).render()?;
/// assert_eq!(rendered.image.pixels.len(), 64 * 48);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Renderer<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    settings: Settings,
    crop: Option<Crop>,
    aov: Aov,
    threads: usize,
    on_progress: Option<&'a (dyn Fn(&Progress) + Sync)>,
    cancel: Option<&'a AtomicBool>,
}

impl<'a> Renderer<'a> {
    /// A renderer of the whole picture in colour, on the rayon pool that it is called in.
    pub fn new(scene: &'a Scene, camera: &'a Camera, settings: Settings) -> Self {
        Self {
            scene,
            camera,
            settings,
            crop: None,
            aov: Aov::Color,
            threads: 0,
            on_progress: None,
            cancel: None,
        }
    }

    /// Renders only this part: the same pixels that the full picture has there.
    pub fn crop(self, crop: Crop) -> Self {
        Self { crop: Some(crop), ..self }
    }

    /// Renders something else than the colour.
    pub fn aov(self, aov: Aov) -> Self {
        Self { aov, ..self }
    }

    /// Renders on this many threads of its own; 0 means those of the rayon pool that it is called
    /// in, by default one a logical core.
    pub fn threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    /// Has `on_progress` called after each tile, by the worker that finished it, one call at a time.
    pub fn on_progress(self, on_progress: &'a (dyn Fn(&Progress) + Sync)) -> Self {
        Self { on_progress: Some(on_progress), ..self }
    }

    /// Gives up, with [`RenderError::Cancelled`], soon after `cancel` becomes true.
    pub fn cancel(self, cancel: &'a AtomicBool) -> Self {
        Self { cancel: Some(cancel), ..self }
    }

    /// Makes the picture.
    ///
    /// # Errors
    /// [`RenderError`] for settings or a camera that make no picture, a picture that is too large,
    /// or after a cancellation.
    pub fn render(&self) -> Result<Rendered, RenderError> {
        self.make(|frame| {
            let (image, stats) = self.linear(frame)?;
            Ok(Rendered { image, stats })
        })
    }

    /// Makes the picture for a file, in no more memory than the file's format asks for: a picture of
    /// eight bits a value takes 3 bytes a pixel and not 12. The file is that of [`PictureFile::write`].
    ///
    /// ```no_run
    /// # use octray::render::{PictureFile, Renderer};
    /// # let loaded = octray::load("scene.toml".as_ref())?;
    /// let file = PictureFile::new("scene.png".as_ref())?;
    /// let picture = Renderer::new(&loaded.scene, &loaded.camera, loaded.settings).render_to(&file)?;
    /// picture.save()?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_to<'f>(&self, file: &'f PictureFile) -> Result<Unsaved<'f>, RenderError> {
        self.make(|frame| {
            if file.format().is_linear() {
                let (image, stats) = self.linear(frame)?;
                return Ok(Unsaved::new(file, Pixels::Linear(image), stats));
            }
            let mut codes = Codes::new(frame.area.width(), frame.area.height())?;
            let film = EightBits::new(frame.aov, frame.depth_range());
            let stats = self.expose(frame, &film, &mut codes.pixels)?;
            Ok(Unsaved::new(file, Pixels::Codes(codes), stats))
        })
    }

    /// Has a frame made into something, on the threads that were asked for.
    fn make<T: Send>(
        &self,
        of: impl FnOnce(&Frame<'_>) -> Result<T, RenderError> + Send,
    ) -> Result<T, RenderError> {
        let frame = Frame::new(self.scene, self.camera, &self.settings, self.crop, self.aov)?
            .cancelled_by(self.cancel);
        if self.threads == 0 {
            return of(&frame);
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build();
        let error = |why: rayon::ThreadPoolBuildError| RenderError::Threads {
            count: self.threads,
            why: why.to_string(),
        };
        pool.map_err(error)?.install(|| of(&frame))
    }

    fn linear(&self, frame: &Frame<'_>) -> Result<(Image, RenderStats), RenderError> {
        let area = &frame.area;
        let mut image = Image::new(area.width(), area.height(), frame.aov)?;
        image.depth_range = frame.depth_range();
        let stats = self.expose(frame, &Linear, &mut image.pixels)?;
        Ok((image, stats))
    }

    /// Renders all pixels of the frame.
    fn expose<F: Film>(
        &self,
        frame: &Frame<'_>,
        film: &F,
        pixels: &mut [F::Pixel],
    ) -> Result<RenderStats, RenderError> {
        let start = Instant::now();
        let (area, width) = (&frame.area, frame.area.width() as usize);
        let threads = rayon::current_num_threads();
        let tiling = Tiling::new(*area, threads);
        let (across, down) = tiling.counts();
        let tiles = across * down;
        let workers = threads.min(tiles as usize);

        let bands: Vec<_> =
            pixels.chunks_mut(width * tiling.side as usize).map(Mutex::new).collect();
        let next_tile = AtomicU32::new(0);
        let total = Mutex::new((RenderStats::default(), 0));
        let work = || {
            let arena = Bump::new();
            let mut tile = TileRenderer::new_in(frame, tiling, &arena);
            let mut pixels = Vec::new();
            loop {
                let index = next_tile.fetch_add(1, Ordering::Relaxed);
                if index >= tiles {
                    break;
                }
                let mut stats = RenderStats::default();
                let Ok(values) = tile.render(frame, index, &mut stats) else {
                    break;
                };
                let mut lap = Lap::start();
                film.develop(values, &mut pixels);
                let row = index / across;
                let mut band = bands[row as usize].lock().unwrap_or_else(PoisonError::into_inner);
                tile.write::<F>(index, &pixels, &mut band);
                drop(band);
                stats.phases.film += lap.seconds();

                let mut total = total.lock().unwrap_or_else(PoisonError::into_inner);
                total.0.add(&stats);
                total.1 += 1;
                if let Some(on_progress) = self.on_progress {
                    let (tiles_done, rays) = (total.1, total.0.rays());
                    let seconds = start.elapsed().as_secs_f64();
                    on_progress(&Progress { tiles_done, tiles, rays, seconds });
                }
            }
        };
        rayon::scope(|scope| (0..workers).for_each(|_| scope.spawn(|_| work())));

        drop(bands);
        let (stats, tiles_done) = total.into_inner().unwrap_or_else(PoisonError::into_inner);
        if tiles_done < tiles {
            return Err(RenderError::Cancelled);
        }
        let wall_seconds = start.elapsed().as_secs_f64();
        Ok(RenderStats { wall_seconds, threads: workers, ..stats })
    }
}
