//! Scenes, workbenches, shapes and checks from outside the crate.

mod checks;
mod generated_shapes;
mod scene_faults;
mod shipped;
mod workbench_faults;
