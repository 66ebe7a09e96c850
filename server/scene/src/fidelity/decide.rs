//! The cheapest settings whose predicted error is within the budget: every setting of a small grid is looked at.

use super::body::BodyNeed;
use super::cost::{triangles_within, update_us};
use super::need::SceneNeed;
use super::parts::Parts;

/// Rates of updates to choose from, Hz. More than the device's rate brings nothing new.
pub const RATES: [f64; 8] = [70.0, 100.0, 140.0, 200.0, 300.0, 500.0, 700.0, 1000.0];
/// Gap tolerances to choose from, over the size of the body; the finest is the method's default.
pub const TOLERANCES: [f64; 3] = [1e-6, 1e-5, 4.5e-5];
/// Rounds of implicit constraints to choose from.
pub const ROUNDS: [u32; 3] = [0, 1, 2];
/// Most errors of a simplified mesh to choose from, over the size of the body; 0 is the mesh in the file.
pub const MESH_ERRORS: [f64; 5] = [0.0, 1e-4, 3e-4, 1e-3, 3e-3];

/// What is not free: the file names it, or the command line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fixed {
    /// Hz.
    pub rate: Option<f64>,
    /// m.
    pub gap_tolerance: Option<f64>,
    /// Implicit rounds.
    pub rounds: Option<u32>,
    /// For each body, god-object first: the most error of its mesh, m.
    pub mesh_errors: Vec<Option<f64>>,
}

/// Settings and what is predicted of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// Hz.
    pub rate: f64,
    /// m.
    pub gap_tolerance: f64,
    /// Implicit rounds.
    pub rounds: u32,
    /// For each body, god-object first: the most error of its mesh, m; 0 is the mesh as it is.
    pub mesh_errors: Vec<f64>,
    /// Predicted error in just-noticeable differences.
    pub j: f64,
    /// Predicted nominal time of an update, us.
    pub update_us: f64,
}

impl Chosen {
    /// Predicted nominal time per second, us.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.rate * self.update_us
    }
}

/// The settings with what is predicted of them.
#[must_use]
pub fn predicted(
    need: &SceneNeed,
    rate: f64,
    gap_tolerance: f64,
    rounds: u32,
    mesh_errors: Vec<f64>,
) -> Chosen {
    let bodies = std::iter::once(&need.body).chain(&need.obstacles);
    let triangles: f64 = bodies
        .zip(&mesh_errors)
        .map(|(body, error)| triangles(body, *error))
        .sum();
    Chosen {
        j: Parts::of(need, rate, gap_tolerance, rounds, &mesh_errors).j(),
        update_us: update_us(triangles, gap_tolerance / need.size, rounds),
        rate,
        gap_tolerance,
        rounds,
        mesh_errors,
    }
}

fn triangles(body: &BodyNeed, error: f64) -> f64 {
    triangles_within(body.triangles, body.area, body.curvature, error)
}

/// The cheapest settings within `budget_j`, and within `time_us` for an update if that is given. Where nothing is within both, the time counts, and the
/// least error within it; where nothing is within the time, the fastest.
#[must_use]
pub fn decide(need: &SceneNeed, fixed: &Fixed, budget_j: f64, time_us: Option<f64>) -> Chosen {
    let mut best: Option<(Rank, Chosen)> = None;
    for candidate in grid(need, fixed) {
        let rank = Rank::of(&candidate, budget_j, time_us);
        if best.as_ref().is_none_or(|(least, _)| rank.before(least)) {
            best = Some((rank, candidate));
        }
    }
    best.map_or_else(
        || predicted(need, RATES[7], TOLERANCES[0] * need.size, 0, Vec::new()),
        |(_, chosen)| chosen,
    )
}

/// Every setting that is free to be chosen.
#[must_use]
pub fn grid(need: &SceneNeed, fixed: &Fixed) -> Vec<Chosen> {
    let rates = fixed.rate.map_or(RATES.to_vec(), |rate| vec![rate]);
    let tolerances = fixed.gap_tolerance.map_or_else(
        || {
            let scaled = TOLERANCES.map(|share| share * need.size);
            let in_order = scaled.iter().copied();
            let fitting: Vec<f64> = in_order.filter(|t| *t <= need.widest_tolerance).collect();
            if fitting.is_empty() {
                vec![need.widest_tolerance]
            } else {
                fitting
            }
        },
        |tolerance| vec![tolerance],
    );
    let rounds = fixed.rounds.map_or(ROUNDS.to_vec(), |rounds| vec![rounds]);
    let mut found = Vec::new();
    for level in levels(need) {
        for rate in &rates {
            for tolerance in &tolerances {
                for rounds in &rounds {
                    let meshes = meshes(need, fixed, level);
                    found.push(predicted(need, *rate, *tolerance, *rounds, meshes));
                }
            }
        }
    }
    found
}

