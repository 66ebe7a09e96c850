//! What is wrong with the files that a faulty scene names: one run of `taut check` tells everything.

use std::path::Path;

use super::load::{Origin, unusable};
use crate::check::judge;
use crate::document::{Document, Node, Value};
use crate::environment_file::read_environment;
use crate::height_map_file::read_height_map;
use crate::mesh_file::read_part;
use crate::problem::{FileError, Problem};
use crate::trace::{DeviceTrace, looping_fault};

/// Most files of a faulty document that are read.
const MAX_FILES: usize = 100;

/// How a file is looked at.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Of a body that is touched.
    Mesh,
    /// Of what is only seen.
    Seen,
    HeightMap,
    Trace,
    /// A trace that begins again at its end.
    LoopingHand,
    Light,
}

/// Everything that is wrong with the files of a document that is no scene for other reasons. Nothing else of it is looked at.
pub(crate) fn file_faults(document: &Document, directory: &Path) -> Vec<Problem> {
    let origin = Origin::Directory(directory.to_path_buf());
    let mut seen: Vec<(Kind, &str)> = Vec::new();
    let mut problems = Vec::new();
    for (kind, node) in named_files(&document.root) {
        let Value::Text(name) = &node.value else {
            continue; // said where the document was read
        };
        if seen.contains(&(kind, name)) || seen.len() >= MAX_FILES {
            continue;
        }
        seen.push((kind, name));
        match origin.locate(name, &node.at) {
            Ok(path) => problems.extend(faults_of(kind, &path, name, node)),
            Err(problem) => problems.push(problem),
        }
    }
    problems
}

/// The nodes that name files.
fn named_files(root: &Node) -> Vec<(Kind, &Node)> {
    let mut found = Vec::new();
    let list = |key: &str| root.child(key).map_or(&[][..], Node::items);
    let mut add = |kind, node: Option<_>| found.extend(node.map(|node| (kind, node)));
    let bodies = root.child("god_object").into_iter().chain(list("obstacle"));
    for body in bodies {
        // What is wrong elsewhere in the file is no fault of pieces that are chosen.
        let is_whole = within(body, &["shape", "only"]).is_none();
        let kind = if is_whole { Kind::Mesh } else { Kind::Seen };
        add(kind, within(body, &["shape", "mesh"]));
        add(Kind::Seen, within(body, &["visual", "mesh"]));
        let map = ["surface", "texture", "height_map", "file"];
        add(Kind::HeightMap, within(body, &map));
        add(Kind::Trace, within(body, &["motion", "trace"]));
    }
    for seen in list("scenery") {
        add(Kind::Seen, within(seen, &["shape", "mesh"]));
    }
    add(Kind::Light, within(root, &["view", "environment"]));
    let repeat = within(root, &["hand", "loop"]).map(|node| &node.value);
    let hand = match repeat {
        Some(Value::Boolean(true)) => Kind::LoopingHand,
        _ => Kind::Trace,
    };
    add(hand, within(root, &["hand", "path"]));
    found
}

/// What hangs below these keys.
fn within<'n>(node: &'n Node, keys: &[&str]) -> Option<&'n Node> {
    keys.iter().try_fold(node, |node, key| node.child(key))
}

fn faults_of(kind: Kind, path: &Path, name: &str, node: &Node) -> Vec<Problem> {
    let told = |error: FileError| error.into_problems();
    match kind {
        Kind::Mesh => match read_part(path, &[]) {
            Ok(part) => {
                let faults = judge(part.mesh, name).faults;
                let told = faults.iter().map(|fault| unusable(&node.at, name, fault));
                told.collect()
            }
            Err(error) => told(error),
        },
        Kind::Seen => read_part(path, &[]).err().map_or_else(Vec::new, told),
        Kind::HeightMap => Vec::from_iter(read_height_map(path).err()),
        Kind::Light => Vec::from_iter(read_environment(path).err()),
        Kind::Trace => DeviceTrace::load(path).err().map_or_else(Vec::new, told),
        Kind::LoopingHand => match DeviceTrace::load(path) {
            Ok(_) => Vec::from_iter(looping_fault(path)),
            Err(error) => told(error),
        },
    }
}
