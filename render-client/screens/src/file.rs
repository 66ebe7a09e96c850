//! Reading the files.

use std::fs::File;
use std::io::Read;
use std::path::{Component, Path};

use crate::bourke;
use crate::fault::{Fault, Unnamed};
use crate::fold::fold;
use crate::mask::{self, Mask};
use crate::mesh::{OutputMesh, Target};
use crate::pfm::{self, FloatMap};

/// Largest coordinate of a surface, m: beyond it the file is in another unit.
const FARTHEST: f32 = 200.0;
/// What rounding may put a texture coordinate beyond 0 and 1.
const ROUNDING: f32 = 1e-3;

/// What is wrong with the name of a file that is to be read in a folder: it must stay in it, and be of a known kind.
#[must_use]
pub fn file_name_fault(name: &str, endings: &[&str]) -> Option<String> {
    let path = Path::new(name);
    let mut parts = path.components();
    let stays = parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if name.is_empty() || !stays {
        return Some(format!(
            "\"{name}\" is no path within the folder of the screens' files; name a file there, without .. and without a leading /"
        ));
    }
    let ending = ending_of(path);
    if endings.contains(&ending.as_str()) {
        return None;
    }
    if ending == "mpcdi" {
        return Some(format!(
            "\"{name}\" is an MPCDI archive, which is not read as such; it is a zip file: take its .pfm maps and .png masks out, and name those (docs/screens.md, MPCDI)"
        ));
    }
    Some(format!(
        "\"{name}\" must end in {}",
        endings
            .iter()
            .map(|e| format!(".{e}"))
            .collect::<Vec<_>>()
            .join(" or ")
    ))
}

/// Reads the warp of a flat screen: Paul Bourke's mesh, or a float map of u, v and anything; nothing is drawn where both are NaN. `aspect`: width over
/// height of the output, as far as it is known: what lies far beyond it is refused. [`OutputMesh::for_output`] fits the mesh to the output.
pub fn read_warp(path: &Path, aspect: f64) -> Result<OutputMesh, Fault> {
    let read = || {
        if ending_of(path) == "pfm" {
            let map = map_of(path, 3)?;
            let off = |value: f32| !(-ROUNDING..=1.0 + ROUNDING).contains(&value); // true for NaN
            // Calibration programs mark so what the projector does not light.
            let is_unlit = |pixel: &[f32]| pixel[0].is_nan() && pixel[1].is_nan();
            let is_wrong = |pixel: &[f32]| !is_unlit(pixel) && (off(pixel[0]) || off(pixel[1]));
            if let Some(place) = find(&map, is_wrong) {
                let text = "has a place in the picture that is not 0 to 1 each way, nor NaN both ways where nothing is drawn";
                return Err(Unnamed::new(format!("{text}, at {place}")));
            }
            let at = |c, r| {
                let pixel = map.pixel(c, r);
                [pixel[0], pixel[1], 0.0]
            };
            let mesh = OutputMesh::of_parts(Target::Picture, map.width, map.height, at);
            return unfolded(mesh, |mesh, node| (None, place_of(mesh, node)));
        }
        let bytes = bytes_of(path, bourke::MAX_BYTES)?;
        let text = String::from_utf8(bytes)
            .map_err(|_| Unnamed::new("is no text; a warp is a .pfm map or Paul Bourke's mesh"))?;
        let (mesh, lines) = bourke::parse(&text, aspect)?;
        let in_shares = mesh.for_output(aspect).into_owned();
        unfolded(in_shares, |_, node| {
            (lines.get(node).copied(), String::new())
        })?;
        Ok(mesh)
    };
    read().map_err(|fault| named(path, fault))
}

/// Reads the surface that an output lights: a float map of points, m, workbench frame.
pub fn read_surface(path: &Path) -> Result<OutputMesh, Fault> {
    let read = || {
        let map = map_of(path, 3)?;
        let off = |value: &f32| !(-FARTHEST..=FARTHEST).contains(value); // true for NaN
        if let Some(place) = find(&map, |pixel| pixel.iter().any(off)) {
            let text =
                format!("has a point that is not within {FARTHEST} m of the workbench's origin");
            return Err(Unnamed::new(format!(
                "{text}, at {place}; give metres, and a point for every value"
            )));
        }
        let at = |c, r| {
            let pixel = map.pixel(c, r);
            [pixel[0], pixel[1], pixel[2]]
        };
        let mesh = OutputMesh::of_parts(Target::Surface, map.width, map.height, at);
        unfolded(mesh, |mesh, node| (None, place_of(mesh, node)))
    };
    read().map_err(|fault| named(path, fault))
}

/// Reads a blend mask; `gamma` is the exponent that makes its values shares of light.
pub fn read_blend(path: &Path, gamma: f64) -> Result<Mask, Fault> {
    let read = || match ending_of(path).as_str() {
        "pfm" => mask::from_map(&map_of(path, 1)?, gamma),
        _ => mask::from_png(bytes_of(path, mask::MAX_BYTES)?, gamma),
    };
    read().map_err(|fault| named(path, fault))
}

