//! All recipes.

mod arrival;
mod bad_meshes;
mod bodies;
mod bunny;
mod comb;
mod control;
mod convex_edge;
mod cylinder;
mod fast_impact;
mod flat_on_flat;
mod free_space;
mod friction;
mod ghost_plane;
mod groove;
mod late_contact;
mod moving_plate;
mod nut;
mod oracles;
mod peg;
mod prism;
mod push_slide_lift;
mod scale;
mod shading_energy;
mod spinning_bar;
mod start_inside;
mod texture;
mod thin_plate;
mod wrong_side;

pub(crate) use bodies::{ball, block, cube, force, ground};
pub(crate) use bunny::large as large_bunnies;
pub(crate) use oracles::SolverName;
pub(crate) use oracles::many_contacts::random_contacts;

use std::borrow::Borrow;

use crate::recipe::Recipe;
use crate::study::Study;

/// How much of each recipe is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// As the recipe says.
    Full,
    /// Fewer start phases and shorter holds.
    Quick,
}

impl Extent {
    /// One of two.
    fn choose<T>(self, full: T, quick: T) -> T {
        match self {
            Self::Full => full,
            Self::Quick => quick,
        }
    }
}

/// Every recipe, case by case.
pub fn all(extent: Extent) -> Vec<Recipe> {
    [
        free_space::recipes,
        push_slide_lift::recipes,
        flat_on_flat::recipes,
        groove::recipes,
        convex_edge::recipes,
        thin_plate::recipes,
        fast_impact::recipes,
        spinning_bar::recipes,
        late_contact::recipes,
        cylinder::recipes,
        ghost_plane::recipes,
        peg::recipes,
        comb::recipes,
        nut::recipes,
        bunny::recipes,
        wrong_side::recipes,
        texture::recipes,
        friction::recipes,
        shading_energy::recipes,
        scale::recipes,
        moving_plate::recipes,
    ]
    .into_iter()
    .flat_map(|recipes| recipes(extent))
    .collect()
}

/// The one of these with this name and case.
///
/// # Panics
///
/// Where there is none.
pub fn named<R: Borrow<Recipe>>(recipes: impl IntoIterator<Item = R>, name: &str, case: &str) -> R {
    let is_it = |recipe: &R| (recipe.borrow().name, recipe.borrow().case.as_str()) == (name, case);
    let found = recipes.into_iter().find(is_it);
    found.unwrap_or_else(|| panic!("no recipe {name}, {case}"))
}

/// Every recipe that is no run along a path. A new one is one line here.
#[rustfmt::skip]
pub const STUDIES: &[Study] = &[
    Study { name: "R03", about: "one contact off centre: closed form", run: oracles::one_contact::run },
    Study { name: "R04", about: "flat on flat: any number of contacts", run: oracles::flat_on_flat::run },
    Study { name: "R05", about: "near-parallel normals", run: oracles::near_parallel::run },
    Study { name: "R06", about: "V-groove", run: oracles::groove::run },
    Study { name: "R07", about: "corner of three planes", run: oracles::corner::run },
    Study { name: "R09", about: "thin plate: a sheet of no thickness", run: control::sheet },
    Study { name: "R14", about: "a wall that arrives late", run: arrival::run },
    Study { name: "R15", about: "critical stiffness of a wall", run: |extent| control::run("R15", extent) },
    Study { name: "R16", about: "limit cycles of a quantised encoder", run: |extent| control::run("R16", extent) },
    Study { name: "R17", about: "handle released in the hole", run: |extent| control::run("R17", extent) },
    Study { name: "R20", about: "rotation past a half turn", run: |extent| control::run("R20", extent) },
    Study { name: "R21", about: "wind-up of two turns", run: |extent| control::run("R21", extent) },
    Study { name: "R22", about: "bad samples of the device", run: |extent| control::run("R22", extent) },
    Study { name: "R23", about: "saturation", run: |extent| control::run("R23", extent) },
    Study { name: "R24", about: "cluster", run: control::cluster },
    Study { name: "R27", about: "bunny on bunny: where its data are not there", run: bunny::unavailable },
    Study { name: "R32", about: "bad meshes", run: bad_meshes::run },
    Study { name: "R33", about: "start in penetration", run: start_inside::run },
    Study { name: "R35", about: "loops that stall", run: |extent| control::run("R35", extent) },
    Study { name: "R36", about: "faults of a string-driven device", run: |extent| control::run("R36", extent) },
    Study { name: "R38", about: "thousands of contacts", run: oracles::many_contacts::run },
];
