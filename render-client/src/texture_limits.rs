//! What the graphics adapter must hold to draw a stage: said before wgpu stops the program for it.

use crate::error::RenderError;
use crate::stage::{Stage, StageScreen};

/// Size of the pictures of a screen off-screen, pixels; refused where a side is longer than `most`. Smaller ones would have another shape, or not
/// the size that was asked for.
pub(crate) fn picture_size(screen: &StageScreen, most: u32) -> Result<(u32, u32), RenderError> {
    let (width, height) = screen.stereo.picture_size(screen.pixels);
    let what = || format!("a picture of the screen \"{}\"", screen.name);
    let smaller = "ask for a smaller window in the workbench file, or with --width and --height";
    within(what, (width.max(1), height.max(1)), most, smaller)
}

/// Refuses a stage with a blend mask that has a side longer than `most`, pixels.
pub(crate) fn check_masks(stage: &Stage, most: u32) -> Result<(), RenderError> {
    stage
        .screens
        .iter()
        .try_for_each(|screen| check_masks_of(screen, most))
}

fn check_masks_of(screen: &StageScreen, most: u32) -> Result<(), RenderError> {
    let Some(correction) = &screen.correction else {
        return Ok(());
    };
    for (place, mask) in correction.masks.iter().enumerate() {
        let what = || {
            let file = correction.mask_files.get(place).map_or("", String::as_str);
            format!(
                "the blend mask \"{file}\" of the screen \"{}\"",
                screen.name
            )
        };
        let smaller = "save it as large as the window";
        within(what, (mask.width, mask.height), most, smaller)?;
    }
    Ok(())
}

/// The size where the adapter holds it; `what` it is of and what to do else are for people.
fn within(
    what: impl FnOnce() -> String,
    (width, height): (u32, u32),
    most: u32,
    remedy: &'static str,
) -> Result<(u32, u32), RenderError> {
    if width.max(height) <= most {
        return Ok((width, height));
    }
    Err(RenderError::TooLarge {
        what: what(),
        width,
        height,
        most,
        remedy,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correction::Correction;
    use crate::view::Screen;
    use nalgebra::Point3;
    use std::sync::Arc;
    use taut_proto::scene::{OutputDescription, Stereo};

    fn screen(pixels: (u32, u32), stereo: Stereo) -> StageScreen {
        let corners = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 0.0, 1.0]].map(Point3::from);
        StageScreen {
            name: "front".to_owned(),
            screen: Screen::from_corners(corners[0], corners[1], corners[2]).expect("a screen"),
            pixels,
            stereo,
            correction: None,
            charts: Vec::new(),
        }
    }

    #[test]
    fn a_picture_too_large_for_the_adapter_is_refused_with_both_sizes() {
        let most = 16_384;
        for (pixels, stereo, size) in [
            ((16_384, 10_923), Stereo::Mono, (16_384, 10_923)),
            ((8192, 5461), Stereo::SideBySide, (16_384, 5461)),
        ] {
            let fits = picture_size(&screen(pixels, stereo), most);
            assert_eq!(fits.expect("fits"), size);
        }
        for (pixels, stereo, size) in [
            ((16_384, 16_385), Stereo::Mono, "16384x16385"),
            ((12_000, 8000), Stereo::SideBySide, "24000x8000"),
            ((12_000, 8200), Stereo::TopBottom, "12000x16400"),
        ] {
            let error = picture_size(&screen(pixels, stereo), most).expect_err("too large");
            let text = error.to_string();
            for part in ["\"front\"", size, "16384", "--width"] {
                assert!(text.contains(part), "{part} in {text}");
            }
            assert_eq!(error.exit_code(), 2);
        }
        let endless = screen((1, u32::MAX), Stereo::TopBottom);
        assert!(picture_size(&endless, most).is_err());
    }

    #[test]
    fn a_blend_mask_too_large_for_the_adapter_is_refused_by_its_file() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, width) in [("left.png", 8), ("right.png", 9)] {
            let white = image::GrayImage::from_pixel(width, 4, image::Luma([255]));
            white.save(folder.path().join(name)).expect("written");
        }
        let described = OutputDescription {
            blend: vec!["left.png".into(), "right.png".into()],
            ..OutputDescription::default()
        };
        let correction = Correction::read(&described, folder.path(), 2.0).expect("two masks");
        let mut screen = screen((8, 4), Stereo::TwoWindows);
        assert!(check_masks_of(&screen, 8).is_ok(), "without a mask");
        screen.correction = correction.map(Arc::new);
        assert!(check_masks_of(&screen, 9).is_ok());
        let error = check_masks_of(&screen, 8).expect_err("too large");
        let text = error.to_string();
        for part in ["\"right.png\"", "\"front\"", "9x4 pixels", "8 each way"] {
            assert!(text.contains(part), "{part} in {text}");
        }
    }
}
