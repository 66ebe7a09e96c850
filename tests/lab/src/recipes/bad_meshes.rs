//! R32: meshes with faults: each is refused by name, or behaves as the sound mesh does.

use god_object::geometry::MeshError;
use god_object::spatial::linear;
use god_object::{Mesh, Pose, Settings};
use nalgebra::Vector3;
use taut_method_tests::motion::Led;
use taut_method_tests::solids::{cells, obstacle, world};
use taut_scene::RawMesh;
use taut_scene::shapes::cuboid;

use super::Extent;
use super::bodies::ball;
use crate::method::Method;
use crate::row::Row;

const RADIUS: f64 = 5e-3;
const DEPTH: f64 = 3e-3;
/// Half of the plate, m: its upper face is z = 0.
const HALF: [f64; 3] = [0.1, 0.1, 0.01];
/// Largest difference of force from the sound plate, N: a micrometre at 1000 N/m, twice.
const DIFFERENCE: f64 = 2e-3;
/// A sliver's height and a small feature's, m.
const SLIVER: f64 = 1e-7;
const FEATURE: f64 = 1e-6;

/// A sound plate.
fn plate() -> RawMesh {
    let mut raw = cuboid(HALF);
    for vertex in &mut raw.vertices {
        vertex.z -= HALF[2];
    }
    raw
}

/// A triangle of the upper face.
fn upper(raw: &RawMesh) -> usize {
    let is_up = |t: &[u32; 3]| t.iter().all(|v| raw.vertices[*v as usize].z > -1e-12);
    raw.triangles.iter().position(is_up).expect("an upper face")
}

pub(super) fn run(_extent: Extent) -> Vec<Row> {
    let mut rows = refusals();
    let sound = slide(plate(), Vector3::zeros()).expect("the plate is sound");
    let mut behaves = |case: &str, raw: RawMesh, away: Vector3<f64>, limit: f64| {
        let row = Row::new("R32", case, Method::Ours.name());
        let felt = slide(raw, away);
        let difference = felt.map_or(f64::NAN, |felt| {
            let pairs = felt.iter().zip(&sound);
            pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
        });
        rows.push(row.at_most("difference_from_sound", difference, "N", limit));
    };
    behaves(
        "sliver of aspect 1e6",
        with_sliver(),
        Vector3::zeros(),
        DIFFERENCE,
    );
    // A ball that rides up on a height h is tilted by sqrt(2 h / r) there, and its force with it.
    let tilt = (2.0 * FEATURE / RADIUS).sqrt();
    let ridden = 1000.0 * DEPTH * tilt + DIFFERENCE;
    behaves(
        "feature of a micrometre",
        with_feature(),
        Vector3::zeros(),
        ridden,
    );
    let away = Vector3::new(1000.0, -700.0, 400.0);
    behaves("a kilometre away", plate(), away, DIFFERENCE);
    for method in Method::ALL {
        if method != Method::Ours {
            let reason = "its meshes come through the same check";
            rows.push(Row::new("R32", "bad meshes", method.name()).out_of_scope(reason));
        }
    }
    rows
}

/// Whether an error is the right one.
type Named = fn(&MeshError) -> bool;

/// What cannot be used, and the fault that must be named.
fn refusals() -> Vec<Row> {
    let mut zero_area = plate();
    let corner = zero_area.triangles[0][0];
    zero_area
        .triangles
        .push([corner, corner, zero_area.triangles[0][1]]);

    let mut duplicate = plate();
    let t = upper(&duplicate);
    let copy = duplicate.vertices[duplicate.triangles[t][0] as usize];
    duplicate.triangles[t][0] = duplicate.vertices.len() as u32;
    duplicate.vertices.push(copy);

    // A vertex on an edge of one triangle that its neighbour does not have.
    let mut junction = plate();
    let t = upper(&junction);
    let [a, b, c] = junction.triangles[t];
    let middle = nalgebra::center(
        &junction.vertices[a as usize],
        &junction.vertices[b as usize],
    );
    let m = junction.vertices.len() as u32;
    junction.vertices.push(middle);
    junction.triangles[t] = [a, m, c];
    junction.triangles.push([m, b, c]);

    let mut open = plate();
    open.triangles.remove(upper(&open));

    let mut one_flipped = plate();
    let t = upper(&one_flipped);
    one_flipped.triangles[t].swap(0, 1);

    let mut inside_out = plate();
    inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));

    let is_open = |e: &MeshError| matches!(e, MeshError::Open { .. });
    let cases: [(&str, RawMesh, Named); 6] = [
        ("zero area", zero_area, |e| {
            matches!(e, MeshError::ZeroArea { .. })
        }),
        ("duplicate vertex", duplicate, is_open),
        ("T-junction", junction, is_open),
        ("open border", open, is_open),
        ("one normal flipped", one_flipped, |e| {
            matches!(e, MeshError::Orientation { .. })
        }),
        ("all normals flipped", inside_out, |e| {
            matches!(e, MeshError::InsideOut { .. })
        }),
    ];
    cases
        .into_iter()
        .map(|(case, raw, named)| {
            let refused = Mesh::new(raw.vertices, raw.triangles).err();
            let wrong = !refused.as_ref().is_some_and(named);
            let row = Row {
                settings: refused.map_or_else(|| "taken".to_owned(), |e| e.to_string()),
                ..Row::new("R32", case, Method::Ours.name())
            };
            row.never("not_refused_by_name", usize::from(wrong))
        })
        .collect()
}

/// A vertex a ten-millionth of a metre beside an edge.
fn with_sliver() -> RawMesh {
    let mut raw = plate();
    let t = upper(&raw);
    let [a, b, c] = raw.triangles[t];
    let at = |v: u32| raw.vertices[v as usize];
    let middle = nalgebra::center(&at(a), &at(b));
    let inward = at(c) - middle;
    let place = middle + inward * (SLIVER / inward.norm());
    let m = raw.vertices.len() as u32;
    raw.vertices.push(place);
    raw.triangles[t] = [a, b, m];
    raw.triangles.extend([[b, c, m], [c, a, m]]);
    raw
}

/// A bump of a micrometre each way, on the ball's path.
fn with_feature() -> RawMesh {
    let bump = [0.012, 0.012 + FEATURE];
    let x = [-HALF[0], bump[0], bump[1], HALF[0]];
    let y = [-HALF[1], 0.0, FEATURE, HALF[1]];
    cells([&x, &y, &[-2.0 * HALF[2], 0.0, FEATURE]], |[i, j, k]| {
        k == 0 || (i == 1 && j == 1)
    })
}

/// Forces of a ball that comes down on the plate, 3 mm deep, and slides.
fn slide(raw: RawMesh, away: Vector3<f64>) -> Option<Vec<Vector3<f64>>> {
    let mesh = Mesh::new(raw.vertices, raw.triangles).ok()?;
    let plate = obstacle("plate", mesh, Pose::from(away));
    let world = world(ball(RADIUS), [plate]);
    let at = |k: u32| {
        let time = f64::from(k) * 1e-3;
        let height = 1e-3 - (DEPTH + 1e-3) * (time / 0.1).min(1.0);
        Pose::from(Vector3::new(0.1 * time, 1e-4, RADIUS + height) + away)
    };
    let settings = Settings::for_size(2.0 * RADIUS);
    let mut led = Led::in_world(world, &settings, at(0));
    let forces = (0..300).map(|k| linear(&led.step(f64::from(k) * 1e-3, &at(k)).wrench));
    Some(forces.collect())
}
