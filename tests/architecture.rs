//! Holds the sources to `ARCHITECTURE.md`: the layers and their order, and who names `wide`.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The entries of the table, such as `error.rs` and `geometry/`, from the top.
fn listed() -> Vec<String> {
    let page = read(&root().join("ARCHITECTURE.md"));
    let section = page.split("## Layers").nth(1).expect("a section on layers");
    let section = section.split("\n## ").next().expect("its text");
    let rows = section.lines().filter_map(|line| line.strip_prefix("| `"));
    let names = rows.map(|row| row.split('`').next().expect("a name").to_owned());
    names.filter(|name| name != "src/").collect()
}

/// The module of an entry.
fn module(entry: &str) -> &str {
    entry.trim_end_matches('/').trim_end_matches(".rs")
}

/// All Rust files of a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// The code of a file without its comments, which may name whatever they like.
fn code(path: &Path) -> String {
    let lines: Vec<_> = read(path)
        .lines()
        .map(|line| if line.trim_start().starts_with("//") { "" } else { line })
        .map(|line| line.split(" // ").next().unwrap_or_default().to_owned())
        .collect();
    lines.join("\n")
}

fn is_word(character: char) -> bool {
    character.is_alphanumeric() || character == '_'
}

/// The names that follow `prefix` in `code`: one, or those of a list in braces.
fn names_after<'c>(code: &'c str, prefix: &str) -> Vec<&'c str> {
    let mut names = Vec::new();
    for (at, _) in code.match_indices(prefix) {
        if code[..at].ends_with(|last: char| is_word(last) || last == ':') {
            continue;
        }
        let rest = &code[at + prefix.len()..];
        let list = match rest.strip_prefix('{') {
            // Names of the first level only: those below belong to their module.
            Some(list) => first_level(list),
            None => vec![rest],
        };
        names.extend(list.into_iter().map(|name| name.split(|c| !is_word(c)).next().unwrap_or("")));
    }
    names.retain(|name| !name.is_empty());
    names
}

/// The parts of a list up to its closing brace.
fn first_level(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (at, character) in list.char_indices() {
        match character {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            '}' | ',' if depth == 0 => {
                parts.push(list[start..at].trim());
                start = at + 1;
                if character == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    parts
}

/// The layer that a name at the root of the crate belongs to: a module, or what `lib.rs` takes from
/// one.
fn layer_of(name: &str, layers: &[String], exports: &str) -> Option<usize> {
    let place = |name: &str| layers.iter().position(|layer| module(layer) == name);
    place(name).or_else(|| {
        exports.split("pub use ").skip(1).find_map(|export| {
            let export = export.split(';').next()?;
            let is_named = export.split(|c| !is_word(c)).skip(1).any(|word| word == name);
            if is_named { place(export.split("::").next()?) } else { None }
        })
    })
}

#[test]
fn the_table_lists_what_is_there() {
    let mut listed = listed();
    let mut there: Vec<String> = fs::read_dir(root().join("src"))
        .expect("a folder")
        .map(|entry| {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            if path.is_dir() { name + "/" } else { name }
        })
        .filter(|name| name != "lib.rs" && name != "main.rs")
        .collect();
    listed.sort();
    there.sort();
    assert_eq!(listed, there, "the table in ARCHITECTURE.md against src/");
}

#[test]
fn files_use_only_what_is_above_them() {
    let (layers, source) = (listed(), root().join("src"));
    let exports = code(&source.join("lib.rs"));
    let mut wrong = Vec::new();
    let mut checked = 0;
    for (own, layer) in layers.iter().enumerate() {
        // The command line is a crate of its own, on top of the library.
        let is_program = module(layer) == "cli";
        let files = if layer.ends_with('/') {
            sources(&source.join(layer))
        } else {
            vec![source.join(layer)]
        };
        for file in files.iter().filter(|_| !is_program) {
            let inside = file.strip_prefix(&source).expect("a file below src");
            let is_folder = file.ends_with("mod.rs");
            let depth = inside.components().count() - usize::from(is_folder);
            let code = code(file);
            // Both ways to name something at the root of the crate.
            let from_root = ["crate::".to_owned(), "super::".repeat(depth)];
            for name in from_root.iter().flat_map(|prefix| names_after(&code, prefix)) {
                let Some(used) = layer_of(name, &layers, &exports) else { continue };
                checked += 1;
                if used > own {
                    let (file, below) = (inside.display(), &layers[used]);
                    wrong.push(format!("src/{file} uses `{name}` of {below}, which is below it"));
                }
            }
            assert!(!code.contains("octray::"), "{} names its own crate", inside.display());
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 100, "only {checked} uses were found: does this test still read imports?");
}

#[test]
fn one_folder_names_wide() {
    let source = root().join("src");
    let naming: Vec<_> = sources(&source)
        .into_iter()
        .filter(|file| !names_after(&code(file), "wide::").is_empty())
        .collect();
    assert!(!naming.is_empty());
    assert!(naming.iter().all(|file| file.starts_with(source.join("simd"))), "{naming:?}");
}

#[test]
fn one_file_has_unsafe_code() {
    let source = root().join("src");
    let with = |file: &PathBuf| code(file).split(|c| !is_word(c)).any(|word| word == "unsafe");
    let having: Vec<_> = sources(&source).into_iter().filter(with).collect();
    assert_eq!(having, [source.join("prefetch.rs")]);
}

/// The crate's page has the layers in the order of the table.
#[test]
fn the_crate_page_lists_the_same_layers() {
    let page = read(&root().join("src/lib.rs"));
    let section = page.split("# Layers").nth(1).expect("a section on layers");
    let section = section.split("//! # ").next().expect("its text");
    let named: Vec<_> =
        section.split("[`").skip(1).map(|rest| rest.split('`').next().expect("a name")).collect();
    let listed = listed();
    let library: Vec<_> =
        listed.iter().map(|layer| module(layer)).filter(|&name| name != "cli").collect();
    assert_eq!(named, library);
}

/// Files that the page names are there.
#[test]
fn named_files_exist() {
    let page = read(&root().join("ARCHITECTURE.md"));
    let named: Vec<_> = page
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|name| name.contains('/') && !name.contains(char::is_whitespace))
        .collect();
    assert!(named.len() > 5);
    for name in named.into_iter().filter(|name| !name.ends_with('/')) {
        assert!(root().join(name).exists(), "ARCHITECTURE.md names {name}");
    }
}

#[test]
fn imports_are_read_as_they_are_written() {
    let code = "use crate::{hit::{Hit, Hits}, ray::Ray};\nfn f(x: &crate::Light) { mycrate::g() }";
    assert_eq!(names_after(code, "crate::"), ["hit", "ray", "Light"]);
    assert_eq!(names_after("super::super::bvh::Bvh", "super::super::"), ["bvh"]);
    let layers = ["simd/".to_owned(), "scene/".to_owned()];
    let exports = "pub use scene::{\n    Camera, Light,\n};\npub use simd::Lanes;";
    assert_eq!(layer_of("Light", &layers, exports), Some(1));
    assert_eq!(layer_of("Lanes", &layers, exports), Some(0));
    assert_eq!(layer_of("Nothing", &layers, exports), None);
}
