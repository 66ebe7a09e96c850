//! Wavefront MTL: colour, opacity and, where it has them, roughness and metalness of named materials.
//!
//! | key          | meaning                                       |
//! |--------------|-----------------------------------------------|
//! | `newmtl`     | the name of the material whose keys follow    |
//! | `Kd`         | diffuse colour, sRGB as CAD programs write it |
//! | `d`, `Tr`    | opacity, or one less it; `d` counts before    |
//! | `Pr`, `Pm`   | roughness and metalness (PBR extension)       |
//! | `map_Kd`     | its colour, times `Kd`; beside the library    |
//! | `map_d`      | its opacity, where it is the same picture     |
//! | `map_...`    | another picture; not drawn                    |
//! | `wrap_Kd`    | ours: how `map_Kd` goes on beyond its edges, along u and v: `repeat`, `mirror`, `clamp` |
//!
//! Of the options of `map_Kd` `-s`, `-o` and `-clamp` count.

use std::path::Path;

use taut_proto::Wrap;

use super::material::Material;
use super::mtl_map::{map, wrap_of};
use super::obj;
use super::picture_use::PictureSource;
use super::read::without_mark;
use crate::appearance::{Appearance, linear};
use crate::files::read_bytes;
use crate::problem::Problem;

/// Largest library, bytes: a material takes some hundred.
const MAX_BYTES: u64 = 16 << 20;
/// Most lines that are complained of.
const MAX_FAULTS: usize = 3;
/// What is said of a key of ours without its numbers.
const NO_NUMBERS: &str = "which has no usable numbers";
/// What is said of a `Tr` of 1 that stands alone: by the key's meaning the body would not be seen.
const OPAQUE: &str = "which is 1: some programs write that of opaque parts, and so it is taken";

