//! Pictures as the bytes of a file; [`PictureFormat`] says which values each format holds.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageBuffer, ImageResult, Rgb};
use rayon::prelude::*;

use crate::render::codes::{EightBits, prim_color};
use crate::render::image::Codes;
use crate::render::{Aov, Image, PictureFormat, RenderError};

/// The bytes of the file, or what the encoder says.
pub(super) fn encode(image: &Image, format: PictureFormat) -> Result<Vec<u8>, String> {
    if !format.is_linear() {
        let codes = eight_bits(image).map_err(|error| error.to_string())?;
        return encode_codes(&codes, format);
    }
    let value = if format == PictureFormat::Exr { exr_value } else { hdr_value };
    let values: Vec<f32> =
        image.pixels.par_iter().flat_map_iter(|&pixel| value(image, pixel)).collect();
    let buffer = ImageBuffer::<Rgb<f32>, _>::from_raw(image.width, image.height, values);
    let buffer = buffer.ok_or_else(|| broken(image.pixels.len(), image.width, image.height))?;
    bytes_of(|bytes| buffer.write_to(bytes, format.image_format()))
}

/// The bytes of a file whose format has eight bits a value, or what the encoder says.
pub(super) fn encode_codes(codes: &Codes, format: PictureFormat) -> Result<Vec<u8>, String> {
    let (width, height) = (codes.width, codes.height);
    let values = codes.pixels.as_flattened();
    let buffer = ImageBuffer::<Rgb<u8>, _>::from_raw(width, height, values);
    let buffer = buffer.ok_or_else(|| broken(codes.pixels.len(), width, height))?;
    bytes_of(|bytes| {
        match format {
            PictureFormat::Jpeg => {
                buffer.write_with_encoder(JpegEncoder::new_with_quality(bytes, 92))
            }
            // To try all filters on each row takes a quarter longer, and saves nothing to speak of.
            PictureFormat::Png => buffer.write_with_encoder(PngEncoder::new_with_quality(
                bytes,
                CompressionType::Fast,
                FilterType::Paeth,
            )),
            _ => buffer.write_to(bytes, format.image_format()),
        }
    })
}

fn broken(pixels: usize, width: u32, height: u32) -> String {
    format!("{pixels} pixels are not {width}x{height}")
}

fn bytes_of(
    write: impl FnOnce(&mut Cursor<Vec<u8>>) -> ImageResult<()>,
) -> Result<Vec<u8>, String> {
    let mut bytes = Cursor::new(Vec::new());
    write(&mut bytes).map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}

fn exr_value(_: &Image, pixel: [f32; 3]) -> [f32; 3] {
    pixel
}

/// Values that an exponent of 8 bits, shared by three numbers of 8 bits, can hold.
fn hdr_value(image: &Image, pixel: [f32; 3]) -> [f32; 3] {
    let value = match image.aov {
        Aov::Normal => pixel.map(|n| n * 0.5 + 0.5),
        Aov::Prim => prim_color(pixel),
        Aov::Color | Aov::Depth => pixel,
    };
    value.map(|value| if value > 1.0e-37 { value.min(1.0e38) } else { 0.0 })
}

/// A picture in eight bits a value.
fn eight_bits(image: &Image) -> Result<Codes, RenderError> {
    /// Pixels that are worth a task.
    const TASK: usize = 4096;
    let of = EightBits::new(image.aov, image.depth_range);
    let mut codes = Codes::new(image.width, image.height)?;
    let tasks = codes.pixels.par_chunks_mut(TASK).zip(image.pixels.par_chunks(TASK));
    tasks.for_each(|(codes, pixels)| of.write(pixels, &mut codes[..pixels.len()]));
    Ok(codes)
}
