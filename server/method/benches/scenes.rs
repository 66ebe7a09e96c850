//! Whole scenes: an update of the god-object, and a force. `cargo bench -p god-object --bench scenes`.
//!
//! Wall-clock time; percentiles of thread CPU time over many steps are printed by `conforming_variants` of `tests/method`. An iteration of `update` is one update at 1 kHz in the midst of the motion.

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/geometry_shapes/mod.rs"]
mod geometry_shapes;
mod scene;

use divan::{Bencher, black_box};
use god_object::{Coupling, GodObject};
use scene::{Scene, names};

/// Updates before the measurement: the body has come into contact.
const APPROACH: u32 = 200;
/// Steps of the motion over which forces are measured.
const STEPS: u32 = 256;

fn main() {
    divan::main();
}

fn in_contact(name: &str) -> (Scene, GodObject) {
    let mut scene = Scene::named(name);
    let mut god_object = GodObject::new(scene.world.clone(), scene.settings, scene.start)
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    for k in 0..APPROACH {
        let device = scene.device(k, god_object.pose());
        god_object.step(&device, None);
    }
    (scene, god_object)
}

#[divan::bench(args = names(), sample_count = 200, sample_size = 1)]
fn update(bencher: Bencher, name: &str) {
    let (mut scene, mut god_object) = in_contact(name);
    let mut k = APPROACH;
    bencher.bench_local(|| {
        let device = scene.device(k, god_object.pose());
        k += 1;
        black_box(god_object.step(black_box(&device), None))
    });
}

#[divan::bench(args = names())]
fn force(bencher: Bencher, name: &str) {
    let (mut scene, mut god_object) = in_contact(name);
    let mut coupling = Coupling::new(&scene.world, &scene.settings);
    // Sets and device poses of a stretch of the motion; the device is one step ahead of the set.
    let recorded: Vec<_> = (0..STEPS)
        .map(|k| {
            let device = scene.device(APPROACH + k, god_object.pose());
            let set = god_object.constraint_set().clone();
            god_object.step(&device, None);
            (set, device)
        })
        .collect();
    let mut k = 0;
    bencher.bench_local(|| {
        let (set, device) = &recorded[k % recorded.len()];
        k += 1;
        black_box(coupling.step(1e-3 * k as f64, black_box(device), black_box(set)))
    });
}
