//! `check` tells surfaces that are felt as they are meant from those that are not.

use god_object::geometry::self_contact;
use god_object::{Mesh, geometry::one_sided_distance};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use taut_scene::shapes::{cuboid, sphere};
use taut_scene::{FileReport, ImportRequest, RawMesh, import, write_ply};

use crate::support::{Folder, assert_says, joined};

/// Numbers between 0 and 1, the same every time.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn turn(&mut self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(6.0 * self.next(), 3.0 * self.next(), 6.0 * self.next())
    }
}

fn checked(mesh: &RawMesh) -> FileReport {
    Folder::new().check("a.ply", write_ply(mesh))
}

fn placed(mut mesh: RawMesh, turn: UnitQuaternion<f64>, way: Vector3<f64>) -> RawMesh {
    mesh.vertices.iter_mut().for_each(|v| *v = turn * *v + way);
    mesh
}

fn turned(mut mesh: RawMesh) -> RawMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    mesh
}

/// A prism over a figure of eight; the second lobe is inside out, and smaller.
fn eight(lobes: [f64; 2], sides: usize, rings: usize, height: f64) -> RawMesh {
    let place = |i: usize| {
        let t = (i as f64 + 0.3) / sides as f64 * std::f64::consts::TAU;
        let size = if t.cos() > 0.0 { lobes[0] } else { lobes[1] };
        [size * t.cos(), size * t.sin() * t.cos()]
    };
    let mut mesh = RawMesh::default();
    for ring in 0..=rings {
        let z = height * ring as f64 / rings as f64;
        let points = (0..sides).map(place).map(|[x, y]| Point3::new(x, y, z));
        mesh.vertices.extend(points);
    }
    let (bottom, top) = (mesh.vertices.len() as u32, mesh.vertices.len() as u32 + 1);
    mesh.vertices
        .extend([Point3::origin(), Point3::new(0.0, 0.0, height)]);
    let at = |ring: usize, i: usize| (ring * sides + i % sides) as u32;
    for i in 0..sides {
        for ring in 0..rings {
            let [a, b] = [at(ring, i), at(ring, i + 1)];
            let [d, c] = [at(ring + 1, i), at(ring + 1, i + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        mesh.triangles.push([bottom, at(0, i + 1), at(0, i)]);
        mesh.triangles.push([top, at(rings, i), at(rings, i + 1)]);
    }
    mesh
}

/// A ball twisted flat at `share` of its radius from the middle: what is beyond is inside out.
fn bow(radius: f64, subdivisions: u32, share: f64) -> RawMesh {
    let mut mesh = sphere(radius, subdivisions);
    for v in &mut mesh.vertices {
        v.y *= v.x / radius + share;
    }
    mesh
}

#[test]
fn a_lobe_that_is_inside_out_is_a_fault_with_its_place() {
    let mut numbers = Numbers(1);
    for case in 0..24 {
        let size = [0.002, 0.03, 0.5][case % 3];
        let share = 0.3 + 0.5 * numbers.next();
        let mesh = if case % 2 == 0 {
            let sides = 8 + 4 * (case % 5);
            eight([size, share * size], sides, 1 + case % 4, size)
        } else {
            bow(size, 2 + case as u32 % 3, share)
        };
        let mesh = placed(mesh, numbers.turn(), Vector3::repeat(size * numbers.next()));
        let report = checked(&mesh);
        let figures = report.mesh.as_ref().unwrap();
        assert!(figures.volume_m3 > 0.0 && figures.watertight, "{report}");
        let told = &report.problems[0].text;
        assert!(
            report.problems.len() == 1 && told.contains("is inside out beside it"),
            "{case}: {report}"
        );
        let folder = Folder::new();
        folder.write("a.ply", write_ply(&mesh));
        let request = ImportRequest {
            obstacles_only: true,
            ..folder.request(&["a.ply"])
        };
        let refused = import(&request).unwrap_err();
        assert_says(&refused, "is inside out beside it");
        assert!(!request.folder.exists());
    }
}

#[test]
fn outward_bodies_that_overlap_are_a_note() {
    let mut numbers = Numbers(2);
    for case in 0..24 {
        let size = [0.002, 0.03, 0.5][case % 3];
        let way = Vector3::new(numbers.next(), numbers.next(), numbers.next()) * size;
        let other = if case % 2 == 0 {
            sphere(size, 1 + case as u32 % 4)
        } else {
            cuboid([size, 0.7 * size, 0.4 * size])
        };
        let third = placed(sphere(0.8 * size, 2), numbers.turn(), -way);
        let one = cuboid([size, 0.6 * size, 0.5 * size]);
        let mesh = joined([one, placed(other, numbers.turn(), way), third]);
        let report = checked(&mesh);
        assert!(report.is_good(), "{case}: {report}");
        let told = report.notes.iter();
        assert!(
            told.clone()
                .any(|note| note.contains("runs through itself")),
            "{case}: {report}"
        );
    }
    let apart = joined([
        cuboid([0.1; 3]),
        placed(
            cuboid([0.1; 3]),
            UnitQuaternion::identity(),
            Vector3::x() * 0.3,
        ),
    ]);
    let report = checked(&apart);
    assert!(report.is_good() && report.mesh.unwrap().meeting.is_none());
}

/// Bodies one within the other, outward and inward by turns, but for the one of number `wrong`.
fn nested(count: usize, wrong: Option<usize>, numbers: &mut Numbers) -> RawMesh {
    let mut size = 0.1;
    joined((0..count).map(|depth| {
        let form = if numbers.next() < 0.5 {
            cuboid([size; 3])
        } else {
            sphere(size, 2)
        };
        size *= 0.4;
        let way = Vector3::repeat(0.2 * size * numbers.next());
        let form = placed(form, numbers.turn(), way);
        let inward = (depth % 2 == 1) != (wrong == Some(depth));
        if inward { turned(form) } else { form }
    }))
}

#[test]
fn walls_of_cavities_and_bodies_in_them_look_the_right_way() {
    let mut numbers = Numbers(3);
    for count in 1..6 {
        let report = checked(&nested(count, None, &mut numbers));
        assert!(report.is_good(), "{report}");
        for wrong in 0..count {
            let report = checked(&nested(count, Some(wrong), &mut numbers));
            let expected = if wrong % 2 == 1 {
                "looks outward, though it is the wall of a cavity"
            } else {
                "is inside out"
            };
            assert!(
                report.problems.len() == 1 && report.problems[0].text.contains(expected),
                "{wrong} of {count}: {report}"
            );
            assert!(!report.mesh.unwrap().oriented);
        }
    }
}

#[test]
fn open_edges_and_parts_inside_out_are_told_together() {
    let mut numbers = Numbers(4);
    for subdivisions in 1..4 {
        let mut open = placed(
            sphere(0.1, subdivisions),
            numbers.turn(),
            Vector3::x() * 0.3,
        );
        open.triangles.pop();
        let ball = sphere(0.1, subdivisions);
        let told = |mesh: &RawMesh| {
            let report = checked(mesh);
            let texts = report.problems.iter().map(|p| p.text.clone());
            (texts.collect::<Vec<_>>(), report.mesh.unwrap().oriented)
        };
        let (texts, oriented) = told(&joined([ball.clone(), open.clone()]));
        assert!(texts.len() == 1 && oriented, "{texts:?}");
        for mesh in [
            joined([turned(ball.clone()), open.clone()]),
            joined([ball, turned(open)]),
        ] {
            let (texts, oriented) = told(&mesh);
            assert!(
                texts.len() == 2
                    && !oriented
                    && texts[0].contains("edges have one triangle only")
                    && texts[1].contains("is inside out"),
                "{texts:?}"
            );
        }
    }
}

#[test]
fn a_distance_is_told_from_a_limit_just_beside_it() {
    let mesh = |half: f64| {
        let raw = cuboid([half; 3]);
        Mesh::new(raw.vertices, raw.triangles).unwrap()
    };
    let (small, large) = (mesh(0.1), mesh(0.11));
    let farthest = 0.01 * 3_f64.sqrt();
    for share in [1.001, 1.01, 1.049, 1.2] {
        let found = one_sided_distance(&large, &small, farthest * share, |_| {});
        assert!(
            found.at_least <= farthest && found.at_most <= farthest * share,
            "{share}: {found:?}"
        );
        let found = one_sided_distance(&large, &small, farthest / share, |_| {});
        assert!(found.at_most.is_infinite() && found.at_least > farthest / share);
    }
}

#[test]
fn a_touch_without_a_crossing_is_no_inverted_lobe() {
    let stacked = joined([
        cuboid([0.1, 0.1, 0.05]),
        placed(
            cuboid([0.05; 3]),
            UnitQuaternion::identity(),
            Vector3::z() * 0.1,
        ),
    ]);
    let mesh = Mesh::new(stacked.vertices, stacked.triangles).unwrap();
    let contact = self_contact(&mesh, |_| {}).unwrap();
    assert_eq!(contact.inverted, None);
}

#[test]
fn what_is_judged_of_a_body_is_what_is_felt_and_not_what_is_drawn() {
    let folder = Folder::new();
    folder.write("eight.ply", write_ply(&eight([0.03, 0.02], 8, 2, 0.05)));
    folder.write("box.ply", write_ply(&cuboid([0.02, 0.02, 0.02])));
    folder.write("sheet.obj", "v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nf 1 2 3\n");
    let scene = |felt: &str, drawn: &str| {
        format!(
            "name = \"a\"\n[god_object]\nmass = 1.0\nshape = {{ sphere = {{ radius = 0.01 }} }}\n\
             pose = {{ position = [0.0, 0.0, 0.5] }}\n[[obstacle]]\nname = \"part\"\n\
             shape = {{ mesh = \"{felt}\" }}\nvisual = {{ mesh = \"{drawn}\" }}\n"
        )
    };
    for drawn in ["sheet.obj", "eight.ply"] {
        let report = folder.check("good.toml", scene("box.ply", drawn));
        assert!(report.is_good(), "{report}");
        assert_says(&report, "part 12");
    }
    let report = folder.check("bad.toml", scene("eight.ply", "box.ply"));
    assert_says(&report, "inside out");
    // The same where the scene has another fault.
    let faulty = scene("eight.ply", "none.obj") + "speed = 1\n";
    let all = folder.check("faulty.toml", faulty).to_string();
    for part in ["`speed`", "inside out", "none.obj"] {
        assert!(all.contains(part), "{part}: {all}");
    }
}
