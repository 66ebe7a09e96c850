//! What updates cost: a committed table, from which the virtual clock draws, so that time is not free and results are the same anywhere.
//!
//! `taut-lab --measure` makes the table anew: every method with every tuning, case and rate once, in CPU time of the thread. What was measured before
//! it was interrupted is kept, and rows of methods that are not measured stay as they are. Its first line names the machine. The slowest hundredth of the updates counts as the 99th percentile: what is beyond cannot be told from
//! disturbances of the machine. A case that is not in the table is charged a whole period for each update, which is said in its row.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::sync::OnceLock;

use crate::clock::{self, Charge, RATES};
use crate::cpu_time::quantile;
use crate::method::{Method, Tuning};
use crate::provenance;
use crate::recipe::Recipe;
use crate::recipes::{Extent, all};
use crate::store::{Store, recipe_key};

/// The table that results follow from.
const TABLE: &str = include_str!("../data/costs.csv");
const HEAD: &str =
    "recipe,case,method,settings,rate_hz,update_p50_us,update_p90_us,update_p99_us,force_p50_us";
/// CPU time of a case after which no more of it is measured, us: the slow ones have shown it by then.
const LONGEST_US: f64 = 0.7e6;
/// Updates that a case is repeated for: the 99th percentile of fewer is a disturbance of the machine.
const UPDATES: usize = 1000;
/// Updates at the start of a run that are not counted.
const COLD: usize = 3;
/// Ends of the pieces between which a cost is drawn, shares of the updates.
const SHARES: [f64; 3] = [0.5, 0.9, 0.99];

/// CPU times of one method in one case, us.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Median, 90th and 99th percentile of an update.
    pub update: [f64; 3],
    /// Median of a force.
    pub force: f64,
}

impl Cost {
    fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (update, force) = numbers.split_first_chunk::<3>()?;
        let force = *force.first().filter(|_| force.len() == 1)?;
        Some(Self {
            update: *update,
            force,
        })
    }

    /// Of an update at a share of all, us: the median below it, straight lines between the percentiles, the last one beyond.
    pub fn at(&self, share: f64) -> f64 {
        let [p50, p90, p99] = self.update;
        let between = |from: usize, low: f64, high: f64| {
            let part = (share - SHARES[from]) / (SHARES[from + 1] - SHARES[from]);
            low + (high - low) * part.clamp(0.0, 1.0)
        };
        if share < SHARES[1] {
            between(0, p50, p90)
        } else {
            between(1, p90, p99)
        }
    }
}

/// The cost of a method in a case, from the committed table.
pub fn of(recipe: &Recipe, method: Method, tuning: Tuning, rate: u32) -> Option<Cost> {
    static COSTS: OnceLock<HashMap<String, Cost>> = OnceLock::new();
    let costs = COSTS.get_or_init(|| read(TABLE));
    costs.get(&key(recipe, method, tuning, rate)).copied()
}

/// The machine that the table was made on.
pub fn machine() -> &'static str {
    TABLE.lines().next().unwrap_or("").trim_start_matches("# ")
}

/// A number in [0, 1), and the next state. Source: Steele, Lea and Flood 2014, SplitMix64.
pub(crate) fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A seed for the draws of a run from one start phase: other phases, other draws.
pub fn seed(recipe: &Recipe, method: Method, tuning: Tuning, rate: u32, phase: f64) -> u64 {
    let name = format!("{} {phase}", key(recipe, method, tuning, rate));
    let bytes = blake3::hash(name.as_bytes());
    let (head, _) = bytes.as_bytes().split_first_chunk().expect("32 bytes");
    u64::from_le_bytes(*head)
}

/// As a line begins. Scaled recipes do the same work as their originals.
fn key(recipe: &Recipe, method: Method, tuning: Tuning, rate: u32) -> String {
    let (name, case) =
        (recipe.costs_as.as_ref()).map_or((recipe.name, &recipe.case), |(n, c)| (*n, c));
    let [case, tuning] = [case.clone(), tuning.to_string()].map(|text| text.replace(',', ";"));
    format!("{name},{case},{},{tuning},{rate}", method.name())
}

fn read(table: &str) -> HashMap<String, Cost> {
    let rows = table
        .lines()
        .filter(|line| !line.starts_with('#') && *line != HEAD);
    let cost = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let (key, numbers) = fields.split_at_checked(5)?;
        let numbers: Option<Vec<f64>> = numbers.iter().map(|n| n.parse().ok()).collect();
        Some((key.join(","), Cost::from_numbers(&numbers?)?))
    };
    rows.map(|line| cost(line).unwrap_or_else(|| panic!("costs.csv: not a row of it: {line}")))
        .collect()
}

