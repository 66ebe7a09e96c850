//! How frames went: counts, and how far apart the screens swapped.

use hdrhistogram::Histogram;
use taut_proto::barrier::{Counts, FrameSkew, NodeState};

use crate::distribution::Distribution;

/// Longest time told apart, ns: a minute.
const LONGEST_NS: u64 = 60_000_000_000;
/// Nodes told apart by name; more are not recorded one by one.
const MAX_NODES: usize = 64;
const US_PER_NS: f64 = 1e-3;

/// How frames went since the server started. Swap times are as true as the nodes' clocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameReport {
    /// Counts of the barrier.
    pub counts: Counts,
    /// Last swap call less first, of each frame that at least two nodes told of, µs.
    pub skew: Distribution,
    /// The same of the times at which their pictures lit up, of each frame of which at least two nodes know it, µs.
    pub light: Distribution,
    /// From the moment at which a frame could be shown to the last swap call, µs.
    pub overhead: Distribution,
    /// Age of the state at the last swap call, µs.
    pub age: Distribution,
    /// Each node by name: its swap call less the first of the same frame, µs.
    pub nodes: Vec<(String, Distribution)>,
    /// Each node that knows it by name: its light less the first of the same frame, µs.
    pub lit_nodes: Vec<(String, Distribution)>,
    /// Nodes that swap on their own now, or did when they left, by name.
    pub free_running: Vec<String>,
}

/// Gathers shown frames. Memory is taken once, and once for each node that shows its first frame.
pub(crate) struct Recorder {
    calls: Apart,
    /// When the pictures lit up.
    pub(super) lights: Apart,
    overhead: Histogram<u64>,
    age: Histogram<u64>,
    /// [`MAX_NODES`] at most; then the oldest goes.
    free_running: Vec<String>,
}

impl Default for Recorder {
    fn default() -> Recorder {
        Recorder {
            calls: Apart::default(),
            lights: Apart::default(),
            overhead: histogram(),
            age: histogram(),
            free_running: Vec::new(),
        }
    }
}

/// How far apart the nodes were in each frame.
pub(super) struct Apart {
    skew: Histogram<u64>,
    nodes: Vec<(String, Histogram<u64>)>,
}

impl Default for Apart {
    fn default() -> Apart {
        Apart {
            skew: histogram(),
            nodes: Vec::new(),
        }
    }
}

impl Apart {
    /// Takes a frame in; `name_of` knows the nodes.
    pub(super) fn record<'a>(
        &mut self,
        shown: &FrameSkew,
        name_of: impl Fn(u16) -> Option<&'a str>,
    ) {
        self.skew.saturating_record(shown.skew_ns);
        for swap in &shown.swaps {
            let Some(name) = name_of(swap.session) else {
                continue; // it has just left
            };
            let known = self.nodes.iter().position(|(node, _)| node == name);
            let index = match known {
                Some(index) => index,
                None if self.nodes.len() < MAX_NODES => {
                    self.nodes.push((name.to_owned(), histogram()));
                    self.nodes.len() - 1
                }
                None => continue,
            };
            self.nodes[index].1.saturating_record(swap.after_first_ns);
        }
    }

    fn by_node(&self) -> Vec<(String, Distribution)> {
        let nodes = self.nodes.iter();
        nodes
            .map(|(node, times)| (node.clone(), Distribution::of(times, US_PER_NS)))
            .collect()
    }
}

impl Recorder {
    /// Takes a frame in; `name_of` knows the nodes.
    pub(crate) fn record<'a>(
        &mut self,
        shown: &FrameSkew,
        name_of: impl Fn(u16) -> Option<&'a str>,
    ) {
        self.overhead.saturating_record(shown.overhead_ns);
        self.age.saturating_record(shown.age_ns);
        self.calls.record(shown, name_of);
    }

    /// Notes what became of a node; whether it runs free from now on, or is in step again, if that is news.
    pub(crate) fn note(&mut self, node: &str, state: Option<NodeState>) -> Option<bool> {
        let known = self.free_running.iter().position(|free| free == node);
        match (state, known) {
            (Some(NodeState::FreeRunning), None) => {
                if self.free_running.len() == MAX_NODES {
                    self.free_running.remove(0);
                }
                self.free_running.push(node.to_owned());
                Some(true)
            }
            // On its way back it is on probation still.
            (Some(NodeState::Synced), Some(index)) => {
                self.free_running.remove(index);
                Some(false)
            }
            // It was away, and begins anew.
            (Some(NodeState::Joining), Some(index)) => {
                self.free_running.remove(index);
                None
            }
            _ => None,
        }
    }

    pub(crate) fn report(&self, counts: Counts) -> FrameReport {
        let us = |times| Distribution::of(times, US_PER_NS);
        FrameReport {
            counts,
            skew: us(&self.calls.skew),
            light: us(&self.lights.skew),
            overhead: us(&self.overhead),
            age: us(&self.age),
            nodes: self.calls.by_node(),
            lit_nodes: self.lights.by_node(),
            free_running: self.free_running.clone(),
        }
    }
}

fn histogram() -> Histogram<u64> {
    // Two significant figures over a fixed range: constants that hdrhistogram takes.
    Histogram::new_with_bounds(1, LONGEST_NS, 2).unwrap_or_else(|_| unreachable!("constant bounds"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_that_comes_again_runs_free_no_more_and_is_news_when_it_does() {
        let mut recorder = Recorder::default();
        let free = |recorder: &Recorder| recorder.report(Counts::default()).free_running;
        let runs_free = Some(NodeState::FreeRunning);
        assert_eq!(recorder.note("wall", runs_free), Some(true));
        assert_eq!(recorder.note("wall", runs_free), None);
        assert_eq!(recorder.note("wall", None), None);
        assert_eq!(free(&recorder), ["wall"], "it did when it left");
        assert_eq!(recorder.note("wall", Some(NodeState::Joining)), None);
        assert!(free(&recorder).is_empty());
        assert_eq!(recorder.note("wall", runs_free), Some(true));
        assert_eq!(recorder.note("wall", Some(NodeState::Synced)), Some(false));
        assert!(free(&recorder).is_empty());
    }
}
