//! One world on two screens and in two eyes: by the projection matrices, and in rendered pictures.

use taut_proto::scene::Stereo;

use crate::support::{draw, l_shape, peg_in_hole};
use image::RgbaImage;
use nalgebra::{Isometry3, Point3, Similarity3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use taut_render::renderer::shapes;
use taut_render::stage::Stage;
use taut_render::view::{ClipPlanes, Eye, Eyes, Screen, project};

const PLANES: ClipPlanes = ClipPlanes {
    near: 0.02,
    far: 20.0,
};

/// What the line may break by at the edge, in metres.
const EDGE_TOLERANCE: f64 = 1e-6;

/// Rounding of a few products of numbers near 1, in metres on a screen.
const ROUNDING: f64 = 1e-9;

/// The place on a screen where an eye sees a point.
fn on_screen(screen: &Screen, eye: &Point3<f64>, point: &Point3<f64>) -> Option<Point3<f64>> {
    let clip = screen.clip_from_workbench(eye, &PLANES)?;
    let seen = project(&clip, point)?;
    Some(screen.point(0.5 + 0.5 * seen.x, 0.5 + 0.5 * seen.y))
}

prop_compose! {
    /// Before the wall, above the table.
    fn eye()(x in -1.5..1.5f64, y in -1.8..-0.2f64, z in 0.2..1.8f64) -> Point3<f64> {
        Point3::new(x, y, z)
    }
}

prop_compose! {
    fn head()(place in eye(), turn in proptest::array::uniform3(-1.2..1.2f64)) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(place.coords),
            UnitQuaternion::from_scaled_axis(turn.into()),
        )
    }
}

proptest! {
    #[test]
    fn a_line_over_both_screens_passes_their_edge_at_one_place(
        eye in eye(), edge in -0.85..0.85f64, depth in 0.1..3.0f64,
        along in proptest::array::uniform3(-1.0..1.0f64),
    ) {
        // A line through a point behind the edge as the eye sees it, in any direction: on each screen
        // its picture is the straight line through the pictures of two of its points.
        let [wall, table] = l_shape();
        let edge = Point3::new(edge, 0.0, 0.0);
        let through = eye + (edge - eye) * depth;
        let along = Vector3::from(along);
        prop_assume!(along.norm() > 0.1);
        // The plane of eye and line meets the edge at one point, unless the edge lies in it.
        let normal = (through - eye).cross(&along);
        prop_assume!(normal.norm() > 0.05 && normal.x.abs() > 0.1 * normal.norm());
        for screen in [&wall, &table] {
            let ends = [-0.05, 0.05].map(|t| on_screen(screen, &eye, &(through + along * t)));
            let [Some(a), Some(b)] = ends else { continue };
            if [&a, &b].iter().any(|p| (*p - edge).norm() > 50.0) {
                continue; // nearly behind the eye: seen at no screen of this size
            }
            // Where the line through both crosses the edge (y = 0 on the table, z = 0 on the wall).
            let height = |p: &Point3<f64>| p.y.abs().max(p.z.abs()) * (p.y + p.z).signum();
            let (from, to) = (height(&a), height(&b));
            if (to - from).abs() < 1e-3 * (b - a).norm() {
                continue; // runs along the edge
            }
            let crossing = a + (b - a) * (from / (from - to));
            prop_assert!((crossing - edge).norm() < EDGE_TOLERANCE, "{crossing} is not {edge}");
        }
    }

    #[test]
    fn both_screens_show_a_point_behind_their_edge_at_the_same_place(
        eye in eye(), across in 0.0..1.0f64, depth in 0.1..5.0f64,
    ) {
        let [wall, table] = l_shape();
        let edge = wall.point(across, 0.0);
        let point = eye + (edge - eye) * depth;
        let places = [&wall, &table].map(|screen| on_screen(screen, &eye, &point));
        if let [Some(upper), Some(lower)] = places {
            prop_assert!((upper - lower).norm() < EDGE_TOLERANCE);
            prop_assert!((upper - edge).norm() < EDGE_TOLERANCE);
        }
    }

    #[test]
    fn disparity_is_where_the_two_lines_of_sight_pierce_the_screen(
        head in head(), separation in 0.05..0.075f64,
        x in -0.6..0.6f64, y in -0.6..1.0f64, z in 0.05..1.1f64,
    ) {
        let eyes = Eyes::of_head(&head, separation);
        let point = Point3::new(x, y, z);
        for screen in l_shape() {
            let pierced = |eye: Eye| {
                let eye = eyes.position(eye);
                let (near, far) = (screen.distance(&eye), screen.distance(&point));
                (near > 0.05 && near - far > 0.05).then(|| eye + (point - eye) * (near / (near - far)))
            };
            let (Some(left), Some(right)) = (pierced(Eye::Left), pierced(Eye::Right)) else { continue };
            let seen = |eye| on_screen(&screen, &eyes.position(eye), &point).expect("in front");
            let found = seen(Eye::Right) - seen(Eye::Left);
            let size = 1.0 + (left - screen.point(0.5, 0.5)).norm();
            prop_assert!((found - (right - left)).norm() < ROUNDING * size * size);
        }
    }

    #[test]
    fn there_is_no_disparity_in_the_plane_of_a_screen(
        head in head(), across in 0.0..1.0f64, upward in 0.0..1.0f64,
    ) {
        let eyes = Eyes::of_head(&head, 0.064);
        for screen in l_shape() {
            let point = screen.point(across, upward);
            let seen = [Eye::Left, Eye::Right].map(|eye| on_screen(&screen, &eyes.position(eye), &point));
            if let [Some(left), Some(right)] = seen {
                prop_assert!((right - left).norm() < ROUNDING);
            }
        }
    }

    #[test]
    fn the_eyes_roll_with_the_head(place in eye(), roll in -1.5..1.5f64, depth in 0.1..2.0f64) {
        // A head that looks straight at the wall and leans: the disparity of what lies behind leans with it.
        let looks = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        let lean = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
        let head = Isometry3::from_parts(Translation3::from(place.coords), looks * lean);
        let eyes = Eyes::of_head(&head, 0.064);
        let [wall, _] = l_shape();
        let point = Point3::new(0.1, depth, 0.6);
        let seen = [Eye::Left, Eye::Right].map(|eye| on_screen(&wall, &eyes.position(eye), &point));
        let [Some(left), Some(right)] = seen else { return Ok(()); };
        let found = right - left;
        let size = 0.064 * depth / (depth - place.y);
        let expected = Vector3::new(size * roll.cos(), 0.0, size * roll.sin());
        prop_assert!((found - expected).norm() < ROUNDING, "{found} is not {expected}");
    }
}