/// Runs all of `methods` once, one after the other so that caches are not shared, and takes the rows of other methods from the table
/// `old`. `done` is told how many recipes are done, and of how many.
///
/// # Errors
///
/// Where rows would be kept that another machine took: the two cannot be compared.
pub fn measure(
    methods: &[Method],
    old: &str,
    store: &Store,
    done: impl Fn(usize, usize),
) -> Result<String, String> {
    let head = format!("# CPU time on {}", provenance::processor());
    let measured_before = old.lines().next().unwrap_or_default();
    let all_methods = Method::ALL.iter().all(|method| methods.contains(method));
    if !all_methods && measured_before != head {
        return Err(format!(
            "the table has `{measured_before}`, this machine is `{head}`: measure all methods, without --method"
        ));
    }
    let mut recipes = all(Extent::Full);
    let also: Vec<Recipe> = all(Extent::Quick)
        .into_iter()
        .filter(|quick| {
            let same = |r: &Recipe| (r.name, &r.case) == (quick.name, &quick.case);
            !recipes.iter().any(same)
        })
        .collect();
    recipes.extend(also);
    recipes.retain(|recipe| recipe.costs_as.is_none());
    let total = recipes.len();
    let mut table = format!("{head}\n{HEAD}\n");
    for (index, recipe) in recipes.iter().enumerate() {
        let with_part = Method::ALL
            .into_iter()
            .filter(|method| (recipe.out_of_scope)(*method).is_none());
        for method in with_part {
            if methods.contains(&method) {
                append_measured(&mut table, recipe, method, store);
            } else {
                append_kept(&mut table, recipe, method, old);
            }
        }
        done(index + 1, total);
    }
    Ok(table)
}

fn append_kept(table: &mut String, recipe: &Recipe, method: Method, old: &str) {
    for tuning in method.tunings() {
        for rate in RATES {
            let begins = format!("{},", key(recipe, method, tuning, rate));
            let rows = old.lines().filter(|line| line.starts_with(&begins));
            table.extend(rows.flat_map(|row| [row, "\n"]));
        }
    }
}

fn append_measured(table: &mut String, recipe: &Recipe, method: Method, store: &Store) {
    for tuning in method.tunings() {
        for rate in RATES {
            let row = key(recipe, method, tuning, rate);
            let cost = store.get(
                "cost",
                &format!("{row} {}", recipe_key(recipe)),
                Cost::from_numbers,
                || {
                    let cost = cost(recipe, method, tuning, rate);
                    (cost, [&cost.update[..], &[cost.force]].concat())
                },
            );
            let ([p50, p90, p99], force) = (cost.update, cost.force);
            let _ = writeln!(table, "{row},{p50:.2},{p90:.2},{p99:.2},{force:.2}");
        }
    }
}

/// Runs a case until it has shown what it takes.
fn cost(recipe: &Recipe, method: Method, tuning: Tuning, rate: u32) -> Cost {
    let period = 1.0 / f64::from(rate);
    let (mut updates, mut forces, mut used) = (Vec::new(), Vec::new(), 0.0);
    while updates.len() < UPDATES && used < LONGEST_US {
        let mut body = method.start(&recipe.scene, period, tuning);
        let charge = &mut Charge::WholePeriod;
        let left = LONGEST_US - used;
        let run = clock::run_within(body.as_mut(), recipe, rate, 0.5, charge, left);
        used += run.update_us.iter().sum::<f64>();
        // The first ones find nothing in the caches.
        updates.extend(run.update_us.iter().skip(COLD));
        forces.extend(run.force_us);
    }
    Cost {
        update: SHARES.map(|share| quantile(&updates, share)),
        force: quantile(&forces, 0.5),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_drawn_between_their_percentiles() {
        let cost = Cost {
            update: [1.0, 5.0, 14.0],
            force: 0.5,
        };
        let drawn = [0.0, 0.5, 0.7, 0.9, 0.999].map(|share| cost.at(share));
        let right = [1.0, 1.0, 3.0, 5.0, 14.0];
        for (drawn, right) in drawn.iter().zip(right) {
            assert!((drawn - right).abs() < 1e-12, "{drawn}, not {right}");
        }
    }

    #[test]
    fn rows_of_methods_that_are_not_measured_stay_as_they_are() {
        let (_, rows) = TABLE.split_once('\n').expect("a head");
        let of = |machine: &str| format!("# CPU time on {machine}\n{rows}");
        let here = of(&provenance::processor());
        let kept = measure(&[], &here, &Store::none(), |_, _| {});
        assert!(kept.expect("a table") == here);
        let other = measure(&[], &of("another"), &Store::none(), |_, _| {});
        assert!(other.expect_err("two machines").contains("another"));
    }

    #[test]
    fn the_committed_table_has_every_method_and_case_of_the_quick_extent() {
        assert!(TABLE.starts_with("# CPU time on "));
        for recipe in all(Extent::Quick) {
            for method in Method::ALL {
                if (recipe.out_of_scope)(method).is_some() {
                    continue;
                }
                for tuning in method.tunings() {
                    for rate in RATES {
                        let cost = of(&recipe, method, tuning, rate);
                        assert!(
                            cost.is_some(),
                            "{recipe:?}, {method:?}, {tuning}, {rate} Hz"
                        );
                    }
                }
            }
        }
    }
}
