//! Meshes with no more triangles than a scene needs: closed, not through themselves, and as near as is said.

use god_object::Mesh;
use god_object::geometry::{nearest_on_mesh, one_sided_distance, self_intersection};
use nalgebra::{Point3, Vector3};
use taut_scene::shapes::{Axis, capsule, cuboid, sphere};
use taut_scene::{BuiltScene, RawMesh, data_file, write_ply};

use crate::support::{Folder, assert_says, joined, quartered};

fn built(mesh: &RawMesh, max_error: f64) -> BuiltScene {
    let folder = Folder::new();
    folder.write("a.ply", write_ply(mesh));
    folder.build(&text(max_error)).unwrap()
}

fn text(max_error: f64) -> String {
    format!(
        "name = \"s\"\n[god_object]\nshape = {{ sphere = {{ radius = 0.01 }} }}\nmass = 1.0\npose = {{ position = [0.0, 0.0, 1.0] }}\n\
         [[obstacle]]\nname = \"a\"\nshape = {{ mesh = \"a.ply\", simplify = {{ max_error = {max_error} }} }}\n"
    )
}

fn mesh(raw: &RawMesh) -> Mesh {
    Mesh::new(raw.vertices.clone(), raw.triangles.clone()).unwrap()
}

/// Largest distance of a dense set of points of `from` to `to`: below any true bound.
fn sampled(from: &Mesh, to: &Mesh) -> f64 {
    let mut farthest: f64 = 0.0;
    for t in 0..from.triangles().len() as u32 {
        let [a, b, c] = from.corners(t);
        for i in 0..=6 {
            for j in 0..=6 - i {
                let (u, v) = (f64::from(i) / 6.0, f64::from(j) / 6.0);
                let p = a + (b - a) * u + (c - a) * v;
                // Every triangle, without the tree.
                let nearest = (0..to.triangles().len() as u32)
                    .map(|k| {
                        let q =
                            god_object::geometry::distance::closest_on_triangle(&p, &to.corners(k));
                        (q.point - p).norm()
                    })
                    .fold(f64::INFINITY, f64::min);
                farthest = farthest.max(nearest);
            }
        }
    }
    farthest
}

#[test]
fn a_finely_cut_box_becomes_twelve_triangles() {
    let n: u32 = 12;
    let mut cut = RawMesh::default();
    let mut face = |u: Vector3<f64>, v: Vector3<f64>| {
        let w = u.cross(&v);
        let first = cut.vertices.len() as u32;
        for i in 0..=n {
            for j in 0..=n {
                let [s, t] = [i, j].map(|k| 2.0 * f64::from(k) / f64::from(n) - 1.0);
                cut.vertices.push(Point3::from((u * s + v * t + w) * 0.05));
            }
        }
        for i in 0..n {
            for j in 0..n {
                let p = first + i * (n + 1) + j;
                let q = p + n + 1;
                cut.triangles.push([p, q, q + 1]);
                cut.triangles.push([p, q + 1, p + 1]);
            }
        }
    };
    for (u, v) in [(0, 1), (1, 2), (2, 0)] {
        let (u, v) = (Vector3::ith(u, 1.0), Vector3::ith(v, 1.0));
        face(u, v);
        face(v, u);
    }
    let raw = weld(&cut);
    let scene = built(&raw, 1e-5);
    let report = &scene.simplified[0];
    assert_eq!(report.triangles_before, 6 * 2 * 144);
    assert_eq!(report.triangles_after, 12, "{report}");
    assert!(
        report.to_original <= 1e-5 && report.from_original <= 1e-5,
        "{report}"
    );
}

fn weld(raw: &RawMesh) -> RawMesh {
    let mut vertices: Vec<Point3<f64>> = Vec::new();
    let place = |p: &Point3<f64>, vertices: &mut Vec<Point3<f64>>| {
        let known = vertices.iter().position(|v| (v - p).norm() < 1e-9);
        known.unwrap_or_else(|| {
            vertices.push(*p);
            vertices.len() - 1
        }) as u32
    };
    let triangles = raw
        .triangles
        .iter()
        .map(|t| t.map(|i| place(&raw.vertices[i as usize], &mut vertices)))
        .collect();
    RawMesh {
        vertices,
        triangles,
    }
}