fn map_of(path: &Path, channels: usize) -> Result<FloatMap, Unnamed> {
    let map = pfm::parse(&bytes_of(path, pfm::MAX_BYTES)?)?;
    if channels == 3 && map.channels != 3 {
        return Err(Unnamed::new(
            "has one value for a pixel, but points have three; save it as a coloured map (PF)",
        ));
    }
    Ok(map)
}

/// The first pixel of which this is true.
fn find(map: &FloatMap, is_wrong: impl Fn(&[f32]) -> bool) -> Option<String> {
    let wrong = map.values.chunks_exact(map.channels).position(is_wrong)?;
    Some(place(wrong % map.width, wrong / map.width))
}

fn place(column: usize, row: usize) -> String {
    format!("column {column}, row {row} from the lower left, both from 0")
}

/// Where a node of a map is, whose border was added.
fn place_of(mesh: &OutputMesh, node: usize) -> String {
    let inner = |index: usize, count: usize| index.clamp(1, count - 2) - 1;
    let (column, row) = (node % mesh.columns, node / mesh.columns);
    place(inner(column, mesh.columns), inner(row, mesh.rows))
}

fn unfolded(
    mesh: OutputMesh,
    whereabouts: impl Fn(&OutputMesh, usize) -> (Option<usize>, String),
) -> Result<OutputMesh, Unnamed> {
    if mesh.triangles().next().is_none() {
        return Err(Unnamed::new(
            "draws nothing: every triangle has a node that is not drawn",
        ));
    }
    match fold(&mesh) {
        None => Ok(mesh),
        Some((node, text)) => {
            let (line, place) = whereabouts(&mesh, node);
            let text = match place.is_empty() {
                true => text,
                false => format!("at {place}: {text}"),
            };
            Err(Unnamed { line, text })
        }
    }
}

fn bytes_of(path: &Path, limit: u64) -> Result<Vec<u8>, Unnamed> {
    let cannot = |error: std::io::Error| {
        Unnamed::new(format!(
            "cannot be opened ({error}); put the file there, or correct its name in the workbench file"
        ))
    };
    if !path.metadata().map_err(cannot)?.is_file() {
        // A pipe would be waited for.
        return Err(Unnamed::new(
            "is no file; put the file there, or correct its name in the workbench file",
        ));
    }
    let file = File::open(path).map_err(cannot)?;
    let mut bytes = Vec::new();
    file.take(limit + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Unnamed::new(format!("cannot be read ({error}); check its disk")))?;
    if bytes.len() as u64 > limit {
        return Err(Unnamed::new(format!(
            "is larger than {limit} bytes; is it the right file?"
        )));
    }
    Ok(bytes)
}

fn ending_of(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_ascii_lowercase()
}

