//! A scene and the two loops of the method on it.

use std::ffi::c_char;
use std::sync::{Mutex, TryLockError};

use taut_scene::{REPLAY_COLUMNS, ReplayWriter, Runner, Scene};

use crate::errors::{Refusal, TautStatus, guard, put, put_text, reference, text};
use crate::types::{TautForce, TautPose, TautSceneInfo, TautUpdate};

/// A scene that is stepped. One thread at a time may use it; a second one is answered `TAUT_BUSY`.
pub struct TautScene {
    info: TautSceneInfo,
    runner: Mutex<Runner>,
}

impl TautScene {
    fn with<R>(&self, body: impl FnOnce(&mut Runner) -> Result<R, Refusal>) -> Result<R, Refusal> {
        match self.runner.try_lock() {
            Ok(mut runner) => body(&mut runner),
            Err(TryLockError::WouldBlock) => Err(Refusal::of(
                TautStatus::TAUT_BUSY,
                "another thread is in a call with this scene; give each thread a scene of its own, or take turns",
            )),
            Err(TryLockError::Poisoned(_)) => Err(Refusal::of(
                TautStatus::TAUT_PANIC,
                "an earlier call with this scene ended by a fault of the library; reset or free it",
            )),
        }
    }
}

/// The library's version.
#[unsafe(no_mangle)]
pub extern "C" fn taut_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// Loads a shipped scene by its name (`peg-in-a-hole`, ...), or a scene file by its path. Free it with `taut_scene_free`.
///
/// # Safety
/// `name_or_path` is a string that ends with a zero byte; `scene` is valid for a write. Both may be NULL, and are refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_scene_load(
    name_or_path: *const c_char,
    scene: *mut *mut TautScene,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        unsafe { put(scene, std::ptr::null_mut(), "scene") }?;
        // SAFETY: as promised by the caller.
        let name = unsafe { text(name_or_path, "name_or_path") }?;
        let built = Scene::named_or_file(name)
            .and_then(|scene| scene.build())
            .map_err(|error| Refusal::file(&error))?;
        let info = TautSceneInfo {
            start: TautPose::of(&built.start),
            reference_point: built.world.body.reference_point.into(),
            mass: built.world.body.mass,
            stiffness: built.stiffness(),
            size: built.size,
            obstacles: built.world.obstacles.len(),
        };
        let runner = Runner::of_scene(built)
            .map_err(|error| Refusal::of(TautStatus::TAUT_BAD_FILE, error.to_string()))?;
        let handle = Box::new(TautScene {
            info,
            runner: Mutex::new(runner),
        });
        // SAFETY: as promised by the caller.
        unsafe { put(scene, Box::into_raw(handle), "scene") }
    })
}

/// Gives a scene back; NULL is nothing. No other thread may be in a call with it.
///
/// # Safety
/// `scene` is NULL or of `taut_scene_load`, and is used no more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_scene_free(scene: *mut TautScene) {
    if !scene.is_null() {
        guard(|| {
            // SAFETY: of `Box::into_raw`, and given back once, as promised by the caller.
            drop(unsafe { Box::from_raw(scene) });
            Ok(())
        });
    }
}

/// What a scene is.
///
/// # Safety
/// `scene` is NULL or a scene; `info` is NULL or valid for a write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_scene_info(
    scene: *const TautScene,
    info: *mut TautSceneInfo,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        let scene = unsafe { reference(scene, "scene") }?;
        // SAFETY: as promised by the caller.
        unsafe { put(info, scene.info, "info") }
    })
}

/// Back to the start, as if nothing had been stepped. Allocates memory: not for a real-time loop.
///
/// # Safety
/// `scene` is NULL or a scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_scene_reset(scene: *mut TautScene) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        let scene = unsafe { reference(scene, "scene") }?;
        scene.runner.clear_poison();
        scene.with(|runner| {
            runner
                .reset()
                .map_err(|error| Refusal::argument(error.to_string()))
        })
    })
}