#[test]
fn what_is_said_of_the_distance_holds_and_finer_limits_keep_more() {
    let raw = capsule(0.02, 0.03, 24, Axis::Y);
    let original = mesh(&raw);
    let mut last = 0;
    for max_error in [2e-3, 1e-3, 4e-4] {
        let scene = built(&raw, max_error);
        let report = &scene.simplified[0];
        let used = &scene.world.obstacles[0].mesh;
        assert_eq!(report.triangles_after, used.triangles().len());
        assert!(report.unchanged.is_none(), "{report}");
        assert!(report.triangles_after > last && report.triangles_after < report.triangles_before);
        last = report.triangles_after;
        assert!(
            report.to_original <= max_error && report.from_original <= max_error,
            "{report}"
        );
        let (there, back) = (sampled(used, &original), sampled(&original, used));
        assert!(
            there <= report.to_original && back <= report.from_original,
            "{there} {back}: {report}"
        );
        // The bound is worth something: not much above what is seen.
        assert!(
            report.from_original <= (1.1 * back).max(0.3 * max_error),
            "{back}: {report}"
        );
        assert_eq!(self_intersection(used), None);
    }
}

#[test]
fn distances_between_surfaces_have_their_closed_form() {
    let (small, large) = (mesh(&cuboid([0.1; 3])), mesh(&cuboid([0.11; 3])));
    let there = one_sided_distance(&small, &large, 1.0, |_| {});
    assert!(there.at_least <= 0.01 + 1e-12 && there.at_most >= 0.01 && there.at_most < 0.3);
    let there = one_sided_distance(&small, &large, 0.02, |_| {});
    assert!((0.01..0.0106).contains(&there.at_most), "{there:?}");
    let back = one_sided_distance(&large, &small, 0.02, |_| {});
    let corner = 0.01 * 3f64.sqrt();
    assert!(
        back.at_most >= corner && back.at_most < 1.06 * corner,
        "{back:?}"
    );
    // Beyond the limit it gives up and says so.
    let beyond = one_sided_distance(&large, &small, 0.015, |_| {});
    assert!(beyond.at_most.is_infinite() && beyond.at_least > 0.015);
    let nearest = nearest_on_mesh(&small, &Point3::new(0.15, 0.02, 0.01), 3);
    assert!((nearest.distance - 0.05).abs() < 1e-15);
}

/// Two cubes, the second so far from the first.
fn pair(half: f64, way: Vector3<f64>) -> Mesh {
    let mut other = cuboid([half; 3]);
    other.vertices.iter_mut().for_each(|v| *v += way);
    mesh(&joined([cuboid([half; 3]), other]))
}

#[test]
fn surfaces_that_run_through_themselves_are_found() {
    for sound in [cuboid([0.1; 3]), sphere(0.1, 3)] {
        assert_eq!(self_intersection(&mesh(&sound)), None);
    }
    let two = pair(0.1, Vector3::new(0.15, 0.03, 0.02));
    assert!(self_intersection(&two).is_some());
}

#[test]
fn what_cannot_be_simplified_is_used_as_it_is_and_said() {
    let scene = built(&cuboid([0.1; 3]), 1e-6);
    let report = &scene.simplified[0];
    assert_eq!((report.triangles_after, report.to_original), (12, 0.0));
    assert_says(&report, "not simplified");
}

#[test]
fn the_check_prints_triangles_and_distance() {
    let folder = Folder::new();
    folder.write("a.ply", write_ply(&sphere(0.05, 4)));
    let report = folder.check("s.toml", text(2e-4));
    assert!(report.is_good(), "{report}");
    assert!(
        report.summary.contains("a: simplified from 5120 to ")
            && report.summary.contains("(limit 2.000e-4 m)")
            && report.summary.contains("exact: god-object"),
        "{report}"
    );
}

#[test]
fn the_bunny_keeps_its_form_with_fewer_triangles() {
    let Some(path) = data_file("bunny_27k.ply") else {
        taut_test_kit::left_out("bunny_27k.ply is not in the data directory");
        return;
    };
    let raw = taut_scene::read_mesh(&path).unwrap();
    let scene = built(&raw, 1e-3);
    let report = &scene.simplified[0];
    println!("{report}");
    assert!(report.unchanged.is_none(), "{report}");
    assert!(
        report.triangles_after * 2 < report.triangles_before,
        "{report}"
    );
}

#[test]
fn faces_in_one_plane_to_rounding_do_not_run_through_themselves() {
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.7, 0.3, 0.2);
    let mut raw = quartered(cuboid([0.03, 0.02, 0.01]), 4);
    raw.vertices.iter_mut().for_each(|v| *v = turn * *v);
    assert_eq!(self_intersection(&mesh(&raw)), None);
}

#[test]
fn solids_that_touch_at_an_edge_or_a_vertex_do_not_run_through_each_other() {
    let meet = |way: [f64; 3]| self_intersection(&pair(0.01, way.into())).is_some();
    assert!(!meet([0.02, 0.02, 0.0]) && !meet([0.02; 3]));
    // With an edge in common, but one in the other.
    assert!(meet([0.01, 0.01, 0.0]) && meet([0.02, 0.01, 0.0]));
}
