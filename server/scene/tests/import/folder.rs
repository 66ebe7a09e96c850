//! What an import writes: a folder that can be used at once, or nothing.

use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::{Pose, linear};
use god_object::{Coupling, GodObject};
use taut_scene::{ImportRequest, UpAxis, check, import, import_unless};

use super::solids::{Soup, moved, part, scaled};
use super::write::{glb, ply, stl};
use crate::support::{Folder, assert_says, built};

fn parts(files: &[(&str, &Soup)]) -> Folder {
    let folder = Folder::new();
    for (name, soup) in files {
        folder.write(name, ply(soup));
    }
    folder
}

fn entries(folder: &Folder) -> usize {
    std::fs::read_dir(folder.path("")).unwrap().count()
}

#[test]
fn the_scene_passes_the_check_and_keeps_the_places_of_the_parts() {
    let parts = parts(&[
        ("peg.ply", &part()),
        ("hole.ply", &moved(part(), [0.1, 0.0, 0.0])),
    ]);
    let report = import(&parts.request(&["peg.ply", "hole.ply"])).unwrap();
    let checked = check(&[&report.scene]).remove(0);
    assert!(checked.is_good(), "{checked}");
    let built = built(&report.scene);
    assert_eq!(built.start.translation.vector, Vector3::zeros());
    assert_eq!(built.name, "out");
    let obstacle = &built.bodies[1];
    assert_eq!(obstacle.name, "hole");
    assert_eq!(obstacle.mesh.bounds().unwrap().0.x, 0.07);
    let text = std::fs::read_to_string(parts.path("out/import.txt")).unwrap();
    assert_eq!(text, format!("{report}\n"));
}

#[test]
fn a_part_that_touches_the_others_begins_above_them() {
    let parts = parts(&[
        ("a.ply", &part()),
        ("b.ply", &moved(part(), [0.02, 0.0, 0.0])),
    ]);
    let report = import(&parts.request(&["a.ply", "b.ply"])).unwrap();
    let start = built(&report.scene).start;
    assert!(start.translation.z > 0.02, "{start}");
    assert!(report.notes[0].contains("touch or overlap"), "{report}");
}

#[test]
fn all_parts_stand_below_a_sphere_where_that_is_asked() {
    let parts = parts(&[("a.ply", &part())]);
    let request = ImportRequest {
        obstacles_only: true,
        ..parts.request(&["a.ply"])
    };
    let report = import(&request).unwrap();
    let built = built(&report.scene);
    assert!(built.world.body.primitive.is_some());
    assert_eq!(built.bodies[1].name, "a");
}

/// Largest force, N, and farthest way behind the hand, in shares of the body's size, along the straight ways between the via points of an imported scene.
fn felt_on_the_way(scene: &str) -> [f64; 2] {
    let built = built(scene);
    let hand = built.hand.as_ref().expect("a hand");
    let via = hand.path.samples();
    let between = |a: &Pose, b: &Pose| (a.translation.vector - b.translation.vector).norm();
    assert!(between(&via[0].pose, &built.start) < 1e-6 * built.size);
    let world = std::sync::Arc::new(built.world.clone());
    let mut god_object = GodObject::new(world, built.settings, built.start).unwrap();
    let mut coupling = Coupling::new(&built.world, &built.settings);
    let mut felt = [0.0_f64; 2];
    for (k, leg) in via.windows(2).enumerate() {
        for step in 1..=200 {
            let device = leg[0]
                .pose
                .lerp_slerp(&leg[1].pose, f64::from(step) / 200.0);
            god_object.step(&device, None);
            let time = k as f64 + f64::from(step) * 5e-3;
            let output = coupling.step(time, &device, god_object.constraint_set());
            felt[0] = felt[0].max(linear(&output.wrench).norm());
            felt[1] = felt[1].max(between(&device, god_object.pose()) / built.size);
        }
    }
    felt
}

