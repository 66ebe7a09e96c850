//! Every generated mesh is closed, outward and has the documented number of triangles.

use std::collections::HashMap;

use god_object::Mesh;
use taut_scene::RawMesh;
use taut_scene::shapes::{Axis, box_with_hole, capsule, cuboid, cylinder, plane, sphere};

const AXES: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

/// Every edge once in each direction, and a positive volume: a check of its own, besides the method's.
fn volume_if_closed(mesh: &RawMesh) -> f64 {
    let mut sides: HashMap<(u32, u32), i32> = HashMap::new();
    let mut volume = 0.0;
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            assert_ne!(a, b);
            *sides.entry((a, b)).or_default() += 1;
        }
        let [a, b, c] = t.map(|i| mesh.vertices[i as usize].coords);
        volume += a.dot(&b.cross(&c)) / 6.0;
    }
    for (&(a, b), &count) in &sides {
        assert_eq!(count, 1, "edge {a} {b}");
        assert_eq!(
            sides.get(&(b, a)),
            Some(&1),
            "edge {a} {b} has no other side"
        );
    }
    Mesh::new(mesh.vertices.clone(), mesh.triangles.clone())
        .expect("the method takes every generated mesh");
    volume
}

fn assert_close(value: f64, expected: f64, relative: f64) {
    assert!(
        (value - expected).abs() <= relative * expected,
        "{value} is not {expected}"
    );
}

#[test]
fn the_box_has_12_triangles_and_its_volume() {
    let mesh = cuboid([0.1, 0.2, 0.3]);
    assert_eq!(mesh.triangles.len(), 12);
    assert_close(volume_if_closed(&mesh), 8.0 * 0.1 * 0.2 * 0.3, 1e-14);
}

#[test]
fn the_papers_peg_has_288_triangles_and_its_axis_where_asked() {
    for axis in AXES {
        let peg = cylinder(0.01, 0.03, 72, axis);
        assert_eq!(peg.triangles.len(), 288);
        let prism = 36.0 * 0.01f64.powi(2) * (std::f64::consts::TAU / 72.0).sin() * 0.06;
        assert_close(volume_if_closed(&peg), prism, 1e-12);
        let (low, high) = peg.bounds().unwrap();
        let along = axis.unit();
        assert!(((high - low).dot(&along) - 0.06).abs() < 1e-15);
        // Vertices lie along the directions across the axis, so the extent across is the full diameter.
        for across in AXES.into_iter().filter(|a| *a != axis) {
            assert!(((high - low).dot(&across.unit()) - 0.02).abs() < 1e-15);
        }
    }
}

#[test]
fn the_papers_box_has_280_triangles_and_an_exact_apothem() {
    for axis in AXES {
        let mesh = box_with_hole([0.03, 0.04, 0.05], 0.0105, 66, axis);
        assert_eq!(mesh.triangles.len(), 280);
        let long = [0.03, 0.04, 0.05]
            .iter()
            .zip(axis.unit().iter())
            .map(|(h, a)| 2.0 * h * a)
            .sum::<f64>();
        let polygon = 66.0 * 0.0105f64.powi(2) * (std::f64::consts::PI / 66.0).tan();
        let expected = 8.0 * 0.03 * 0.04 * 0.05 - polygon * long;
        assert_close(volume_if_closed(&mesh), expected, 1e-12);
        // No wall vertex is nearer to the axis than the apothem, and flats reach it.
        let across = |v: &nalgebra::Point3<f64>| {
            (v.coords - axis.unit() * v.coords.dot(&axis.unit())).norm()
        };
        let nearest = mesh
            .vertices
            .iter()
            .map(across)
            .fold(f64::INFINITY, f64::min);
        assert_close(nearest, 0.0105 / (std::f64::consts::PI / 66.0).cos(), 1e-12);
    }
}

#[test]
fn holes_of_any_number_of_sides_are_closed() {
    for facets in 8..80 {
        let mesh = box_with_hole([0.03, 0.03, 0.03], 0.02, facets, Axis::Y);
        assert_eq!(mesh.triangles.len(), 4 * facets + 16, "{facets}");
        volume_if_closed(&mesh);
    }
}

#[test]
fn the_sphere_has_20_times_4_to_the_k_triangles_on_it() {
    for subdivisions in 0..6 {
        let mesh = sphere(0.02, subdivisions);
        assert_eq!(mesh.triangles.len(), 20 * 4usize.pow(subdivisions));
        assert!(
            mesh.vertices
                .iter()
                .all(|v| (v.coords.norm() - 0.02).abs() < 1e-15)
        );
        volume_if_closed(&mesh);
        let deepest = mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize].coords);
            0.02 - a.dot(&(b - a).cross(&(c - a)).normalize())
        });
        // The documented bound.
        assert!(
            deepest.fold(0.0, f64::max) <= 0.3 * 0.02 / f64::from(4u32.pow(subdivisions)),
            "{subdivisions}"
        );
    }
}

#[test]
fn the_capsule_is_closed_and_lies_on_itself() {
    for axis in AXES {
        let mesh = capsule(0.01, 0.02, 48, axis);
        assert_eq!(mesh.triangles.len(), 2304);
        volume_if_closed(&mesh);
        for v in &mesh.vertices {
            let along = v.coords.dot(&axis.unit());
            let from_segment = (v.coords - axis.unit() * along.clamp(-0.02, 0.02)).norm();
            assert!((from_segment - 0.01).abs() < 1e-15);
        }
    }
    for facets in [8, 9, 10, 11, 13] {
        volume_if_closed(&capsule(0.01, 0.02, facets, Axis::Z));
    }
}

#[test]
fn the_planes_upper_face_holds_the_origin() {
    for axis in AXES {
        let mesh = plane(1.0, 0.1, axis);
        assert_close(volume_if_closed(&mesh), 0.1, 1e-12);
        let heights: Vec<f64> = mesh
            .vertices
            .iter()
            .map(|v| v.coords.dot(&axis.unit()))
            .collect();
        assert_eq!(
            heights.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            0.0
        );
    }
}
