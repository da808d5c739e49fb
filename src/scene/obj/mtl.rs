//! MTL files: the colours and the highlight of materials. Nothing in them is fatal: what can't be
//! read is a warning, and the default stands in for it.

use std::fmt::Write;
use std::path::Path;

use glam::Vec3;

use crate::scene::Material;
use crate::scene::file::read as files;

/// The materials of a file; none if it can't be read.
pub(super) fn read(path: &Path, warnings: &mut Vec<String>) -> tobj::MTLLoadResult {
    let text = files::bytes(path).and_then(|bytes| {
        files::refuse_binary(&bytes, path).map(|text| String::from_utf8_lossy(text).into_owned())
    });
    let text = text.map(|text| clean(&text, path, warnings)).unwrap_or_else(|error| {
        warnings.push(format!("{error}; faces with its materials get the default one"));
        String::new()
    });
    tobj::load_mtl_buf(&mut text.as_bytes())
}

/// The lines that make a [`Material`], as `tobj` reads them: a colour is three numbers.
fn clean(text: &str, path: &Path, warnings: &mut Vec<String>) -> String {
    let mut clean = String::with_capacity(text.len());
    let mut textures = 0;
    let path = path.display();
    for (index, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let Some(key) = words.next() else { continue };
        let numbers: Option<Vec<f32>> =
            words.take_while(|word| !word.starts_with('#')).map(|word| word.parse().ok()).collect();
        let _ = match (key, numbers.as_deref()) {
            ("newmtl", _) => {
                let name = line.trim_start()[key.len()..].trim();
                writeln!(clean, "newmtl {}", if name.is_empty() { "unnamed" } else { name })
            }
            ("Ka" | "Kd" | "Ks", Some(&[r, g, b])) => writeln!(clean, "{key} {r} {g} {b}"),
            ("Ka" | "Kd" | "Ks", Some(&[grey])) => writeln!(clean, "{key} {grey} {grey} {grey}"),
            ("Ns", Some(&[exponent, ..])) => writeln!(clean, "{key} {exponent}"),
            ("Ka" | "Kd" | "Ks" | "Ns", _) => {
                let wanted = if key == "Ns" { "one number" } else { "three numbers" };
                let line = index + 1;
                warnings.push(format!("{path}:{line}: `{key}` is left out: it needs {wanted}"));
                Ok(())
            }
            (key, _) => {
                textures += usize::from(key.to_ascii_lowercase().starts_with("map_k"));
                Ok(())
            }
        };
    }
    if textures > 0 {
        warnings.push(format!("{path}: textures left out, plain colours stand in: {textures}"));
    }
    clean
}

/// A material of the scene. Without `Ka` the ambient colour is the diffuse one.
pub(super) fn material(from: &tobj::Material, warnings: &mut Vec<String>) -> Material {
    let default = Material::default();
    let diffuse = from.diffuse.map_or(default.diffuse, Vec3::from_array);
    let material = Material {
        ambient: from.ambient.map_or(diffuse, Vec3::from_array),
        diffuse,
        specular: from.specular.map_or(Vec3::ZERO, Vec3::from_array),
        // Exporters write 0 for a surface without a highlight.
        shininess: from.shininess.map_or(default.shininess, |exponent| exponent.max(1.0)),
        mirror: 0.0,
    };
    match material.validate() {
        Ok(()) => material,
        Err(why) => {
            warnings.push(format!("material `{}` is left out: {why}", from.name));
            default
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn materials(text: &str) -> (Vec<Material>, Vec<String>) {
        let mut warnings = Vec::new();
        let text = clean(text, Path::new("a.mtl"), &mut warnings);
        let (found, _) = tobj::load_mtl_buf(&mut text.as_bytes()).unwrap();
        (found.iter().map(|one| material(one, &mut warnings)).collect(), warnings)
    }

    #[test]
    fn colours_and_exponents_are_read() {
        let (found, warnings) = materials(
            "newmtl red\n\tKa 0.1 0 0\n Kd 1 0 0 # red\nKs 0.5\nNs 20\n\nnewmtl plain\nillum 2\n",
        );
        let red = Material {
            ambient: Vec3::new(0.1, 0.0, 0.0),
            diffuse: Vec3::X,
            specular: Vec3::splat(0.5),
            shininess: 20.0,
            mirror: 0.0,
        };
        assert_eq!(found, [red, Material::default()]);
        assert!(warnings.is_empty(), "{warnings:?}");
    }

    #[test]
    fn odd_lines_are_warnings() {
        let (found, warnings) =
            materials("newmtl a\nKd 1 1\nKs x y z\nNs\nmap_Kd wood.png\nKa -1 0 0\nnewmtl\nNs 0\n");
        assert_eq!(found.len(), 2);
        assert_eq!(found[0], Material::default());
        assert_eq!(
            warnings,
            [
                "a.mtl:2: `Kd` is left out: it needs three numbers",
                "a.mtl:3: `Ks` is left out: it needs three numbers",
                "a.mtl:4: `Ns` is left out: it needs one number",
                "a.mtl: textures left out, plain colours stand in: 1",
                "material `a` is left out: `ambient` is [-1, 0, 0]: its parts must be finite and at \
                 least 0",
            ]
        );
    }
}
