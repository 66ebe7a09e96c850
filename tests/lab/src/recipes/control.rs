//! The control recipes, which live in a package of their own: run from there, and told as rows.
//!
//! They close the loop through a simulated device and hand with this project's coupling; the methods and rates of the other recipes have no
//! part in them.

use taut_control_tests::RECIPES;

use super::Extent;
use crate::method::Method;
use crate::row::Row;

/// The rows of one of them. The quick extent names it only: its package's tests run it.
pub(super) fn run(name: &'static str, extent: Extent) -> Vec<Row> {
    let about = "closed loop with a simulated device";
    let row = Row::new(name, about, Method::Ours.name());
    if extent == Extent::Quick {
        return vec![
            row.out_of_scope("run by the tests of taut-control-tests and by the full extent"),
        ];
    }
    let recipe = RECIPES.iter().find(|recipe| recipe.name == name);
    let Some(recipe) = recipe else {
        return vec![row.never("not_in_taut-control-tests", 1)];
    };
    (recipe.run)()
        .into_iter()
        .map(|found| {
            let row = Row {
                settings: format!("measured {}; expected {}", found.measured, found.expected),
                ..Row::new(name, &found.case, Method::Ours.name())
            };
            row.never("missed", usize::from(!found.pass))
        })
        .collect()
}

/// R09 with a sheet of no thickness needs meshes that are no solids.
pub(super) fn sheet(_extent: Extent) -> Vec<Row> {
    let row = Row::new("R09", "two-sided sheet of 0 mm", "all methods");
    vec![row.out_of_scope(
        "meshes are closed solids: a sheet without thickness is refused when it is loaded",
    )]
}

/// R24 needs real sockets.
pub(super) fn cluster(_extent: Extent) -> Vec<Row> {
    let row = Row::new("R24", "cluster", "all methods");
    vec![row.out_of_scope("no haptic method: sockets and clients, in taut-network-tests")]
}
