//! Points without faces as a solid: all that is within an offset of any of them.
//!
//! | symbol | name | unit |
//! | --- | --- | --- |
//! | T | thickness | m |
//! | r | offset, T / 2 | m |
//! | a | pitch of the lattice, T / 4 | m |
//! | d(p) | distance of a place from the nearest point | m |
//!
//! d is sampled on a body-centred cubic lattice, and the surface is where its linear interpolation is r. Since d changes by at most 1 per metre, every point of the
//! surface has |d - r| <= E = 0.6 a = 0.15 T: 0.56 a by the interpolation (`lattice`), and 0.04 a by the values that are moved away from r, so that no triangle
//! is thinner than that lets it. For the same reason all with d < r - E is inside and all with d > r + E outside: each point lies at least 0.35 T deep, and what is nearer
//! to two points than r + E may be closed between them.
//!
//! Libraries for isosurfaces were looked at: those for surface nets and marching cubes place vertices by the values of a cell of the grid and bound the error by 1.7
//! pitches, three times as much, or leave edges with four triangles.

use nalgebra::{Point3, Vector3};

use super::point_tree::PointTree;
use crate::lattice::{INTERPOLATION, Samples, Site, beside, nearest_site};
use crate::mesh_file::RawMesh;
use crate::progress::Progress;

/// Pitches in the thickness: with 4 the surface is within 0.15 of it, and a plane of points has some 400 triangles on a square of the thickness.
const PITCHES: f64 = 4.0;
/// A value nearer to the surface than this, in pitches, is moved there: the least height of a triangle grows with it, and the error.
const SNAP: f64 = 0.04;
/// The surface is so near to its offset, as a share of the thickness.
pub(super) const ERROR_SHARE: f64 = 0.15;
const _: () = assert!(INTERPOLATION + SNAP <= ERROR_SHARE * PITCHES);
/// Most points: with their tree they take a gigabyte.
const MAX_POINTS: usize = 1 << 24;
/// Most sites of the lattice at which the distance is found: their surface has some five million triangles, and its import takes some gigabytes.
pub(super) const MAX_SITES: usize = 1 << 21;
/// Sites are numbered by 32 bits along an axis.
const MAX_EXTENT: f64 = 1e9;
/// The sites that are worked on between two reports.
const SITES_PER_REPORT: usize = 1 << 12;

/// A shell around points.
#[derive(Debug)]
pub(super) struct Shell {
    /// Closed, triangles seen from outside, m.
    pub(super) mesh: RawMesh,
    /// No point of the surface is nearer to the nearest of the points, nor farther, m.
    pub(super) distances: [f64; 2],
}

/// The solid of all that is within half the thickness, m, of these points, of which there is one at least. `most_sites` bounds time and memory.
///
/// Fails with a sentence that names a thickness which is possible.
pub(super) fn shell(
    points: &[Point3<f64>],
    thickness: f64,
    most_sites: usize,
    progress: &Progress,
) -> Result<Shell, String> {
    let count = points.len();
    if count > MAX_POINTS {
        return Err(format!(
            "has {count} points, but {MAX_POINTS} are the limit; thin them out (CloudCompare: Edit, Subsample)"
        ));
    }
    let cloud = Cloud::of(points);
    let Some(samples) = cloud.samples(thickness, most_sites, progress) else {
        progress.show(0, 0);
        let enough = cloud.thickness_that_fits(thickness, most_sites, progress);
        return Err(format!(
            "is too large for a shell of {thickness} m: the distance would be needed at more than {most_sites} places {:.3e} m apart; write --thicken {enough} or more, or cut out what shall be felt",
            pitch(thickness)
        ));
    };
    let half = pitch(thickness) / 2.0;
    let mesh = samples.surface(|site| cloud.middle + place(site, half));
    let [r, error] = [0.5, ERROR_SHARE].map(|share| share * thickness);
    Ok(Shell {
        mesh,
        distances: [r - error, r + error],
    })
}

fn pitch(thickness: f64) -> f64 {
    thickness / PITCHES
}

/// Where a site is, m, from the middle of the cloud.
fn place(site: Site, half_pitch: f64) -> Vector3<f64> {
    Vector3::from(site.map(f64::from)) * half_pitch
}

struct Cloud {
    /// Of the box around the points: digits far from the origin are not lost.
    middle: Point3<f64>,
    /// Points from there, m.
    tree: PointTree,
    /// Longest side of the box, m.
    extent: f64,
}

