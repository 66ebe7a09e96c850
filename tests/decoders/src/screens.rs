//! Pictures: warps, surfaces and blend masks of screens, and the light around a scene.

use crate::files::with_file;

/// Width over height of the output in the checks.
const ASPECT: f64 = 1.5;
/// Names by the first byte of the input; the ending chooses the reader.
const NAMES: [&str; 5] = [
    "warp.data",
    "warp.pfm",
    "surface.pfm",
    "blend.pfm",
    "blend.png",
];

fn check(mask: &taut_screens::Mask) {
    let pixels = mask.width as usize * mask.height as usize;
    assert_eq!(mask.shares.len(), pixels);
    let is_share = |share: &f32| (0.0..=1.0).contains(share);
    assert!(mask.shares.iter().all(is_share));
}

/// A file of a screen, which one by the first byte: what is read has as many nodes as it says, all of them finite.
pub(crate) fn screen_file(bytes: &[u8]) {
    let Some((which, content)) = bytes.split_first() else {
        return;
    };
    let which = usize::from(*which) % NAMES.len();
    with_file(NAMES[which], content, |path| {
        let mesh = match which {
            0 | 1 => taut_screens::read_warp(path, ASPECT),
            2 => taut_screens::read_surface(path),
            _ => {
                if let Ok(mask) = taut_screens::read_blend(path, 2.2) {
                    check(&mask);
                }
                return;
            }
        };
        if let Ok(mesh) = mesh {
            assert_eq!(mesh.nodes.len(), mesh.columns * mesh.rows);
            for node in &mesh.nodes {
                let numbers = node.place.iter().chain(&node.target);
                assert!(numbers.chain([&node.share]).all(|x| x.is_finite()));
            }
        }
    });
}

/// The light around a scene as a picture: what is read can be drawn with.
pub(crate) fn environment_hdr(bytes: &[u8]) {
    with_file("light.hdr", bytes, |path| {
        if let Ok(light) = taut_scene::read_environment(path) {
            crate::wire::panorama(&light.encode());
        }
    });
}

pub(crate) fn environment_hdr_seeds() -> Vec<Vec<u8>> {
    let pixels: Vec<_> = (0..16 * 8)
        .map(|pixel| image::Rgb([pixel as f32, 0.5, 800.0]))
        .collect();
    let mut file = Vec::new();
    let written = image::codecs::hdr::HdrEncoder::new(&mut file).encode(&pixels, 16, 8);
    assert!(written.is_ok(), "{written:?}");
    let empty = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n";
    vec![file, empty.to_vec()]
}

/// A picture on a surface, PNG or JPEG: what is read can be sent.
pub(crate) fn picture(bytes: &[u8]) {
    if let Ok(texture) = taut_scene::read_picture(bytes) {
        crate::wire::texture(&texture.encode());
    }
}

pub(crate) fn picture_seeds() -> Vec<Vec<u8>> {
    let colours =
        image::RgbImage::from_fn(16, 8, |x, y| image::Rgb([16 * x as u8, 32 * y as u8, 128]));
    let encoded = |format| {
        let mut file = std::io::Cursor::new(Vec::new());
        let written = colours.write_to(&mut file, format);
        assert!(written.is_ok(), "{written:?}");
        file.into_inner()
    };
    vec![
        encoded(image::ImageFormat::Png),
        encoded(image::ImageFormat::Jpeg),
        grey_png(),
    ]
}

/// Two by two grey pixels.
fn grey_png() -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    let picture = image::GrayImage::from_raw(2, 2, vec![0, 85, 170, 255]);
    let written = picture.map(|picture| picture.write_to(&mut file, image::ImageFormat::Png));
    assert!(matches!(written, Some(Ok(()))));
    file.into_inner()
}

pub(crate) fn screen_file_seeds() -> Vec<Vec<u8>> {
    const SQUARE: &str = "2\n2 2\n-1.5 -1 0 0 1\n1.5 -1 1 0 1\n-1.5 1 0 1 0.5\n1.5 1 1 1 -1\n";
    let map = |kind: &str, values: &[f32]| {
        let values = values.iter().flat_map(|value| value.to_le_bytes());
        format!("{kind}\n2 2\n-1.0\n")
            .into_bytes()
            .into_iter()
            .chain(values)
            .collect::<Vec<u8>>()
    };
    let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let files = [
        SQUARE.as_bytes().to_vec(),
        map("PF", &corners),
        map("PF", &corners),
        map("Pf", &[0.0, 0.5, 0.5, 1.0]),
        grey_png(),
    ];
    files
        .into_iter()
        .enumerate()
        .map(|(which, file)| [vec![which as u8], file].concat())
        .collect()
}
