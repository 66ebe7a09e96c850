//! What to import, and how.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::placing::UpAxis;
use super::unit::LengthUnit;
use crate::problem::Problem;

/// One file of an import.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportPart {
    /// The mesh file.
    pub path: PathBuf,
    /// The body that it is part of, with all files that name the same one; `None` is a body of its own.
    pub body: Option<String>,
    /// Its unit, if it is another than that of the request.
    pub unit: Option<LengthUnit>,
    /// Which way is up in it, if it is another than that of the request.
    pub up: Option<UpAxis>,
}

impl ImportPart {
    /// A file as it is named on the command line: `FILE`, or `BODY=FILE`. A file whose own name holds a `=` is that file.
    pub fn named(word: &OsStr) -> Self {
        let text = word.to_string_lossy();
        match text.split_once('=') {
            Some((body, path)) if is_body(body) && !Path::new(word).exists() => Self {
                path: path.into(),
                body: Some(body.to_owned()),
                ..Self::default()
            },
            _ => Path::new(word).into(),
        }
    }

    /// Whether the user means it by this name: its path, or the last part of that.
    pub fn is_named(&self, name: &str) -> bool {
        self.path == Path::new(name) || self.path.file_name() == Some(OsStr::new(name))
    }
}

/// A folder's name is none of a body: `./a=b.stl` is a file.
fn is_body(text: &str) -> bool {
    !text.is_empty() && !text.contains(std::path::is_separator)
}

impl<P: Into<PathBuf>> From<P> for ImportPart {
    fn from(path: P) -> Self {
        Self {
            path: path.into(),
            ..Self::default()
        }
    }
}

/// A value for all files, or `FILE=VALUE` for one.
#[derive(Clone, Debug, PartialEq)]
pub struct ForFile<T> {
    /// The path of a part, or the last part of that; `None` is for all that are not named.
    pub file: Option<String>,
    /// The value.
    pub value: T,
}

impl<T: FromStr> FromStr for ForFile<T> {
    type Err = T::Err;

    fn from_str(text: &str) -> Result<Self, T::Err> {
        let (file, value) = match text.rsplit_once('=') {
            Some((file, value)) => (Some(file.to_owned()), value),
            None => (None, text),
        };
        let value = value.parse()?;
        Ok(Self { file, value })
    }
}

/// Gives each part the value that is for it, and back the one for all others; or says what is wrong with what was written after `option`.
pub fn give_to_parts<T: Copy + PartialEq>(
    option: &str,
    choices: &[ForFile<T>],
    parts: &mut [ImportPart],
    place: fn(&mut ImportPart) -> &mut Option<T>,
) -> Result<Option<T>, Problem> {
    let mut for_all = None;
    let twice = |what: &str| {
        let text = format!("is written with two values for {what}; write one");
        Err(Problem::of_file(option, text))
    };
    for ForFile { file, value } in choices {
        let Some(file) = file else {
            match for_all.replace(*value) {
                Some(before) if before != *value => return twice("all parts"),
                _ => continue,
            }
        };
        let mut meant = parts
            .iter_mut()
            .filter(|part| part.is_named(file))
            .peekable();
        if meant.peek().is_none() {
            let text = format!("names {file}, but no part is called so; write the name of a part");
            return Err(Problem::of_file(option, text));
        }
        for part in meant {
            match place(part).replace(*value) {
                Some(before) if before != *value => return twice(file),
                _ => {}
            }
        }
    }
    Ok(for_all)
}

/// What to import, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportRequest {
    /// Mesh files; the body of the first one is the god-object.
    pub parts: Vec<ImportPart>,
    /// The folder to write; there must be nothing of that name.
    pub folder: PathBuf,
    /// Unit of files that name none of their own: STL, OBJ, PLY.
    pub unit: Option<LengthUnit>,
    /// Which way is up in the files; `None` takes them as they are, and says so of glTF.
    pub up: Option<UpAxis>,
    /// Most distance by which a simplified mesh may differ, m.
    pub simplify: Option<f64>,
    /// Most edges of a hole that is closed; `None` closes small ones, and with `thicken` none.
    pub close_holes: Option<usize>,
    /// Thickness of the solid that an open sheet becomes, m; `None` refuses sheets.
    pub thicken: Option<f64>,
    /// Name of the scene; `None` takes the folder's.
    pub name: Option<String>,
    /// All parts stand, and a sphere is in the hand.
    pub obstacles_only: bool,
    /// Nodes, objects or groups that are taken of each file that names any; none takes all.
    pub only: Vec<String>,
    /// Each node, object or group is a body of its own, in files that are not part of a named body.
    pub split: bool,
}