impl Cloud {
    fn of(points: &[Point3<f64>]) -> Self {
        let first = points.first().copied().unwrap_or_else(Point3::origin);
        let around =
            |(low, high): (Point3<f64>, Point3<f64>), p: &Point3<f64>| (low.inf(p), high.sup(p));
        let (low, high) = points.iter().fold((first, first), around);
        let middle = nalgebra::center(&low, &high);
        let from_middle = points.iter().map(|p| (p - middle).into()).collect();
        Self {
            middle,
            tree: PointTree::of(from_middle),
            extent: (high - low).max(),
        }
    }

    /// d - r at all sites where it is negative and at those beside them; `None` if these are more than `most`.
    fn samples(&self, thickness: f64, most: usize, progress: &Progress) -> Option<Samples> {
        let (pitch, offset) = (pitch(thickness), thickness / 2.0);
        let half = pitch / 2.0;
        let possible = self.extent / half < MAX_EXTENT; // false for NaN
        if !possible {
            return None;
        }
        let mut samples = Samples::default();
        let add = |samples: &mut Samples, site: Site| {
            if samples.index.contains_key(&site) {
                return Some(());
            }
            if samples.sites.len() == most {
                return None;
            }
            let value = self.tree.distance(place(site, half).into()) - offset;
            let least = SNAP * pitch;
            samples.add(site, value, least);
            Some(())
        };
        // Every site within r of a point is reached from the site nearest to that point over sites nearer to it.
        for point in self.tree.points() {
            add(&mut samples, nearest_site(point.map(|c| c / half)))?;
        }
        let mut next = 0;
        while next < samples.sites.len() {
            if samples.values[next] < 0.0 {
                for site in beside(samples.sites[next]) {
                    add(&mut samples, site)?;
                }
            }
            next += 1;
            if next % SITES_PER_REPORT == 0 {
                progress.show(next, samples.sites.len());
            }
        }
        Some(samples)
    }

    /// A thickness above one that does not fit which does, m, of two digits and at most a fifth above the least one.
    fn thickness_that_fits(&self, too_thin: f64, most: usize, progress: &Progress) -> f64 {
        let fits = |thickness: f64| {
            !self.is_hopeless(thickness, most) && self.samples(thickness, most, progress).is_some()
        };
        let (mut low, mut high) = (too_thin, two_digits_up(2.0 * too_thin));
        // Ends where one site is near to all points.
        while !fits(high) {
            (low, high) = (high, two_digits_up(2.0 * high));
        }
        while high / low > 1.2 {
            let middle = two_digits_up((low * high).sqrt());
            if middle >= high {
                break;
            }
            if fits(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        high
    }

    /// Whether the points lie nearest to more sites than may be.
    fn is_hopeless(&self, thickness: f64, most: usize) -> bool {
        let half = pitch(thickness) / 2.0;
        if self.extent / half >= MAX_EXTENT {
            return true;
        }
        let mut met = std::collections::HashSet::new();
        self.tree.points().iter().any(|point| {
            met.insert(nearest_site(point.map(|c| c / half)));
            met.len() > most
        })
    }
}

/// Two significant digits, rounded up.
fn two_digits_up(value: f64) -> f64 {
    let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    if rounded >= value {
        return rounded;
    }
    let unit = 10_f64.powf(value.log10().floor() - 1.0);
    format!("{:.1e}", rounded + unit).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(count: u32, radius: f64) -> Vec<Point3<f64>> {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let on = |k: u32| {
            let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / f64::from(count);
            let (sin, cos) = (golden * f64::from(k)).sin_cos();
            let around = (1.0 - z * z).sqrt();
            Point3::new(around * cos, around * sin, z) * radius
        };
        (0..count).map(on).collect()
    }

    #[test]
    fn what_is_too_large_is_refused_with_a_thickness_that_fits() {
        let progress = Progress::on_triangles(0, "");
        for (points, thickness) in [
            (ball(2000, 0.05), 1e-3),
            (ball(300, 0.05), 1e-6),
            (vec![Point3::origin(), Point3::new(1e4, 0.0, 0.0)], 1e-9),
        ] {
            let most = 400;
            let text = shell(&points, thickness, most, &progress).unwrap_err();
            let (_, after) = text.split_once("write --thicken ").expect("an option");
            let enough: f64 = after.split(' ').next().unwrap().parse().unwrap();
            assert!(enough > thickness, "{text}");
            assert!(shell(&points, enough, most, &progress).is_ok(), "{text}");
            assert!(
                shell(&points, 0.7 * enough, most, &progress).is_err(),
                "{text}"
            );
        }
    }

    #[test]
    fn two_digits_are_rounded_up() {
        for (value, expected) in [
            (0.001, 0.001),
            (0.00101, 0.0011),
            (9.91, 10.0),
            (1.0, 1.0),
            (3.7e-9, 3.7e-9),
        ] {
            assert!(
                (two_digits_up(value) / expected - 1.0).abs() < 1e-12,
                "{value}"
            );
        }
    }
}