/// Mesh levels, if any mesh may be simplified.
fn levels(need: &SceneNeed) -> Vec<f64> {
    let mut bodies = std::iter::once(&need.body).chain(&need.obstacles);
    if bodies.any(|body| body.simplifiable) {
        MESH_ERRORS.to_vec()
    } else {
        vec![0.0]
    }
}

fn meshes(need: &SceneNeed, fixed: &Fixed, level: f64) -> Vec<f64> {
    let bodies = std::iter::once(&need.body).chain(&need.obstacles);
    bodies
        .enumerate()
        .map(|(index, body)| {
            let set = fixed.mesh_errors.get(index).copied().flatten();
            let free = if body.simplifiable {
                level * need.size
            } else {
                0.0
            };
            set.unwrap_or(free)
        })
        .collect()
}

/// What is compared, the first that differs decides; smaller is better.
struct Rank([f64; 3]);

impl Rank {
    fn of(candidate: &Chosen, budget_j: f64, time_us: Option<f64>) -> Self {
        let late = time_us.map_or(0.0, |time| (candidate.update_us - time).max(0.0));
        let over = (candidate.j - budget_j).max(0.0);
        Self([late, over, candidate.cost()])
    }

    fn before(&self, other: &Self) -> bool {
        let pairs = self.0.iter().zip(&other.0);
        pairs
            .map(|(a, b)| a.total_cmp(b))
            .find(|order| order.is_ne())
            .is_some_and(std::cmp::Ordering::is_lt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fidelity::contact_tests::{self, sphere};

    fn need(body: BodyNeed, obstacle: BodyNeed) -> SceneNeed {
        SceneNeed {
            k_s: 0.5,
            speed: 0.2,
            force: 1.43,
            ..contact_tests::need(body, obstacle)
        }
    }

    #[test]
    fn a_plane_needs_the_slowest_rate_and_a_sphere_rounds_or_more() {
        let plane = BodyNeed {
            curvature: 0.0,
            ..sphere(1.0)
        };
        let flat = decide(&need(sphere(0.02), plane), &Fixed::default(), 0.5, None);
        assert_eq!((flat.rate, flat.rounds), (RATES[0], 0));
        let ball = need(sphere(0.02), sphere(0.02));
        let round = decide(&ball, &Fixed::default(), 0.5, None);
        assert!(round.cost() > flat.cost() && round.rounds > 0 && round.j <= 0.5);
        let linear = Fixed {
            rounds: Some(0),
            ..Fixed::default()
        };
        let linear = decide(&ball, &linear, 0.5, None);
        assert!(linear.rate > flat.rate && linear.j <= 0.5);
        assert!(linear.cost() > round.cost());
    }

    #[test]
    fn nothing_of_the_grid_within_the_budget_is_cheaper() {
        let need = SceneNeed {
            lever: 0.05,
            ..need(sphere(0.02), sphere(0.02))
        };
        let chosen = decide(&need, &Fixed::default(), 0.5, None);
        for other in grid(&need, &Fixed::default()) {
            assert!(other.j > 0.5 || other.cost() >= chosen.cost(), "{other:?}");
        }
    }

    #[test]
    fn what_is_set_is_kept_and_a_budget_that_cannot_be_met_takes_the_least_error() {
        let need = need(sphere(0.005), sphere(0.005));
        let fixed = Fixed {
            rate: Some(70.0),
            rounds: Some(2),
            ..Fixed::default()
        };
        let chosen = decide(&need, &fixed, 0.5, None);
        assert_eq!((chosen.rate, chosen.rounds), (70.0, 2));
        assert!(chosen.j > 0.5);
        let all = grid(&need, &fixed);
        assert!(all.iter().all(|other| other.j >= chosen.j));
    }

    #[test]
    fn a_time_that_cannot_be_met_takes_the_fastest() {
        let need = need(sphere(0.02), sphere(0.02));
        let chosen = decide(&need, &Fixed::default(), 0.5, Some(1e-3));
        let all = grid(&need, &Fixed::default());
        assert!(all.iter().all(|other| other.update_us >= chosen.update_us));
    }

    #[test]
    fn a_tighter_budget_is_never_cheaper() {
        let need = need(sphere(0.02), sphere(0.03));
        let costs = [2.0, 1.0, 0.5, 0.2, 0.1]
            .map(|budget| decide(&need, &Fixed::default(), budget, None).cost());
        assert!(costs.windows(2).all(|pair| pair[0] <= pair[1]), "{costs:?}");
    }
}
