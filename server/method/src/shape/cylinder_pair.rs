//! Contacts of two cylinders.
//!
//! Sides that cross, rims on sides, rims on caps, and caps that overlap in part: each in closed form. Where only two rims are near, the nearest pair of
//! points of the whole solids stands for them: a second local minimum between the same two rims has no row.

use nalgebra::Vector3;

use super::closest;
use super::cylinder::{CROSSINGS, Cylinder};
use super::element::{Cone, Rod, Row};
use super::piece::Piece;
use crate::constraint::{Feature, LOOK_AHEAD_TILT, NORMAL_CONE_TOLERANCE};

/// How far the nearest points may be off their normal, as a share of the gap: the search's accuracy.
const OFF_NORMAL: f64 = 1e-3;

/// Every row between `a` and `b`, a first.
pub(super) fn cylinder_cylinder(a: &Cylinder, b: &Cylinder, mut found: impl FnMut(Row)) {
    if let Some(row) = a.rod_on_side(&a_side(b)) {
        found(row);
    }
    let parallel = a.axis.cross(&b.axis).norm() <= LOOK_AHEAD_TILT;
    a.rod_on_rims(&a_side(b), &mut found);
    b.rod_on_rims(&a_side(a), |row| found(row.reversed()));
    for end in 0..2 {
        rims_over_cap(a, b, end, &mut found);
        rims_over_cap(b, a, end, |row| found(row.reversed()));
    }
    if parallel {
        overlapping_caps(a, b, &mut found);
    }
    rim_on_rim(a, b, found);
}

/// The side as a rod: its axis with the radius around it.
fn a_side(c: &Cylinder) -> Rod<'static> {
    Rod {
        ends: c.ends,
        round: c.radius,
        cone: Cone::Any,
        feature: Feature::Side,
    }
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
        let along = (distance * distance + b.radius * b.radius - a.radius * a.radius)
            / (2.0 * distance);
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

/// The nearest points of the two solids, where they lie on rims of both.
fn rim_on_rim(a: &Cylinder, b: &Cylinder, mut found: impl FnMut(Row)) {
    let [first, second] = [a, b].map(|c| Piece {
        points: [c.ends[0], c.ends[1], c.ends[1]],
        count: 2,
        round: 0.0,
        disc: c.radius,
        axis: c.axis,
        face: None,
    });
    let normal = closest::direction(&first, &second);
    let (x, y) = (first.farthest(&-normal), second.farthest(&normal));
    let gap = normal.dot(&(x - y));
    let aligned = (x - y - normal * gap).norm() <= OFF_NORMAL * gap; // false for NaN
    // Neither along nor across an axis: there caps and sides have their own rows.
    let slanted = |axis: &Vector3<f64>| {
        let cosine = axis.dot(&normal).abs();
        cosine > NORMAL_CONE_TOLERANCE && 1.0 - cosine > NORMAL_CONE_TOLERANCE
    };
    if aligned && slanted(&a.axis) && slanted(&b.axis) {
        let end = |c: &Cylinder, n: f64| if c.axis.dot(&normal) * n > 0.0 { 1 } else { 0 };
        found(Row {
            features: [
                Feature::Rim(end(a, -1.0), CROSSINGS),
                Feature::Rim(end(b, 1.0), CROSSINGS),
            ],
            on_first: x,
            on_second: y,
            normal,
            gap,
        });
    }
}
