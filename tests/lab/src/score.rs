//! The headline: of the cases that every compared method can run, how many are within the budget, and which are not.

use std::collections::BTreeMap;

use crate::method::Method;
use crate::outcome::Outcome;
use crate::recipe::Recipe;

/// A case as it is counted: scaled variants of one are one case.
pub type Case = (String, String);

/// What one method came to at one rate, over the common cases.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Who.
    pub method: Method,
    /// Updates asked for, Hz.
    pub rate: u32,
    /// Fewest updates a second that were held in a case, Hz.
    pub held: f64,
    /// Each case, and whether every line of every variant is kept.
    pub cases: BTreeMap<Case, bool>,
}

impl Score {
    /// How many cases are within the budget.
    #[must_use]
    pub fn within(&self) -> usize {
        self.cases.values().filter(|within| **within).count()
    }

    /// `n of m common cases within the budget`, and those that are not by name.
    #[must_use]
    pub fn headline(&self) -> String {
        let outside: Vec<String> = (self.cases.iter())
            .filter(|(_, within)| !**within)
            .map(|((name, case), _)| format!("{name} {case}"))
            .collect();
        let outside = if outside.is_empty() {
            String::new()
        } else {
            format!("; outside: {}", outside.join("; "))
        };
        format!(
            "{}, {} Hz asked, at least {:.0} Hz held: {} of {} common cases within the budget{outside}",
            self.method.name(),
            self.rate,
            self.held,
            self.within(),
            self.cases.len()
        )
    }
}

/// A score for each of the methods and rates that were run. `methods` are those that are compared: a case that one of them has no part in counts for none.
#[must_use]
pub fn scores(recipes: &[&Recipe], outcomes: &[Outcome], methods: &[Method]) -> Vec<Score> {
    let mut scores: Vec<Score> = Vec::new();
    for outcome in outcomes {
        let of_it = |r: &&&Recipe| (r.name, &r.case) == (outcome.recipe, &outcome.case);
        let Some(recipe) = recipes.iter().find(of_it) else {
            continue;
        };
        if methods.iter().any(|m| (recipe.out_of_scope)(*m).is_some()) {
            continue;
        }
        let case = match &recipe.costs_as {
            Some((name, case)) => (recipe.name.to_owned(), format!("{name} {case}")),
            None => (recipe.name.to_owned(), recipe.case.clone()),
        };
        let key = (outcome.method, outcome.rate);
        let index = scores.iter().position(|s| (s.method, s.rate) == key);
        let index = index.unwrap_or_else(|| {
            scores.push(Score {
                method: outcome.method,
                rate: outcome.rate,
                held: f64::INFINITY,
                cases: BTreeMap::new(),
            });
            scores.len() - 1
        });
        let score = &mut scores[index];
        score.held = score.held.min(outcome.load.held);
        *score.cases.entry(case).or_insert(true) &= outcome.passes(recipe);
    }
    scores
}
