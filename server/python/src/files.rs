//! Files: what is wrong with them, traces, and the replay of a trace.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use numpy::PyArray2;
use pyo3::prelude::*;
use taut_scene::{
    DeviceTrace, FinishedFile, REPLAY_COLUMNS, ReplayWriter, Runner, Scene, numbers_of_pose,
};

use crate::convert::{bad, bad_file, table};

/// Time between two looks whether a signal came, such as that of Ctrl-C: each waits until the interpreter's lock is free.
const SIGNAL_LOOK: Duration = Duration::from_millis(100);

/// What was found about one file.
#[pyclass(frozen, get_all, module = "taut")]
pub(crate) struct FileReport {
    file: String,
    good: bool,
    summary: String,
    problems: Vec<String>,
    notes: Vec<String>,
    /// Cubic metres; `None` if it is no mesh.
    volume: Option<f64>,
    /// Metres; `None` if it is no mesh.
    size: Option<(f64, f64, f64)>,
    triangles: Option<usize>,
    watertight: Option<bool>,
    text: String,
}

#[pymethods]
impl FileReport {
    fn __str__(&self) -> &str {
        &self.text
    }
}

#[pyfunction]
pub(crate) fn check(py: Python<'_>, path: PathBuf) -> PyResult<FileReport> {
    let report = py
        .detach(|| taut_scene::check(&[path]))
        .pop()
        .ok_or_else(|| bad("no report"))?;
    let mesh = report.mesh.as_ref();
    Ok(FileReport {
        text: report.to_string(),
        good: report.is_good(),
        problems: report.problems.iter().map(ToString::to_string).collect(),
        volume: mesh.map(|mesh| mesh.volume_m3),
        size: mesh.map(|mesh| mesh.size_m.into()),
        triangles: mesh.map(|mesh| mesh.triangles),
        watertight: mesh.map(|mesh| mesh.watertight),
        file: report.file,
        summary: report.summary,
        notes: report.notes,
    })
}

#[pyfunction]
pub(crate) fn read_trace(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let trace = py.detach(|| DeviceTrace::load(&path)).map_err(bad_file)?;
    let numbers = trace
        .samples()
        .iter()
        .flat_map(|sample| {
            [sample.time]
                .into_iter()
                .chain(numbers_of_pose(&sample.pose))
        })
        .collect();
    table(py, numbers, 8)
}

#[pyfunction]
#[pyo3(signature = (scene, trace, out = None))]
pub(crate) fn replay<'py>(
    py: Python<'py>,
    scene: &str,
    trace: PathBuf,
    out: Option<PathBuf>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let numbers = py.detach(|| rows(scene, &trace, out.as_deref()))?;
    table(py, numbers, REPLAY_COLUMNS.split(',').count())
}

/// All columns of all rows; the file, if one is named, gets the bytes that `taut replay` writes, and is neither the trace, nor the scene, nor
/// a file that this names. An exception of a signal's handler ends it, and nothing is written.
fn rows(scene: &str, trace: &Path, out: Option<&Path>) -> PyResult<Vec<f64>> {
    let named = [Path::new(scene), trace];
    let scene = Scene::named_or_file(scene).map_err(bad_file)?;
    let built = scene.build().map_err(bad_file)?;
    let files = scene.files().map_err(bad_file)?;
    let of_scene = files.iter().map(|(_, found)| found.as_path());
    let inputs: Vec<&Path> = named.into_iter().chain(of_scene).collect();
    let trace = DeviceTrace::load(trace).map_err(bad_file)?;
    let mut runner = Runner::of_scene(built).map_err(|error| bad(error.to_string()))?;
    let cannot_write = |error: std::io::Error| {
        bad(format!(
            "{}: the answer cannot be written ({error}); check the path, its permissions and the free space",
            out.unwrap_or(Path::new("")).display()
        ))
    };
    let mut writer = out
        .map(|out| ReplayWriter::new(FinishedFile::create(out, &inputs)?, false))
        .transpose()
        .map_err(cannot_write)?;
    let mut numbers = Vec::new();
    let mut looked = Instant::now();
    for sample in trace.samples() {
        if looked.elapsed() >= SIGNAL_LOOK {
            // None: the interpreter ends, and runs no handler any more.
            Python::try_attach(|py| py.check_signals()).transpose()?;
            looked = Instant::now();
        }
        let row = runner.row(sample.time, &sample.pose, &mut ());
        if let Some(writer) = &mut writer {
            writer.write(&row).map_err(cannot_write)?;
        }
        numbers.push(row.time);
        numbers.extend(numbers_of_pose(&row.device_pose));
        numbers.extend(numbers_of_pose(&row.god_object_pose));
        numbers.extend(row.wrench.iter());
        numbers.extend([row.contacts as f64, row.active as f64]);
        numbers.extend([row.gap_min, row.kkt, row.stale]);
    }
    if let Some(writer) = writer {
        writer
            .finish()
            .and_then(FinishedFile::finish)
            .map_err(cannot_write)?;
    }
    Ok(numbers)
}
