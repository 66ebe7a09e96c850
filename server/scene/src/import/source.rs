//! A file of an import, or a piece of one: read, in its unit, repaired.

use std::path::Path;

use super::UpAxis;
use super::cloud::{ERROR_SHARE, MAX_SITES, Shell, shell};
use super::edges::components;
use super::repair::{Repaired, is_single, repair};
use super::report::{Finding, Places, SourceReport};
use super::request::{ImportPart, ImportRequest};
use super::unit::{LengthUnit, unit_of};
use super::weld;
use crate::mesh_file::{FileLook, MeshFile, Pieces, RawMesh};
use crate::problem::{FileError, Problem};
use crate::progress::Progress;
use crate::scene::MAX_OBSTACLES;

/// What a body is made of.
pub(super) struct Source {
    pub(super) report: SourceReport,
    /// Closed, m, as it lies in the file.
    pub(super) mesh: RawMesh,
    /// The surface as it was in the file, m, if it has several looks and its faces are seen from the same sides still.
    pub(super) as_read: Option<RawMesh>,
    pub(super) look: FileLook,
    pub(super) up: Option<UpAxis>,
}

/// What became of something, with what it is called.
pub(super) type Called<T> = (String, Result<T, FileError>);

/// A file that was read, and nothing done to it.
pub(super) struct Read {
    path: std::path::PathBuf,
    file: MeshFile,
}

impl Read {
    /// A file without faces is taken where `points` are.
    pub(super) fn of(path: &Path, points: bool) -> Result<Self, FileError> {
        let file = MeshFile::read_with_points(path)?;
        let is_cloud = file.mesh.triangles.is_empty() && !file.mesh.vertices.is_empty();
        match file.lacks_faces() {
            Some(text) if !(points && is_cloud) => {
                Err(Problem::of_file(path.display(), text).into())
            }
            _ => Ok(Self {
                path: path.to_path_buf(),
                file,
            }),
        }
    }

    /// Whether it has a piece of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.file.pieces.has(name)
    }

    /// The chosen pieces as one. A file that names no pieces is taken whole, whichever were chosen.
    pub(super) fn joined(
        mut self,
        part: &ImportPart,
        request: &ImportRequest,
    ) -> Result<Source, FileError> {
        let is_named = !self.file.pieces.names().is_empty();
        let only = request.only.as_slice();
        let what = self
            .file
            .take(&self.path, if is_named { only } else { &[] })?;
        let told = told_of_file(&self.file.pieces, only);
        source(what, None, told, part, request)
    }

    /// The chosen pieces, each by itself, with what it is called. A file that names no pieces is one.
    pub(super) fn split(
        self,
        part: &ImportPart,
        request: &ImportRequest,
    ) -> Result<Vec<Called<Source>>, FileError> {
        let stem = self.path.file_stem().unwrap_or_default();
        let stem = stem.to_string_lossy().into_owned();
        if self.file.pieces.names().is_empty() {
            return Ok(vec![(stem, self.joined(part, request))]);
        }
        let Self { path, file } = self;
        let fail = |text: String| FileError::from(Problem::of_file(path.display(), text));
        let apart = file.pieces.apart(&request.only);
        if let (true, Some(first)) = (apart.is_empty(), request.only.first()) {
            return Err(fail(file.pieces.no_such(first)));
        }
        if apart.len() > MAX_OBSTACLES {
            return Err(fail(format!(
                "has {} pieces, but a scene holds {MAX_OBSTACLES} bodies; leave --split out, or choose some with --only",
                apart.len()
            )));
        }
        let parts = file.parts(apart.iter().map(|(_, triangles)| &triangles[..]));
        let left_out = file.pieces.left_out().iter();
        let mut told: Vec<Finding> = left_out.map(|text| left_out_finding(text)).collect();
        let source = |(what, (name, _)): (_, &(Option<&str>, Vec<u32>))| {
            let told = std::mem::take(&mut told);
            let called = name.unwrap_or(&stem).to_owned();
            (called, source(what, *name, told, part, request))
        };
        Ok(parts.zip(&apart).map(source).collect())
    }
}

