//! Descent of two trees whose bodies move: pairs of volumes in the order of the windows of time in which they may be near.

use pulp::{Simd, WithSimd};

use super::advancement::{PairSearch, PiecePair};
use super::agenda::{Agenda, Part, Waiting};
use super::collider::Collider;
use super::descent::{AT_ONCE, InMotion, Opened, at_once, open};
use super::facing_volumes::{FacingVolumes, Side};
use super::impact::{AdvancementSettings, First};
use super::intervals::{Interval, Intervals, WHOLE, halvings};
use super::motion::RelativeMotion;
use super::turned::TurnedNodes;
use super::windows::{Window, Windows};
use super::work::Work;
use super::workspace::CollisionWorkspace;
use crate::geometry::Primitive;
use crate::geometry::wide_tree::{Below, Child, ROOT, WideTree};

/// When volumes come near is worked out where the body moves by more than this share of the larger one's radius in half an interval. Otherwise
/// they count as near in all of the window of what they are in, which is the cheaper test.
const TIMED_SHARE: f32 = 0.5;

/// A body on its way and an obstacle.
pub(super) struct Problem<'a> {
    pub(super) body: Collider<'a>,
    pub(super) obstacle: Collider<'a>,
    pub(super) relative: &'a RelativeMotion,
    /// Radius of the body about G, m.
    pub(super) radius: f64,
    pub(super) settings: &'a AdvancementSettings,
}

impl Problem<'_> {
    #[inline]
    pub(super) fn pair(&self, a: u32, b: u32) -> PiecePair {
        let (on_body, body_normal) = self.body.piece(a);
        let (on_obstacle, obstacle_normal) = self.obstacle.piece(b);
        PiecePair {
            on_body,
            body_normal,
            on_obstacle,
            obstacle_normal,
        }
    }

    /// The primitive that a mesh is searched against, and whose the mesh is.
    fn primitive(&self) -> Option<(&Primitive, Side)> {
        match (&self.body, &self.obstacle) {
            (Collider::Mesh(_), Collider::Primitive(primitive)) => Some((primitive, Side::Body)),
            (Collider::Primitive(primitive), Collider::Mesh(_)) => {
                Some((primitive, Side::Obstacle))
            }
            _ => None,
        }
    }

    /// The trees of both; `leaves` become those of primitives.
    pub(super) fn trees<'t>(
        &'t self,
        [body, obstacle]: &'t mut [WideTree; 2],
    ) -> (&'t WideTree, &'t WideTree) {
        let start = self.relative.start();
        let reached = (
            &start,
            self.relative.length(self.radius) + 2.0 * self.radius,
        );
        (
            self.body.tree(body, reached),
            self.obstacle.tree(obstacle, reached),
        )
    }
}

/// Whether the mesh's volume of a pair stays beyond a primitive in an interval. The primitive is on one side of the plane through its point nearest to the
/// volume's centre; the volume is on the other while the centre's distance exceeds its extent and what the interval adds. Boxes say little of what is round.
#[inline]
fn stays_beyond(
    (primitive, side): (&Primitive, Side),
    volumes: &FacingVolumes,
    trees: (&WideTree, &WideTree),
    pair: (Child, Child),
) -> bool {
    let (tree, child, other) = match side {
        Side::Body => (trees.0, pair.0, trees.1),
        Side::Obstacle => (trees.1, pair.1, trees.0),
    };
    let center = tree.center(child);
    let (at, added) = volumes.seen_by_other(side, &center);
    let nearest = primitive.nearest(&(other.origin + at));
    let radius = f64::from(tree.radius(child));
    let in_mesh = volumes.frame(side).turn.tr_mul(&nearest.normal);
    let extent = tree.extent(child, &in_mesh).min(radius);
    nearest.distance > extent + added.along(&nearest.normal, radius) // false for NaN
}

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

impl WithSimd for DescentInMotion<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            problem,
            search,
            first,
            workspace,
            work,
        } = self;
        let CollisionWorkspace {
            agenda,
            stack,
            memories,
            current,
            intervals,
            turned,
            leaves,
            ..
        } = workspace;
        let trees = problem.trees(leaves);
        let primitive = problem.primitive();
        let memory = &memories[*current];
        intervals.restart(first.time, search.gaps.stop);
        let mut halving = Halving {
            problem,
            intervals,
            trees,
            most: halvings(problem.settings.max_intervals),
            share: problem.settings.interval_edges as f32,
        };
        stack.clear();
        agenda.clear();
        stack.push(Waiting {
            pair: (ROOT, ROOT),
            interval: WHOLE,
            window: Window::WHOLE,
        });
        let mut queue = Queue {
            stack,
            agenda,
            now: Part::FIRST,
            last: Part::of(1.0),
        };
        let end = first.time;
        let mut opened = [(Opened::nothing(Windows::NONE), WHOLE); AT_ONCE];
        loop {
            let (most, mut count) = (at_once(queue.stack.len()), 0);
            while count < most
                && let Some(mut next) = queue.pop(count == 0)
            {
                let (a, b) = next.pair;
                let size = trees.0.radius(a).max(trees.1.radius(b));
                halving.straighten(&mut next, size, &mut queue, turned, work);
                let interval = halving.interval(next.interval, turned);
                let [from, to] = interval.times(next.window);
                let to = to.min(first.time);
                let later = from >= first.time || (first.is_near() && from > 0.0);
                if (later && from > 0.0) || first.overlapping {
                    continue;
                }
                if primitive.is_some_and(|p| stays_beyond(p, &interval.volumes, trees, (a, b))) {
                    continue;
                }
                if let (Below::Triangle(t), Below::Triangle(s)) =
                    (trees.0.below(a), trees.1.below(b))
                {
                    work.triangle_pairs += 1;
                    let pair = problem.pair(t, s);
                    let times = [interval.from, from, to];
                    if !search.is_free(&pair, &interval.start, times, &first.lately)
                        && !memory.has((t, s))
                    {
                        let start = if from > interval.from {
                            problem.relative.at(from)
                        } else {
                            interval.start
                        };
                        let outcome =
                            search.follow(&pair, &start, [from, to], &mut first.lately, work);
                        first.take(outcome, (t, s), from);
                        queue.last = Part::of((first.time / end) as f32);
                    }
                    continue;
                }
                work.node_pairs += 1;
                let volumes = &interval.volumes;
                let timed = volumes.sweeps_more_than(TIMED_SHARE * size);
                let (pair, window) = ((a, b), next.window);
                let pair = if timed {
                    open(&InMotion::<true>(window), trees, volumes, turned, pair)
                } else {
                    open(&InMotion::<false>(window), trees, volumes, turned, pair)
                };
                opened[count] = (pair, next.interval);
                count += 1;
            }
            if count == 0 {
                break;
            }
            // What waited last goes on first.
            for (opened, number) in opened[..count].iter().rev() {
                let interval = halving.interval(*number, turned);
                opened.for_each(opened.found.meeting(), |pair, lane| {
                    let window = opened.found.of(lane);
                    let next = Waiting {
                        pair,
                        interval: *number,
                        window,
                    };
                    queue.push(interval.part(window.enter), next);
                });
            }
        }
    }
}
