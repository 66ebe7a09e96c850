//! Contacts of two cylinders.
//!
//! Sides that cross, rims on sides, rims on caps, and caps that overlap in part: each in closed form. Rims on rims are searched from two starts: a
//! further local minimum between the same two rims has no row.

use nalgebra::{Point3, Vector3};

use super::cylinder::{CROSSINGS, Cylinder};
use super::element::{Row, rod_rod};
use crate::collision::{Core, Disc, direction};
use crate::constraint::{Feature, LOOK_AHEAD_TILT, NORMAL_CONE_TOLERANCE};

/// Projections from rim to rim before Newton's method takes over.
const ALTERNATIONS: u32 = 12;
/// Steps of Newton's method: six reach rounding from there.
const NEWTON_STEPS: u32 = 8;
/// Minima nearer than this are one, in radii.
const SAME_POINT: f64 = 1e-6;

/// Every row between `a` and `b`, a first; of rims on rims those within `reach`, m.
pub(super) fn cylinder_cylinder(
    a: &Cylinder,
    b: &Cylinder,
    reach: f64,
    mut found: impl FnMut(Row),
) {
    if let Some(row) = rod_rod(&a.side(), &b.side()) {
        found(row);
    }
    let parallel = a.axis.cross(&b.axis).norm() <= LOOK_AHEAD_TILT;
    a.rod_on_rims(&b.side(), &mut found);
    b.rod_on_rims(&a.side(), |row| found(row.reversed()));
    for end in 0..2 {
        rims_over_cap(a, b, end, &mut found);
        rims_over_cap(b, a, end, |row| found(row.reversed()));
    }
    if parallel {
        overlapping_caps(a, b, &mut found);
    }
    rim_on_rim(a, b, reach, found);
}

/// Rim points of `a` over the cap `end` of `b`.
fn rims_over_cap(a: &Cylinder, b: &Cylinder, end: usize, found: impl FnMut(Row)) {
    let (normal, center) = (b.outward(end), b.ends[end]);
    let limit = b.radius * (1.0 + NORMAL_CONE_TOLERANCE);
    a.rims_over(
        &normal,
        &center,
        false,
        Feature::Cap(end as u8),
        |at, height| {
            let offset = at - center - normal * height;
            height >= 0.0 && offset.norm() <= limit
        },
        found,
    );
}

/// Caps that face each other and overlap in part hold each other where their circles cross.
fn overlapping_caps(a: &Cylinder, b: &Cylinder, mut found: impl FnMut(Row)) {
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let normal = b.outward(j);
        if a.outward(i).dot(&normal) >= 0.0 {
            continue;
        }
        let offset = a.ends[i] - b.ends[j];
        let sideways = offset - normal * normal.dot(&offset);
        let distance = sideways.norm();
        // From b's centre: how far along the line of centres the crossings lie.
        let along =
            (distance * distance + b.radius * b.radius - a.radius * a.radius) / (2.0 * distance);
        let squared = b.radius * b.radius - along * along;
        let crosses = squared > 0.0; // false for NaN: circles with one centre
        if !crosses {
            continue;
        }
        let line = sideways / distance;
        let beside = normal.cross(&line) * squared.sqrt();
        for (place, side) in [(CROSSINGS, beside), (CROSSINGS + 1, -beside)] {
            let foot = b.ends[j] + line * along + side;
            // Up to a's cap, along b's normal.
            let cap = a.outward(i);
            let height = cap.dot(&(a.ends[i] - foot)) / cap.dot(&normal);
            found(Row {
                features: [Feature::Rim(i as u8, place), Feature::Cap(j as u8)],
                on_first: foot + normal * height,
                on_second: foot,
                normal,
                gap: height,
            });
        }
    }
}