/// Repairs what was read of a file, or of its piece of this name.
fn source(
    (mesh, look): (RawMesh, FileLook),
    piece: Option<&str>,
    mut findings: Vec<Finding>,
    part: &ImportPart,
    request: &ImportRequest,
) -> Result<Source, FileError> {
    let path = &part.path;
    let of_file = |text: String| match piece {
        None => Problem::of_file(path.display(), text),
        Some(name) => Problem::of_file(
            path.display(),
            format!("its piece \"{name}\", by itself as --split has it, {text}"),
        ),
    };
    let faults = |texts: Vec<String>| FileError::of_all(texts.into_iter().map(of_file).collect());
    let as_read = (!look.parts.is_empty()).then(|| mesh.clone());
    let (made, unit, unit_assumed) = made(mesh, part, request).map_err(faults)?;
    // A face that was turned, or that has a back now, would be seen from its wrong side in the surface of the file.
    let turned = |finding: &Finding| finding.kind == "triangles-turned";
    let faces_as_before = made.thickened.is_none() && !made.findings.iter().any(turned);
    findings.extend(made.findings);
    Ok(Source {
        report: SourceReport {
            file: path.display().to_string(),
            piece: piece.map(str::to_owned),
            unit: unit.name,
            unit_assumed,
            findings,
            moved_m: made.moved,
            thickened_m: made.thickened,
        },
        mesh: made.mesh,
        as_read: as_read
            .filter(|_| faces_as_before)
            .map(|mesh| mesh.scaled(unit.metres)),
        look,
        up: request.up_of(part),
    })
}

/// A closed surface made of what a file holds, its unit, and whether nobody named that.
fn made(
    mesh: RawMesh,
    part: &ImportPart,
    request: &ImportRequest,
) -> Result<(Repaired, LengthUnit, bool), Vec<String>> {
    let (path, is_cloud) = (&part.path, mesh.triangles.is_empty());
    // A vertex of no triangle is no part of the surface, however far away it is.
    let raw = if is_cloud {
        mesh
    } else {
        mesh.without_unused()
    };
    let around = request.thicken.filter(|_| is_cloud).unwrap_or_default();
    let (unit, unit_assumed) =
        unit_of(path, &raw, request.unit_of(part), around).map_err(|text| vec![text])?;
    let (single, file) = (is_single(&raw.vertices), path.display());
    let raw = raw.scaled(unit.metres);
    let repaired = match request.thicken.filter(|_| is_cloud) {
        Some(thickness) => shelled(&raw, single, thickness, path)?,
        None => {
            let count = raw.triangles.len();
            let what = format_args!("{file}: mending {count} triangles");
            let _progress = Progress::on_triangles(count, what);
            repair(raw, single, request)?
        }
    };
    Ok((repaired, unit, unit_assumed))
}

/// A shell around points.
fn shelled(
    cloud: &RawMesh,
    single: bool,
    thickness: f64,
    path: &Path,
) -> Result<Repaired, Vec<String>> {
    let (count, file) = (cloud.vertices.len(), path.display());
    let (rounding, error) = (weld::rounding(cloud, single), ERROR_SHARE * thickness);
    let readable = rounding <= error; // false for NaN
    if !readable {
        return Err(vec![format!(
            "has points that are good to {rounding:.3e} m only, since they lie so far from the origin, but a shell of {thickness} m follows them within {error:.3e} m; move them near to the origin in double precision, or write a larger --thicken"
        )]);
    }
    let progress = Progress::of(format_args!("{file}: a shell around {count} points"));
    let Shell {
        mesh,
        distances: [least, most],
    } = shell(&cloud.vertices, thickness, MAX_SITES, &progress).map_err(|text| vec![text])?;
    let parts = components(&mesh.triangles).len();
    // V - E + F is 2 for a ball, and 2 less for each handle.
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    let handles = (2 * parts + triangles / 2).saturating_sub(vertices) / 2;
    let mut text = format!(
        "made a shell around {count} points: its surface is {least:.3e} to {most:.3e} m from the nearest of them, in {parts} closed parts"
    );
    if handles > 0 {
        text += &format!(
            "; {handles} gaps between points go through it: a larger --thicken closes them if they are not meant"
        );
    }
    Ok(Repaired {
        mesh,
        findings: vec![Finding::new("shelled", &Places::of(parts, None), text)],
        moved: 0.0,
        thickened: Some(most),
    })
}

/// Which pieces of the file are the body, and what of the file is none.
fn told_of_file(pieces: &Pieces, only: &[String]) -> Vec<Finding> {
    let mut told = Vec::new();
    let count = pieces.names().len();
    if count > 1 {
        let text = if only.is_empty() {
            format!(
                "joined its {count} pieces in one body: {}; --only takes some, --split makes a body of each",
                pieces.listed()
            )
        } else {
            let names: Vec<String> = only
                .iter()
                .filter(|name| pieces.has(name))
                .map(|name| format!("\"{name}\""))
                .collect();
            format!(
                "took only {} of its {count} pieces: {}",
                names.join(", "),
                pieces.listed()
            )
        };
        told.push(Finding::new("pieces", &Places::of(count, None), text));
    }
    told.extend(pieces.left_out().iter().map(|text| left_out_finding(text)));
    told
}

fn left_out_finding(text: &str) -> Finding {
    Finding::new("left-out", &Places::of(1, None), text)
}
