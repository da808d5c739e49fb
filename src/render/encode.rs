//! Pictures as the bytes of a file; [`PictureFormat`] says which values each format holds.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageBuffer, Rgb};
use rayon::prelude::*;

use crate::render::{Aov, Image, PictureFormat};

/// The bytes of the file, or what the encoder says.
pub(super) fn encode(image: &Image, format: PictureFormat) -> Result<Vec<u8>, String> {
    let broken =
        || format!("{} pixels are not {}x{}", image.pixels.len(), image.width, image.height);
    let (width, height) = (image.width, image.height);
    let mut bytes = Cursor::new(Vec::new());
    let encoded = match format {
        PictureFormat::Exr | PictureFormat::Hdr => {
            let value = if format == PictureFormat::Exr { exr_value } else { hdr_value };
            let values = image.pixels.par_iter().flat_map_iter(|&pixel| value(image, pixel));
            let buffer: Option<ImageBuffer<Rgb<f32>, _>> =
                ImageBuffer::from_raw(width, height, values.collect());
            DynamicImage::ImageRgb32F(buffer.ok_or_else(broken)?)
                .write_to(&mut bytes, format.image_format())
        }
        _ => {
            let values = image.pixels.par_iter().flat_map_iter(|&pixel| eight_bits(image, pixel));
            let buffer: Option<ImageBuffer<Rgb<u8>, _>> =
                ImageBuffer::from_raw(width, height, values.collect());
            let picture = DynamicImage::ImageRgb8(buffer.ok_or_else(broken)?);
            if format == PictureFormat::Jpeg {
                picture.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, 92))
            } else {
                picture.write_to(&mut bytes, format.image_format())
            }
        }
    };
    encoded.map_err(|error| error.to_string())?;
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

fn eight_bits(image: &Image, pixel: [f32; 3]) -> [u8; 3] {
    let value = match image.aov {
        Aov::Color => pixel.map(srgb),
        Aov::Normal => pixel.map(|n| n * 0.5 + 0.5),
        Aov::Depth => {
            let [near, far] = image.depth_range;
            pixel.map(|depth| (far - depth) / (far - near).max(f32::MIN_POSITIVE))
        }
        Aov::Prim => prim_color(pixel),
    };
    // NaN becomes 0.
    value.map(|value| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

/// The sRGB curve: from linear to encoded, both 0 to 1.
fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// A bright colour that differs between neighbouring ids; black for a miss.
fn prim_color([geom_id, prim_id, hit]: [f32; 3]) -> [f32; 3] {
    if hit == 0.0 {
        return [0.0; 3];
    }
    let mut bits = (geom_id as u32).wrapping_mul(0x9e37_79b9) ^ (prim_id as u32);
    for _ in 0..2 {
        bits = (bits ^ (bits >> 16)).wrapping_mul(0x7feb_352d);
        bits = (bits ^ (bits >> 15)).wrapping_mul(0x846c_a68b);
    }
    [0, 8, 16].map(|shift| 0.2 + 0.8 * (bits >> shift & 255) as f32 / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_srgb() {
        let pixel = |value| {
            let image = Image::new(1, 1, Aov::Color).unwrap();
            eight_bits(&image, [value; 3])[0]
        };
        // 0.2140411 is the middle grey 128 of sRGB; 0.0030353 is 10 by the straight part.
        for (linear, encoded) in [
            (0.0, 0),
            (1.0, 255),
            (0.215_86, 128),
            (0.003_035_3, 10),
            (7.0, 255),
            (-1.0, 0),
            (f32::NAN, 0),
            (f32::INFINITY, 255),
        ] {
            assert_eq!(pixel(linear), encoded, "{linear}");
        }
    }
}