/// Line, key and what is to be said of it.
type Remark = (usize, String, &'static str);

/// Says of the named materials of `list` what the file says, which lies in `folder` seen from the mesh; lines that are not understood, or not taken at their word, are named.
pub(super) fn read_library(
    path: &Path,
    folder: &Path,
    list: &mut [Material],
) -> Result<Vec<String>, Problem> {
    let bytes = read_bytes(path, MAX_BYTES)?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let faults = parse(&String::from_utf8_lossy(without_mark(&bytes)), folder, list);
    let named = faults.into_iter().take(MAX_FAULTS);
    Ok(named
        .map(|(line, key, why)| format!("`{key}` in line {line} of {file}, {why}"))
        .collect())
}

/// The pictures that a library names as colours, seen from the mesh; none of one that cannot be read.
pub(super) fn pictures(path: &Path, folder: &Path) -> Vec<PictureSource> {
    let bytes = read_bytes(path, MAX_BYTES).unwrap_or_default();
    let text = String::from_utf8_lossy(without_mark(&bytes));
    let keys = text
        .lines()
        .filter_map(|line| line.trim().split_once(char::is_whitespace));
    let maps = keys.filter(|(key, _)| *key == "map_Kd");
    maps.map(|(_, rest)| map(rest, folder).source).collect()
}

fn parse(text: &str, folder: &Path, list: &mut [Material]) -> Vec<Remark> {
    let mut faults = Vec::new();
    let mut see_through = vec![SeeThrough::default(); list.len()];
    let mut current: Option<usize> = None;
    for (number, line) in text.lines().enumerate().map(|(i, line)| (i + 1, line)) {
        let line = line.trim();
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        if key == "newmtl" {
            let name = obj::name(rest);
            current = list.iter().position(|material| material.name == name);
            if let Some(place) = current {
                list[place].is_defined = true;
            }
            continue;
        }
        let Some(place) = current else {
            continue;
        };
        if take_map(key, rest, folder, &mut list[place], &mut see_through[place]) {
            continue;
        }
        let rest = rest.split('#').next().unwrap_or_default();
        if !take(key, rest, number, &mut list[place], &mut see_through[place]) {
            faults.push((number, key.to_owned(), NO_NUMBERS));
        }
    }
    for (material, said) in list.iter_mut().zip(&see_through) {
        finish_map(material, said);
        material.appearance.opacity = match (said.dissolve, said.transparency) {
            (Some(opacity), _) => Some(opacity),
            (None, Some((line, 1.0))) => {
                faults.push((line, "Tr".to_owned(), OPAQUE));
                Some(1.0)
            }
            (None, Some((_, transparency))) => Some(1.0 - transparency),
            (None, None) => material.appearance.opacity,
        };
    }
    faults
}

/// What a library says of how far one sees through a material, and of how its picture goes on.
#[derive(Clone, Debug, Default)]
struct SeeThrough {
    /// Of `d`: the opacity.
    dissolve: Option<f32>,
    /// Line and value of `Tr`: one less the opacity.
    transparency: Option<(usize, f32)>,
    /// Of `map_d`: a picture.
    map: Option<PictureSource>,
    /// Of `wrap_Kd`.
    wrap: Option<[Wrap; 2]>,
}

/// `false` where the key names no picture of colour or opacity, and nothing of one.
fn take_map(
    key: &str,
    rest: &str,
    folder: &Path,
    material: &mut Material,
    said: &mut SeeThrough,
) -> bool {
    match key {
        "map_Kd" => material.picture = Some(map(rest, folder)),
        "map_d" => said.map = Some(map(rest, folder).source),
        "wrap_Kd" => {
            let wraps: Vec<Wrap> = rest.split_whitespace().filter_map(wrap_of).collect();
            said.wrap = wraps.first_chunk().copied();
        }
        _ => return false,
    }
    true
}

/// What is known of a material's picture when all of its keys are.
fn finish_map(material: &mut Material, said: &SeeThrough) {
    if let (Some(used), Some(wrap)) = (&mut material.picture, said.wrap) {
        used.wrap = wrap;
    }
    match (&mut material.picture, &said.map) {
        (Some(used), Some(map)) if used.source == *map => used.is_opacity = true,
        (_, Some(_)) => material.textured = true,
        (_, None) => {}
    }
    // Some programs write black where a picture says the colour.
    let colour = &mut material.appearance.color;
    if material.picture.is_some() && *colour == Some([0.0; 3]) {
        *colour = Some([1.0; 3]);
    }
}

/// `false` where the key is one of ours and its numbers are none.
fn take(
    key: &str,
    rest: &str,
    line: usize,
    material: &mut Material,
    see_through: &mut SeeThrough,
) -> bool {
    let numbers: Vec<f64> = rest
        .split_whitespace()
        .map_while(|word| word.parse().ok().filter(|value: &f64| value.is_finite()))
        .map(|value: f64| value.clamp(0.0, 1.0))
        .collect();
    let Appearance {
        color,
        roughness,
        metallic,
        ..
    } = &mut material.appearance;
    match (key, numbers.as_slice()) {
        ("Kd", &[red, green, blue, ..]) => {
            *color = Some([red, green, blue].map(|part| linear(part) as f32));
        }
        // One number is a grey.
        ("Kd", &[grey]) => *color = Some([linear(grey) as f32; 3]),
        ("d", &[value, ..]) => see_through.dissolve = Some(value as f32),
        ("Tr", &[value, ..]) => see_through.transparency = Some((line, value as f32)),
        ("Pr", &[value, ..]) => *roughness = Some(value as f32),
        ("Pm", &[value, ..]) => *metallic = Some(value as f32),
        ("Kd" | "d" | "Tr" | "Pr" | "Pm", _) => return false,
        _ => material.textured |= key.starts_with("map_") || key == "norm" || key == "bump",
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str) -> Material {
        Material {
            name: name.to_owned(),
            ..Material::default()
        }
    }

    #[test]
    fn the_keys_of_the_materials_that_are_asked_for_are_read() {
        let mut list = [named("red paint"), named("glass")];
        let text = "newmtl other\nKd 1 1 1\nnewmtl red paint\nKd 0.8 0.04 0 # sRGB\nPm 0.5\n\
                    Pr 0.25\nmap_Kd a.png\r\nnewmtl glass\nTr 0.75\nKd 2\n";
        assert_eq!(parse(text, Path::new(""), &mut list), []);
        let red = &list[0].appearance;
        let [r, g, b] = red.color.unwrap();
        assert!((r - 0.6038).abs() < 1e-3 && (g - 0.0031).abs() < 1e-3 && b == 0.0);
        assert_eq!((red.roughness, red.metallic), (Some(0.25), Some(0.5)));
        assert!(list[0].picture.is_some() && list[1].picture.is_none());
        assert!(!list[0].textured && !list[1].textured);
        assert_eq!(list[1].appearance.opacity, Some(0.25));
        assert_eq!(list[1].appearance.color, Some([1.0; 3]));
    }

    #[test]
    fn a_name_may_hold_the_sign_that_begins_comments() {
        let mut list = [named("#c0c0c0"), named("Material #25"), named("Material")];
        let text = "newmtl #c0c0c0\nKd 1 # white\n#Kd 0\nnewmtl Material #25\nd 0.5\n";
        assert_eq!(parse(text, Path::new(""), &mut list), []);
        assert_eq!(list[0].appearance.color, Some([1.0; 3]));
        assert_eq!(list[1].appearance.opacity, Some(0.5));
        let defined = list.map(|material| material.is_defined);
        assert_eq!(defined, [true, true, false]);
    }

    #[test]
    fn a_comment_behind_a_name_is_none_of_it() {
        let mut list = [named("Material")];
        let text = "newmtl Material # the grey one\nKd 0\nnewmtl Material #25\nKd 1\n";
        assert_eq!(parse(text, Path::new(""), &mut list), []);
        assert_eq!(list[0].appearance.color, Some([0.0; 3]));
        assert!(list[0].is_defined);
    }

    #[test]
    fn a_lone_transparency_of_one_is_opaque_and_dissolve_counts_before_it() {
        for (keys, opacity, line) in [
            ("Tr 1.000000", 1.0, Some(2)),
            ("Tr 0", 1.0, None),
            ("Tr 0.75", 0.25, None),
            ("d 0.5\nTr 1", 0.5, None),
            ("Tr 0.25\nd 1", 1.0, None),
            ("d 0", 0.0, None),
        ] {
            let mut list = [named("m")];
            let said = parse(&format!("newmtl m\n{keys}\n"), Path::new(""), &mut list);
            assert_eq!(list[0].appearance.opacity, Some(opacity), "{keys}");
            let said: Vec<usize> = said.iter().map(|(line, ..)| *line).collect();
            assert_eq!(said, Vec::from_iter(line), "{keys}");
        }
    }

    #[test]
    fn lines_without_their_numbers_are_named() {
        let mut list = [named("m")];
        let text = "newmtl m\nKd spectral a.rfl\nd nan\nKd 1 0\nNs many\n";
        let faults = parse(text, Path::new(""), &mut list);
        let lines: Vec<usize> = faults.iter().map(|(line, ..)| *line).collect();
        assert_eq!(lines, [2, 3, 4]);
        assert_eq!(list[0].appearance, Appearance::default());
    }

    #[test]
    fn a_picture_is_the_opacity_only_where_map_d_is_the_same() {
        for (keys, is_opacity, textured) in [
            ("map_Kd a.png", false, false),
            ("map_Kd a.png\nmap_d a.png", true, false),
            ("map_d b.png\nmap_Kd a.png", false, true),
            ("map_d a.png", false, true),
        ] {
            let mut list = [named("m")];
            let text = format!("newmtl m\nKd 0 0 0\nwrap_Kd mirror clamp\n{keys}\n");
            assert_eq!(parse(&text, Path::new(""), &mut list), []);
            let [material] = list;
            let used = material.picture.as_ref();
            assert_eq!(
                used.is_some_and(|used| used.is_opacity),
                is_opacity,
                "{keys}"
            );
            assert_eq!(material.textured, textured, "{keys}");
            let white = used.is_some().then_some([1.0; 3]).or(Some([0.0; 3]));
            assert_eq!(material.appearance.color, white, "{keys}");
            let wraps = used.is_none_or(|used| used.wrap == [Wrap::Mirror, Wrap::Clamp]);
            assert!(wraps, "{keys}");
        }
    }
}