/// Loop 1: the god-object follows the device as far as the obstacles let it, and never further. `god_object` gets its pose; `update`
/// gets what was done, and may be NULL.
///
/// # Safety
/// `scene` is NULL or a scene; the others are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_god_object_update(
    scene: *mut TautScene,
    device: *const TautPose,
    god_object: *mut TautPose,
    update: *mut TautUpdate,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        let (scene, device) = unsafe { (reference(scene, "scene")?, reference(device, "device")?) };
        let device = device.pose()?;
        if god_object.is_null() {
            return Err(Refusal::argument("`god_object` is NULL"));
        }
        scene.with(|runner| {
            let report = runner.update(&device);
            if !update.is_null() {
                // SAFETY: not NULL, and valid as promised by the caller.
                unsafe { update.write(TautUpdate::of(&report)) };
            }
            let pose = TautPose::of(runner.god_object().pose());
            // SAFETY: as promised by the caller.
            unsafe { put(god_object, pose, "god_object") }
        })
    })
}

/// Loop 2: the force for a device pose on the newest constraint set. `time`, s, never runs back; once per reading of the device.
///
/// # Safety
/// `scene` is NULL or a scene; the others are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_coupling_step(
    scene: *mut TautScene,
    time: f64,
    device: *const TautPose,
    force: *mut TautForce,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        unsafe { put(force, TautForce::default(), "force") }?; // no force, unless there is an answer
        // SAFETY: as promised by the caller.
        let (scene, device) = unsafe { (reference(scene, "scene")?, reference(device, "device")?) };
        let device = device.pose()?;
        scene.with(|runner| {
            runner.check_time(time).map_err(Refusal::argument)?;
            let answer = TautForce::of(&runner.force(time, &device));
            // SAFETY: as promised by the caller.
            unsafe { put(force, answer, "force") }
        })
    })
}

/// Sends an obstacle (counted from 0, in the scene file's order) somewhere: it goes there at the next update of the god-object.
///
/// # Safety
/// `scene` is NULL or a scene; `target` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_obstacle_move(
    scene: *mut TautScene,
    obstacle: usize,
    target: *const TautPose,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        let (scene, target) = unsafe { (reference(scene, "scene")?, reference(target, "target")?) };
        let target = target.pose()?;
        scene.with(|runner| {
            runner
                .move_obstacle(obstacle, &target)
                .map_err(Refusal::argument)
        })
    })
}

/// Where an obstacle is.
///
/// # Safety
/// `scene` is NULL or a scene; `pose` is NULL or valid for a write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_obstacle_pose(
    scene: *const TautScene,
    obstacle: usize,
    pose: *mut TautPose,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        let scene = unsafe { reference(scene, "scene") }?;
        scene.with(|runner| {
            let found = runner.obstacle_pose(obstacle).ok_or_else(|| {
                Refusal::argument(format!(
                    "there is no obstacle {obstacle}; the scene has {}, counted from 0",
                    scene.info.obstacles
                ))
            })?;
            // SAFETY: as promised by the caller.
            unsafe { put(pose, TautPose::of(found), "pose") }
        })
    })
}

/// The names of the columns of `taut_replay_row`, without an end of line.
#[unsafe(no_mangle)]
pub extern "C" fn taut_replay_header() -> *const c_char {
    static HEADER: std::sync::OnceLock<std::ffi::CString> = std::sync::OnceLock::new();
    HEADER
        .get_or_init(|| std::ffi::CString::new(REPLAY_COLUMNS).unwrap_or_default())
        .as_ptr()
}

/// Moves the scene's obstacles, updates the god-object, computes the force, and writes the row that `taut replay` writes, without an
/// end of line. 1024 bytes are always enough. Where the buffer is too short, the row was computed and is lost.
///
/// # Safety
/// `scene` is NULL or a scene; `device` is NULL or valid; `buffer` is NULL or valid for `length` bytes, `needed` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_replay_row(
    scene: *mut TautScene,
    time: f64,
    device: *const TautPose,
    buffer: *mut c_char,
    length: usize,
    needed: *mut usize,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        let (scene, device) = unsafe { (reference(scene, "scene")?, reference(device, "device")?) };
        let device = device.pose()?;
        if buffer.is_null() {
            return Err(Refusal::argument("`buffer` is NULL"));
        }
        scene.with(|runner| {
            runner.check_time(time).map_err(Refusal::argument)?;
            let row = runner.row(time, &device, &mut ());
            let line = ReplayWriter::line(&row);
            // SAFETY: as promised by the caller.
            unsafe { put_text(line.trim_end(), buffer, length, needed) }
        })
    })
}
