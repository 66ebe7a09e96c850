//! Meshes: what is accepted, what is refused and why, and what is derived from them.

use crate::geometry_shapes;

use crate::geometry_shapes::{
    cuboid, grid_box, icosphere, mesh, peg, read_ply, tetrahedron, torus,
};
use god_object::geometry::{Mesh, MeshError, MeshReport, corner_normals, mass_properties};
use god_object::nalgebra::{Matrix3, Point3, Vector3};

#[test]
fn a_box_has_twelve_convex_edges_and_six_flat_ones() {
    let m = mesh(cuboid([1.0, 2.0, 3.0]));
    assert_eq!((m.triangles().len(), m.edges().len()), (12, 18));
    let right = m
        .edges()
        .iter()
        .filter(|e| (e.convexity - std::f64::consts::FRAC_PI_2).abs() < 1e-15)
        .count();
    let flat = m
        .edges()
        .iter()
        .filter(|e| e.convexity.abs() < 1e-15 && !e.is_convex())
        .count();
    assert_eq!((right, flat), (12, 6));
    assert_eq!(
        m.bounding_box(),
        [Point3::new(-1.0, -2.0, -3.0), Point3::new(1.0, 2.0, 3.0)]
    );
    assert!((m.radius_about(&Point3::origin()) - 14.0_f64.sqrt()).abs() < 1e-15);
}

#[test]
fn edges_triangles_and_rings_agree() {
    for soup in [icosphere(1.0, 2), torus(1.0, 0.3, 12, 8), peg(1.0, 2.0, 7)] {
        let m = mesh(soup);
        for t in 0..m.triangles().len() as u32 {
            for (k, e) in m.triangle_edges(t).iter().enumerate() {
                let edge = &m.edges()[*e as usize];
                let corners = m.triangles()[t as usize];
                let side = [corners[k], corners[(k + 1) % 3]];
                let expected = if edge.faces[0] == t {
                    edge.vertices
                } else {
                    [edge.vertices[1], edge.vertices[0]]
                };
                assert_eq!(side, expected);
                assert!(edge.faces.contains(&t));
                assert!(m.neighbours(side[0]).contains(&side[1]));
            }
        }
        let ring_sizes: usize = (0..m.vertices().len() as u32)
            .map(|v| m.neighbours(v).len())
            .sum();
        assert_eq!(ring_sizes, 2 * m.edges().len());
    }
}

#[test]
fn the_inner_side_of_a_torus_is_concave_around_the_hole() {
    let m = mesh(torus(1.0, 0.4, 24, 16));
    let inner_ring = |e: &&god_object::geometry::Edge| {
        e.vertices
            .iter()
            .all(|v| m.vertices()[*v as usize].coords.xy().norm() < 0.7)
    };
    assert!(
        m.edges()
            .iter()
            .filter(inner_ring)
            .any(|e| e.convexity < -1e-3)
    );
}

type Change<'a> = &'a dyn Fn(&mut Vec<Point3<f64>>, &mut Vec<[u32; 3]>);

#[test]
fn each_fault_is_named_with_its_place() {
    let (vertices, triangles) = tetrahedron(1.0);
    let with = |change: Change| {
        let (mut v, mut t) = (vertices.clone(), triangles.clone());
        change(&mut v, &mut t);
        Mesh::new(v, t).expect_err("a fault")
    };
    assert!(matches!(
        with(&|v, _| v[2].y = f64::NAN),
        MeshError::VertexNotFinite { vertex: 2 }
    ));
    assert!(matches!(
        with(&|_, t| t[1][0] = 9),
        MeshError::IndexOutOfRange {
            triangle: 1,
            vertex: 9,
            vertices: 4
        }
    ));
    assert!(matches!(
        with(&|v, _| v[3] = v[1]),
        MeshError::ZeroArea { .. }
    ));
    assert!(matches!(
        with(&|_, t| {
            t.pop();
        }),
        MeshError::Open { .. }
    ));
    assert!(matches!(
        with(&|_, t| t[0].swap(0, 1)),
        MeshError::Orientation { .. }
    ));
    assert!(matches!(
        with(&|_, t| t.iter_mut().for_each(|t| t.swap(0, 1))),
        MeshError::InsideOut { .. }
    ));
    assert!(matches!(
        with(&|_, t| {
            let copy = t.clone();
            t.extend(copy);
        }),
        MeshError::NonManifold { count: 4, .. }
    ));
    assert!(matches!(with(&|_, t| t.clear()), MeshError::Empty));
}

