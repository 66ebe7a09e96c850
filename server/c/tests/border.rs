//! What comes over the border from C: refused with a code and a text, and the force is then none.
#![allow(unsafe_code, reason = "the functions of C are called as C calls them")]

use std::ffi::{CStr, CString, c_char};
use std::ptr::{null, null_mut};

use taut_c::*;

const START: TautPose = TautPose {
    position: [0.0; 3],
    rotation: [1.0, 0.0, 0.0, 0.0],
};

fn said() -> String {
    // SAFETY: a string until the next failure of this thread.
    unsafe { CStr::from_ptr(taut_last_error()) }
        .to_string_lossy()
        .into_owned()
}

fn load(name: &str) -> (TautStatus, *mut TautScene) {
    let name = CString::new(name).unwrap();
    let mut scene = null_mut();
    // SAFETY: a string, and a place for the handle.
    let status = unsafe { taut_scene_load(name.as_ptr(), &raw mut scene) };
    (status, scene)
}

fn sphere() -> (*mut TautScene, TautPose) {
    let (status, scene) = load("sphere-on-plane");
    assert_eq!(status, TautStatus::TAUT_OK, "{}", said());
    let mut info = TautSceneInfo::default();
    // SAFETY: a scene, and a place for the answer.
    let status = unsafe { taut_scene_info(scene, &raw mut info) };
    assert_eq!(status, TautStatus::TAUT_OK);
    assert!(info.mass > 0.0 && info.stiffness > 0.0 && info.obstacles == 1);
    (scene, info.start)
}

#[test]
fn a_body_pressed_into_an_obstacle_is_stopped_and_pushed_back() {
    let (scene, mut device) = sphere();
    let (mut pose, mut update, mut force) = (START, TautUpdate::default(), TautForce::default());
    for step in 0..200 {
        device.position[2] = (device.position[2] - 0.0005).max(0.010); // radius 20 mm: 5 mm or more too deep
        // SAFETY: a scene and places for the answers.
        let status = unsafe {
            assert_eq!(
                taut_god_object_update(scene, &raw const device, &raw mut pose, &raw mut update),
                TautStatus::TAUT_OK
            );
            taut_coupling_step(
                scene,
                f64::from(step) * 0.001,
                &raw const device,
                &raw mut force,
            )
        };
        assert_eq!(status, TautStatus::TAUT_OK, "{}", said());
    }
    assert!(update.contacts > 0 && update.gap_min > 0.0, "{update:?}");
    assert!(pose.position[2] > device.position[2] + 0.001, "{pose:?}");
    assert!(force.solved && force.force[2] > 0.5, "{force:?}");
    // SAFETY: a scene, given back once.
    unsafe {
        assert_eq!(taut_scene_reset(scene), TautStatus::TAUT_OK);
        taut_scene_free(scene);
    }
}

#[test]
fn null_is_refused_everywhere() {
    let (scene, device) = sphere();
    let (mut pose, mut force, mut good) = (START, TautForce::default(), true);
    let (d, p, f) = (&raw const device, &raw mut pose, &raw mut force);
    let path = c"nowhere.ply".as_ptr();
    // SAFETY: every pointer is NULL or valid.
    let answers = unsafe {
        [
            (taut_scene_load(null(), &mut null_mut()), "name_or_path"),
            (
                taut_scene_load(c"sphere-on-plane".as_ptr(), null_mut()),
                "scene",
            ),
            (taut_scene_info(null(), null_mut()), "scene"),
            (taut_scene_info(scene, null_mut()), "info"),
            (taut_scene_reset(null_mut()), "scene"),
            (
                taut_god_object_update(null_mut(), d, p, null_mut()),
                "scene",
            ),
            (
                taut_god_object_update(scene, null(), p, null_mut()),
                "device",
            ),
            (
                taut_god_object_update(scene, d, null_mut(), null_mut()),
                "god_object",
            ),
            (taut_coupling_step(null_mut(), 0.0, d, f), "scene"),
            (taut_coupling_step(scene, 0.0, null(), f), "device"),
            (taut_coupling_step(scene, 0.0, d, null_mut()), "force"),
            (taut_obstacle_move(scene, 0, null()), "target"),
            (taut_obstacle_pose(scene, 0, null_mut()), "pose"),
            (
                taut_replay_row(scene, 0.0, d, null_mut(), 9, null_mut()),
                "buffer",
            ),
            (
                taut_check(null(), &raw mut good, null_mut(), 0, null_mut()),
                "path",
            ),
            (
                taut_check(path, null_mut(), null_mut(), 0, null_mut()),
                "good",
            ),
            (
                taut_check(path, &raw mut good, null_mut(), 0, null_mut()),
                "buffer",
            ),
            (taut_trace_load(null(), &mut null_mut()), "path"),
            (
                taut_trace_sample(null(), 0, null_mut(), null_mut()),
                "trace",
            ),
        ]
        .map(|(status, name)| (status, name, said()))
    };
    for (status, name, _) in &answers {
        assert_eq!(*status, TautStatus::TAUT_BAD_ARGUMENT, "{name}");
    }
    assert_eq!(answers.last().unwrap().2, "`trace` is NULL");
    // SAFETY: NULL is nothing; the scene is given back once.
    unsafe {
        taut_scene_free(null_mut());
        taut_trace_free(null_mut());
        assert_eq!(taut_trace_length(null()), 0);
        taut_scene_free(scene);
    }
}

