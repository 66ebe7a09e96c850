//! The light around the scene, seen in what mirrors it. Skipped, said aloud, without an adapter.

use taut_proto::scene::Show;
use taut_proto::scene::Stereo;

use crate::support::{on_wall, peg_in_hole, shown, state};
use image::RgbaImage;
use nalgebra::{Isometry3, Similarity3};
use taut_proto::{Finish, Panorama};
use taut_render::environment::Environment;
use taut_render::renderer::shapes;
use taut_render::stage::{Stage, StageBody};

const PIXELS: (u32, u32) = (360, 240);

/// Red to the right of the viewer, green to the left, blue above, dark elsewhere.
fn coloured() -> Panorama {
    Panorama::from_fn(|column, row| match (column, row) {
        (_, 0..32) => [0.0, 0.0, 1.0],
        (160..224, 32..96) => [1.0, 0.0, 0.0],
        (32..96, 32..96) => [0.0, 1.0, 0.0],
        _ => [0.0; 3],
    })
}

/// A white ball before the wall, of one finish, in coloured light.
fn ball(finish: Finish, turned: f64) -> Stage {
    let mut stage = on_wall(shapes::sphere(0.2, 64), PIXELS, Stereo::Mono);
    let around = nalgebra::Vector3::z() * turned;
    stage.workbench_from_scene = Similarity3::new(nalgebra::Vector3::zeros(), around, 1.0);
    stage.god_object.colour = [1.0; 3];
    stage.god_object.finish = Some(finish);
    stage.environment = Environment::of(Some(&coloured()));
    stage
}

fn draw(stage: Stage, reflections: bool) -> Option<RgbaImage> {
    let show = Show {
        reflections,
        ..Show::default()
    };
    let at = state(Isometry3::translation(0.0, 0.0, 0.6));
    Some(shown(stage, &at, show)?.remove(0))
}

/// Colour of the ball so far right of and above its middle, in its radii (40 pixels).
fn at(image: &RgbaImage, across: f32, up: f32) -> [i32; 3] {
    let (x, y) = (180.0 + 40.0 * across, 120.0 - 40.0 * up);
    let [red, green, blue, _] = image.get_pixel(x as u32, y as u32).0;
    [red, green, blue].map(i32::from)
}

fn finish(roughness: f32, metallic: f32) -> Finish {
    Finish {
        roughness,
        metallic,
    }
}

#[test]
fn a_mirror_shows_what_stands_where_however_the_scene_is_turned() {
    for turned in [0.0, 1.3] {
        let Some(picture) = draw(ball(finish(0.0, 1.0), turned), true) else {
            return;
        };
        // Where the surface is turned by 45 degrees from the eye, it mirrors what is to that side.
        let [red, green, blue] = at(&picture, 0.68, 0.0);
        assert!(red > 60 + green.max(blue), "{red} {green} {blue}");
        let [red, green, blue] = at(&picture, -0.68, 0.0);
        assert!(green > 60 + red.max(blue), "{red} {green} {blue}");
        let [red, green, blue] = at(&picture, 0.0, 0.75);
        assert!(blue > 60 + red.max(green), "{red} {green} {blue}");
    }
}

#[test]
fn a_rough_metal_mixes_what_a_smooth_one_shows_apart() {
    let redness = |roughness, reflections| {
        let picture = draw(ball(finish(roughness, 1.0), 0.0), reflections)?;
        let [red, green, blue] = at(&picture, 0.68, 0.0);
        Some(red - green.max(blue))
    };
    let Some(smooth) = redness(0.0, true) else {
        return;
    };
    let (satin, rough) = (redness(0.5, true), redness(1.0, true));
    assert!(
        satin < Some(smooth) && rough < satin,
        "{smooth} {satin:?} {rough:?}"
    );
    // Without reflections even a smooth one has what a rough one gets.
    let plain = redness(0.0, false);
    assert!(
        plain < Some(smooth - 30) && plain > Some(0),
        "{smooth} {plain:?}"
    );
}

#[test]
fn matt_surfaces_take_the_colour_of_the_light_that_they_face() {
    let Some(picture) = draw(ball(finish(1.0, 0.0), 0.0), true) else {
        return;
    };
    let [red, green, _] = at(&picture, 0.85, 0.0);
    assert!(red > green + 20, "{red} {green}");
    let [red, green, _] = at(&picture, -0.85, -0.1);
    assert!(green > red, "{red} {green}");
}

/// A room of 8 m whose walls are felt and not seen: its size is not that of what casts shadows.
#[test]
fn a_body_that_is_not_drawn_leaves_light_and_shadows_as_they_are() {
    let drawn = |with_room: bool| {
        let mut stage = peg_in_hole(PIXELS, Stereo::Mono);
        if with_room {
            stage.meshes.push(shapes::cuboid([4.0; 3]).into());
            stage.obstacles.push(StageBody {
                mesh: 2,
                opacity: 0.0,
                ..stage.obstacles[0]
            });
        }
        crate::support::draw(stage, Isometry3::translation(0.0, -0.042, 0.0))
    };
    let Some(alone) = drawn(false) else {
        return;
    };
    assert!(drawn(true).expect("drawn before") == alone);
}

/// Two panes in one plane, the middle of each nearer to another eye.
#[test]
fn both_eyes_see_translucent_bodies_over_each_other_in_one_order() {
    let small = shapes::cuboid([0.01; 3]);
    let mut stage = on_wall(small, PIXELS, Stereo::TwoWindows);
    stage.meshes.push(shapes::cuboid([0.3, 0.01, 0.2]).into());
    let pane = |x: f64, colour: [f32; 3]| StageBody {
        mesh: 1,
        pose: Isometry3::translation(x, 0.0, 0.6),
        colour,
        opacity: 0.8,
        ..stage.god_object
    };
    stage.obstacles = vec![pane(-0.1, [0.8, 0.02, 0.02]), pane(0.1, [0.02, 0.7, 0.02])];
    let Some(pictures) = crate::support::draw(stage, Isometry3::identity()) else {
        return;
    };
    let [left, right] = [0, 1].map(|eye: usize| {
        let [red, green, ..] = pictures[eye].get_pixel(180, 120).0;
        red > green
    });
    assert_eq!(left, right, "red is in front");
}
