//! All recipes.

mod bodies;
mod cylinder;
mod fast_impact;
mod ghost_plane;
mod late_contact;
mod push_slide_lift;
mod thin_plate;
mod wrong_side;

use crate::recipe::Recipe;

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
#[must_use]
pub fn all(extent: Extent) -> Vec<Recipe> {
    [
        push_slide_lift::recipes,
        thin_plate::recipes,
        fast_impact::recipes,
        late_contact::recipes,
        cylinder::recipes,
        ghost_plane::recipes,
        wrong_side::recipes,
    ]
    .into_iter()
    .flat_map(|recipes| recipes(extent))
    .collect()
}
