//! The pairs that rows are chosen from: what faces the body now, nearest first, as far as the work allows.

use super::GodObject;
use crate::collision::{Placement, Work};
use crate::constraint::{At, Collected, RowReduction, collect_bounded};

impl GodObject {
    /// The facing pairs within `distance`, m; every obstacle has its share of the work. Where some need more than last time, those that come after
    /// have what these leave, and at least what each would have if all that are near had the same. First come the nearest, so that the order of the
    /// scene says nothing.
    pub(super) fn collect_candidates(
        &mut self,
        reduction: &mut RowReduction,
        at: &At,
        distance: f64,
        work: &mut Work,
    ) {
        reduction.begin(at, distance);
        self.set.gap_min = f64::INFINITY;
        let share = self.share();
        let (mut left, mut even) = (self.settings.look_ahead_pairs, None);
        self.note_order(at);
        for place in 0..self.order.len() {
            let index = self.order[place];
            let pairs = if left < share {
                let even = even.get_or_insert_with(|| self.even_share(at, distance));
                share.min(left.max(*even))
            } else {
                share
            };
            let collected = self.candidates_of(index, at, (distance, pairs), work);
            left = left.saturating_sub(collected.looked_at.min(pairs));
            self.looked_at[index] = collected.looked_at;
            self.nearest[index] = collected.gap_min.min(collected.complete_within);
            self.set.gap_min = self.set.gap_min.min(collected.gap_min);
            reduction.offer(at, index, &self.contacts, &collected);
        }
        // Known rows may be nearer than what a collection that was given up has found.
        let gap_min = reduction.gap_min(at, work);
        self.set.gap_min = self.set.gap_min.min(gap_min);
    }

    /// Sorts the obstacles by how near their last collection left them, then by how far their origins are from the body.
    fn note_order(&mut self, at: &At) {
        let body = &at.reference.translation.vector;
        let off = |index: usize| (at.places[index].translation.vector - body).norm();
        let nearest = &self.nearest;
        self.order.sort_unstable_by(|a, b| {
            let nearer = nearest[*a].total_cmp(&nearest[*b]);
            let nearer = nearer.then_with(|| off(*a).total_cmp(&off(*b)));
            nearer.then(a.cmp(b))
        });
    }

    /// Most pairs to look at for one obstacle, whichever comes first: what those do not need that needed less last time is the others'.
    fn share(&self) -> u64 {
        let all = self.settings.look_ahead_pairs;
        let mut share = 1;
        loop {
            let less = self.looked_at.iter().filter(|pairs| **pairs < share);
            let (count, spent) = less.fold((0, 0), |(n, sum), pairs| (n + 1, sum + pairs));
            let others = (self.looked_at.len() as u64).saturating_sub(count).max(1);
            let larger = all.saturating_sub(spent) / others;
            if larger <= share {
                return share;
            }
            share = larger;
        }
    }

    /// Most pairs to look at for each of the obstacles that may have some within `distance`, m, if all had the same.
    fn even_share(&self, at: &At, distance: f64) -> u64 {
        let near = |index: &usize| {
            let [(body, body_pose), (obstacle, pose)] = at.colliders(*index);
            !Placement::of(body_pose, pose).is_beyond(distance, body, obstacle)
        };
        let count = (0..at.places.len()).filter(near).count() as u64;
        self.settings.look_ahead_pairs / count.max(1)
    }

    /// Leaves those of one obstacle within `distance`, m, in `self.contacts`, nearest first, as many as so many pairs of triangles and features tell.
    fn candidates_of(
        &mut self,
        index: usize,
        at: &At,
        (distance, pairs): (f64, u64),
        work: &mut Work,
    ) -> Collected {
        let [body, obstacle] = at.colliders(index);
        self.contacts.clear();
        collect_bounded(
            body,
            obstacle,
            u16::try_from(index).unwrap_or(u16::MAX),
            distance,
            pairs,
            self.collision.of_obstacle(index),
            &mut self.contacts,
            work,
        )
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};
    use std::sync::Arc;

    use nalgebra::{Matrix3, Point3, Vector3};

    use super::*;
    use crate::geometry::Mesh;
    use crate::settings::Settings;
    use crate::spatial::Pose;
    use crate::world::{Body, Obstacle, Surface, World};

    const RINGS: u32 = 8;
    const SIDES: u32 = 16;

    /// In the direction of an angle down from the z axis and one around it.
    fn direction(down: f64, around: f64) -> Vector3<f64> {
        let (z, across) = (down.cos(), down.sin());
        Vector3::new(across * around.cos(), across * around.sin(), z)
    }

    fn ball(radius: f64) -> Mesh {
        let point = |ring: u32, side: u32| {
            let down = PI * f64::from(ring) / f64::from(RINGS);
            let around = TAU * f64::from(side) / f64::from(SIDES);
            Point3::from(direction(down, around) * radius)
        };
        let mut vertices = vec![point(0, 0), point(RINGS, 0)];
        for ring in 1..RINGS {
            vertices.extend((0..SIDES).map(|side| point(ring, side)));
        }
        let place = |ring: u32, side: u32| 2 + (ring - 1) * SIDES + side % SIDES;
        let mut triangles = Vec::new();
        for side in 0..SIDES {
            triangles.push([0, place(1, side), place(1, side + 1)]);
            triangles.push([1, place(RINGS - 1, side + 1), place(RINGS - 1, side)]);
            for ring in 1..RINGS - 1 {
                let [a, b] = [side, side + 1].map(|side| place(ring, side));
                let [c, d] = [side, side + 1].map(|side| place(ring + 1, side));
                triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
        Mesh::new(vertices, triangles).expect("a closed ball")
    }

    /// None was near before, so that each would have all the work.
    #[test]
    fn obstacles_that_are_near_all_at_once_share_the_work() {
        let count = 24;
        let pebble = |k: u32| {
            let down = (1.0 - f64::from(2 * k + 1) / f64::from(count)).acos();
            let out = direction(down, 2.4 * f64::from(k));
            Obstacle {
                name: format!("pebble {k}"),
                mesh: ball(6e-3),
                primitive: None,
                pose: Pose::new(out * 0.03, Vector3::zeros()),
                surface: Surface::default(),
            }
        };
        let world = World {
            body: Body {
                mesh: ball(0.02),
                primitive: None,
                mass: 0.2,
                inertia: Matrix3::identity() * 4e-5,
                reference_point: Point3::origin(),
            },
            obstacles: (0..count).map(pebble).collect(),
        };
        let settings = Settings::for_size(0.04);
        let start = Pose::identity();
        let mut god_object =
            GodObject::new(Arc::new(world), settings, start).expect("a free start");
        let mut reduction = god_object.reduction.take().expect("rows are chosen");
        let at = god_object.place().expect("a metric");
        god_object.collect_candidates(&mut reduction, &at, 0.02, &mut Work::default());
        let (all, pairs) = (settings.look_ahead_pairs, &god_object.looked_at);
        let total = pairs.iter().sum::<u64>();
        assert!(all < total && total < 5 * all / 2, "{pairs:?}");
        let even = all / u64::from(count);
        assert!(pairs.iter().all(|pairs| *pairs >= even), "{pairs:?}");
    }
}
