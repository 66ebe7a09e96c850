//! The laboratory: recipes for which haptic methods are known to fail, run for several methods and rates on a virtual clock.
//!
//! A recipe is a geometry, a motion of the device, the ideal answer where it has a closed form, and pass lines. Every recipe is
//! run for every method and every rate of updates; the failures of the baselines are shown, since they are the point.
//!
//! - [`method`]: what a method has to do, and which there are; `methods`: each in a file.
//! - [`clock`]: the virtual clock, and what it records.
//! - [`recipe`]: what a recipe is; [`recipes`]: all of them; [`study`]: those that are no run along a path.
//! - [`oracle`]: right answers for recipes without a formula, by a way that shares nothing with the method.
//! - `reference`: right answers for scenes without either, by the method itself, with their own error.
//! - [`measure`]: errors of force, steps, energy, penetration, in units of what people feel.
//! - [`outcome`]: a recipe run for one method at one rate, against its pass lines.
//! - [`measured`]: what is measured of runs from every start phase; [`store`]: results that a later run need not make again.
//! - [`sweeps`]: one setting of this project's method at a time, error against time; `maps`: stability, method by method.
//! - [`costs`]: what updates cost, from a committed table; `felt`: the error in what people feel, millisecond by millisecond.
//! - [`crew`]: work side by side; [`run`]: all of it, with progress; [`page`]: the report as one HTML file; `provenance`: on what it was made.
//! - [`row`]: the one type of row that tables and files are made of.
//! - [`papers`]: each opponent on a scene of its own paper.
//! - [`replay`]: measured contact forces of a person's hand, and what each method renders for the same motion.
//! - [`fidelity`]: is what a scene chooses for itself the cheapest that is good enough?
//! - [`score`]: the headline; [`report`]: table and CSV; `chart`: error against time, recipe by recipe; [`overview`]: all of them in one picture.
//!
//! Same machine type, same answers, and same pictures: what an update costs is drawn from the committed table. Times that a run took stand in
//! a file of their own.

mod chart;
pub mod clock;
pub mod costs;
mod cpu_time;
pub mod crew;
mod felt;
pub mod fidelity;
mod figures;
mod maps;
pub mod measure;
pub mod measured;
pub mod method;
mod methods;
pub mod oracle;
pub mod outcome;
pub mod overview;
pub mod page;
pub mod papers;
mod plot;
mod port;
mod provenance;
mod reasons;
pub mod recipe;
pub mod recipes;
mod reference;
pub mod replay;
pub mod report;
pub mod row;
pub mod run;
pub mod score;
pub mod store;
pub mod study;
pub mod sweeps;
mod tuning;
mod vertex_depth;
