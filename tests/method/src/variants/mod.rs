//! Conforming contact in many variants: scenes that nobody tuned for, made from factors, and what is measured in each.
//!
//! - [`mod@covering`]: which combinations of factors are run, so that every two levels of two factors meet.
//! - [`shapes`]: solids that fit each other.
//! - [`scene`]: a variant as a world, settings and the path of a hand.
//! - [`oracle`]: the force by every facing pair within reach.
//! - [`measure`]: one variant led along its path: times, rows, error against the oracle, penetrations.
//! - [`bunnies`]: no variant: two organic bodies that a hand slides over each other.

pub mod bunnies;
pub mod covering;
pub mod measure;
pub mod oracle;
pub mod scene;
pub mod shapes;

use shapes::Tessellation;

/// Which solids fit each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// A peg in a hole with an end stop below it.
    PegInHole,
    /// A shaft that stands out of its bore at both ends.
    ShaftInBore,
    /// A plate between two plates.
    PlateInSlot,
    /// A plate on a table.
    PlateOnTable,
    /// A plate on a half-space.
    PlateOnHalfSpace,
}

/// How the obstacle's surface feels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feel {
    /// Neither friction nor shading.
    Plain,
    /// Coulomb friction of 0.1.
    Friction,
    /// Force shading, crease angle 0.3 rad.
    Shading,
}

/// What moves by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moving {
    /// Nothing.
    Nothing,
    /// A part that the body does not touch.
    Aside,
    /// The part that holds the body, to and fro by 0.1 mm.
    Holder,
}

/// What the hand does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Presses, and stays.
    Rest,
    /// Presses, and slides along.
    Slide,
    /// Presses, and turns.
    Turn,
    /// Comes from where nothing touches, and goes again.
    Land,
}

/// One scene of conforming contact.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// What it is called in tables and on the command line.
    pub name: String,
    /// Which solids.
    pub fit: Fit,
    /// Least play on each side, m.
    pub clearance: f64,
    /// How the body is cut.
    pub body: Tessellation,
    /// How the obstacle is cut.
    pub obstacle: Tessellation,
    /// By which share of its facets the obstacle is turned against the body.
    pub turned: f64,
    /// Every vertex is off by up to this along each axis, m.
    pub roughness: f64,
    /// How far the middle of the body's surface stands out, m.
    pub crown: f64,
    /// A half-space far below.
    pub floor: bool,
    /// The obstacles' surface.
    pub feel: Feel,
    /// What moves by itself.
    pub moving: Moving,
    /// What the hand does.
    pub motion: Motion,
    /// Of the roughness and of the place in the world.
    pub seed: u64,
}

/// The peg of the method's table of targets: 26,208 triangles in a hole of 26,784, pushed to the side and down onto an end stop.
pub fn dense_peg(name: &str) -> Variant {
    let cut = Tessellation {
        facets: 144,
        bands: 90,
    };
    Variant {
        name: name.into(),
        fit: Fit::PegInHole,
        clearance: 1e-4,
        body: cut,
        obstacle: cut,
        turned: 0.0,
        roughness: 0.0,
        crown: 0.0,
        floor: false,
        feel: Feel::Plain,
        moving: Moving::Nothing,
        motion: Motion::Slide,
        seed: 1,
    }
}

/// A plate of so many facets around, crowned, that slides on a half-space.
pub fn crowned_plate(name: &str, facets: u32) -> Variant {
    let cut = Tessellation { facets, bands: 1 };
    Variant {
        fit: Fit::PlateOnHalfSpace,
        body: cut,
        obstacle: Tessellation { facets: 12, ..cut },
        crown: 22e-6,
        ..dense_peg(name)
    }
}

/// The cases that have names of their own.
pub fn named() -> Vec<Variant> {
    let long = Tessellation {
        facets: 72,
        bands: 1,
    };
    let banded = Tessellation {
        facets: 216,
        bands: 60,
    };
    vec![
        dense_peg("peg"),
        Variant {
            floor: true,
            ..dense_peg("peg-floor")
        },
        Variant {
            feel: Feel::Friction,
            ..dense_peg("peg-friction")
        },
        Variant {
            feel: Feel::Shading,
            ..dense_peg("peg-shading")
        },
        Variant {
            moving: Moving::Aside,
            ..dense_peg("peg-moving")
        },
        Variant {
            turned: 1.0 / 3.0,
            ..dense_peg("peg-turned")
        },
        Variant {
            body: long,
            obstacle: banded,
            ..dense_peg("peg-long-in-banded")
        },
        Variant {
            body: banded,
            obstacle: long,
            ..dense_peg("peg-banded-in-long")
        },
        Variant {
            clearance: 7e-6,
            ..dense_peg("peg-h7g6")
        },
        Variant {
            fit: Fit::PlateOnTable,
            // Bends of 7 urad from face to face.
            body: Tessellation {
                facets: 1440,
                bands: 1,
            },
            obstacle: Tessellation {
                facets: 12,
                bands: 1,
            },
            crown: 22e-6,
            motion: Motion::Rest,
            ..dense_peg("plate-crowned")
        },
        crowned_plate("plate-half-space", 1440),
    ]
}

/// Variants in which every two levels of two factors meet; with at most about `triangles` triangles a side.
pub fn covering(triangles: u32, seed: u64) -> Vec<Variant> {
    let fits = [
        Fit::PegInHole,
        Fit::ShaftInBore,
        Fit::PlateInSlot,
        Fit::PlateOnTable,
    ];
    let motions = [Motion::Rest, Motion::Slide, Motion::Turn, Motion::Land];
    let feels = [Feel::Plain, Feel::Friction, Feel::Shading];
    let movings = [Moving::Nothing, Moving::Aside, Moving::Holder];
    let clearances = [5e-6, 2e-5, 1e-4, 1e-3];
    let facets = [12, 72, 180, 720];
    let turns = [0.0, 1.0 / 3.0, 0.5];
    let roughness = [0.0, 1e-6, 5e-6];
    let crowns = [0.0, 22e-6];
    let rows = covering::pairwise(&[4, 4, 4, 4, 3, 3, 3, 3, 3, 2, 2], seed);
    let variant = |(k, row): (usize, Vec<usize>)| {
        let flat = matches!(fits[row[0]], Fit::PlateInSlot | Fit::PlateOnTable);
        // A plate has the square of its cells along a side, twice, and up to two bands.
        let most = if flat {
            12 * (triangles / 8).isqrt()
        } else {
            triangles / 4
        };
        let facets = facets[row[3]].min(most).max(7);
        let bands = (triangles / (2 * facets)).clamp(1, 60);
        let banded = Tessellation { facets, bands };
        let long = Tessellation { facets, bands: 1 };
        let other = Tessellation {
            facets: (facets * 3 / 5 + 1).max(7),
            bands: (bands * 2 / 3).max(1),
        };
        let [body, obstacle] = [[banded, banded], [long, banded], [banded, other]][row[4]];
        Variant {
            name: format!("v{k}"),
            fit: fits[row[0]],
            motion: motions[row[1]],
            clearance: clearances[row[2]],
            body,
            obstacle,
            turned: turns[row[5]],
            roughness: roughness[row[6]],
            feel: feels[row[7]],
            moving: movings[row[8]],
            crown: crowns[row[9]],
            floor: row[10] == 1,
            seed: seed + k as u64,
        }
    };
    rows.into_iter().enumerate().map(variant).collect()
}
