//! How the distance of two features changes when the body moves: the true distance, not its linearisation.
//!
//! | symbol | name in code          | unit   | meaning                                                           |
//! |--------|-----------------------|--------|-------------------------------------------------------------------|
//! | x_s    | `start`               | m, –   | pose of the reference point where the row was collected           |
//! | x_k    | `candidate`           | m, –   | pose of the reference point at which it is evaluated              |
//! | R      | `turn`                | –      | rotation from x_s to x_k                                          |
//! | n, n'  | `normal`              | –      | unit, obstacle to body, at x_s and at x_k                         |
//! | x, y   |                       | m      | closest points on the body and on the obstacle                    |
//! | g'     | `gap`                 | m      | signed distance at x_k: negative when the features have crossed   |
//!
//! The gradient of g' with respect to a small motion from x_k is the row `[n'; (y' - G') x n']`: the closest points move along
//! their features, which does not change the distance to first order.
//!
//! Beyond the paper: its constraints are linear in the displacement from x_s (Section 7.3.2 names this a limitation).

use nalgebra::{Point3, Vector3};

use super::NonPenetrationConstraint;
use crate::spatial::Pose;

/// Edges at a smaller angle are parallel, as its sine: their common normal says nothing.
const PARALLEL_SINE: f64 = 1e-6;

/// Which feature a row has its normal from, and so how the normal turns with the body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Separation {
    /// The obstacle's: it stays. A corner of the body over a face; and corners against edges and corners, whose direction of
    /// difference turns into the normal of a face that is not in the set.
    #[default]
    OfObstacle,
    /// The face of the body's: it turns with the body.
    OfBody,
    /// The common normal of two edges, unit vectors in the world at x_s; the body's edge turns.
    OfEdges {
        /// Along the edge of the body.
        on_body: Vector3<f64>,
        /// Along the edge of the obstacle.
        on_obstacle: Vector3<f64>,
    },
    /// A ball of the body's over a plane of the obstacle's: its centre counts, however it turns.
    OfBall {
        /// m.
        radius: f64,
    },
    /// A rim of the body's over a plane of the obstacle's: its lowest point at any pose. World at x_s.
    OfRim {
        /// Centre of the rim, m.
        center: Point3<f64>,
        /// Unit, across the rim.
        axis: Vector3<f64>,
        /// m.
        radius: f64,
    },
    /// Points or lines with balls around them: spheres, sides of capsules and cylinders, vertices, edges. World at x_s.
    OfRods {
        /// Unit, along the body's; zero for a point.
        on_body: Vector3<f64>,
        /// Unit, along the obstacle's; zero for a point.
        on_obstacle: Vector3<f64>,
        /// Of the balls on body and obstacle, m.
        radii: [f64; 2],
    },
}

/// A row evaluated at another pose of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovedConstraint {
    /// Contact point on the obstacle, world, m.
    pub point: Point3<f64>,
    /// Unit normal, from the obstacle to the body, world.
    pub normal: Vector3<f64>,
    /// Signed distance of the features, taken as unbounded planes and lines, m.
    pub gap: f64,
}

impl NonPenetrationConstraint {
    /// The row as it is when the body's reference point has gone from `start` to `candidate`; the features are taken as unbounded.
    ///
    /// `shading_normal` in the place of the normal, where there is one and `shaded` asks for it: it stays with the obstacle.
    pub fn moved(&self, start: &Pose, candidate: &Pose, shaded: bool) -> MovedConstraint {
        let turn = candidate.rotation * start.rotation.inverse();
        let on_body = self.point + self.normal * self.gap;
        let arm = turn * (on_body.coords - start.translation.vector);
        let x = Point3::from(candidate.translation.vector + arm);
        let interpolated = self.shading_normal.filter(|_| shaded);
        if let Some(normal) = interpolated {
            let gap = self.gap + normal.dot(&(x - on_body));
            return MovedConstraint {
                point: x - normal * gap,
                normal,
                gap,
            };
        }
        match self.separation {
            Separation::OfObstacle => self.off_plane(&x),
            Separation::OfBody => {
                let normal = turn * self.normal;
                MovedConstraint {
                    point: self.point,
                    normal,
                    gap: normal.dot(&(x - self.point)),
                }
            }
            Separation::OfEdges {
                on_body: along,
                on_obstacle,
            } => self
                .between_rods(&x, [&along, &(turn * along), &on_obstacle], [0.0; 2])
                .unwrap_or_else(|| self.off_plane(&x)),
            Separation::OfBall { radius } => {
                // The centre moves; the lowest point is always below it.
                let raised = self.normal * radius;
                let arm = turn * (on_body + raised - start.translation.vector).coords;
                self.off_plane(&(Point3::from(candidate.translation.vector + arm) - raised))
            }
            Separation::OfRim {
                center,
                axis,
                radius,
            } => {
                let arm = turn * (center.coords - start.translation.vector);
                let axis = turn * axis;
                let down = axis * axis.dot(&self.normal) - self.normal;
                let sine = down.norm();
                let lowest = if sine > 0.0 { down / sine } else { down };
                self.off_plane(&Point3::from(
                    candidate.translation.vector + arm + lowest * radius,
                ))
            }
            Separation::OfRods {
                on_body: along,
                on_obstacle,
                radii,
            } => {
                let core = on_body + self.normal * radii[0];
                let arm = turn * (core.coords - start.translation.vector);
                let moved = Point3::from(candidate.translation.vector + arm);
                self.between_rods(&moved, [&along, &(turn * along), &on_obstacle], radii)
                    .unwrap_or_else(|| self.off_plane(&x))
            }
        }
    }

