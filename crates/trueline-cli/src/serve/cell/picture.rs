//! A small picture as PNG, and with the seam drawn over it.

use std::fmt::Write;
use trueline_cell::SmallPicture;

/// The bytes of a PNG.
///
/// # Errors
/// Error of the encoder.
pub(super) fn png(picture: &SmallPicture) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width as u32, picture.height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&picture.gray)?;
    writer.finish()?;
    Ok(bytes)
}

/// The picture at `path` with a cross where the seam was found.
#[must_use]
pub(super) fn markup(picture: &SmallPicture, path: &str) -> String {
    let [width, height] = picture.size_px;
    let found = if picture.seam_px.is_some() { "the seam is marked" } else { "no seam found" };
    let mut out = format!(
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"Picture {frame}: {found}\">\
         <image href=\"{path}?frame={frame}\" width=\"{width}\" height=\"{height}\"/>",
        frame = picture.frame
    );
    if let Some([u, v]) = picture.seam_px {
        // Pixel (0, 0) is the middle of the first one; the picture's corner is half a pixel before it.
        let (x, y, arm) = (u + 0.5, v + 0.5, 0.03 * width as f64);
        let _ = write!(
            out,
            "<path class=\"seen\" d=\"M{:.1} {y:.1}H{:.1}M{x:.1} {:.1}V{:.1}\"/><circle class=\"seen\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\"/>",
            x - arm,
            x + arm,
            y - arm,
            y + arm,
            0.5 * arm
        );
    }
    out + "</svg>"
}
