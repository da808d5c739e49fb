//! `[camera]` and `[render]`.

use toml::Spanned;

use super::check::Source;
use super::error::LoadError;
use super::keys::{BuildName, CameraKeys, RenderKeys, ShadingName};
use super::values::Whole;
use crate::bvh::BuildQuality;
use crate::scene::settings::{MAX_BOUNCES, MAX_SAMPLES, MAX_SIDE};
use crate::scene::{Camera, Settings, Shading};

/// The angle of view of a camera that names none, in degrees.
const DEFAULT_FOV: f32 = 40.0;

/// The camera, checked to have a view.
pub(super) fn camera(source: Source<'_>, at: &Spanned<CameraKeys>) -> Result<Camera, LoadError> {
    let keys = at.get_ref();
    let camera = Camera {
        eye: source.vector("eye", &keys.eye)?,
        target: source.vector("target", &keys.target)?,
        up: keys.up.as_ref().map_or(Ok(glam::Vec3::Y), |up| source.vector("up", up))?,
        vertical_fov: keys.vertical_fov.as_ref().map_or(DEFAULT_FOV, |fov| fov.get_ref().0 as f32),
    };
    if let Err(error) = camera.view(1.0) {
        let span = match error.key() {
            "vertical_fov" => keys.vertical_fov.as_ref().map(Spanned::span),
            "up" => keys.up.as_ref().map(Spanned::span),
            "target" => Some(keys.target.span()),
            _ => None,
        };
        let problem = super::Problem::Value(error.to_string());
        return Err(source.fail(span.unwrap_or(at.span()), problem));
    }
    Ok(camera)
}

/// How much work goes into the tree.
pub(super) fn build(keys: &RenderKeys) -> BuildQuality {
    match keys.build {
        Some(BuildName::Fast) => BuildQuality::Fast,
        Some(BuildName::Balanced) => BuildQuality::Balanced,
        Some(BuildName::High) => BuildQuality::High,
        None => BuildQuality::default(),
    }
}

/// The settings: each key's own, else the default.
pub(super) fn settings(source: Source<'_>, keys: &RenderKeys) -> Result<Settings, LoadError> {
    let default = Settings::default();
    let whole = |key, at: &Option<Spanned<Whole>>, range, default| {
        at.as_ref().map_or(Ok(default), |at| source.whole(key, at, range))
    };
    let settings = Settings {
        width: whole("width", &keys.width, 1..=MAX_SIDE, default.width)?,
        height: whole("height", &keys.height, 1..=MAX_SIDE, default.height)?,
        spp: whole("spp", &keys.spp, 1..=MAX_SAMPLES, default.spp)?,
        shadow_samples: whole(
            "shadow_samples",
            &keys.shadow_samples,
            1..=MAX_SAMPLES,
            default.shadow_samples,
        )?,
        max_bounces: whole("max_bounces", &keys.max_bounces, 0..=MAX_BOUNCES, default.max_bounces)?,
        seed: match &keys.seed {
            Some(at) => u64::try_from(at.get_ref().0).map_err(|_| {
                let value = at.get_ref().0;
                source.wrong(at, format!("`seed` is {value}: it must be 0 or above"))
            })?,
            None => default.seed,
        },
        background: match &keys.background {
            Some(at) => source.color("background", at)?,
            None => default.background,
        },
        shading: match keys.shading {
            Some(ShadingName::Flat) => Shading::Flat,
            Some(ShadingName::Phong) => Shading::Phong,
            None => default.shading,
        },
    };
    // Each side is in range by itself; what is left is their product.
    if let Err(error) = settings.validate() {
        let span = keys.height.as_ref().or(keys.width.as_ref()).map(Spanned::span);
        return Err(source.fail(span.unwrap_or(0..0), super::Problem::Value(error.to_string())));
    }
    Ok(settings)
}