/// Only one bright bar of these half extents, seen by a fixed head.
fn bar(half_extents: [f32; 3], pixels: (u32, u32), stereo: Stereo) -> Stage {
    let mut stage = peg_in_hole(pixels, stereo);
    stage.workbench_from_scene = Similarity3::identity();
    stage.meshes = vec![shapes::cuboid(half_extents).into()];
    stage.god_object.colour = [0.9, 0.22, 0.02];
    stage.obstacles.clear();
    stage
}

/// Middle of the orange in a row, weighted by how orange a pixel is: finer than a pixel.
fn middle_of_row(image: &RgbaImage, row: u32) -> Option<f64> {
    let weigh = |x: u32| {
        let [red, _, blue, _] = image.get_pixel(x, row).0;
        (f64::from(red) - 1.5 * f64::from(blue) - 20.0).max(0.0)
    };
    let (sum, moment) = (0..image.width()).fold((0.0, 0.0), |(sum, moment), x| {
        (sum + weigh(x), moment + weigh(x) * (f64::from(x) + 0.5))
    });
    (sum > 100.0).then(|| moment / sum)
}

#[test]
fn a_bright_line_across_both_screens_meets_at_their_edge() {
    let pixels = (720, 480);
    for (lean, head) in [
        (0.0, [0.2, -0.9, 0.8]),
        (0.35, [-0.5, -0.7, 0.5]),
        (-0.3, [0.45, -1.2, 1.1]),
    ] {
        let mut stage = bar([0.008, 0.008, 0.9], pixels, Stereo::Mono);
        stage.head = Isometry3::translation(head[0], head[1], head[2]);
        // Behind the edge, leaning to the side and to the viewer.
        let turn = Vector3::new(0.4, lean, 0.0);
        let Some(pictures) = draw(stage, Isometry3::new(Vector3::new(0.05, 0.12, -0.05), turn))
        else {
            return;
        };
        // The line's middle in the two rows nearest to the edge on each screen, carried on to the edge itself.
        let at_edge = |image: &RgbaImage, near: u32, next: u32| {
            let [near, next] = [near, next].map(|row| middle_of_row(image, row).expect("crosses"));
            near + (near - next) * 0.5 / 8.0
        };
        let (last, wall) = (pixels.1 - 1, &pictures[0]);
        let on_wall = at_edge(wall, last, last - 8);
        let on_table = at_edge(&pictures[1], 0, 8);
        assert!(
            (on_wall - on_table).abs() < 1.0,
            "{on_wall} on the wall, {on_table} on the table"
        );
    }
}

#[test]
fn disparity_in_pictures_is_the_computed_one_to_a_fraction_of_a_pixel() {
    let pixels = (720, 480);
    for depth in [-0.35, 0.0, 0.6] {
        let mut stage = bar([0.012, 0.0005, 0.2], pixels, Stereo::TwoWindows);
        stage.screens.truncate(1);
        stage.head = Isometry3::translation(0.05, -1.1, 0.6);
        let middle = Point3::new(0.1, depth, 0.6);
        let eyes = Eyes::of_head(&stage.head, stage.eye_separation);
        let wall = stage.screens[0].screen;
        // The front face is what is seen.
        let face = middle - Vector3::y() * 0.0005;
        let pixel = |eye| {
            let clip = wall
                .clip_from_workbench(&eyes.position(eye), &PLANES)
                .expect("in front");
            (0.5 + 0.5 * project(&clip, &face).expect("in front").x) * f64::from(pixels.0)
        };
        let expected = pixel(Eye::Right) - pixel(Eye::Left);
        let pose = Isometry3::translation(middle.x, middle.y, middle.z);
        let Some(pictures) = draw(stage, pose) else {
            return;
        };
        let row = pixels.1 / 2;
        let seen: Vec<f64> = pictures
            .iter()
            .map(|image| middle_of_row(image, row).expect("seen"))
            .collect();
        let found = seen[1] - seen[0];
        assert!(
            (found - expected).abs() < 0.3,
            "{found} is not {expected} pixels at {depth} m"
        );
        // Behind the screen the right eye sees it further right, in front further left.
        assert_eq!(found > 1.0, depth > 0.1);
        assert_eq!(found < -1.0, depth < -0.1);
    }
}
