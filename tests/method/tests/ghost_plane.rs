//! A plane cut into 10,000 triangles feels like one of two.

use std::sync::Arc;

use crate::geometry_shapes::{Soup, cuboid, grid_box, mesh, read_ply};
use god_object::{Mesh, Pose, Settings, World};
use nalgebra::Vector3;
use taut_method_tests::hand::Random;
use taut_method_tests::motion::Led;
use taut_method_tests::solids;

/// Half the side of the plate, m, and half its thickness.
const HALF_SIDE: f64 = 0.1;
const HALF_THICKNESS: f64 = 0.01;
/// Cells along each side of the fine plate: 10,082 triangles on its upper face.
const CELLS: usize = 71;
/// Largest difference of the forces relative to the force.
const TOLERANCE: f64 = 1e-9;
/// Torques count with the body's size.
const ARM: f64 = 0.05;

/// The plate with `cells` x `cells` squares on each large face, inner vertices moved within the face by up to a third of a cell.
fn plate(cells: usize) -> Soup {
    let half = [HALF_SIDE, HALF_SIDE, HALF_THICKNESS];
    let (mut vertices, triangles) = grid_box(half, [cells, cells, 1]);
    let mut random = Random(10);
    let reach = 2.0 * HALF_SIDE / cells as f64 / 3.0;
    for v in &mut vertices {
        if v.x.abs() < HALF_SIDE - 1e-9 && v.y.abs() < HALF_SIDE - 1e-9 {
            v.x += reach * (2.0 * random.unit() - 1.0);
            v.y += reach * (2.0 * random.unit() - 1.0);
        }
    }
    (vertices, triangles)
}

fn world(body: &Mesh, plate: Soup) -> Arc<World> {
    let place = world_from_plate() * Pose::translation(0.0, 0.0, -HALF_THICKNESS);
    let plate = solids::obstacle("plate", mesh(plate), place);
    solids::world(solids::body(body.clone()), [plate])
}

/// Askew, so that no coordinate is a round number.
fn world_from_plate() -> Pose {
    Pose::new(Vector3::new(0.3, -0.2, 0.1), Vector3::new(0.4, 0.7, -0.2))
}

/// Slides the body over both plates, pressed in by some millimetres, and compares every force.
fn feels_alike(name: &str, body: &Mesh, start: Pose, path: impl Fn(f64) -> Pose) {
    let settings = Settings::for_size(2.0 * ARM);
    let [mut fine, mut coarse] = [plate(CELLS), plate(1)]
        .map(|soup| Led::in_world(world(body, soup), &settings, world_from_plate() * start));
    let (mut worst, mut touching, mut most, mut few) = (0.0_f64, 0, 0, 0);
    for k in 0..=600 {
        let time = 1e-3 * f64::from(k);
        let device = world_from_plate() * path(time / 0.6);
        let (a, b) = (fine.step(time, &device), coarse.step(time, &device));
        let size = b.wrench.fixed_rows::<3>(0).norm();
        let difference = a.wrench - b.wrench;
        let error =
            difference.fixed_rows::<3>(0).norm() + difference.fixed_rows::<3>(3).norm() / ARM;
        most = most.max(a.report.contacts);
        few = few.max(b.report.contacts);
        if size > 0.0 {
            touching += 1;
            worst = worst.max(error / size);
        } else {
            assert!(error == 0.0, "{name}: a force in the air at {time} s");
        }
        assert!(
            error <= TOLERANCE * size,
            "{name}: differs by {error:e} N of {size} N at {time} s; {} and {} rows",
            a.report.contacts,
            b.report.contacts
        );
    }
    assert!(touching > 400, "{name}: touched {touching} times");
    println!("{name}: {touching} forces, of up to {most} rows beside {few}, alike to {worst:e}");
}

/// From the left to the right, pressed in to `height` after a tenth of the way.
fn slide(share: f64, above: f64, height: f64) -> Vector3<f64> {
    let down = (share / 0.1).min(1.0);
    Vector3::new(
        0.08 * (share - 0.5),
        0.03 * (2.0 * share - 1.0).powi(2) - 0.017,
        above + (height - above) * down,
    )
}

#[test]
fn a_flat_box_slides_alike_over_two_and_ten_thousand_triangles() {
    let body = mesh(cuboid([0.02, 0.015, 0.01]));
    let path = |share: f64| Pose::new(slide(share, 0.013, 0.006), Vector3::zeros());
    feels_alike("flat box", &body, path(0.0), path);
}

#[test]
fn the_edge_of_a_tilted_box_slides_alike_over_two_and_ten_thousand_triangles() {
    let body = mesh(cuboid([0.02, 0.015, 0.01]));
    let path = |share: f64| Pose::new(slide(share, 0.025, 0.010), Vector3::new(0.0, 0.5, 0.0));
    feels_alike("tilted box", &body, path(0.0), path);
}

#[test]
fn a_bunny_slides_alike_over_two_and_ten_thousand_triangles() {
    let Some(soup) = read_ply("bunny_1k.ply") else {
        return;
    };
    let body = mesh(soup);
    // It stands on its feet, y up.
    let upright = Vector3::new(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
    let lowest = body
        .vertices()
        .iter()
        .map(|v| (Pose::new(Vector3::zeros(), upright) * v).z)
        .fold(f64::INFINITY, f64::min);
    let path = |share: f64| Pose::new(slide(share, 0.003 - lowest, -0.004 - lowest), upright);
    feels_alike("bunny", &body, path(0.0), path);
}
