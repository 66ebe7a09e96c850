//! The picture that a `map_...` key of a Wavefront MTL names, behind its options.

use std::path::Path;

use taut_proto::Wrap;

use super::obj;
use super::picture_use::{PictureSource, PictureUse};

/// How a picture goes on, by a word of ours.
pub(super) fn wrap_of(word: &str) -> Option<Wrap> {
    match word {
        "repeat" => Some(Wrap::Repeat),
        "mirror" => Some(Wrap::Mirror),
        "clamp" => Some(Wrap::Clamp),
        _ => None,
    }
}

/// The picture of a `map_...` key. Options come before its name, which may hold blanks.
pub(super) fn map(rest: &str, folder: &Path) -> PictureUse {
    let mut rest = obj::name(rest);
    let (mut scale, mut offset, mut wrap) = ([1.0; 2], [0.0; 2], Wrap::Repeat);
    while let Some((option, behind)) = rest.split_once(char::is_whitespace) {
        let words = match option {
            "-s" | "-o" | "-t" => 3, // one at least
            "-mm" => 2,
            "-clamp" | "-blendu" | "-blendv" | "-cc" | "-bm" | "-boost" | "-imfchan"
            | "-texres" | "-type" => 1,
            _ => break,
        };
        rest = behind.trim_start();
        let mut numbers = Vec::new();
        for taken in 0..words {
            let (word, behind) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            let number = word.parse().ok().filter(|value: &f64| value.is_finite());
            if words == 3 && taken > 0 && number.is_none() {
                break;
            }
            numbers.extend(number);
            if option == "-clamp" && word == "on" {
                wrap = Wrap::Clamp;
            }
            rest = behind.trim_start();
        }
        let into = match option {
            "-s" => &mut scale,
            "-o" => &mut offset,
            _ => continue,
        };
        into.iter_mut()
            .zip(numbers)
            .for_each(|(part, number)| *part = number);
    }
    let source = PictureSource::Beside {
        folder: folder.to_owned(),
        name: rest.to_owned(),
    };
    // v of the file runs up the picture.
    let ([su, sv], [ou, ov]) = (scale, offset);
    PictureUse {
        wrap: [wrap; 2],
        placing: [[su, 0.0, ou], [0.0, sv, 1.0 - sv - ov]],
        ..PictureUse::of(source)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_named_behind_its_options() {
        let of = |text: &str| map(text, Path::new("sub"));
        for (text, name) in [
            ("a b.png", "a b.png"),
            ("-s 2 3 a.png", "a.png"),
            ("-o 0.5 0.25 0 -s 2 1 1 3d.png", "3d.png"),
            ("-clamp on -mm 0 1 -bm 0.5 a.jpg", "a.jpg"),
            ("-imfchan r -texres 256 a.jpg # wood", "a.jpg"),
            ("C:\\pictures\\a.jpg", "C:\\pictures\\a.jpg"),
        ] {
            let PictureSource::Beside {
                folder,
                name: found,
            } = of(text).source
            else {
                panic!("{text}");
            };
            assert_eq!((found.as_str(), folder.as_path()), (name, Path::new("sub")));
        }
        // Twice as often, a quarter up the picture: down it the other way.
        let used = of("-s 2 2 -o 0 0.25 a.png");
        assert_eq!(used.place([0.5, 1.0]), [1.0, 0.75]);
        assert_eq!(of("-clamp on a.png").wrap, [Wrap::Clamp; 2]);
        assert_eq!(of("sub\\a.png").source.file(), Some("sub/sub/a.png".into()));
        assert_eq!(of("../a.png").source.file(), None);
    }
}
