//! Files to text: what is no readable text is refused before anything parses it.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use super::error::{LoadError, Place, Problem};

/// What a UTF-8 text may begin with.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// How much of a mesh is in memory while it is read.
const BUFFER: usize = 1 << 18;

/// The bytes of a regular file.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, LoadError> {
    check(path)?;
    fs::read(path).map_err(|error| LoadError::new(path, None, Problem::Unreadable(error)))
}

/// A regular file to be read from its beginning, and how many bytes it has.
pub(crate) fn open(path: &Path) -> Result<(BufReader<File>, u64), LoadError> {
    check(path)?;
    let fail = |error| LoadError::new(path, None, Problem::Unreadable(error));
    let file = File::open(path).map_err(fail)?;
    let bytes = file.metadata().map_err(fail)?.len();
    Ok((BufReader::with_capacity(BUFFER, file), bytes))
}

/// Refuses what is no regular file without opening it: opening a pipe waits for its writer.
pub(crate) fn check(path: &Path) -> Result<(), LoadError> {
    let fail = |problem| LoadError::new(path, None, problem);
    let metadata = fs::metadata(path).map_err(|error| fail(Problem::Unreadable(error)))?;
    if metadata.is_dir() {
        return Err(fail(Problem::Kind("is a folder: name a file in it".into())));
    }
    if !metadata.is_file() {
        let what = "is a pipe or a device: write its contents to a file and name that";
        return Err(fail(Problem::Kind(what.into())));
    }
    Ok(())
}

/// The text of a file that must be UTF-8, without its byte order mark.
pub(crate) fn utf8<'a>(bytes: &'a [u8], path: &Path) -> Result<&'a str, LoadError> {
    let bytes = refuse_binary(bytes, path)?;
    std::str::from_utf8(bytes).map_err(|error| {
        let good = &bytes[..error.valid_up_to()];
        let place = std::str::from_utf8(good).ok().map(|text| Place::of(text, text.len()));
        let what = format!("byte {:#04x} is not UTF-8: save the file as UTF-8", bytes[good.len()]);
        LoadError::new(path, place, Problem::Kind(what))
    })
}

/// The bytes after a UTF-8 byte order mark; an error for what is UTF-16 or no text at all.
pub(crate) fn refuse_binary<'a>(bytes: &'a [u8], path: &Path) -> Result<&'a [u8], LoadError> {
    refuse_utf16(bytes, path)?;
    refuse_zeros(bytes, path)?;
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    if bytes.trim_ascii().is_empty() {
        return Err(empty(path));
    }
    Ok(bytes)
}

/// An error for the beginning of a file that is UTF-16.
pub(crate) fn refuse_utf16(bytes: &[u8], path: &Path) -> Result<(), LoadError> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        let what = "is UTF-16 text: save it as UTF-8";
        return Err(LoadError::new(path, None, Problem::Kind(what.into())));
    }
    Ok(())
}

/// An error for bytes that no text has.
pub(crate) fn refuse_zeros(bytes: &[u8], path: &Path) -> Result<(), LoadError> {
    if memchr::memchr(0, bytes).is_some() {
        let what = "is a binary file: a scene is a TOML text and a mesh an OBJ text";
        return Err(LoadError::new(path, None, Problem::Kind(what.into())));
    }
    Ok(())
}

/// The error for a file with nothing in it.
pub(crate) fn empty(path: &Path) -> LoadError {
    let what = "is empty: a scene needs at least one of [[spheres]], [[quads]] and [[meshes]], an \
                OBJ at least one face";
    LoadError::new(path, None, Problem::Empty(what.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(bytes: &[u8]) -> String {
        utf8(bytes, Path::new("a.toml")).unwrap_err().to_string()
    }

    #[test]
    fn only_utf8_text_passes() {
        let path = Path::new("a.toml");
        assert_eq!(utf8(b"\xef\xbb\xbfa = 1", path).unwrap(), "a = 1");
        assert_eq!(refused(b"\xff\xfea\0"), "a.toml: is UTF-16 text: save it as UTF-8");
        assert!(refused(b"a\0b").starts_with("a.toml: is a binary file"));
        assert_eq!(
            refused(b"x\ny\xc3\xa4\xc3"),
            "a.toml:2:3: byte 0xc3 is not UTF-8: save the file as UTF-8"
        );
        assert!(refused(b"").starts_with("a.toml: is empty"));
        assert!(refused(b"\xef\xbb\xbf \r\n").starts_with("a.toml: is empty"));
    }
}