#[test]
fn reports_of_sound_and_broken_surfaces_count_their_faults() {
    let (vertices, triangles) = cuboid([0.5, 1.0, 1.5]);
    let sound = MeshReport::of(&vertices, &triangles);
    assert!(sound.is_sound());
    assert!((sound.volume - 6.0).abs() < 1e-14);
    assert!(
        (sound.smallest_feature - 2.0 / 5.0_f64.sqrt()).abs() < 1e-14,
        "{}",
        sound.smallest_feature
    );

    let open = MeshReport::of(&vertices, &triangles[1..]);
    assert!(!open.watertight && open.border_edges == 3);
    let mut flipped = triangles.clone();
    flipped[3].swap(0, 1);
    let flipped = MeshReport::of(&vertices, &flipped);
    assert!(flipped.watertight && !flipped.oriented && flipped.misoriented_edges == 3);
    let mut doubled = triangles.clone();
    doubled.extend([triangles[0], [0, 0, 1], [0, 1, 99]]);
    let doubled = MeshReport::of(&vertices, &doubled);
    assert_eq!(
        (
            doubled.duplicate_faces,
            doubled.degenerate_faces,
            doubled.non_manifold_edges
        ),
        (1, 2, 3)
    );
    assert!(!MeshReport::of(&[], &[]).is_sound());
}

#[test]
fn mass_properties_of_a_box_and_a_tetrahedron_are_the_closed_forms() {
    let moved = |soup: geometry_shapes::Soup, by: Vector3<f64>| {
        (soup.0.iter().map(|p| p + by).collect(), soup.1)
    };
    let by = Vector3::new(10.0, -7.0, 3.0);
    let m = mass_properties(&mesh(moved(grid_box([0.5, 1.0, 1.5], [2, 3, 1]), by)));
    assert!((m.volume - 6.0).abs() < 1e-13 && (m.centroid.coords - by).norm() < 1e-14);
    let expected = Matrix3::from_diagonal(&Vector3::new(
        6.0 / 12.0 * 13.0,
        6.0 / 12.0 * 10.0,
        6.0 / 12.0 * 5.0,
    ));
    assert!((m.inertia_per_density - expected).norm() < 1e-12);

    let a = 2.0_f64;
    let m = mass_properties(&mesh(moved(tetrahedron(a), by)));
    assert!((m.volume - a.powi(3) / 6.0).abs() < 1e-14);
    assert!((m.centroid.coords - by - Vector3::repeat(a / 4.0)).norm() < 1e-14);
    // About the centroid: diagonal a^5/80, off-diagonal a^5/480.
    let expected = Matrix3::from_fn(|i, j| {
        if i == j {
            a.powi(5) / 80.0
        } else {
            a.powi(5) / 480.0
        }
    });
    assert!(
        (m.inertia_per_density - expected).norm() < 1e-14,
        "{}",
        m.inertia_per_density
    );
}

#[test]
fn corner_normals_keep_creases_and_smooth_the_rest() {
    let b = mesh(grid_box([1.0; 3], [3, 2, 1]));
    for (t, corners) in corner_normals(&b, 0.5).iter().enumerate() {
        assert!(
            corners
                .iter()
                .all(|n| (n - b.face_normal(t as u32)).norm() < 1e-15)
        );
    }
    let s = mesh(icosphere(2.0, 3));
    for (t, corners) in corner_normals(&s, 0.5).iter().enumerate() {
        for (k, n) in corners.iter().enumerate() {
            let radial = s.corners(t as u32)[k].coords.normalize();
            assert!((n - radial).norm() < 2e-2 && (n.norm() - 1.0).abs() < 1e-14);
        }
    }
    // A peg: smooth around, sharp at the rims.
    let p = mesh(peg(1.0, 2.0, 36));
    for (t, corners) in corner_normals(&p, 0.5).iter().enumerate() {
        let side = p.face_normal(t as u32).z.abs() < 0.5;
        for (k, n) in corners.iter().enumerate() {
            let q = p.corners(t as u32)[k];
            let expected = if side {
                Vector3::new(q.x, q.y, 0.0).normalize()
            } else {
                *p.face_normal(t as u32)
            };
            assert!((n - expected).norm() < 1e-12);
        }
    }
}

#[test]
fn slivers_of_a_cad_export_are_accepted() {
    let Some((vertices, triangles)) = read_ply("assembly/gear_medium.ply") else {
        return;
    };
    let report = MeshReport::of(&vertices, &triangles);
    assert!(
        report.smallest_feature < 1e-7,
        "{}",
        report.smallest_feature
    );
    let m = Mesh::new(vertices, triangles).expect("the gear is sound");
    assert_eq!(m.triangles().len(), 35022);
}

#[test]
fn the_tree_holds_every_triangle_once_and_inside_its_boxes() {
    let m = mesh(torus(1.0, 0.3, 20, 15));
    let nodes = m.tree().nodes();
    let mut seen = vec![0; m.triangles().len()];
    let mut stack = vec![(0_usize, vec![])];
    while let Some((i, mut above)) = stack.pop() {
        above.push(i);
        let node = &nodes[i];
        if node.is_leaf() {
            seen[node.triangle as usize] += 1;
            for p in m.corners(node.triangle) {
                for a in &above {
                    let out = (p - nodes[*a].center).abs() - nodes[*a].half;
                    assert!(out.max() <= 0.0);
                }
            }
        } else {
            stack.push((i + 1, above.clone()));
            stack.push((node.second as usize, above));
        }
    }
    assert!(seen.iter().all(|n| *n == 1));
}

