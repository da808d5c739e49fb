//! Pictures in files: the format from the extension, written beside and renamed.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use image::ImageFormat;
use tempfile::NamedTempFile;
use thiserror::Error;

use crate::render::Image;
use crate::render::encode::{encode, encode_codes};
use crate::render::image::Codes;

/// Why a picture is not in its file. The file that was there before, if any, is intact.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// A file name that tells no format that is written here.
    #[error("{}: {why}; the formats are {}", path.display(), PictureFormat::list())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong with its name.
        why: String,
    },
    /// Something that is not a file stands where the picture should go.
    #[error("{}: is {what}: give the name of a file", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
        /// What it is.
        what: &'static str,
    },
    /// A picture that the format does not hold.
    #[error(
        "{}: {width}x{height} pixels are too many for {}, whose sides have up to {max}; \
         write .png or .exr", path.display(), format.name()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The format.
        format: PictureFormat,
        /// Pixels from left to right.
        width: u32,
        /// Pixels from top to bottom.
        height: u32,
        /// The longest side.
        max: u32,
    },
    /// The encoder refused the picture.
    #[error("{}: could not be encoded: {why}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What the encoder says.
        why: String,
    },
    /// The system refused the file: a missing directory, no permission, a full disk.
    #[error("{}: could not be written: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// The formats that pictures are written in.
///
/// Formats of 8 bits hold colour by the exact sRGB curve (IEC 61966-2-1), clipped to 0..1; EXR and
/// HDR hold it linear. What they hold of other pictures than of colour:
///
/// | | 8 bits, no curve | HDR (no negative values) | EXR |
/// |---|---|---|---|
/// | normal | `n / 2 + 1/2` | `n / 2 + 1/2` | `n` |
/// | depth | near 1, far 0, miss 0 | distance, miss the largest value | distance, miss infinity |
/// | prim | a colour hashed from the ids, miss black | the same | `geom_id, prim_id, 1` |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum PictureFormat {
    Png,
    Jpeg,
    Bmp,
    Tga,
    Tiff,
    WebP,
    Exr,
    Hdr,
}

impl PictureFormat {
    /// All of them, each with its extensions, the usual one first.
    pub const ALL: [(Self, &'static [&'static str]); 8] = [
        (Self::Png, &["png"]),
        (Self::Jpeg, &["jpg", "jpeg"]),
        (Self::Bmp, &["bmp"]),
        (Self::Tga, &["tga"]),
        (Self::Tiff, &["tif", "tiff"]),
        (Self::WebP, &["webp"]),
        (Self::Exr, &["exr"]),
        (Self::Hdr, &["hdr"]),
    ];

    /// The format of a file name, by its extension in capitals or not.
    ///
    /// # Errors
    /// [`OutputError::Format`] with all the extensions that are known.
    pub fn of_path(path: &Path) -> Result<Self, OutputError> {
        let error = |why| Err(OutputError::Format { path: path.into(), why });
        let Some(extension) = path.extension() else {
            return error("has no extension to tell the format".into());
        };
        let extension = extension.to_string_lossy().to_ascii_lowercase();
        match Self::ALL.iter().find(|(_, known)| known.contains(&extension.as_str())) {
            Some((format, _)) => Ok(*format),
            None => error(format!("`.{extension}` is no format that can be written")),
        }
    }

    /// What the format is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Bmp => "BMP",
            Self::Tga => "TGA",
            Self::Tiff => "TIFF",
            Self::WebP => "WebP",
            Self::Exr => "OpenEXR",
            Self::Hdr => "Radiance HDR",
        }
    }

    /// The most pixels that a side may have.
    pub fn max_side(self) -> u32 {
        match self {
            Self::WebP => 16_383,
            Self::Jpeg | Self::Tga => 65_535,
            _ => u32::MAX,
        }
    }

    fn list() -> String {
        let extensions: Vec<_> =
            Self::ALL.iter().flat_map(|(_, known)| *known).map(|e| format!(".{e}")).collect();
        extensions.join(", ")
    }

    /// True if it holds floats.
    pub(super) fn is_linear(self) -> bool {
        matches!(self, Self::Exr | Self::Hdr)
    }

    pub(super) fn image_format(self) -> ImageFormat {
        match self {
            Self::Png => ImageFormat::Png,
            Self::Jpeg => ImageFormat::Jpeg,
            Self::Bmp => ImageFormat::Bmp,
            Self::Tga => ImageFormat::Tga,
            Self::Tiff => ImageFormat::Tiff,
            Self::WebP => ImageFormat::WebP,
            Self::Exr => ImageFormat::OpenExr,
            Self::Hdr => ImageFormat::Hdr,
        }
    }
}