/// A part in the hand beside others and on them, and a sphere over one; small, as they are, and large.
#[test]
fn a_simulated_hand_meets_what_was_imported() {
    for size in [0.05, 1.0, 20.0] {
        let beside = moved(part(), [0.1, 0.0, 0.0]);
        let on = moved(part(), [0.02, 0.0, 0.0]);
        for (other, obstacles_only) in [(beside, false), (on.clone(), false), (on, true)] {
            let parts = parts(&[
                ("a.ply", &scaled(part(), size)),
                ("b.ply", &scaled(other, size)),
            ]);
            let request = ImportRequest {
                obstacles_only,
                ..parts.request(&["a.ply", "b.ply"])
            };
            let report = import(&request).unwrap();
            let note = report.notes.last().expect("a note");
            assert!(
                note.contains("hand.csv") && note.contains("against"),
                "{note}"
            );
            let [force, behind] = felt_on_the_way(&report.scene);
            println!("{size}: {force} N, behind by {behind}");
            assert!((0.1..40.0).contains(&force), "{size}: {force} N");
            assert!((0.005..2.0).contains(&behind), "{size}: {behind}");
        }
    }
}

#[test]
fn a_folder_that_exists_is_refused_by_name_and_left_as_it_is() {
    let parts = parts(&[("a.ply", &part())]);
    std::fs::create_dir(parts.path("out")).unwrap();
    let error = import(&parts.request(&["a.ply"])).unwrap_err().to_string();
    assert_says(&error, "out: exists already");
    assert_eq!(std::fs::read_dir(parts.path("out")).unwrap().count(), 0);
    let nowhere = ImportRequest {
        folder: parts.path("no/such/out"),
        ..parts.request(&["a.ply"])
    };
    let error = import(&nowhere).unwrap_err().to_string();
    assert_says(&error, "cannot be made");
}

#[test]
fn faults_of_all_parts_are_told_at_once_and_nothing_is_left() {
    let parts = parts(&[("mm.ply", &scaled(part(), 1e3)), ("good.ply", &part())]);
    let request = parts.request(&["mm.ply", "good.ply", "missing.ply"]);
    let before = entries(&parts);
    let error = import(&request).unwrap_err();
    assert_eq!(error.problems().len(), 2, "{:?}", error.problems());
    assert!(error.problems()[0].file.ends_with("mm.ply"));
    assert_eq!(entries(&parts), before);
}

#[test]
fn the_report_can_be_copied_and_a_thin_part_has_a_thickness() {
    let thin: Soup = part()
        .into_iter()
        .map(|t| t.map(|[x, y, z]| [x, y, z * 1e-4]))
        .collect();
    let parts = parts(&[("a.ply", &thin)]);
    let request = ImportRequest {
        folder: parts.path("my part"),
        unit: Some("m".parse().unwrap()),
        ..parts.request(&["a.ply"])
    };
    let text = import(&request).unwrap().to_string();
    assert_says(&text, "0.0600 x 0.0400 x 2.000e-6 m,");
    assert!(text.ends_with("my part/scene.toml'"), "{text}");
}

#[test]
fn an_import_that_is_interrupted_leaves_nothing() {
    let parts = parts(&[
        ("a.ply", &part()),
        ("b.ply", &moved(part(), [0.1, 0.0, 0.0])),
    ]);
    let request = parts.request(&["a.ply", "b.ply"]);
    let before = entries(&parts);
    let mut asked = 0;
    for end in 1.. {
        asked = 0;
        let outcome = import_unless(&request, &mut || {
            asked += 1;
            asked == end
        });
        if outcome.is_ok() {
            break;
        }
        let error = outcome.unwrap_err().to_string();
        assert!(
            error.ends_with("out: the import was interrupted; nothing was written"),
            "{error}"
        );
        assert_eq!(entries(&parts), before);
    }
    assert!(asked >= 4, "asked {asked} times");
}

