//! A scene that is changed key by key: the text of its file keeps its comments and its layout, and what comes out is read as every scene file is.

use std::fmt;

use god_object::Settings;
use toml_edit::{DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::built::GOD_OBJECT_NAME;
use super::load::Scene;
use crate::document::{Section, nearest};
use crate::files::MAX_TOML_BYTES;
use crate::problem::{FileError, Problem};

/// Most edits at once.
const MAX_EDITS: usize = 100;
/// Longest edit, bytes.
const MAX_EDIT_BYTES: usize = 500;
/// Most names of a scene's objects in one sentence.
const MAX_NAMES: usize = 8;
/// `[god_object]` and `[coupling]`, in an edit.
const GOD_OBJECT: &str = "god_object";
const COUPLING: &str = "coupling";
/// Names that are no object's.
pub(crate) const RESERVED_NAMES: [&str; 3] = [GOD_OBJECT_NAME, GOD_OBJECT, COUPLING];
/// What can be changed of everything that is drawn.
const OF_BODIES: [&str; 6] = [
    "pose.position",
    "pose.rotation",
    "color",
    "opacity",
    "roughness",
    "metallic",
];
/// What can be changed of obstacles besides.
const OF_OBSTACLES: [&str; 1] = ["surface.friction"];
/// What can be changed of `[coupling]`: the stiffness is `k_h k_s` times the mass.
const OF_COUPLING: [&str; 3] = ["k_h", "k_s", "damping_time"];

/// A key that an edit set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EditedKey {
    /// `plate.surface.friction`.
    pub key: String,
    /// As it was written; `None` where it was not.
    pub before: Option<String>,
    /// As it is written now.
    pub after: String,
}

impl fmt::Display for EditedKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let before = self.before.as_deref().unwrap_or("as usual");
        write!(f, "{}: {before} -> {}", self.key, self.after)
    }
}

/// The table of a scene's text that an edit goes into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Coupling,
    GodObject,
    Obstacle(usize),
    Scenery(usize),
}

impl Place {
    fn keys(self) -> Vec<&'static str> {
        match self {
            Self::Coupling => OF_COUPLING.to_vec(),
            Self::GodObject | Self::Scenery(_) => OF_BODIES.to_vec(),
            Self::Obstacle(_) => [&OF_BODIES[..], &OF_OBSTACLES].concat(),
        }
    }

    /// Its table in the document; one that is missing is made where it is one of a kind.
    fn table(self, root: &mut Table) -> Option<&mut dyn TableLike> {
        let (list, index) = match self {
            Self::Coupling => {
                let made = || Item::Table(Table::new());
                return root
                    .entry(COUPLING)
                    .or_insert_with(made)
                    .as_table_like_mut();
            }
            Self::GodObject => return root.get_mut(GOD_OBJECT)?.as_table_like_mut(),
            Self::Obstacle(index) => ("obstacle", index),
            Self::Scenery(index) => ("scenery", index),
        };
        match root.get_mut(list)? {
            Item::ArrayOfTables(tables) => Some(tables.get_mut(index)?),
            Item::Value(Value::Array(values)) => {
                Some(values.get_mut(index)?.as_inline_table_mut()?)
            }
            _ => None,
        }
    }
}

impl Scene {
    /// The same scene with some keys set, each by `NAME.KEY=VALUE`: `plate.surface.friction=0.3`, `god_object.color="#ff8800"`, `coupling.k_h=1500`. Its
    /// text keeps everything else, comments too. A value that is no TOML is taken as text.
    ///
    /// # Errors
    /// No object of that name, a key that is not changed in this way, or a scene that comes out with a fault.
    pub fn edited<S: AsRef<str>>(&self, edits: &[S]) -> Result<(Self, Vec<EditedKey>), FileError> {
        if edits.len() > MAX_EDITS {
            let text = format!("are more than {MAX_EDITS} at once; put them into the file");
            return Err(Problem::of_file("edits", text).into());
        }
        let mut document: DocumentMut = self.text().parse().map_err(|error| {
            let text = format!("cannot be edited ({error}); edit the file by hand");
            Problem::of_file(self.name(), text)
        })?;
        let mut keys = Vec::new();
        for edit in edits {
            keys.push(self.apply(&mut document, edit.as_ref())?);
        }
        if let Some(other) = self.other_gain(&keys) {
            keys.push(self.apply(&mut document, &other)?);
        }
        let mut text = document.to_string();
        if self.text().contains("\r\n") {
            // The editor of documents ends every line by itself.
            text = text.replace("\r\n", "\n").replace('\n', "\r\n");
        }
        if text.len() as u64 > MAX_TOML_BYTES {
            let why = format!("would be larger than {MAX_TOML_BYTES} bytes");
            return Err(Problem::of_file(self.name(), why).into());
        }
        let edited = self.with_text(&text).map_err(|error| match edits {
            [only] => FileError::of_all(
                error
                    .into_problems()
                    .into_iter()
                    .map(|problem| Problem::of_file(only.as_ref().trim(), problem.to_string()))
                    .collect(),
            ),
            _ => error,
        })?;
        Ok((edited, keys))
    }

