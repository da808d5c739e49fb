//! `[materials.NAME]` and `[[lights]]`.

use std::collections::BTreeMap;

use glam::Vec3;
use toml::Spanned;

use super::check::{Source, nearest};
use super::error::{LoadError, Problem};
use super::keys::{Key, LightKeys, LightName, MaterialKeys};
use super::values::OneOrThree;
use crate::scene::{Light, LightShape, Material, SceneBuilder};

/// The exponent of the highlight of a material that names none.
const DEFAULT_SHININESS: f32 = 32.0;

/// The materials of a file by name, and the default one for what names none.
pub(super) struct Materials {
    by_name: BTreeMap<String, u32>,
    default: Option<u32>,
}

impl Materials {
    /// Adds the materials in the order of their names.
    pub(super) fn add(
        source: Source<'_>,
        keys: &BTreeMap<String, MaterialKeys>,
        builder: &mut SceneBuilder,
    ) -> Result<Self, LoadError> {
        let mut by_name = BTreeMap::new();
        for (name, keys) in keys {
            by_name.insert(name.clone(), builder.add_material(material(source, keys)?));
        }
        Ok(Self { by_name, default: None })
    }

    /// The number of a material that a key names.
    pub(super) fn find(&self, source: Source<'_>, at: &Spanned<String>) -> Result<u32, LoadError> {
        let name = at.get_ref();
        if let Some(&id) = self.by_name.get(name) {
            return Ok(id);
        }
        let known = self.by_name.keys().map(String::as_str);
        let mend = if let Some(near) = nearest(name, known.clone()) {
            format!("did you mean `{near}`?")
        } else if self.by_name.is_empty() {
            format!("there are none; add [materials.{name}]")
        } else {
            let known: Vec<&str> = known.collect();
            format!("there are `{}`", known.join("`, `"))
        };
        Err(source.wrong(at, format!("there is no material `{name}`: {mend}")))
    }

    /// The number of the material that a key names, or of the default one.
    pub(super) fn find_or_default(
        &mut self,
        source: Source<'_>,
        at: &Key<String>,
        builder: &mut SceneBuilder,
    ) -> Result<u32, LoadError> {
        match at {
            Some(at) => self.find(source, at),
            None => Ok(self.default(builder)),
        }
    }

    /// The number of the default material, which is added when it is first used.
    pub(super) fn default(&mut self, builder: &mut SceneBuilder) -> u32 {
        *self.default.get_or_insert_with(|| builder.add_material(Material::default()))
    }
}

fn material(source: Source<'_>, keys: &MaterialKeys) -> Result<Material, LoadError> {
    let color = |key, at: &Key<OneOrThree>, default| {
        at.as_ref().map_or(Ok(default), |at| source.color(key, at))
    };
    let base = color("color", &keys.color, Material::default().diffuse)?;
    let shininess = keys
        .shininess
        .as_ref()
        .map_or(Ok(DEFAULT_SHININESS), |at| source.positive("shininess", at))?;
    let mirror = match &keys.mirror {
        Some(at) if !(0.0..=1.0).contains(&at.get_ref().0) => {
            let value = at.get_ref().0;
            return Err(source.wrong(at, format!("`mirror` is {value}: it must be from 0 to 1")));
        }
        Some(at) => at.get_ref().0 as f32,
        None => 0.0,
    };
    Ok(Material {
        ambient: color("ambient", &keys.ambient, base)?,
        diffuse: color("diffuse", &keys.diffuse, base)?,
        specular: color("specular", &keys.specular, Vec3::ZERO)?,
        shininess,
        mirror,
    })
}

/// One light.
pub(super) fn light(source: Source<'_>, at: &Spanned<LightKeys>) -> Result<Light, LoadError> {
    let keys = at.get_ref();
    let (name, other) = match keys.kind {
        LightName::Point => ("point", "area"),
        LightName::Area => ("area", "point"),
    };
    let of_area = [("corner", &keys.corner), ("edge_u", &keys.edge_u), ("edge_v", &keys.edge_v)];
    let position = [("position", &keys.position)];
    let (wanted, foreign): (&[_], &[_]) = match keys.kind {
        LightName::Point => (&position, &of_area),
        LightName::Area => (&of_area, &position),
    };
    if let Some((key, Some(at))) = foreign.iter().find(|(_, at)| at.is_some()) {
        let message =
            format!("`{key}` belongs to type = \"{other}\", and this light is \"{name}\"");
        return Err(source.wrong(at, message));
    }
    let mut vectors = Vec::with_capacity(3);
    for (key, value) in wanted {
        let Some(value) = value else {
            let message = format!("a light of type \"{name}\" needs `{key}`, three numbers");
            return Err(source.fail(at.span(), Problem::Format(message)));
        };
        vectors.push(source.vector(key, value)?);
    }
    let shape = match vectors[..] {
        [corner, edge_u, edge_v] => LightShape::Quad { corner, edge_u, edge_v },
        _ => LightShape::Point(vectors[0]),
    };
    let color = |key, at: &Key<OneOrThree>, default| {
        at.as_ref().map_or(Ok(default), |at| source.color(key, at))
    };
    let intensity = color("intensity", &keys.intensity, Vec3::ONE)?;
    let light = Light {
        shape,
        ambient: color("ambient", &keys.ambient, Vec3::ZERO)?,
        diffuse: color("diffuse", &keys.diffuse, intensity)?,
        specular: color("specular", &keys.specular, intensity)?,
    };
    // What is left to be wrong is the area.
    let area = keys.edge_u.as_ref().map_or(at.span(), Spanned::span);
    light.validate().map_err(|why| source.fail(area, Problem::Value(format!("light: {why}"))))?;
    Ok(light)
}