#[test]
fn names_that_would_be_the_same_are_told_apart() {
    let parts = parts(&[
        ("a b.ply", &part()),
        ("god-object.ply", &moved(part(), [0.1, 0.0, 0.0])),
    ]);
    parts.write("A-B.stl", stl(&moved(part(), [0.2, 0.0, 0.0])));
    parts.write("coupling.ply", ply(&moved(part(), [0.3, 0.0, 0.0])));
    let names = ["a b.ply", "god-object.ply", "A-B.stl", "coupling.ply"];
    let report = import(&parts.request(&names)).unwrap();
    let files: Vec<&str> = report.parts.iter().map(|p| p.mesh_file.as_str()).collect();
    let written = ["a-b.ply", "god-object-2.ply", "A-B-2.ply", "coupling-2.ply"];
    assert_eq!(files, written);
}

/// From 3 to 7 cm along the y axis of the file.
#[test]
fn what_is_up_in_the_files_is_up_in_the_scene_where_that_is_said() {
    let parts = Folder::new();
    parts.write("a.glb", glb(&moved(part(), [0.0, 0.05, 0.0])));
    let lying = [[-0.03, 0.03, -0.01], [0.03, 0.07, 0.01]];
    let upright = [[-0.03, -0.01, 0.03], [0.03, 0.01, 0.07]];
    for (out, up, expected) in [
        ("unsaid", None, lying),
        ("z", Some(UpAxis::Z), lying),
        ("y", Some(UpAxis::Y), upright),
    ] {
        let request = ImportRequest {
            up,
            folder: parts.path(out),
            ..parts.request(&["a.glb"])
        };
        let report = import(&request).unwrap();
        let (low, high) = built(&report.scene).bodies[0].mesh.bounds().unwrap();
        for (corner, meant) in [low, high].into_iter().zip(expected) {
            let off = (corner - Point3::from(meant)).amax();
            assert!(off < 1e-7, "{out}: {corner}");
        }
        assert!(report.parts[0].mesh.volume_m3 > 0.0, "{report}");
        let hint = report.notes.iter().any(|note| note.contains("--up y"));
        assert_eq!(hint, up.is_none(), "{report}");
    }
}

#[test]
fn a_place_is_told_in_metres_of_the_part() {
    let overlapping: Soup = [part(), moved(part(), [0.03, 0.02, 0.01])].concat();
    let parts = parts(&[("a.ply", &overlapping)]);
    let report = import(&parts.request(&["a.ply"])).unwrap();
    let finding = report.parts[0]
        .all_findings()
        .find(|f| f.kind == "meets-itself")
        .unwrap();
    // The boxes meet along the outline of [0, 0.03] x [0, 0.02] x [0, 0.01].
    let [x, y, z] = finding.places_m[0];
    let on_both = |c: f64, half: f64| (-1e-9..=half + 1e-9).contains(&c);
    assert!(
        on_both(x, 0.03) && on_both(y, 0.02) && on_both(z, 0.01),
        "{finding}"
    );
    assert_says(&report, "NOT MENDED");
}

/// A body that begins above them moves the middle by some centimetres.
#[test]
fn parts_far_from_the_origin_are_shown_in_the_middle_of_the_workbench() {
    for way in [[0.0; 3], [5.0, -3.0, 2.0], [-0.4, 0.7, -0.2]] {
        let parts = parts(&[("a.ply", &moved(part(), way))]);
        for obstacles_only in [false, true] {
            let request = ImportRequest {
                obstacles_only,
                folder: parts.path(&format!("out-{obstacles_only}")),
                ..parts.request(&["a.ply"])
            };
            let report = import(&request).unwrap();
            let built = built(&report.scene);
            let view = built.view;
            let (origin, body) = (view.origin.unwrap(), usize::from(obstacles_only));
            let (low, high) = built.bodies[body].mesh.bounds().unwrap();
            let seen = [0, 1, 2].map(|k| origin[k] + view.display_scale * 0.5 * (low[k] + high[k]));
            assert!(seen[0].abs() < 1e-3, "{seen:?}");
            assert!((seen[1] + 0.45).abs() < 1e-3, "{seen:?}");
            assert!((seen[2] - 0.25).abs() < 0.05, "{seen:?}");
        }
    }
}
