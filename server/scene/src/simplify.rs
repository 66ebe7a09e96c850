//! A mesh with no more triangles than a scene needs, and how far it is from the one in the file.
//!
//! The simplifier's own error is an estimate. What is stated here is measured afterwards, as a rigorous upper bound, both ways; a candidate beyond the
//! limit, open, inside out or running through itself is not taken, and the next finer one is tried.

use std::time::Instant;

use god_object::Mesh;
use god_object::geometry::{one_sided_distance, self_intersection};
use meshopt::SimplifyOptions;
use nalgebra::Point3;

use crate::mesh_file::RawMesh;
use crate::progress::Progress;
use crate::simplified_cache::{Key, SimplifiedCache};

/// Errors that the simplifier is asked for, as shares of the limit: coarsest first.
const LEVELS: [f32; 8] = [2.0, 1.4, 1.0, 0.7, 0.5, 0.3, 0.15, 0.05];
/// Simplifying fewer triangles takes no second.
const KEPT_TRIANGLES: usize = 10_000;
/// Most passes of the simplifier over its own answer.
const MAX_PASSES: u32 = 8;

/// How a mesh was simplified.
#[derive(Clone, Debug, PartialEq)]
pub struct Simplified {
    /// `god-object`, or the obstacle's name.
    pub body: String,
    /// Triangles in the file.
    pub triangles_before: usize,
    /// Triangles that are used.
    pub triangles_after: usize,
    /// The limit in the scene, m.
    pub max_error: f64,
    /// No point of the mesh that is used is farther from the mesh in the file, m: an upper bound.
    pub to_original: f64,
    /// No point of the mesh in the file is farther from the mesh that is used, m: an upper bound.
    pub from_original: f64,
    /// Why the mesh in the file is used as it is; `None` when it was simplified.
    pub unchanged: Option<String>,
}

impl std::fmt::Display for Simplified {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (before, after) = (self.triangles_before, self.triangles_after);
        match &self.unchanged {
            Some(why) => write!(
                f,
                "{}: not simplified within {:.3e} m, {before} triangles as in the file: {why}",
                self.body, self.max_error
            ),
            None => write!(
                f,
                "{}: simplified from {before} to {after} triangles, at most {:.3e} m from the file's surface and the file's at most {:.3e} m from it (limit {:.3e} m)",
                self.body, self.to_original, self.from_original, self.max_error
            ),
        }
    }
}

/// The coarsest candidate within `max_error` (m) of `original`, both ways, that is closed, outward and does not run through itself; else the original.
///
/// Meshes of 10,000 triangles and more are looked for in the user's cache first, and kept there if it took longer than a second.
pub fn simplify(original: Mesh, max_error: f64, body: &str) -> (Mesh, Simplified) {
    let is_large = original.triangles().len() >= KEPT_TRIANGLES;
    let cache = is_large.then(SimplifiedCache::of_user).flatten();
    simplify_with(original, max_error, body, cache.as_ref())
}

/// The same with this cache, or none.
pub(crate) fn simplify_with(
    original: Mesh,
    max_error: f64,
    body: &str,
    cache: Option<&SimplifiedCache>,
) -> (Mesh, Simplified) {
    let Some(cache) = cache else {
        return compute(original, max_error, body);
    };
    let key = Key::of(&original, max_error);
    if let Some((mesh, report)) = cache.read(key, &original, max_error, body) {
        return (mesh.unwrap_or(original), report);
    }
    let begun = Instant::now();
    let (mesh, report) = compute(original, max_error, body);
    cache.keep(key, &mesh, &report, begun.elapsed());
    (mesh, report)
}