fn named(path: &Path, fault: Unnamed) -> Fault {
    Fault {
        file: path.display().to_string(),
        line: fault.line,
        text: fault.text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        (folder, path)
    }

    fn map(width: usize, height: usize, value: impl Fn(usize, usize) -> [f32; 3]) -> Vec<u8> {
        let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
        for row in 0..height {
            for column in 0..width {
                bytes.extend(value(column, row).iter().flat_map(|v| v.to_le_bytes()));
            }
        }
        bytes
    }

    #[test]
    fn a_cylinder_is_read_and_its_border_lies_on_its_chords() {
        let points = map(9, 5, |c, r| {
            let angle = (c as f32 - 4.0) * 0.1;
            [angle.sin(), angle.cos(), r as f32 * 0.2]
        });
        let (_keep, path) = written("wall.pfm", &points);
        let mesh = read_surface(&path).expect("a surface");
        assert_eq!(
            (mesh.target, mesh.columns, mesh.rows),
            (Target::Surface, 11, 7)
        );
        let border = mesh.node(0, 3).target;
        let radius = border[0].hypot(border[1]);
        assert!(
            (radius - 1.0).abs() < 0.01 && border[0] < -0.4_f32.sin(),
            "{border:?}"
        );
    }

    #[test]
    fn points_that_are_none_are_told_with_their_place() {
        for wrong in [f32::NAN, f32::INFINITY, 1500.0] {
            let points = map(3, 3, |c, r| match (c, r) {
                (2, 1) => [0.0, wrong, 0.0],
                _ => [c as f32, 0.0, r as f32],
            });
            let (_keep, path) = written("wall.pfm", &points);
            let fault = read_surface(&path).expect_err("refused").to_string();
            assert!(fault.contains("wall.pfm: has a point"), "{fault}");
            assert!(
                fault.contains("column 2, row 1 from the lower left"),
                "{fault}"
            );
        }
        let points = map(3, 3, |c, r| [c as f32 * 0.7, r as f32 * 0.5, f32::NAN]);
        let (_keep, path) = written("wall.pfm", &points);
        let fault = read_warp(&path, 1.0).expect_err("refused").to_string();
        assert!(
            fault.contains("not 0 to 1 each way") && fault.contains("at column 2, row 0"),
            "{fault}"
        );
    }

    /// As calibration programs mark pixels that light no screen; one number of two is a fault.
    #[test]
    fn nothing_is_drawn_where_a_warp_has_no_place() {
        let unlit = |second: f32| {
            map(4, 3, move |c, r| match (c, r) {
                (3, 2) => [f32::NAN, second, f32::NAN],
                _ => [c as f32 * 0.3, r as f32 * 0.4, f32::NAN],
            })
        };
        let (_keep, path) = written("wall.pfm", &unlit(f32::NAN));
        let mesh = read_warp(&path, 1.0).expect("a warp");
        // The node itself, and the border that would be carried on from it: above, aside and at the corner.
        let dark: Vec<usize> = (0..mesh.nodes.len())
            .filter(|&k| mesh.nodes[k].share < 0.0)
            .collect();
        assert_eq!(dark, [22, 23, 28, 29]);
        assert_eq!(mesh.triangles().count(), 2 * 5 * 4 - 8);
        let finite = |node: &crate::OutputNode| node.target.iter().all(|x| x.is_finite());
        assert!(mesh.nodes.iter().all(finite));
        let (_keep, path) = written("half.pfm", &unlit(0.5));
        let fault = read_warp(&path, 1.0).expect_err("refused").to_string();
        assert!(fault.contains("at column 3, row 2"), "{fault}");
        let (_keep, path) = written("dark.pfm", &map(4, 3, |_, _| [f32::NAN; 3]));
        let fault = read_warp(&path, 1.0).expect_err("refused").to_string();
        assert!(fault.contains("draws nothing"), "{fault}");
    }

    #[test]
    fn a_fold_is_told_with_its_line_or_place() {
        let mesh =
            "2\n3 2\n-1 -1 0 0 1\n0 -1 0.5 0 1\n1 -1 1 0 1\n-1 1 0 1 1\n0 1 0.9 1 1\n1 1 0.2 1 1\n";
        let (_keep, path) = written("warp.data", mesh.as_bytes());
        let fault = read_warp(&path, 1.0).expect_err("folds");
        assert!(
            fault.line.is_some() && fault.text.contains("folds over"),
            "{fault}"
        );
        let points = map(4, 3, |c, r| [[0.0, 1.0, 0.4, 2.0][c], 0.0, r as f32]);
        let (_keep, path) = written("wall.pfm", &points);
        let fault = read_surface(&path).expect_err("folds").to_string();
        assert!(
            fault.contains("column 2") && fault.contains("folds back"),
            "{fault}"
        );
    }

    #[test]
    fn a_file_that_is_not_there_or_a_folder_says_what_to_do() {
        let folder = tempfile::tempdir().expect("a folder");
        let missing = read_surface(&folder.path().join("none.pfm")).expect_err("missing");
        assert!(missing.text.contains("put the file there"), "{missing}");
        assert!(read_blend(folder.path(), 1.0).is_err());
    }

    proptest::proptest! {
        #[test]
        fn a_file_with_any_bytes_changed_is_read_or_refused(
            places in proptest::collection::vec((0_usize..140, proptest::prelude::any::<u8>()), 0..6),
            kept in 0_usize..160,
        ) {
            let mut files = [
                map(3, 3, |c, r| [c as f32 / 3.0, r as f32 / 3.0, 0.0]),
                b"2\n2 2\n-1 -1 0 0 1\n1 -1 1 0 1\n-1 1 0 1 1\n1 1 1 1 1\n".to_vec(),
            ];
            for (file, name) in files.iter_mut().zip(["a.pfm", "a.data"]) {
                for (place, byte) in &places {
                    if let Some(at) = file.get_mut(*place) {
                        *at = *byte;
                    }
                }
                file.truncate(kept);
                let (_keep, path) = written(name, file);
                if let Ok(mesh) = read_warp(&path, 1.0) {
                    let finite = mesh.nodes.iter().all(|node| {
                        node.target.iter().chain(&node.place).all(|value| value.is_finite())
                    });
                    proptest::prop_assert!(finite);
                }
                let _ = read_surface(&path); // it ends
            }
        }
    }

    #[test]
    fn names_stay_in_their_folder_and_mpcdi_is_refused_by_name() {
        let pfm = |name: &str| file_name_fault(name, &["pfm"]);
        assert_eq!(pfm("front.pfm"), None);
        assert_eq!(pfm("./screens/front.PFM"), None);
        for name in ["../front.pfm", "/etc/front.pfm", "a/../../b.pfm", ""] {
            assert!(
                pfm(name).is_some_and(|fault| fault.contains("within the folder")),
                "{name}"
            );
        }
        assert!(pfm("all.mpcdi").is_some_and(|fault| fault.contains("MPCDI archive")));
        assert!(pfm("front.txt").is_some_and(|fault| fault.contains("must end in .pfm")));
    }
}
