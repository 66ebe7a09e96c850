//! Zilles and Salisbury 1995: the god-object is the point of the surface nearest to the device, and nothing is too thin for it.

use god_object::Pose;
use nalgebra::Vector3;

use super::{Figure, HALF, TINY, driven, figure};
use crate::clock::TICK;
use crate::costs;
use crate::method::{Method, Scene};
use crate::recipe::Recipe;
use crate::recipes::{block, cube};

const PLACES: u32 = 200;
/// Updates at each place.
const UPDATES: u32 = 10;

/// `plate`: the recipe of a thin one.
pub(super) fn figures(plate: &Recipe) -> Vec<Figure> {
    let scene = corner();
    let start = |scene: &Scene| Method::Point.start(scene, TICK, Method::Point.tunings()[0]);
    let mut state = 1;
    let errors = (0..PLACES).map(|_| {
        let device = Vector3::from_fn(|_, _| 0.03 * costs::uniform(&mut state) - 0.01);
        let pose = Pose::from(device);
        let found = driven(start(&scene).as_mut(), (UPDATES, 1), |_| pose);
        let found = found[found.len() - 1].0.translation.vector;
        (found - device.map(|x| x.max(HALF))).amax()
    });
    let worst = errors.fold(0.0, f64::max);
    let time = |tick: u32| f64::from(tick) * TICK;
    let run = driven(start(&plate.scene).as_mut(), (plate.ticks(), 1), |tick| {
        (plate.device)(time(tick))
    });
    let astray = (0..).zip(&run);
    let astray = astray.map(|(tick, (pose, _))| (plate.astray)(time(tick), pose));
    let source = (Method::Point, "Zilles and Salisbury 1995");
    let figure = |of, here, most| figure(source, of, "0 m", here, [0.0, most], "m");
    vec![
        figure(
            "way to the point of the surface nearest to the device, on one, two and three planes, 200 places",
            worst,
            2.0 * scene.settings.rest_distance,
        ),
        figure(
            "way beyond a plate of 0.1 mm that the device goes 50 mm through, R09",
            astray.fold(0.0, f64::max),
            TINY,
        ),
    ]
}

/// A cube in a corner of three walls: its centre may be where no coordinate is below [`HALF`].
fn corner() -> Scene {
    let wall = |at: [f64; 3]| {
        block(
            "wall",
            at.map(|x| x - 0.1).into(),
            at.map(|x| x + 0.1).into(),
        )
    };
    let walls = [[-0.1, 0.0, 0.0], [0.1, -0.1, 0.0], [0.1, 0.1, -0.1]].map(wall);
    let start = Pose::translation(0.02, 0.02, 0.02);
    Scene::new(cube(HALF), walls, 2.0 * HALF, 0.1, start)
}
