//! What is wrong with a file, and where.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::error::BuildError;

/// A place in a text, both counted from 1; columns count characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The line.
    pub line: usize,
    /// The character in it.
    pub column: usize,
}

impl Place {
    /// The place of a byte of `text`. An offset past the end counts as the end.
    pub fn of(text: &str, offset: usize) -> Self {
        let before = &text.as_bytes()[..offset.min(text.len())];
        let line_start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
        // All bytes of a character after its first are 10xxxxxx.
        let started = before[line_start..].iter().filter(|&&byte| byte & 0xc0 != 0x80);
        Self { line, column: started.count() + 1 }
    }
}

/// Why a scene or a mesh could not be loaded: prints as one line, `file:line:column: what is wrong
/// and what would be right`.
#[derive(Debug)]
pub struct LoadError {
    /// The file that is wrong.
    pub file: PathBuf,
    /// Where in it, if the problem has a place.
    pub place: Option<Place>,
    /// What is wrong.
    pub problem: Problem,
}

/// What is wrong with a file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file can't be read.
    #[error("{}", explain(.0))]
    Unreadable(#[source] io::Error),
    /// It is something else than a file of text, or of an unknown kind.
    #[error("{0}")]
    Kind(String),
    /// The text does not follow the format: syntax, an unknown key, a wrong type.
    #[error("{0}")]
    Format(String),
    /// A value that is out of its range, or that names something that is not there.
    #[error("{0}")]
    Value(String),
    /// The scene has nothing that a ray could hit.
    #[error("{0}")]
    Empty(String),
    /// The scene as a whole can't be built.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// The reason of a failed read, and what would mend it.
fn explain(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file: check the path".into(),
        io::ErrorKind::PermissionDenied => "no permission to read it: change its mode".into(),
        _ => format!("can't be read: {error}"),
    }
}

impl LoadError {
    pub(crate) fn new(file: &Path, place: Option<Place>, problem: Problem) -> Self {
        Self { file: file.to_owned(), place, problem }
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(Place { line, column }) = self.place {
            write!(f, ":{line}:{column}")?;
        }
        write!(f, ": {}", self.problem)
    }
}

impl std::error::Error for LoadError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        // `Problem` is part of the message, so what follows it is what caused that.
        self.problem.source()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_characters_from_one() {
        let text = "ab\r\n\u{e4}\u{1f600}c\n";
        let place = |offset| {
            let Place { line, column } = Place::of(text, offset);
            (line, column)
        };
        assert_eq!(place(0), (1, 1));
        assert_eq!(place(1), (1, 2));
        assert_eq!(place(4), (2, 1));
        assert_eq!(place(6), (2, 2));
        assert_eq!(place(10), (2, 3));
        assert_eq!(place(12), (3, 1));
        assert_eq!(place(99), (3, 1));
        assert_eq!(Place::of("", 0), Place { line: 1, column: 1 });
    }
}
