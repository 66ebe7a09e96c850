//! Files: traces of a device, and what is wrong with meshes, scenes and traces.

use std::ffi::c_char;
use std::path::Path;

use taut_scene::DeviceTrace;

use crate::errors::{Refusal, TautStatus, guard, put, put_text, reference, text};
use crate::types::TautPose;

/// A recorded motion of the device.
pub struct TautTrace(DeviceTrace);

/// Looks at a file (mesh, scene, trace or workbench) as `taut check` does, and writes what was found, as text. `good` gets whether
/// nothing is wrong. A file that is bad, or missing, is an answer, no error.
///
/// # Safety
/// `path` is NULL or a string that ends with a zero byte; `buffer` is NULL or valid for `length` bytes, the others are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_check(
    path: *const c_char,
    good: *mut bool,
    buffer: *mut c_char,
    length: usize,
    needed: *mut usize,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        unsafe { put(good, false, "good") }?;
        // SAFETY: as promised by the caller.
        let path = unsafe { text(path, "path") }?;
        let reports = taut_scene::check(&[path]);
        let report = reports
            .first()
            .ok_or_else(|| Refusal::argument("no report"))?;
        // SAFETY: as promised by the caller.
        unsafe {
            put(good, report.is_good(), "good")?;
            put_text(&report.to_string(), buffer, length, needed)
        }
    })
}

/// Reads a trace: CSV with the columns t, x, y, z, qw, qx, qy, qz. Free it with `taut_trace_free`.
///
/// # Safety
/// `path` is NULL or a string that ends with a zero byte; `trace` is NULL or valid for a write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_trace_load(
    path: *const c_char,
    trace: *mut *mut TautTrace,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        unsafe { put(trace, std::ptr::null_mut(), "trace") }?;
        // SAFETY: as promised by the caller.
        let path = unsafe { text(path, "path") }?;
        let loaded = DeviceTrace::load(Path::new(path)).map_err(|error| Refusal::file(&error))?;
        // SAFETY: as promised by the caller.
        unsafe { put(trace, Box::into_raw(Box::new(TautTrace(loaded))), "trace") }
    })
}

/// Number of samples; 0 for NULL.
///
/// # Safety
/// `trace` is NULL or a trace.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_trace_length(trace: *const TautTrace) -> usize {
    // SAFETY: as promised by the caller.
    unsafe { trace.as_ref() }.map_or(0, |trace| trace.0.samples().len())
}

/// One sample, counted from 0: its time, s, and the device's pose.
///
/// # Safety
/// `trace` is NULL or a trace; the others are NULL or valid for a write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_trace_sample(
    trace: *const TautTrace,
    index: usize,
    time: *mut f64,
    device: *mut TautPose,
) -> TautStatus {
    guard(|| {
        // SAFETY: as promised by the caller.
        let samples = unsafe { reference(trace, "trace") }?.0.samples();
        let sample = samples.get(index).ok_or_else(|| {
            let count = samples.len();
            Refusal::argument(format!(
                "there is no sample {index}; the trace has {count}, counted from 0"
            ))
        })?;
        // SAFETY: as promised by the caller.
        unsafe {
            put(time, sample.time, "time")?;
            put(device, TautPose::of(&sample.pose), "device")
        }
    })
}

/// Gives a trace back; NULL is nothing.
///
/// # Safety
/// `trace` is NULL or of `taut_trace_load`, and is used no more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn taut_trace_free(trace: *mut TautTrace) {
    if !trace.is_null() {
        // SAFETY: of `Box::into_raw`, and given back once, as promised by the caller.
        drop(unsafe { Box::from_raw(trace) });
    }
}