#[test]
fn numbers_without_meaning_are_refused_and_give_no_force() {
    let (scene, good) = sphere();
    let mut force = TautForce {
        force: [9.0; 3],
        ..TautForce::default()
    };
    let step = |time: f64, device: TautPose, force: &mut TautForce| {
        // SAFETY: a scene and valid places.
        unsafe { taut_coupling_step(scene, time, &raw const device, force) }
    };
    let mut nan = good;
    nan.position[1] = f64::NAN;
    assert_eq!(step(0.0, nan, &mut force), TautStatus::TAUT_BAD_ARGUMENT);
    assert!(
        said().contains("finite") && force == TautForce::default(),
        "{}",
        said()
    );
    let mut long = good;
    long.rotation = [2.0, 0.0, 0.0, 0.0];
    assert_eq!(step(0.0, long, &mut force), TautStatus::TAUT_BAD_ARGUMENT);
    assert!(said().contains("the quaternion has norm 2"), "{}", said());
    assert_eq!(
        step(f64::NAN, good, &mut force),
        TautStatus::TAUT_BAD_ARGUMENT
    );
    assert_eq!(step(1.0, good, &mut force), TautStatus::TAUT_OK);
    assert_eq!(step(0.5, good, &mut force), TautStatus::TAUT_BAD_ARGUMENT);
    assert!(said().contains("never run back"), "{}", said());
    // SAFETY: a scene and a valid pose; then the scene is given back once.
    unsafe {
        let status = taut_obstacle_move(scene, 7, &raw const good);
        assert_eq!(status, TautStatus::TAUT_BAD_ARGUMENT);
        assert!(said().contains("no obstacle 7"), "{}", said());
        taut_scene_free(scene);
    }
}

#[test]
fn a_short_buffer_is_refused_with_the_length_that_is_needed() {
    let (mut good, mut needed, mut buffer) = (true, 0, [1 as c_char; 4]);
    let path = c"nowhere.ply".as_ptr();
    // SAFETY: valid places; the length is the buffer's.
    let status =
        unsafe { taut_check(path, &raw mut good, buffer.as_mut_ptr(), 4, &raw mut needed) };
    assert_eq!((status, buffer), (TautStatus::TAUT_SHORT_BUFFER, [1; 4]));
    assert!(!good && needed > 4 && said().contains(&needed.to_string()));
    let mut long = vec![1 as c_char; needed];
    // SAFETY: as before.
    let status = unsafe { taut_check(path, &raw mut good, long.as_mut_ptr(), needed, null_mut()) };
    // SAFETY: the call wrote a string.
    let text = unsafe { CStr::from_ptr(long.as_ptr()) }.to_string_lossy();
    assert_eq!(status, TautStatus::TAUT_OK);
    assert!(text.contains("nowhere.ply: cannot be opened"), "{text}");
}

#[test]
fn a_bad_file_is_refused_with_the_words_of_the_program() {
    let (status, scene) = load("no-such-scene.toml");
    assert_eq!(status, TautStatus::TAUT_BAD_FILE);
    assert!(scene.is_null());
    let program = taut_scene::Scene::named_or_file("no-such-scene.toml").unwrap_err();
    assert_eq!(said(), program.to_string());
}