impl ImportRequest {
    /// The unit that the user named for a file.
    pub(super) fn unit_of(&self, part: &ImportPart) -> Option<LengthUnit> {
        part.unit.or(self.unit)
    }

    /// Which way the user said is up in a file.
    pub(super) fn up_of(&self, part: &ImportPart) -> Option<UpAxis> {
        part.up.or(self.up)
    }

    /// The files of each body, in the order of their first ones.
    pub(super) fn bodies(&self) -> Vec<Vec<&ImportPart>> {
        let mut bodies: Vec<Vec<&ImportPart>> = Vec::new();
        for part in &self.parts {
            let same =
                |files: &&mut Vec<&ImportPart>| part.body.is_some() && files[0].body == part.body;
            match bodies.iter_mut().find(same) {
                Some(files) => files.push(part),
                None => bodies.push(vec![part]),
            }
        }
        bodies
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_a_file_or_a_body_and_a_file_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let there = folder.path().join("a=b.stl");
        std::fs::write(&there, "").unwrap();
        for (word, path, body) in [
            ("a.stl", "a.stl", None),
            ("lid=a.stl", "a.stl", Some("lid")),
            ("lid=x/a=b.stl", "x/a=b.stl", Some("lid")),
            ("./lid=a.stl", "./lid=a.stl", None),
            ("=a.stl", "=a.stl", None),
            (there.to_str().unwrap(), there.to_str().unwrap(), None),
        ] {
            let part = ImportPart::named(OsStr::new(word));
            assert_eq!(part.path, Path::new(path), "{word}");
            assert_eq!(part.body.as_deref(), body, "{word}");
        }
    }

    #[test]
    fn a_value_for_one_file_counts_before_that_for_all() {
        let given = |words: &[&str]| {
            let mut parts = ["a.stl", "x/b.stl"].map(ImportPart::from);
            let choices: Vec<ForFile<UpAxis>> = words.iter().map(|w| w.parse().unwrap()).collect();
            let all = give_to_parts("--up", &choices, &mut parts, |part| &mut part.up);
            all.map(|all| (all, parts.map(|part| part.up)))
                .map_err(|error| error.to_string())
        };
        let (y, z) = (Some(UpAxis::Y), Some(UpAxis::Z));
        assert_eq!(given(&[]), Ok((None, [None, None])));
        assert_eq!(given(&["y", "b.stl=z"]), Ok((y, [None, z])));
        assert_eq!(given(&["x/b.stl=z", "y", "y"]), Ok((y, [None, z])));
        for (words, fault) in [
            (
                &["y", "z"][..],
                "--up: is written with two values for all parts",
            ),
            (&["c.stl=y"], "names c.stl, but no part is called so"),
            (&["b.stl=y", "x/b.stl=z"], "two values for x/b.stl"),
        ] {
            let said = given(words).unwrap_err();
            assert!(said.contains(fault), "{said}");
        }
        assert!("b.stl=up".parse::<ForFile<UpAxis>>().is_err());
    }

    #[test]
    fn files_of_a_body_are_together_wherever_they_are_named() {
        let words = ["peg.stl", "h=a.stl", "x.stl", "h=b.stl", "x.stl"];
        let request = ImportRequest {
            parts: words.map(|word| ImportPart::named(OsStr::new(word))).into(),
            ..ImportRequest::default()
        };
        let files = |files: &Vec<&ImportPart>| files.len();
        let counts: Vec<usize> = request.bodies().iter().map(files).collect();
        assert_eq!(counts, [1, 2, 1, 1]);
    }
}