    /// Distance of the body's point from the plane that the row was collected with.
    fn off_plane(&self, x: &Point3<f64>) -> MovedConstraint {
        let gap = self.normal.dot(&(x - self.point));
        MovedConstraint {
            point: x - self.normal * gap,
            normal: self.normal,
            gap,
        }
    }

    /// Distance of two points or lines with balls around them: the body's through `p` along `u`, which was `before`, and the obstacle's along `v`.
    /// `None` when they meet, and of parallel edges.
    fn between_rods(
        &self,
        p: &Point3<f64>,
        [before, u, v]: [&Vector3<f64>; 3],
        [on_body, on_obstacle]: [f64; 2],
    ) -> Option<MovedConstraint> {
        let q = self.point - self.normal * on_obstacle;
        let difference = p - q;
        let across = u.cross(v);
        let squared = across.norm_squared();
        let crossing = squared > PARALLEL_SINE * PARALLEL_SINE; // false for NaN
        let (normal, foot) = if crossing {
            let side = self.normal.dot(&before.cross(v)).signum();
            let along_obstacle = u.cross(&difference).dot(&across) / squared;
            (across * (side / squared.sqrt()), q + v * along_obstacle)
        } else if on_body + on_obstacle == 0.0 {
            return None;
        } else if *v == Vector3::zeros() {
            let off = difference - u * u.dot(&difference);
            (off.try_normalize(f64::MIN_POSITIVE)?, q)
        } else {
            let along_obstacle = v.dot(&difference);
            let off = difference - v * along_obstacle;
            (
                off.try_normalize(f64::MIN_POSITIVE)?,
                q + v * along_obstacle,
            )
        };
        Some(MovedConstraint {
            point: foot + normal * on_obstacle,
            normal,
            gap: normal.dot(&difference) - on_body - on_obstacle,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::{Feature, FeaturePair, contact_jacobian};
    use crate::spatial::{Vector6, advance_pose};

    fn rods(on_body: Vector3<f64>, on_obstacle: Vector3<f64>) -> Separation {
        Separation::OfRods {
            on_body,
            on_obstacle,
            radii: [0.02, 0.03],
        }
    }

    /// Of a rim whose lowest point lies 5 mm below its centre and 8.7 mm along `u`: half a right angle and more.
    fn rim_axis(normal: &Vector3<f64>, u: &Vector3<f64>) -> Vector3<f64> {
        let radial = u * 0.75f64.sqrt() - normal * 0.5;
        normal.cross(u).cross(&radial)
    }

    fn rows() -> Vec<NonPenetrationConstraint> {
        let normal = Vector3::new(0.2, -0.3, 0.9).normalize();
        let on_body = normal.cross(&Vector3::x()).normalize();
        let on_obstacle = normal.cross(&Vector3::new(0.3, 1.0, 0.1)).normalize();
        [
            Separation::OfObstacle,
            Separation::OfBody,
            Separation::OfEdges {
                on_body,
                on_obstacle,
            },
            Separation::OfBall { radius: 0.02 },
            Separation::OfRim {
                center: Point3::new(0.02, -0.01, 0.03) + normal * 1e-3 + normal * 5e-3
                    - on_body * (0.01f64.powi(2) - 0.005f64.powi(2)).sqrt(),
                axis: rim_axis(&normal, &on_body),
                radius: 0.01,
            },
            rods(on_body, on_obstacle),
            rods(on_body, Vector3::zeros()),
            rods(Vector3::zeros(), on_obstacle),
            rods(Vector3::zeros(), Vector3::zeros()),
        ]
        .map(|separation| NonPenetrationConstraint {
            features: FeaturePair {
                obstacle: 0,
                on_body: Feature::Vertex(0),
                on_obstacle: Feature::Face(0),
            },
            point: Point3::new(0.02, -0.01, 0.03),
            normal,
            gap: 1e-3,
            separation,
            obstacle_displacement: Vector3::zeros(),
            shading_normal: None,
        })
        .to_vec()
    }

    #[test]
    fn a_row_that_did_not_move_is_itself() {
        let start = Pose::translation(0.01, 0.0, 0.05);
        for row in rows() {
            let same = row.moved(&start, &start, false);
            assert!((same.point - row.point).norm() < 1e-15);
            assert!((same.normal - row.normal).norm() < 1e-14);
            assert!((same.gap - row.gap).abs() < 1e-16);
        }
    }

    /// Central differences of the gap against the row, at a pose turned by a radian.
    #[test]
    fn the_row_at_a_candidate_is_the_gradient_of_the_gap_there() {
        let start = Pose::translation(0.01, 0.0, 0.05);
        let far = Vector6::new(3e-3, -2e-3, 1e-3, 0.6, -0.7, 0.4);
        let candidate = advance_pose(&start, &far, 1.0);
        let step = 1e-5;
        for row in rows() {
            let here = row.moved(&start, &candidate, false);
            let center = Point3::from(candidate.translation.vector);
            let jacobian = contact_jacobian(&here.normal, &here.point, &center);
            for k in 0..6 {
                let mut motion = Vector6::zeros();
                motion[k] = step;
                let gap = |time| {
                    row.moved(&start, &advance_pose(&candidate, &motion, time), false)
                        .gap
                };
                let slope = (gap(1.0) - gap(-1.0)) / (2.0 * step);
                assert!(
                    (slope - jacobian[k]).abs() < 1e-8,
                    "{:?} {k}: {slope} {}",
                    row.separation,
                    jacobian[k]
                );
            }
        }
    }
}
