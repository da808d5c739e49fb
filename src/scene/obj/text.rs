//! The lines of a text, as they come from a file: what is in memory is a block and its longest line.

use std::borrow::Cow;
use std::io::{ErrorKind, Read};
use std::path::Path;

use crate::scene::file::{LoadError, Place, Problem, read as files};

/// How much is read at a time.
const BLOCK: usize = 1 << 18;

/// A text cut into lines, those that end in a backslash joined with the next one.
pub(super) struct Lines<'a, R> {
    from: R,
    file: &'a Path,
    buffer: Vec<u8>,
    /// What of the buffer is read and not yet given out.
    start: usize,
    end: usize,
    /// How many line ends have been given out.
    line: usize,
    is_first_block: bool,
    is_over: bool,
    is_blank: bool,
}

/// One line with its end.
pub(super) struct Line<'a> {
    /// The text; what is no ASCII has plain spaces for all kinds of white space.
    pub(super) bytes: Cow<'a, [u8]>,
    raw: &'a [u8],
    file: &'a Path,
    /// How many lines are before it.
    before: usize,
}

impl<'a, R: Read> Lines<'a, R> {
    pub(super) fn new(from: R, file: &'a Path) -> Self {
        Self {
            from,
            file,
            buffer: vec![0; BLOCK],
            start: 0,
            end: 0,
            line: 0,
            is_first_block: true,
            is_over: false,
            is_blank: true,
        }
    }

    /// The next line; none after the last one.
    ///
    /// # Errors
    /// A file that can't be read, is no text, or has nothing in it.
    pub(super) fn next(&mut self) -> Result<Option<Line<'_>>, LoadError> {
        let before = self.line;
        let mut searched = 0;
        let length = loop {
            let left = &self.buffer[self.start..self.end];
            if let Some(found) = memchr::memchr(b'\n', &left[searched..]) {
                searched += found + 1;
                self.line += 1;
                if !is_continued(&left[..searched]) {
                    break searched;
                }
            } else if self.is_over {
                break left.len();
            } else {
                searched = left.len();
                self.fill()?;
            }
        };
        if length == 0 {
            return if self.is_blank { Err(files::empty(self.file)) } else { Ok(None) };
        }
        let raw = &self.buffer[self.start..self.start + length];
        self.start += length;
        Ok(Some(Line { bytes: plain(raw), raw, file: self.file, before }))
    }

    /// Reads on.
    fn fill(&mut self) -> Result<(), LoadError> {
        self.buffer.copy_within(self.start..self.end, 0);
        (self.start, self.end) = (0, self.end - self.start);
        if self.end + BLOCK > self.buffer.len() {
            self.buffer.resize((self.buffer.len() * 2).max(self.end + BLOCK), 0);
        }
        let old = self.end;
        // A first block of a few bytes could part a byte order mark.
        while self.end < old + BLOCK && !self.is_over {
            match self.from.read(&mut self.buffer[self.end..old + BLOCK]) {
                Ok(0) => self.is_over = true,
                Ok(count) => self.end += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => {
                    return Err(LoadError::new(self.file, None, Problem::Unreadable(error)));
                }
            }
        }
        let new = &self.buffer[old..self.end];
        if self.is_first_block {
            files::refuse_utf16(new, self.file)?;
            self.start = if new.starts_with(files::BYTE_ORDER_MARK) { 3 } else { 0 };
            self.is_first_block = false;
        }
        files::refuse_zeros(new, self.file)?;
        self.is_blank &= self.buffer[old.max(self.start)..self.end].trim_ascii().is_empty();
        Ok(())
    }
}

impl Line<'_> {
    /// The words up to a comment, without the backslashes that continue the line.
    #[inline]
    pub(super) fn words(&self) -> impl Iterator<Item = &[u8]> {
        let mut rest = &self.bytes[..];
        std::iter::from_fn(move || {
            loop {
                let start = rest.iter().position(|&byte| !is_space(byte))?;
                let word = &rest[start..];
                let end = word.iter().position(|&byte| is_space(byte) || byte == b'#');
                let (mut word, after) = word.split_at(end.unwrap_or(word.len()));
                rest = if after.starts_with(b"#") { &[] } else { after };
                while let [shorter @ .., b'\\'] = word {
                    word = shorter;
                }
                if !word.is_empty() {
                    return Some(word);
                }
                if rest.is_empty() {
                    return None;
                }
            }
        })
    }

    /// What follows the keyword, if that is the line's first word: a name, which may have spaces.
    pub(super) fn name_after(&self, keyword: &str) -> Option<String> {
        let text = String::from_utf8_lossy(self.raw);
        let name = text.trim_start().strip_prefix(keyword)?;
        if !name.is_empty() && !name.starts_with(char::is_whitespace) {
            return None;
        }
        let name = name.trim().replace("\\\r\n", " ").replace("\\\n", " ");
        Some(name.replace(['\n', '\r', '\t'], " "))
    }

    /// An error at one of its words.
    #[cold]
    pub(super) fn wrong(&self, word: &[u8], what: String) -> LoadError {
        let offset = word.as_ptr() as usize - self.bytes.as_ptr() as usize;
        let mut place = Place::of(&String::from_utf8_lossy(&self.bytes), offset);
        place.line += self.before;
        LoadError::new(self.file, Some(place), Problem::Format(what))
    }
}

fn is_continued(line: &[u8]) -> bool {
    let last = line.iter().rposition(|byte| !matches!(byte, b'\n' | b'\r'));
    last.is_some_and(|last| line[last] == b'\\')
}

#[inline]
fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | 9..=13)
}

/// The line as words can be cut from it byte by byte. A character stays one character, so columns
/// stay as they are.
fn plain(line: &[u8]) -> Cow<'_, [u8]> {
    if line.is_ascii() {
        return Cow::Borrowed(line);
    }
    let space = |character: char| match character {
        '\n' => '\n',
        _ if character.is_whitespace() => ' ',
        _ => character,
    };
    let text: String = String::from_utf8_lossy(line).chars().map(space).collect();
    Cow::Owned(text.into_bytes())
}
