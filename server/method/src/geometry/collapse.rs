//! Which nodes of the binary tree become children of the wide tree's nodes: those that make the cheapest wide tree.
//!
//! | symbol    | name in code | meaning                                                                              |
//! |-----------|--------------|--------------------------------------------------------------------------------------|
//! | C(n, k)   | `costs`      | least cost of what lies below n if at most k children stand for n                    |
//! | w(n)      | `weight`     | cost of a wide node that holds the children of n: how often it is opened, relatively |
//!
//! `C(n, 1) = w(n) + min_i C(l, i) + C(r, 8 - i)` and `C(n, k) = min(C(n, 1), min_i C(l, i) + C(r, k - i))` for the children l, r of n;
//! a triangle costs nothing.
//! Nodes that are filled from the top, the largest descendant first, leave three lanes of five empty at the bottom.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, HPG 2017, section 3.

use super::lanes::LANES;
use super::tree::Node;

/// How the children of each wide node are found.
pub(super) struct Collapse<'a> {
    binary: &'a [Node],
    /// For each node and number of children less one, how many of them its first child gets; 0 where the node itself is one child.
    /// The last is for the node opened, the only way in which all lanes are its own.
    splits: Vec<[u8; LANES]>,
}

impl<'a> Collapse<'a> {
    /// The cheapest for this binary tree.
    pub(super) fn of(binary: &'a [Node]) -> Self {
        let mut costs = vec![[0.0_f32; LANES - 1]; binary.len()];
        let mut splits = vec![[0; LANES]; binary.len()];
        // Children follow their parent: from the back, theirs are known.
        for (n, node) in binary.iter().enumerate().rev() {
            if node.is_leaf() {
                continue;
            }
            let (first, second) = (&costs[n + 1], &costs[node.second as usize]);
            let shared = |lanes: usize| {
                (1..lanes)
                    .map(|i| (first[i - 1] + second[lanes - i - 1], i as u8))
                    .reduce(|a, b| if b.0 < a.0 { b } else { a })
                    .unwrap_or((f32::INFINITY, 0))
            };
            let (below, open) = shared(LANES);
            let own = weight(node) + below;
            let mut least = [own; LANES - 1];
            splits[n][LANES - 1] = open;
            for lanes in 2..LANES {
                let (cost, split) = shared(lanes);
                if cost < own {
                    least[lanes - 1] = cost;
                    splits[n][lanes - 1] = split;
                }
            }
            costs[n] = least;
        }
        Self { binary, splits }
    }

    /// The children of the wide node that opens `node`, which is no leaf, in the order of the binary tree; how many there are.
    pub(super) fn open(&self, node: u32) -> ([u32; LANES], usize) {
        let (mut children, mut count) = ([0; LANES], 0);
        self.gather(node, LANES, &mut children, &mut count);
        (children, count)
    }

    fn gather(&self, node: u32, lanes: usize, children: &mut [u32; LANES], count: &mut usize) {
        match self.splits[node as usize][lanes - 1] {
            0 => {
                children[*count] = node;
                *count += 1;
            }
            split => {
                let split = usize::from(split);
                let second = self.binary[node as usize].second;
                self.gather(node + 1, split, children, count);
                self.gather(second, lanes - split, children, count);
            }
        }
    }
}

/// Two surfaces that meet open a node about as often as it is long: of radius to the power of 0, 0.7, 1, 1.3 and 2, 1 asks for the fewest
/// tests of nodes where two bunnies slide, and fills 5.5 lanes of eight.
fn weight(node: &Node) -> f32 {
    node.radius as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tree::Tree;
    use nalgebra::Point3;
    use proptest::prelude::*;

    /// Least cost of opening the root, by trying all sets of children that are cuts of a subtree.
    fn brute(binary: &[Node]) -> f32 {
        let mut costs = vec![0.0; binary.len()];
        for n in (0..binary.len()).rev().filter(|n| !binary[*n].is_leaf()) {
            let best = cuts(binary, n, LANES)
                .iter()
                .filter(|cut| cut.len() > 1)
                .map(|cut| cut.iter().map(|c| costs[*c]).sum::<f32>())
                .fold(f32::INFINITY, f32::min);
            costs[n] = weight(&binary[n]) + best;
        }
        costs[0]
    }

    fn cuts(binary: &[Node], n: usize, lanes: usize) -> Vec<Vec<usize>> {
        let mut all = vec![vec![n]];
        if binary[n].is_leaf() || lanes == 1 {
            return all;
        }
        let second = binary[n].second as usize;
        for i in 1..lanes {
            for a in cuts(binary, n + 1, i) {
                for b in cuts(binary, second, lanes - i) {
                    all.push([a.clone(), b].concat());
                }
            }
        }
        all
    }

    fn cost(collapse: &Collapse<'_>, n: u32) -> f32 {
        if collapse.binary[n as usize].is_leaf() {
            return 0.0;
        }
        let (children, count) = collapse.open(n);
        assert!((2..=LANES).contains(&count));
        let below: f32 = children[..count].iter().map(|c| cost(collapse, *c)).sum();
        weight(&collapse.binary[n as usize]) + below
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn no_other_choice_of_children_is_cheaper(corners in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 12)) {
            let vertices: Vec<_> = corners.iter().map(|c| Point3::from(*c)).collect();
            let triangles: Vec<[u32; 3]> = (0..10).map(|k| [k, k + 1, k + 2]).collect();
            let tree = Tree::build(&vertices, &triangles);
            let made = cost(&Collapse::of(tree.nodes()), 0);
            let least = brute(tree.nodes());
            prop_assert!((made - least).abs() <= 1e-5 * least, "{made} {least}");
        }
    }
}