fn compute(original: Mesh, max_error: f64, body: &str) -> (Mesh, Simplified) {
    let before = original.triangles().len();
    let progress = Progress::on_triangles(
        before,
        format_args!("{body}: simplifying {before} triangles"),
    );
    let report = |after: usize, [to_original, from_original]: [f64; 2], unchanged| Simplified {
        body: body.to_owned(),
        triangles_before: before,
        triangles_after: after,
        max_error,
        to_original,
        from_original,
        unchanged,
    };
    let mut reason = "no candidate has fewer triangles".to_owned();
    for (tried, level) in LEVELS.into_iter().enumerate() {
        progress.attempt(tried + 1, LEVELS.len());
        let raw = reduced(
            original.vertices(),
            original.triangles(),
            max_error as f32 * level,
        );
        if raw.triangles.len() >= before {
            break; // finer levels have no fewer
        }
        match measured(raw, &original, max_error, &progress) {
            Ok((mesh, distances)) => {
                let report = report(mesh.triangles().len(), distances, None);
                return (mesh, report);
            }
            Err(why) => reason = why,
        }
    }
    let report = report(before, [0.0; 2], Some(reason));
    (original, report)
}

/// A surface with fewer triangles, by the simplifier's estimate off by at most this error, m. Its vertices are vertices of the original, to the last digit.
pub(crate) fn reduced(vertices: &[Point3<f64>], triangles: &[[u32; 3]], error: f32) -> RawMesh {
    let first = vertices.first().copied().unwrap_or_else(Point3::origin);
    let around =
        |(low, high): (Point3<f64>, Point3<f64>), v: &Point3<f64>| (low.inf(v), high.sup(v));
    let (low, high) = vertices.iter().fold((first, first), around);
    let middle = nalgebra::center(&low, &high);
    let places: Vec<[f32; 3]> = vertices
        .iter()
        .map(|v| (v - middle).map(|c| c as f32).into())
        .collect();
    let mut kept: Vec<u32> = triangles.iter().flatten().copied().collect();
    // One pass stops early on flat faces.
    for _ in 0..MAX_PASSES {
        let options = SimplifyOptions::ErrorAbsolute;
        let fewer = meshopt::simplify_decoder(&kept, &places, 0, error, options, None);
        let done = fewer.len() == kept.len();
        kept = fewer;
        if done {
            break;
        }
    }
    let kept = RawMesh {
        vertices: vertices.to_vec(),
        triangles: kept.as_chunks().0.to_vec(),
    };
    let all: Vec<u32> = (0..kept.triangles.len() as u32).collect();
    kept.some(&all)
}

/// The candidate as a mesh, and its distances to and from the original, m; or why it is not taken.
fn measured(
    raw: RawMesh,
    original: &Mesh,
    max_error: f64,
    progress: &Progress,
) -> Result<(Mesh, [f64; 2]), String> {
    let mesh = Mesh::new(raw.vertices, raw.triangles)
        .map_err(|error| format!("the candidates are not closed surfaces: {error}"))?;
    if let Some([a, b]) = self_intersection(&mesh) {
        return Err(format!(
            "the candidates run through themselves, as at triangles {a} and {b}"
        ));
    }
    let total = mesh.triangles().len() + original.triangles().len();
    let bound = |from: &Mesh, to: &Mesh, offset: usize| {
        let found = one_sided_distance(from, to, max_error, |done| {
            progress.show(offset + done, total)
        });
        if found.at_most <= max_error {
            Ok(found.at_most)
        } else {
            Err(too_far(found.at_least, max_error))
        }
    };
    let to_original = bound(&mesh, original, 0)?;
    let from_original = bound(original, &mesh, mesh.triangles().len())?;
    Ok((mesh, [to_original, from_original]))
}

/// Why a candidate is not taken that is at least so far away, m.
fn too_far(at_least: f64, max_error: f64) -> String {
    let how_far = if at_least > max_error {
        format!("the finest candidate is {at_least:.6e} m away")
    } else {
        format!("the finest candidate is {at_least:.6e} m away, too near to the limit to tell")
    };
    format!("{how_far}; allow a larger distance (max_error, --simplify)")
}