    /// Where one of the gains is set and the scene has neither: the other as it runs, which is not as it is read beside a gain that is written.
    fn other_gain(&self, keys: &[EditedKey]) -> Option<String> {
        let is_set = |key: &str| keys.iter().any(|set| set.key == key);
        let of = self.coupling();
        let neither = of.k_s.is_none() && of.k_h.is_none();
        let usual = Settings::for_size(1.0);
        match (is_set("coupling.k_s"), is_set("coupling.k_h")) {
            (true, false) if neither => Some(format!("coupling.k_h={:?}", usual.k_h)),
            (false, true) if neither => Some(format!("coupling.k_s={:?}", usual.k_s)),
            _ => None,
        }
    }

    fn apply(&self, document: &mut DocumentMut, edit: &str) -> Result<EditedKey, FileError> {
        let shown = edit.trim();
        if edit.len() > MAX_EDIT_BYTES || edit.contains(char::is_control) {
            let text = format!(
                "has more than {MAX_EDIT_BYTES} bytes or more than one line; write NAME.KEY=VALUE"
            );
            return Err(Problem::of_file("the edit", text).into());
        }
        let fail = |text: String| FileError::from(Problem::of_file(shown, text));
        let Some((path, value)) = edit.split_once('=') else {
            let text = "has no `=`; write NAME.KEY=VALUE, such as coupling.k_h=1500";
            return Err(fail(text.to_owned()));
        };
        let (path, value) = (path.trim(), value.trim());
        let (place, key) = self.place(path).map_err(fail)?;
        let value: Value = value.parse().unwrap_or_else(|_| value.into());
        let (after, table) = (written(&value), place.table(document.as_table_mut()));
        let set = table.ok_or_else(|| "is not where it was; edit the file".to_owned());
        let keys: Vec<&str> = key.split('.').collect();
        let before = set
            .and_then(|table| set_in(table, &keys, value))
            .map_err(fail)?;
        Ok(EditedKey {
            key: path.to_owned(),
            before,
            after,
        })
    }

    /// What `path` names: the table, and the key in it.
    fn place<'p>(&self, path: &'p str) -> Result<(Place, &'p str), String> {
        let obstacles = self.obstacles().iter().enumerate();
        let scenery = self.scenery().iter().enumerate();
        let fixed = [(GOD_OBJECT, Place::GodObject), (COUPLING, Place::Coupling)];
        let named = fixed
            .into_iter()
            .chain(obstacles.map(|(i, body)| (body.name.as_str(), Place::Obstacle(i))))
            .chain(scenery.map(|(i, body)| (body.name.as_str(), Place::Scenery(i))));
        // A name may hold dots, and begin another's.
        let found: Vec<(&str, Place, &str)> = named
            .clone()
            .filter_map(|(name, place)| {
                let key = path.strip_prefix(name)?.strip_prefix('.')?;
                Some((name, place, key))
            })
            .collect();
        let whole = found
            .iter()
            .find(|(_, place, key)| place.keys().contains(key));
        if let Some((name, place, key)) = whole {
            return match place {
                Place::Obstacle(i) if key.starts_with("pose") && self.moves(*i) => Err(format!(
                    "has no effect: \"{name}\" moves as its trace says; change the trace"
                )),
                _ => Ok((*place, *key)),
            };
        }
        if let Some((name, place, key)) = found.first() {
            let keys = place.keys();
            let hint = nearest(key, keys.iter().copied());
            return Err(format!(
                "sets `{key}`, which is no key that can be changed while it runs; of \"{name}\" these can: {}{hint}",
                keys.join(", ")
            ));
        }
        if let Some((_, place)) = named.clone().find(|(name, _)| *name == path) {
            return Err(format!(
                "names no key of \"{path}\"; write {path}.KEY=VALUE, where KEY is one of: {}",
                place.keys().join(", ")
            ));
        }
        let wrong = path.split_once('.').map_or(path, |(name, _)| name);
        let names: Vec<&str> = named.map(|(name, _)| name).collect();
        let hint = nearest(wrong, names.iter().copied());
        let more = names.len().saturating_sub(MAX_NAMES);
        let shown = names[..names.len() - more].join(", ");
        let more = if more > 0 {
            format!(" and {more} more")
        } else {
            String::new()
        };
        Err(format!(
            "names no object: there is no \"{wrong}\" among {shown}{more}{hint}; write NAME.KEY=VALUE"
        ))
    }

    fn moves(&self, obstacle: usize) -> bool {
        self.obstacles()
            .get(obstacle)
            .is_some_and(|body| body.motion.is_some())
    }
}