/// A file that a picture will be written to.
#[derive(Clone, Debug)]
pub struct PictureFile {
    /// As given, for messages.
    path: PathBuf,
    /// Where a link leads, so that a rename replaces the file and not the link.
    target: PathBuf,
    format: PictureFormat,
}

impl PictureFile {
    /// Checks that a picture can be written to `path`, before any work is put into it: that the
    /// format is known, and that the directory lets a file be made.
    ///
    /// # Errors
    /// [`OutputError`] names the file and what is wrong.
    pub fn new(path: &Path) -> Result<Self, OutputError> {
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        if let Ok(metadata) = fs::metadata(path)
            && !metadata.is_file()
        {
            let what = if metadata.is_dir() { "a directory" } else { "no ordinary file" };
            return Err(OutputError::NotAFile { path: path.into(), what });
        }
        let format = PictureFormat::of_path(path)?;
        let file = Self { path: path.into(), target, format };
        file.beside()?;
        Ok(file)
    }

    /// The format that the extension tells.
    pub fn format(&self) -> PictureFormat {
        self.format
    }

    /// Checks that the format holds pictures of this size.
    ///
    /// # Errors
    /// [`OutputError::TooLarge`] names the longest side.
    pub fn check_size(&self, width: u32, height: u32) -> Result<(), OutputError> {
        let (path, format, max) = (self.path.clone(), self.format, self.format.max_side());
        if width.max(height) <= max {
            return Ok(());
        }
        Err(OutputError::TooLarge { path, format, width, height, max })
    }

    /// Writes the picture to a new file in the same directory, and when all of it is on the disk
    /// renames that to the path. So the path never holds half a picture.
    ///
    /// # Errors
    /// [`OutputError`] names the file; nothing new is left in the directory.
    pub fn write(&self, image: &Image) -> Result<(), OutputError> {
        self.check_size(image.width, image.height)?;
        self.replace(encode(image, self.format))
    }

    /// The same for a picture of eight bits a value, and a format that has as many.
    pub(super) fn write_codes(&self, codes: &Codes) -> Result<(), OutputError> {
        self.check_size(codes.width, codes.height)?;
        self.replace(encode_codes(codes, self.format))
    }

    fn replace(&self, encoded: Result<Vec<u8>, String>) -> Result<(), OutputError> {
        let bytes = encoded.map_err(|why| OutputError::Encode { path: self.path.clone(), why })?;
        let mut file = self.beside()?;
        let written = file.write_all(&bytes).and_then(|()| file.as_file().sync_all());
        written.map_err(|source| self.io(source))?;
        file.persist(&self.target).map_err(|error| self.io(error.error))?;
        Ok(())
    }

    /// A new file in the directory of the target, with the permissions of the file that it will
    /// replace; it is removed when dropped.
    fn beside(&self) -> Result<NamedTempFile, OutputError> {
        let directory = match self.target.parent() {
            Some(directory) if !directory.as_os_str().is_empty() => directory,
            _ => Path::new("."),
        };
        if !directory.is_dir() {
            let why = format!("there is no directory {}", directory.display());
            let source = io::Error::new(io::ErrorKind::NotFound, why);
            return Err(OutputError::Io { path: self.path.clone(), source });
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".octray-").suffix(".part");
        // The default is for secrets; a picture gets what the user's mask allows.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(directory).map_err(|source| self.io(source))?;
        if let Ok(metadata) = fs::metadata(&self.target) {
            let kept = file.as_file().set_permissions(metadata.permissions());
            kept.map_err(|source| self.io(source))?;
        }
        Ok(file)
    }

    fn io(&self, source: io::Error) -> OutputError {
        // Without the name of the file beside, which means nothing to the user.
        let source = match source.raw_os_error() {
            Some(code) => io::Error::from_raw_os_error(code),
            None => source.kind().into(),
        };
        OutputError::Io { path: self.path.clone(), source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_tells_the_format() {
        for (name, format) in [
            ("a.png", PictureFormat::Png),
            ("b/c.d.JPeG", PictureFormat::Jpeg),
            ("x.exr", PictureFormat::Exr),
        ] {
            assert_eq!(PictureFormat::of_path(Path::new(name)).unwrap(), format);
        }
        for name in ["a", "a.gif", ".png", ""] {
            let message = PictureFormat::of_path(Path::new(name)).unwrap_err().to_string();
            assert!(message.contains(".webp, .exr, .hdr"), "{message}");
        }
    }
}
