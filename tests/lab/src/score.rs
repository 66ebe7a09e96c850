//! The headline: of the cases that every compared method can run, how many are within the budget, and which are not.

use std::collections::{BTreeMap, BTreeSet};

use crate::measure::Measure;
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
    /// Each case, and the lines that some variant of it missed.
    pub cases: BTreeMap<Case, BTreeSet<&'static str>>,
}

impl Score {
    /// How many cases miss none of the lines that count.
    fn keeping(&self, counts: impl Fn(&str) -> bool) -> usize {
        let cases = self.cases.values();
        let kept = cases.filter(|missed| !missed.iter().any(|line| counts(line)));
        kept.count()
    }

    /// How many cases are within the budget.
    pub fn within(&self) -> usize {
        self.keeping(|_| true)
    }

    /// How many keep the two lines of what is felt, whatever else they miss.
    pub fn felt(&self) -> usize {
        let felt = [Measure::JndP95, Measure::JndShare].map(Measure::key);
        self.keeping(|line| felt.contains(&line))
    }

    /// How many would be within the budget if bodies might meet: a penalty method has no body that stays outside.
    pub fn within_where_bodies_may_meet(&self) -> usize {
        let meeting = [Measure::Intersections, Measure::Penetration].map(Measure::key);
        self.keeping(|line| !meeting.contains(&line))
    }

    /// The cases that are not within the budget, by name.
    pub(crate) fn outside(&self) -> Vec<String> {
        let outside = self.cases.iter().filter(|(_, missed)| !missed.is_empty());
        let named = outside.map(|((name, case), _)| format!("{name} {case}"));
        named.collect()
    }

    /// Each line that was missed, and in how many cases; the one that most missed comes first.
    pub fn reasons(&self) -> Vec<(&'static str, usize)> {
        let mut reasons = BTreeMap::new();
        for line in self.cases.values().flatten() {
            *reasons.entry(*line).or_insert(0) += 1;
        }
        let mut reasons: Vec<_> = reasons.into_iter().collect();
        reasons.sort_by_key(|(_, cases)| std::cmp::Reverse(*cases)); // stable: by name
        reasons
    }

    /// `n of m common cases within the budget`, how many are by less, the lines that were missed, and the cases that are not by name.
    pub fn headline(&self) -> String {
        let outside = self.outside();
        let outside = if outside.is_empty() {
            String::new()
        } else {
            let reasons = self.reasons();
            let reasons: Vec<_> = reasons.iter().map(|(l, n)| format!("{l} {n}")).collect();
            let (reasons, outside) = (reasons.join(", "), outside.join("; "));
            format!("; lines missed, and in how many cases: {reasons}; outside: {outside}")
        };
        format!(
            "{}, {} Hz asked, at least {:.0} Hz held: {} of {} common cases within the budget; by what is felt alone: {}; where bodies may meet: \
             {}{outside}",
            self.method.name(),
            self.rate,
            self.held,
            self.within(),
            self.cases.len(),
            self.felt(),
            self.within_where_bodies_may_meet(),
        )
    }
}

/// A score for each of the methods and rates that were run. `methods` are those that are compared: a case that one of them has no part in counts for none.
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
        score.held = score.held.min(outcome.measured.load.held);
        let missed = score.cases.entry(case).or_default();
        missed.extend(outcome.missed(recipe));
    }
    scores
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_are_counted_by_the_lines_that_they_miss() {
        let missed = [
            vec![],
            vec!["step"],
            vec!["intersections", "penetration"],
            vec!["intersections", "j_share_above_1"],
            vec!["j_p95"],
        ];
        let case = |(at, lines): (usize, &Vec<&'static str>)| {
            let name = ("R00".to_owned(), at.to_string());
            (name, lines.iter().copied().collect())
        };
        let score = Score {
            method: Method::Penalty,
            rate: 1000,
            held: 1000.0,
            cases: missed.iter().enumerate().map(case).collect(),
        };
        let counted = [
            score.within(),
            score.felt(),
            score.within_where_bodies_may_meet(),
        ];
        assert_eq!(counted, [1, 3, 2]);
        let said = "1 of 5 common cases within the budget; by what is felt alone: 3; where bodies may meet: 2; lines missed";
        assert!(score.headline().contains(said), "{}", score.headline());
    }
}