/// Where two rims are locally nearest, from two starts for each pair of rims: the nearest points of the two solids, and those of one rim to the
/// centre of the other.
fn rim_on_rim(a: &Cylinder, b: &Cylinder, reach: f64, mut found: impl FnMut(Row)) {
    let solids = [a, b].map(|c| Core {
        points: [c.ends[0], c.ends[1], c.ends[1]],
        disc: Some(Disc {
            radius: c.radius,
            axis: c.axis,
        }),
    });
    let mut nearest = None;
    for i in 0..2 {
        for j in 0..2 {
            let centers = b.ends[j] - a.ends[i];
            if centers.norm() > reach + a.radius + b.radius {
                continue;
            }
            let normal = nearest.get_or_insert_with(|| direction(&solids[0], &solids[1]));
            let starts = [solids[0].farthest(&-*normal), b.ends[j]];
            let mut first: Option<Row> = None;
            for start in starts {
                let Some(row) = settle([(a, i), (b, j)], &start) else {
                    continue;
                };
                let known = first.is_some_and(|known| {
                    (known.on_first - row.on_first).norm() <= SAME_POINT * a.radius
                });
                if !known {
                    found(row);
                    first = Some(row);
                }
            }
        }
    }
}

/// The local minimum of the distance between two rims that starts at the point of the first nearest to `start`; `None` when it is none, or not between the
/// normal cones of both.
fn settle([(a, i), (b, j)]: [(&Cylinder, usize); 2], start: &Point3<f64>) -> Option<Row> {
    let radial = |c: &Cylinder, end: usize, p: &Point3<f64>| {
        let offset = p - c.ends[end];
        (offset - c.axis * c.axis.dot(&offset)).try_normalize(f64::MIN_POSITIVE)
    };
    let (mut u, mut v) = (radial(a, i, start)?, a.mark);
    for _ in 0..ALTERNATIONS {
        v = radial(b, j, &(a.ends[i] + u * a.radius))?;
        u = radial(a, i, &(b.ends[j] + v * b.radius))?;
    }
    // Newton on half the squared distance, by the angles of both.
    for _ in 0..NEWTON_STEPS {
        let difference = (a.ends[i] + u * a.radius) - (b.ends[j] + v * b.radius);
        let (p, q) = (a.axis.cross(&u) * a.radius, b.axis.cross(&v) * b.radius);
        let (g, h) = (difference.dot(&p), -difference.dot(&q));
        let (aa, ab, bb) = (
            p.norm_squared() - a.radius * difference.dot(&u),
            -p.dot(&q),
            q.norm_squared() + b.radius * difference.dot(&v),
        );
        let determinant = aa * bb - ab * ab;
        let minimum = determinant > 0.0 && aa > 0.0; // false for NaN
        if !minimum {
            break;
        }
        let (s, t) = (
            (ab * h - bb * g) / determinant,
            (ab * g - aa * h) / determinant,
        );
        let turned = |c: &Cylinder, r: Vector3<f64>, by: f64| {
            let moved = r + c.axis.cross(&r) * by;
            moved / moved.norm()
        };
        (u, v) = (turned(a, u, s), turned(b, v, t));
    }
    let (x, y) = (a.ends[i] + u * a.radius, b.ends[j] + v * b.radius);
    let normal = (x - y).try_normalize(f64::MIN_POSITIVE)?;
    let across = |c: &Cylinder, r: &Vector3<f64>| c.axis.cross(r).dot(&normal).abs();
    let settled = across(a, &u).max(across(b, &v)) <= NORMAL_CONE_TOLERANCE;
    let facing = u.dot(&-normal) >= -NORMAL_CONE_TOLERANCE
        && a.outward(i).dot(&-normal) >= -NORMAL_CONE_TOLERANCE
        && v.dot(&normal) >= -NORMAL_CONE_TOLERANCE
        && b.outward(j).dot(&normal) >= -NORMAL_CONE_TOLERANCE;
    let place = CROSSINGS + u8::from(a.axis.cross(&b.axis).dot(&u) >= 0.0);
    (settled && facing).then(|| {
        Row::between(
            [Feature::Rim(i as u8, place), Feature::Rim(j as u8, place)],
            [x, y],
            [0.0; 2],
            normal,
        )
    })
}
