//! Rows of a table of factors in which every two levels of two factors meet: a pairwise covering array, drawn from a seed.
//!
//! Greedy: each row begins with a pair that has not met yet, and takes, factor by factor, the level that lets most new pairs meet.
//! Source: the density algorithm for covering arrays, Bryce and Colbourn 2007, with seeded ties.

use crate::hand::Random;

/// Rows of level indices, one for each factor; `levels[f]` is how many the factor f has.
pub fn pairwise(levels: &[usize], seed: u64) -> Vec<Vec<usize>> {
    let mut random = Random(seed);
    let mut open: Vec<[(usize, usize); 2]> = Vec::new();
    for f in 0..levels.len() {
        for g in f + 1..levels.len() {
            for i in 0..levels[f] {
                open.extend((0..levels[g]).map(|j| [(f, i), (g, j)]));
            }
        }
    }
    let mut rows = Vec::new();
    while !open.is_empty() {
        let first = open[(random.unit() * open.len() as f64) as usize];
        let mut row: Vec<Option<usize>> = vec![None; levels.len()];
        first.iter().for_each(|(f, i)| row[*f] = Some(*i));
        for f in shuffled(levels.len(), &mut random) {
            if row[f].is_none() {
                row[f] = Some(best_level(&open, &row, f, levels[f], &mut random));
            }
        }
        let row: Vec<usize> = row.into_iter().flatten().collect();
        open.retain(|pair| pair.iter().any(|(f, i)| row[*f] != *i));
        rows.push(row);
    }
    rows
}

/// The level of factor `f` that lets most open pairs meet in the row.
fn best_level(
    open: &[[(usize, usize); 2]],
    row: &[Option<usize>],
    f: usize,
    levels: usize,
    random: &mut Random,
) -> usize {
    let gains = |level: usize| {
        let meets = |pair: &&[(usize, usize); 2]| {
            pair.contains(&(f, level))
                && pair
                    .iter()
                    .all(|(g, j)| *g == f || row[*g].is_none_or(|chosen| chosen == *j))
        };
        open.iter().filter(meets).count()
    };
    shuffled(levels, random)
        .into_iter()
        .max_by_key(|level| gains(*level))
        .unwrap_or(0)
}

fn shuffled(count: usize, random: &mut Random) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for k in (1..count).rev() {
        order.swap(k, (random.unit() * (k + 1) as f64) as usize);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_two_levels_of_two_factors_meet_in_some_row_and_rows_are_few() {
        let levels = [4, 4, 4, 3, 3, 2, 2, 3, 3, 4];
        let rows = pairwise(&levels, 7);
        for f in 0..levels.len() {
            for g in f + 1..levels.len() {
                for i in 0..levels[f] {
                    for j in 0..levels[g] {
                        assert!(rows.iter().any(|row| row[f] == i && row[g] == j));
                    }
                }
            }
        }
        assert!(rows.len() <= 30, "{}", rows.len());
        assert_eq!(rows, pairwise(&levels, 7));
    }
}
