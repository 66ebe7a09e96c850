//! Descent of two trees whose bodies move: pairs of volumes in the order of the windows of time in which they may be near.

use pulp::{Simd, WithSimd};

use super::advancement::PairSearch;
use super::agenda::{Agenda, Part, Waiting};
use super::descent::{AT_ONCE, InMotion, Opened, at_once, open};
use super::facing_volumes::Side;
use super::impact::First;
use super::intervals::{Interval, Intervals, WHOLE, halvings};
use super::problem::{Problem, beyond_primitive, primitive_of};
use super::turned::TurnedNodes;
use super::windows::{Window, Windows};
use super::work::Work;
use super::workspace::{CollisionWorkspace, Memory};
use crate::geometry::Primitive;
use crate::geometry::wide_tree::{Below, ROOT, WideTree};

/// When volumes come near is worked out where the body moves by more than this share of the larger one's radius in half an interval. Otherwise
/// they count as near in all of the window of what they are in, which is the cheaper test.
const TIMED_SHARE: f32 = 0.5;

/// A search for every pair of pieces that may face each other within the gap at some time before the first impact so far, with the vectors
/// that the processor has.
pub(super) struct DescentInMotion<'a, 'p> {
    pub(super) problem: &'a Problem<'p>,
    pub(super) search: &'a PairSearch<'p>,
    pub(super) first: &'a mut First,
    pub(super) workspace: &'a mut CollisionWorkspace,
    pub(super) work: &'a mut Work,
}

/// Pairs of volumes that wait: those under way, last in, first out; and those that come near later.
struct Queue<'a> {
    stack: &'a mut Vec<Waiting>,
    agenda: &'a mut Agenda,
    /// Parts of the time that is searched: the one looked at, and that of the first impact.
    now: Part,
    last: Part,
}

impl Queue<'_> {
    #[inline(always)]
    fn push(&mut self, part: Part, waiting: Waiting) {
        if part <= self.now || !self.agenda.push(part.0 as usize, waiting) {
            self.stack.push(waiting);
        }
    }

    /// The agenda has its turn when nothing earlier is under way.
    #[inline(always)]
    fn pop(&mut self, nothing_under_way: bool) -> Option<Waiting> {
        self.stack.pop().or_else(|| {
            let last = self.last.0 as usize;
            let (part, next) = nothing_under_way.then(|| self.agenda.pop(last))??;
            self.now = Part(part as u32);
            Some(next)
        })
    }
}

/// What the intervals of a motion are made from, and how short they may be.
struct Halving<'a> {
    problem: &'a Problem<'a>,
    intervals: &'a mut Intervals,
    trees: (&'a WideTree, &'a WideTree),
    /// Most halvings.
    most: u32,
    /// Share of the larger volume's radius that a path may stray from a straight one.
    share: f32,
}

impl Halving<'_> {
    #[inline(always)]
    fn interval(&mut self, number: u32, turned: &mut TurnedNodes) -> &Interval {
        self.intervals
            .get(number, self.problem.relative, self.trees, turned)
    }

    /// Halves the interval of a pair until the path of its volumes is nearly straight there. The half in which they cannot meet is left out; of two in
    /// which they may, the later one waits.
    #[inline(always)]
    fn straighten(
        &mut self,
        next: &mut Waiting,
        size: f32,
        queue: &mut Queue<'_>,
        turned: &mut TurnedNodes,
        work: &mut Work,
    ) {
        let (most, tree, longest) = (self.most, self.trees.0, self.share * size);
        loop {
            let number = next.interval;
            let interval = self.interval(number, turned);
            let straight = number.ilog2() >= most
                || !interval
                    .volumes
                    .strays_more_than(longest, tree, next.pair.0);
            if straight {
                return;
            }
            work.node_pairs += 1;
            if next.window.leave < 0.0 {
                next.window = next.window.in_first_half();
                next.interval = 2 * number;
            } else if next.window.enter > 0.0 {
                next.window = next.window.in_second_half();
                next.interval = 2 * number + 1;
            } else {
                let later = Waiting {
                    pair: next.pair,
                    interval: 2 * number + 1,
                    window: next.window.in_second_half(),
                };
                queue.push(interval.part(0.0), later);
                next.window = next.window.in_first_half();
                next.interval = 2 * number;
            }
        }
    }
}

/// The pairs of pieces that a search meets.
struct Pieces<'a, 'p> {
    problem: &'a Problem<'p>,
    search: &'a PairSearch<'p>,
    memory: &'a Memory,
}

