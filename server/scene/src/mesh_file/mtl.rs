//! Wavefront MTL: colour, opacity and, where it has them, roughness and metalness of named materials.
//!
//! | key          | meaning                                       |
//! |--------------|-----------------------------------------------|
//! | `newmtl`     | the name of the material whose keys follow    |
//! | `Kd`         | diffuse colour, sRGB as CAD programs write it |
//! | `d`, `Tr`    | opacity, or one less it                       |
//! | `Pr`, `Pm`   | roughness and metalness (PBR extension)       |
//! | `map_...`    | a picture; not drawn                          |

use std::path::Path;

use super::material::Material;
use super::read::without_mark;
use crate::appearance::{Appearance, linear};
use crate::files::read_bytes;
use crate::problem::Problem;

/// Largest library, bytes: a material takes some hundred.
const MAX_BYTES: u64 = 16 << 20;
/// Most lines that are complained of.
const MAX_FAULTS: usize = 3;

/// Says of the named materials of `list` what the file says; lines that are not understood are named.
pub(super) fn read_library(path: &Path, list: &mut [Material]) -> Result<Vec<String>, Problem> {
    let bytes = read_bytes(path, MAX_BYTES)?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let faults = parse(&String::from_utf8_lossy(without_mark(&bytes)), list);
    let named = faults.into_iter().take(MAX_FAULTS);
    Ok(named
        .map(|(line, key)| format!("`{key}` in line {line} of {file}, which has no usable numbers"))
        .collect())
}

fn parse(text: &str, list: &mut [Material]) -> Vec<(usize, String)> {
    let mut faults = Vec::new();
    let mut current: Option<usize> = None;
    for (number, line) in text.lines().enumerate().map(|(i, line)| (i + 1, line)) {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        if key == "newmtl" {
            current = list
                .iter()
                .position(|material| material.name == rest.trim());
            continue;
        }
        let Some(material) = current.and_then(|place| list.get_mut(place)) else {
            continue;
        };
        if !take(key, rest, material) {
            faults.push((number, key.to_owned()));
        }
    }
    faults
}

/// `false` where the key is one of ours and its numbers are none.
fn take(key: &str, rest: &str, material: &mut Material) -> bool {
    let numbers: Vec<f64> = rest
        .split_whitespace()
        .map_while(|word| word.parse().ok().filter(|value: &f64| value.is_finite()))
        .map(|value: f64| value.clamp(0.0, 1.0))
        .collect();
    let Appearance {
        color,
        roughness,
        metallic,
        opacity,
    } = &mut material.appearance;
    match (key, numbers.as_slice()) {
        ("Kd", &[red, green, blue, ..]) => {
            *color = Some([red, green, blue].map(|part| linear(part) as f32));
        }
        // One number is a grey.
        ("Kd", &[grey]) => *color = Some([linear(grey) as f32; 3]),
        ("d", &[value, ..]) => *opacity = Some(value as f32),
        ("Tr", &[value, ..]) => *opacity = Some(1.0 - value as f32),
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
        assert_eq!(parse(text, &mut list), []);
        let red = &list[0].appearance;
        let [r, g, b] = red.color.unwrap();
        assert!((r - 0.6038).abs() < 1e-3 && (g - 0.0031).abs() < 1e-3 && b == 0.0);
        assert_eq!((red.roughness, red.metallic), (Some(0.25), Some(0.5)));
        assert!(list[0].textured && !list[1].textured);
        assert_eq!(list[1].appearance.opacity, Some(0.25));
        assert_eq!(list[1].appearance.color, Some([1.0; 3]));
    }

    #[test]
    fn lines_without_their_numbers_are_named() {
        let mut list = [named("m")];
        let text = "newmtl m\nKd spectral a.rfl\nd nan\nKd 1 0\nNs many\n";
        let faults = parse(text, &mut list);
        let lines: Vec<usize> = faults.iter().map(|(line, _)| *line).collect();
        assert_eq!(lines, [2, 3, 4]);
        assert_eq!(list[0].appearance, Appearance::default());
    }
}
