//! The Python module `taut._taut`; `taut/__init__.pyi` says what is in it, with units and frames.
#![forbid(unsafe_code)]

mod convert;
mod files;
mod push;
mod simulation;

use pyo3::prelude::*;

pyo3::create_exception!(
    taut,
    TautError,
    pyo3::exceptions::PyValueError,
    "Input that cannot be used; the text says what, where and what to do."
);

#[pymodule]
#[pyo3(name = "_taut")]
fn taut_module(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("TautError", module.py().get_type::<TautError>())?;
    module.add(
        "COLUMNS",
        taut_scene::REPLAY_COLUMNS.split(',').collect::<Vec<_>>(),
    )?;
    module.add(
        "SHIPPED_SCENES",
        taut_scene::SHIPPED_SCENES.map(|scene| scene.name).to_vec(),
    )?;
    module.add_class::<simulation::Simulation>()?;
    module.add_class::<simulation::Update>()?;
    module.add_class::<simulation::Force>()?;
    module.add_class::<files::FileReport>()?;
    module.add_class::<push::PushWrench>()?;
    module.add_function(wrap_pyfunction!(files::check, module)?)?;
    module.add_function(wrap_pyfunction!(files::read_trace, module)?)?;
    module.add_function(wrap_pyfunction!(files::replay, module)?)
}