/// The name of an obstacle or a piece of scenery: one that an edit can say, and that is not another's.
pub(super) fn object_name(section: &Section<'_>, example: &str) -> Option<String> {
    let name = section.required_text("name", example)?;
    let complain = |why: &str| {
        let of = section.name();
        let text = format!("the name {name:?} in {of} {why}; write another");
        section.complain_of("name", text);
    };
    if RESERVED_NAMES.contains(&name) {
        complain("is that of the held body or of a table");
    } else if name.contains(|c: char| c == '=' || c.is_control()) || name.trim() != name {
        complain("has an `=`, a control character or a blank at its ends");
    }
    Some(name.to_owned())
}

/// A value as it is written, without what stands around it.
fn written(value: &Value) -> String {
    let mut bare = value.clone();
    bare.decor_mut().clear();
    bare.to_string()
}

/// Sets a key below `table`; what was written there before.
fn set_in(
    table: &mut dyn TableLike,
    keys: &[&str],
    value: Value,
) -> Result<Option<String>, String> {
    let (key, below) = match keys {
        [] => return Err("names no key".to_owned()),
        [key, below @ ..] => (*key, below),
    };
    if below.is_empty() {
        return match table.get_mut(key) {
            Some(Item::Value(old)) => {
                let before = written(old);
                replace(old, value)?;
                Ok(Some(before))
            }
            None | Some(Item::None) => {
                insert(table, key, value);
                Ok(None)
            }
            Some(_) => Err(format!("finds a table at `{key}`; edit the file")),
        };
    }
    if !table.contains_key(key) {
        insert(table, key, InlineTable::new().into());
    }
    let inner = table.get_mut(key).and_then(Item::as_table_like_mut);
    let inner = inner.ok_or_else(|| format!("finds no table at `{key}`; edit the file"))?;
    set_in(inner, below, value)
}

/// Adds a key after the others; the space before the end of a line or of a bracket goes there with it.
fn insert(table: &mut dyn TableLike, key: &str, mut value: Value) {
    let last = table
        .iter_mut()
        .last()
        .and_then(|(_, item)| item.as_value_mut());
    if let Some(last) = last {
        let suffix = last.decor().suffix().and_then(|text| text.as_str());
        let space = suffix
            .filter(|text| text.chars().all(|c| c == ' '))
            .map(str::to_owned);
        if let Some(space) = space {
            last.decor_mut().set_suffix("");
            *value.decor_mut() = toml_edit::Decor::new(" ", space);
        }
    }
    table.insert(key, Item::Value(value));
}

/// Puts a value in the place of another; what stands around it stays, and around the items of a list of the same length.
fn replace(old: &mut Value, mut new: Value) -> Result<(), String> {
    if let (Value::Array(items), Value::Array(values)) = (&mut *old, &new)
        && items.len() == values.len()
    {
        return items
            .iter_mut()
            .zip(values.iter())
            .try_for_each(|(item, value)| replace(item, value.clone()));
    }
    if written(old).contains('\n') {
        let text =
            "would lose what stands between the lines of the value in the file; edit the file";
        return Err(text.to_owned());
    }
    *new.decor_mut() = old.decor().clone();
    *old = new;
    Ok(())
}
