//! Several files that become one body.

use std::ffi::OsStr;
use std::path::Path;

use taut_scene::{ImportPart, ImportReport, ImportRequest, UpAxis, import};

use super::judge::{judge, one_sided};
use super::solids::{HALF, Noise, Soup, VOLUME, cuboid, flipped, mapped, moved, part, scaled};
use super::write::{glb, obj_soup, ply, stl};
use crate::support::{Folder, assert_says, built};

impl Folder {
    /// Imports words of the command line, all standing, into a folder of this name.
    pub(super) fn words(&self, words: &[&str], out: &str) -> ImportRequest {
        let named = |word: &&str| {
            let (body, file) = word.split_once('=').unwrap_or(("", word));
            let path = self.path(file);
            let equals = if body.is_empty() { "" } else { "=" };
            ImportPart::named(OsStr::new(&format!("{body}{equals}{}", path.display())))
        };
        ImportRequest {
            parts: words.iter().map(named).collect(),
            folder: self.path(out),
            obstacles_only: true,
            ..ImportRequest::default()
        }
    }
}

pub(super) fn volumes(report: &ImportReport, body: usize) -> (Vec<f64>, Soup) {
    let folder = Path::new(&report.folder);
    let verdict = judge(&folder.join(&report.parts[body].mesh_file));
    assert!(verdict.closed, "{report}");
    (verdict.volumes, verdict.soup)
}

pub(super) fn kinds(report: &ImportReport, body: usize) -> Vec<&'static str> {
    let findings = report.parts[body].all_findings();
    findings.map(|finding| finding.kind).collect()
}

/// Boxes in four formats, three units and two ideas of up, at places of their own in the scene.
#[test]
fn files_of_any_format_unit_and_up_become_one_body() {
    let mut noise = Noise::new();
    for round in 0..6 {
        let mut place = |k: usize| {
            let mut aside = || 0.002 * noise.next();
            [0.1 * (k as f64 - 1.5) + aside(), aside(), aside()]
        };
        let meant: Vec<Soup> = (0..4).map(|k| moved(part(), place(k))).collect();
        let folder = Folder::new();
        // +z of the scene is +y of this file.
        let lying = mapped(meant[2].clone(), |[x, y, z]| [x, z, -y]);
        folder.write("a.stl", stl(&scaled(meant[0].clone(), 1e3)));
        folder.write("b.obj", obj_soup(&scaled(meant[1].clone(), 1.0 / 0.0254)));
        folder.write("c.glb", glb(&lying));
        folder.write("d.ply", ply(&scaled(meant[3].clone(), 1e2)));
        let mut words = ["all=a.stl", "all=b.obj", "all=c.glb", "all=d.ply"];
        words.rotate_left(round % 4);
        let mut request = folder.words(&words, "out");
        for part in &mut request.parts {
            let ending = part.path.extension().unwrap().to_str().unwrap();
            (part.unit, part.up) = match ending {
                "obj" => (Some("inch".parse().unwrap()), None),
                "glb" => (None, Some(UpAxis::Y)),
                "ply" => (Some("cm".parse().unwrap()), None),
                _ => (None, None),
            };
        }
        request.unit = Some("mm".parse().unwrap());
        let report = import(&request).unwrap();
        assert_eq!(
            (report.parts.len(), report.parts[0].body.as_str()),
            (1, "all")
        );
        let (volumes, soup) = volumes(&report, 0);
        assert_eq!(volumes.len(), 4);
        assert!(
            volumes.iter().all(|v| (v / VOLUME - 1.0).abs() < 1e-5),
            "{volumes:?}"
        );
        let all = meant.concat();
        assert!(
            report
                .notes
                .iter()
                .all(|n| !n.contains("far from the origin"))
        );
        let apart = one_sided(&soup, &all).max(one_sided(&all, &soup));
        assert!(apart < 1e-7, "{apart}");
        assert_says(&report, "places above are those in the files");
        assert_says(&report, "b.obj: shared 28 vertices");
    }
}

/// Within a file faces that coincide are taken out; between two nothing is merged, and the touch is said.
#[test]
fn nothing_is_merged_between_files() {
    let folder = Folder::new();
    folder.write("a.ply", ply(&part()));
    folder.write("b.ply", ply(&moved(part(), [2.0 * HALF[0], 0.0, 0.0])));
    let report = import(&folder.words(&["x=a.ply", "x=b.ply"], "out")).unwrap();
    let (volumes, _) = volumes(&report, 0);
    assert_eq!(volumes.len(), 2, "{report}");
    assert_eq!(kinds(&report, 0), ["meets-itself"]);
    assert_says(&report, "NOT MENDED");
    // Bodies of their own do not meet themselves.
    let report = import(&folder.words(&["x=a.ply", "y=b.ply"], "two")).unwrap();
    assert_eq!((report.parts.len(), kinds(&report, 1)), (2, vec![]));
}

