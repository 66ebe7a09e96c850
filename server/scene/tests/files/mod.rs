//! Scenes, workbenches, shapes and checks from outside the crate.

mod check_scenes;
mod checks;
mod edits;
mod exact_shapes;
mod fidelity;
mod generated_shapes;
mod looks;
mod scene_faults;
mod scene_page;
mod scene_values;
mod seen;
mod shipped;
mod simplification;
mod surfaces;
mod textured;
mod workbench_faults;
mod workbench_inputs;
mod workbench_lookers_on;
mod workbench_screens;
