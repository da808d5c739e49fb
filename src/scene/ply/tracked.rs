//! Bytes on their way to the parser, and where in a text the last word of them began.

use std::cell::Cell;
use std::io::{self, BufRead, Read};
use std::rc::Rc;

use crate::scene::file::Place;

/// How far a text has been read.
#[derive(Debug)]
pub(super) struct Track {
    next: Cell<Place>,
    word: Cell<Place>,
    in_word: Cell<bool>,
}

impl Track {
    /// A text that begins after so many lines of something else.
    pub(super) fn after(lines: usize) -> Self {
        let start = Place { line: lines + 1, column: 1 };
        let word = Place { line: lines, column: 1 };
        Self { next: Cell::new(start), word: Cell::new(word), in_word: Cell::new(false) }
    }

    /// Where the last word began. Before the first one, a line above the text.
    pub(super) fn word(&self) -> Place {
        self.word.get()
    }

    /// Where the next byte is.
    pub(super) fn next(&self) -> Place {
        self.next.get()
    }

    fn pass(&self, bytes: &[u8]) {
        let Place { mut line, mut column } = self.next.get();
        for &byte in bytes {
            let is_space = byte.is_ascii_whitespace();
            if !is_space && !self.in_word.get() {
                self.word.set(Place { line, column });
            }
            self.in_word.set(!is_space);
            if byte == b'\n' {
                (line, column) = (line + 1, 1);
            } else {
                column += 1;
            }
        }
        self.next.set(Place { line, column });
    }
}

/// A reader that tells a [`Track`] what went by; without one it hands on the bytes alone.
pub(super) struct Tracked<R> {
    inner: R,
    track: Option<Rc<Track>>,
}

impl<R> Tracked<R> {
    pub(super) fn new(inner: R, track: Option<Rc<Track>>) -> Self {
        Self { inner, track }
    }
}

impl<R: Read> Read for Tracked<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let mut count = self.inner.read(to)?;
        let Some(track) = &self.track else { return Ok(count) };
        // The parser takes a last word without a line end after it for one that is cut off.
        if count == 0 && track.in_word.get() && !to.is_empty() {
            to[0] = b'\n';
            count = 1;
        }
        track.pass(&to[..count]);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Tracked<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.inner.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        if let (Some(track), Ok(bytes)) = (&self.track, self.inner.fill_buf()) {
            track.pass(&bytes[..count.min(bytes.len())]);
        }
        self.inner.consume(count);
    }
}