/// A box of half the size in a box, each way round, and one in that: wall of a cavity, and a core.
#[test]
fn nesting_is_judged_of_all_files_together() {
    let nested = [1.0, 0.5, 0.25].map(|size| cuboid(HALF.map(|half| size * half)));
    let whole = [VOLUME, VOLUME / 8.0, VOLUME / 64.0];
    for turned in 0..8_u8 {
        for count in 2..=3 {
            let folder = Folder::new();
            let mut words: Vec<String> = Vec::new();
            for (k, soup) in nested.iter().take(count).enumerate() {
                let is_turned = turned >> k & 1 == 1;
                let soup = if is_turned {
                    flipped(soup.clone())
                } else {
                    soup.clone()
                };
                folder.write(&format!("{k}.ply"), ply(&soup));
                words.insert(0, format!("x={k}.ply"));
            }
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let report = import(&folder.words(&words, "out")).unwrap();
            let (mut found, _) = volumes(&report, 0);
            found.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
            let expected = [whole[0], -whole[1], whole[2]];
            assert_eq!(found.len(), count);
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found / expected - 1.0).abs() < 1e-9,
                    "{turned}: {found} {expected}"
                );
            }
            assert!(kinds(&report, 0).contains(&"cavities"), "{report}");
            assert!((report.parts[0].mesh.volume_m3 - found.iter().sum::<f64>()).abs() < 1e-15);
        }
    }
}

pub(super) const TWO_LOOKS: &str = "newmtl m0\nKd 1 0 0\nnewmtl m1\nKd 0 1 0\n";

/// A box as OBJ with these materials, by turns.
fn coloured(soup: &Soup, materials: &[&str]) -> String {
    let mut text = String::from("mtllib looks.mtl\n");
    for [x, y, z] in soup.iter().flatten() {
        text += &format!("v {x} {y} {z}\n");
    }
    for t in 0..soup.len() {
        let material = materials[t % materials.len()];
        let [a, b, c] = [1, 2, 3].map(|k| 3 * t + k);
        text += &format!("usemtl {material}\nf {a} {b} {c}\n");
    }
    text
}

/// How many triangles of what is drawn have each red, green and blue; none where a material says nothing.
fn drawn(report: &ImportReport, body: usize) -> Vec<(Option<[f32; 3]>, usize)> {
    let mut counts: Vec<(Option<[f32; 3]>, usize)> = Vec::new();
    for (look, count) in &built(&report.scene).bodies[body + 1].looks {
        match counts.iter_mut().find(|(color, _)| *color == look.color) {
            Some((_, all)) => *all += count,
            None => counts.push((look.color, *count)),
        }
    }
    counts.sort_by_key(|(color, _)| color.map(|c| c.map(f32::to_bits)));
    counts
}

#[test]
fn each_file_keeps_its_looks() {
    let (red, green) = (Some([1.0, 0.0, 0.0]), Some([0.0, 1.0, 0.0]));
    let folder = Folder::new();
    folder.write("looks.mtl", TWO_LOOKS);
    let aside = |k: f64| moved(part(), [0.1 * k, 0.0, 0.0]);
    folder.write("two.obj", coloured(&aside(1.0), &["m0", "m1"]));
    folder.write("red.obj", coloured(&aside(2.0), &["m0"]));
    folder.write(
        "inside-out.obj",
        coloured(&flipped(aside(3.0)), &["m1", "m1", "m0"]),
    );
    folder.write("plain.stl", stl(&aside(4.0)));
    // Colours of one file, colours of each, a file without any.
    for (words, expected) in [
        (&["x=two.obj", "x=red.obj"][..], vec![(green, 6), (red, 18)]),
        (&["x=red.obj", "x=plain.stl"], vec![(None, 12), (red, 12)]),
        (
            &["x=two.obj", "x=plain.stl"],
            vec![(None, 12), (green, 6), (red, 6)],
        ),
        // Its faces were turned: it is drawn as it is felt, in the colour of its largest area.
        (
            &["x=two.obj", "x=inside-out.obj"],
            vec![(green, 18), (red, 6)],
        ),
        (&["x=red.obj", "x=red.obj"], vec![]),
    ] {
        let out = format!("out-{}", words.join("-"));
        let report = import(&folder.words(words, &out)).unwrap();
        let mut expected = expected;
        expected.sort_by_key(|(color, _)| color.map(|c: [f32; 3]| c.map(f32::to_bits)));
        assert_eq!(drawn(&report, 0), expected, "{words:?}: {report}");
        let lost = report.to_string().contains("of its look is not drawn: of ");
        assert_eq!(lost, words.contains(&"x=inside-out.obj"), "{report}");
        // What is drawn lies where what is felt does.
        let scene = built(&report.scene);
        let [low, high] = scene.world.obstacles[0].mesh.bounding_box();
        let seen = scene.bodies[1].mesh.bounds().unwrap();
        assert!((seen.0 - low).norm() < 1e-6 && (seen.1 - high).norm() < 1e-6);
    }
}

#[test]
fn faults_of_all_files_of_a_body_are_told_at_once() {
    let folder = Folder::new();
    folder.write("good.ply", ply(&part()));
    folder.write("mm.ply", ply(&scaled(part(), 1e3)));
    let request = folder.words(&["x=good.ply", "x=mm.ply", "x=none.ply"], "out");
    let error = import(&request).unwrap_err();
    let files: Vec<&str> = error.problems().iter().map(|p| p.file.as_str()).collect();
    assert_eq!(files.len(), 2, "{error}");
    assert!(files[0].ends_with("mm.ply") && files[1].ends_with("none.ply"));
    assert!(!request.folder.exists());
}