/// Boxes with these half sides and centres, each turned inside out where the sign is negative, as one surface.
fn boxes(parts: &[([f64; 3], [f64; 3], f64)]) -> geometry_shapes::Soup {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (half, center, sign) in parts {
        let first = vertices.len() as u32;
        let (corners, faces) = cuboid(*half);
        vertices.extend(corners.iter().map(|p| p + Vector3::from(*center)));
        triangles.extend(faces.iter().map(|t| {
            let [a, b, c] = t.map(|v| v + first);
            if *sign < 0.0 { [b, a, c] } else { [a, b, c] }
        }));
    }
    (vertices, triangles)
}

#[test]
fn a_closed_part_that_is_inside_out_is_refused_by_name() {
    let (large, small) = ([1.0; 3], [0.2; 3]);
    let beside = boxes(&[(large, [0.0; 3], 1.0), (small, [3.0, 0.0, 0.0], -1.0)]);
    let error = Mesh::new(beside.0.clone(), beside.1.clone()).unwrap_err();
    let MeshError::PartInsideOut(part) = error else {
        panic!("{error}");
    };
    assert_eq!((part.triangle, part.triangles), (12, 12));
    assert!((part.center - Point3::new(3.0, 0.0, 0.0)).norm() < 1e-12);
    assert!((part.volume + 0.064).abs() < 1e-12, "{}", part.volume);
    let report = MeshReport::of(&beside.0, &beside.1);
    assert!(report.watertight && !report.oriented && !report.is_sound());
    assert_eq!(report.inverted_parts, [part]);
}

#[test]
fn cavities_and_what_floats_in_them_are_told_by_nesting() {
    // A box with two cavities, one of which holds a box with a cavity of its own.
    let sound = boxes(&[
        ([1.0; 3], [0.0; 3], 1.0),
        ([0.4; 3], [0.5, 0.0, 0.0], -1.0),
        ([0.2; 3], [0.5, 0.1, 0.0], 1.0),
        ([0.1; 3], [0.5, 0.1, 0.0], -1.0),
        ([0.1; 3], [-0.5, 0.0, 0.0], -1.0),
    ]);
    assert!(MeshReport::of(&sound.0, &sound.1).is_sound());
    assert!(Mesh::new(sound.0, sound.1).is_ok());
    // What floats in a cavity, inside out.
    let floating = boxes(&[
        ([1.0; 3], [0.0; 3], 1.0),
        ([0.4; 3], [0.5, 0.0, 0.0], -1.0),
        ([0.2; 3], [0.5, 0.1, 0.0], -1.0),
    ]);
    let refused = Mesh::new(floating.0, floating.1).unwrap_err();
    assert!(matches!(refused, MeshError::PartInsideOut(part) if part.triangle == 24));
    // A part inside out that cuts through the wall of another is no cavity.
    let crossing = boxes(&[([1.0; 3], [0.0; 3], 1.0), ([0.3; 3], [1.0, 0.0, 0.0], -1.0)]);
    let refused = Mesh::new(crossing.0, crossing.1).unwrap_err();
    assert!(matches!(refused, MeshError::PartInsideOut(_)));
}

#[test]
fn parts_know_how_many_others_surround_them_whichever_way_they_look() {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    // Three in each other, the middle one inside out, and one beside them.
    for (size, away, turned) in [
        (4.0, 0.0, false),
        (1.5, 0.0, true),
        (0.4, 0.0, false),
        (0.4, 9.0, true),
    ] {
        let (v, t) = tetrahedron(size);
        let first = vertices.len() as u32;
        // About its own middle.
        let middle = v.iter().map(|p| p.coords).sum::<Vector3<f64>>() / 4.0;
        vertices.extend(v.iter().map(|p| p - middle + Vector3::x() * away));
        triangles.extend(t.iter().map(|t| {
            let [a, b, c] = t.map(|v| v + first);
            if turned { [a, c, b] } else { [a, b, c] }
        }));
    }
    let adjacent = (0..triangles.len() as u32 / 4).flat_map(|part| {
        let first = 4 * part;
        (0..3).map(move |k| [first, first + k + 1])
    });
    let parts = god_object::geometry::closed_parts(&vertices, &triangles, adjacent);
    let depths: Vec<usize> = parts.iter().map(|part| part.depth).collect();
    assert_eq!(depths, [0, 1, 2, 0]);
    let outward: Vec<bool> = parts.iter().map(|part| part.volume > 0.0).collect();
    assert_eq!(outward, [true, false, true, false]);
}
