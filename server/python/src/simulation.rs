//! A scene and the two loops of the method on it.

use std::sync::{Mutex, MutexGuard};

use god_object::ProjectionStatus;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use taut_scene::{Runner, Scene};

use crate::convert::{VectorLike, array_of, bad, bad_file, pose_of, table};

/// A scene that is stepped. Threads may share it: they take turns, without the interpreter's lock.
#[pyclass(frozen, module = "taut")]
pub(crate) struct Simulation {
    runner: Mutex<Runner>,
    #[pyo3(get)]
    name: String,
    #[pyo3(get)]
    stiffness: f64,
    #[pyo3(get)]
    size: f64,
    #[pyo3(get)]
    mass: f64,
    #[pyo3(get)]
    obstacles: Vec<String>,
    reference_point: [f64; 3],
}

/// What one update of the god-object did.
#[pyclass(frozen, get_all, module = "taut")]
pub(crate) struct Update {
    contacts: usize,
    active: usize,
    gap_min: f64,
    kkt: f64,
    substeps: u32,
    solver_failures: u32,
    obstacles_blocked: u32,
    unfinished: bool,
}

/// The force on the hand.
#[pyclass(frozen, module = "taut")]
pub(crate) struct Force {
    wrench: [f64; 6],
    #[pyo3(get)]
    active: usize,
    #[pyo3(get)]
    kkt: f64,
    #[pyo3(get)]
    solved: bool,
    #[pyo3(get)]
    saturated: bool,
}

#[pymethods]
impl Force {
    #[getter]
    fn wrench<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.wrench)
    }
}

impl Simulation {
    /// The runner, after whoever has it now. A call that panicked leaves it unusable until `reset`.
    fn lock(&self) -> PyResult<MutexGuard<'_, Runner>> {
        self.runner.lock().map_err(|_| {
            bad("an earlier call ended by a fault of the library; reset the simulation")
        })
    }

    /// The number of an obstacle. One that is below 0 or beyond any list is refused as every other that no obstacle has.
    fn index_of(&self, index: &Bound<'_, PyAny>) -> PyResult<usize> {
        index.extract::<usize>().map_err(|error| {
            if error.is_instance_of::<PyOverflowError>(index.py()) {
                self.no_obstacle(index)
            } else {
                error
            }
        })
    }

    fn no_obstacle(&self, index: &impl std::fmt::Display) -> PyErr {
        let count = self.obstacles.len();
        bad(format!(
            "there is no obstacle {index}; the scene has {count}, counted from 0"
        ))
    }
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scene, overrides = Vec::new()))]
    fn new(py: Python<'_>, scene: &str, overrides: Vec<String>) -> PyResult<Self> {
        let built = py
            .detach(|| {
                Scene::named_or_file(scene)?
                    .with_overrides(&overrides)?
                    .build()
            })
            .map_err(bad_file)?;
        Ok(Self {
            name: built.name.clone(),
            stiffness: built.stiffness(),
            size: built.size,
            mass: built.world.body.mass,
            obstacles: built
                .world
                .obstacles
                .iter()
                .map(|o| o.name.clone())
                .collect(),
            reference_point: built.world.body.reference_point.into(),
            runner: Mutex::new(Runner::of_scene(built).map_err(|error| bad(error.to_string()))?),
        })
    }

    #[getter]
    fn reference_point<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.reference_point)
    }

    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let start = py.detach(|| Ok::<_, PyErr>(*self.lock()?.start()))?;
        Ok(array_of(py, &start))
    }

    #[getter]
    fn god_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let pose = py.detach(|| Ok::<_, PyErr>(*self.lock()?.god_object().pose()))?;
        Ok(array_of(py, &pose))
    }

    fn update(&self, py: Python<'_>, device: VectorLike<'_>) -> PyResult<Update> {
        let device = pose_of(&device)?;
        let report = py.detach(|| Ok::<_, PyErr>(self.lock()?.update(&device)))?;
        Ok(Update {
            contacts: report.contacts,
            active: report.active,
            gap_min: report.gap_min,
            kkt: report.kkt,
            substeps: report.substeps,
            solver_failures: report.solver_failures,
            obstacles_blocked: report.obstacles_blocked,
            unfinished: report.unfinished,
        })
    }

    fn force(&self, py: Python<'_>, time: f64, device: VectorLike<'_>) -> PyResult<Force> {
        let device = pose_of(&device)?;
        let output = py.detach(|| {
            let mut runner = self.lock()?;
            runner.check_time(time).map_err(bad)?;
            Ok::<_, PyErr>(runner.force(time, &device))
        })?;
        Ok(Force {
            wrench: output.wrench.into(),
            active: output.active,
            kkt: output.kkt,
            solved: output.status == ProjectionStatus::Solved,
            saturated: output.saturated,
        })
    }

    fn constraints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = py.detach(|| {
            let runner = self.lock()?;
            let rows = runner.constraint_set().constraints.iter();
            Ok::<_, PyErr>(
                rows.flat_map(|row| {
                    let (p, n) = (row.point, row.normal);
                    [p.x, p.y, p.z, n.x, n.y, n.z, row.gap]
                })
                .collect(),
            )
        })?;
        table(py, rows, 7)
    }

    fn move_obstacle(
        &self,
        py: Python<'_>,
        index: &Bound<'_, PyAny>,
        target: VectorLike<'_>,
    ) -> PyResult<()> {
        let index = self.index_of(index)?;
        let target = pose_of(&target)?;
        py.detach(|| self.lock()?.move_obstacle(index, &target).map_err(bad))
    }

    fn obstacle_pose<'py>(
        &self,
        py: Python<'py>,
        index: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let index = self.index_of(index)?;
        let pose = py.detach(|| Ok::<_, PyErr>(self.lock()?.obstacle_pose(index).copied()))?;
        let pose = pose.ok_or_else(|| self.no_obstacle(&index))?;
        Ok(array_of(py, &pose))
    }

    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.runner.clear_poison();
        py.detach(|| self.lock()?.reset().map_err(|error| bad(error.to_string())))
    }
}