impl Pieces<'_, '_> {
    /// Follows a pair through a part of an interval where it is not free there; whether it was followed.
    #[inline(always)]
    fn look_at(
        &self,
        (t, s): (u32, u32),
        interval: &Interval,
        [from, to]: [f64; 2],
        first: &mut First,
        work: &mut Work,
    ) -> bool {
        work.triangle_pairs += 1;
        let pair = self.problem.pair(t, s);
        let times = [interval.from, from, to];
        let search = self.search;
        // Witnesses were followed before.
        if search.is_free(&pair, &interval.start, times, &first.lately) || self.memory.has((t, s)) {
            return false;
        }
        let start = if from > interval.from {
            self.problem.relative.at(from)
        } else {
            interval.start
        };
        let outcome = search.follow(&pair, &start, [from, to], &mut first.lately, work);
        first.take(outcome, (t, s), from);
        true
    }
}

/// A search under way.
struct Run<'a, 'p> {
    pieces: Pieces<'a, 'p>,
    halving: Halving<'a>,
    queue: Queue<'a>,
    turned: &'a mut TurnedNodes,
    first: &'a mut First,
    work: &'a mut Work,
    primitive: Option<(&'a Primitive, Side)>,
    /// Where the search ends if nothing is met.
    end: f64,
}

impl Run<'_, '_> {
    /// Looks at a pair that waited: pieces are followed, and what comes of volumes is what was found when one was opened, in which interval.
    #[inline(always)]
    fn look_at(&mut self, mut next: Waiting) -> Option<(Opened<Windows>, u32)> {
        let (turned, first) = (&mut *self.turned, &mut *self.first);
        let trees = self.halving.trees;
        let (a, b) = next.pair;
        let size = trees.0.radius(a).max(trees.1.radius(b));
        self.halving
            .straighten(&mut next, size, &mut self.queue, turned, self.work);
        let interval = self.halving.interval(next.interval, turned);
        let [from, to] = interval.times(next.window);
        let to = to.min(first.time);
        let later = from >= first.time || (first.is_near() && from > 0.0);
        if (later && from > 0.0) || first.overlapping {
            return None;
        }
        let volumes = &interval.volumes;
        let beyond = |primitive| beyond_primitive(primitive, volumes, trees, next.pair) > 0.0;
        if self.primitive.is_some_and(beyond) {
            return None;
        }
        if let (Below::Triangle(t), Below::Triangle(s)) = (trees.0.below(a), trees.1.below(b)) {
            let pieces = &self.pieces;
            if pieces.look_at((t, s), interval, [from, to], first, self.work) {
                self.queue.last = Part::of((first.time / self.end) as f32);
            }
            return None;
        }
        self.work.node_pairs += 1;
        let timed = volumes.sweeps_more_than(TIMED_SHARE * size);
        let window = next.window;
        let pair = if timed {
            open(&InMotion::<true>(window), trees, volumes, turned, next.pair)
        } else {
            open(
                &InMotion::<false>(window),
                trees,
                volumes,
                turned,
                next.pair,
            )
        };
        Some((pair, next.interval))
    }

    /// Lets those wait that meet, of what was opened.
    #[inline(always)]
    fn push(&mut self, opened: &Opened<Windows>, number: u32) {
        let interval = self.halving.interval(number, self.turned);
        opened.for_each(opened.found.meeting(), |pair, lane| {
            let window = opened.found.of(lane);
            let next = Waiting {
                pair,
                interval: number,
                window,
            };
            self.queue.push(interval.part(window.enter), next);
        });
    }
}

impl WithSimd for DescentInMotion<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (problem, workspace) = (self.problem, self.workspace);
        let (stack, agenda) = (&mut workspace.stack, &mut workspace.agenda);
        let intervals = &mut workspace.intervals;
        intervals.restart(self.first.time, self.search.gaps.stop);
        stack.clear();
        agenda.clear();
        stack.push(Waiting {
            pair: (ROOT, ROOT),
            interval: WHOLE,
            window: Window::WHOLE,
        });
        let mut run = Run {
            pieces: Pieces {
                problem,
                search: self.search,
                memory: &workspace.memories[workspace.current],
            },
            halving: Halving {
                problem,
                intervals,
                trees: problem.trees(&mut workspace.leaves),
                most: halvings(problem.settings.max_intervals),
                share: problem.settings.interval_edges as f32,
            },
            queue: Queue {
                stack,
                agenda,
                now: Part::FIRST,
                last: Part::of(1.0),
            },
            turned: &mut workspace.turned,
            primitive: primitive_of(&problem.body, &problem.obstacle),
            end: self.first.time,
            first: self.first,
            work: self.work,
        };
        let mut opened = [(Opened::nothing(Windows::NONE), WHOLE); AT_ONCE];
        loop {
            let (most, mut count) = (at_once(run.queue.stack.len()), 0);
            while count < most
                && let Some(next) = run.queue.pop(count == 0)
            {
                if let Some(found) = run.look_at(next) {
                    opened[count] = found;
                    count += 1;
                }
            }
            if count == 0 {
                break;
            }
            // What waited last goes on first.
            for (pair, number) in opened[..count].iter().rev() {
                run.push(pair, *number);
            }
        }
    }
}
