//! `octray info`: what a scene holds and how its tree came out.

use std::time::Instant;

use glam::Vec3;
use octray::bvh::PrimKind;
use octray::{InstructionSets, LightShape, Scene};

use super::args::InfoArgs;
use super::load::{Loading, load};
use super::{Stop, answer, say};

pub(super) fn run(args: &InfoArgs) -> Result<(), Stop> {
    let start = Instant::now();
    let loaded = load(&args.scene, args.build, &Loading::shown())?;
    let load_seconds = start.elapsed().as_secs_f64();
    loaded.warnings.iter().for_each(|warning| say(&format!("warning: {warning}")));
    let facts = Facts::of(&loaded.scene, load_seconds);
    answer(&if args.json { facts.json() } else { facts.text() })
}

struct Facts<'a> {
    scene: &'a Scene,
    load_seconds: f64,
    spheres: usize,
    quads: usize,
    triangles: usize,
    point_lights: usize,
    area_lights: usize,
    bytes_per_primitive: f64,
    sets: InstructionSets,
}

impl<'a> Facts<'a> {
    fn of(scene: &'a Scene, load_seconds: f64) -> Self {
        let is_point = |light: &&octray::Light| matches!(light.shape, LightShape::Point(_));
        let point_lights = scene.lights().iter().filter(is_point).count();
        Self {
            scene,
            load_seconds,
            spheres: scene.primitive_count(PrimKind::Sphere),
            quads: scene.primitive_count(PrimKind::Quad),
            triangles: scene.primitive_count(PrimKind::Triangle),
            point_lights,
            area_lights: scene.lights().len() - point_lights,
            bytes_per_primitive: scene.bytes() as f64
                / scene.bvh().stats().primitives.max(1) as f64,
            sets: InstructionSets::detect(),
        }
    }

    fn text(&self) -> String {
        let (bounds, tree) = (self.scene.bounds(), self.scene.bvh().stats());
        let rebuild = match self.sets.rebuild_command() {
            Some(command) => format!(
                "\nunused        {}: the CPU has more than this build uses; rebuild with\n              \
                 {command}",
                self.sets.unused().join(" ")
            ),
            None => String::new(),
        };
        format!(
            "primitives    {} spheres, {} quads, {} triangles\n\
             lights        {} point, {} area\n\
             materials     {}\n\
             bounds        {} to {}\n\
             tree          {} nodes, {} leaves, depth {}, SAH cost {:.2}\n\
             memory        {:.1} bytes a primitive, {} in all\n\
             time          {:.3} s to build the tree, {:.3} s to load in all\n\
             build uses    {}\n\
             CPU has       {}{rebuild}\n",
            self.spheres,
            self.quads,
            self.triangles,
            self.point_lights,
            self.area_lights,
            self.scene.materials().len(),
            short(bounds.min),
            short(bounds.max),
            tree.nodes,
            tree.leaves,
            tree.depth,
            tree.sah_cost,
            self.bytes_per_primitive,
            self.scene.bytes(),
            self.scene.build_seconds(),
            self.load_seconds,
            self.sets.build.join(" "),
            self.sets.cpu.join(" "),
        )
    }

    fn json(&self) -> String {
        let (bounds, tree) = (self.scene.bounds(), self.scene.bvh().stats());
        let dropped = self.scene.dropped();
        let json = serde_json::json!({
            "primitives": {
                "spheres": self.spheres,
                "quads": self.quads,
                "triangles": self.triangles,
                "dropped": dropped.degenerate + dropped.not_finite,
            },
            "lights": { "point": self.point_lights, "area": self.area_lights },
            "materials": self.scene.materials().len(),
            "bounds": { "min": bounds.min.to_array(), "max": bounds.max.to_array() },
            "tree": {
                "nodes": tree.nodes,
                "leaves": tree.leaves,
                "depth": tree.depth,
                "sah_cost": tree.sah_cost,
            },
            "bytes": self.scene.bytes(),
            "bytes_per_primitive": self.bytes_per_primitive,
            "seconds": { "build": self.scene.build_seconds(), "load": self.load_seconds },
            "instruction_sets": {
                "build": self.sets.build,
                "cpu": self.sets.cpu,
                "rebuild": self.sets.rebuild_command(),
            },
        });
        format!("{json:#}\n")
    }
}

/// A point with six digits a number, and without the tiny numbers that boxes are widened by.
fn short(point: Vec3) -> String {
    let digits = |value: f32| match format!("{value:.5e}").parse::<f32>() {
        Ok(value) if value.abs() >= f32::MIN_POSITIVE => value.to_string(),
        _ => "0".into(),
    };
    format!("({}, {}, {})", digits(point.x), digits(point.y), digits(point.z))
}
