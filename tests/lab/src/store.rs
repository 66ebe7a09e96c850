//! Results that are finished, each in a file: a run that was interrupted goes on where it stopped.
//!
//! A file is named by a hash of everything that its result follows from: recipe, method, settings, rate, the sources of method and
//! laboratory, versions of crates, the profile of the build and the processor, since times are kept with the answers. A file that is
//! not whole is none.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::provenance;
use crate::recipe::Recipe;
use crate::reference;

/// First bytes of a file; another layout gets another.
const MAGIC: [u8; 8] = *b"tautdon1";

/// Files begun by this process.
static PARTS: AtomicUsize = AtomicUsize::new(0);

/// A folder of results, or none.
#[derive(Debug, Default)]
pub struct Store {
    directory: Option<PathBuf>,
    read: AtomicUsize,
}

impl Store {
    /// Nothing is kept.
    pub fn none() -> Self {
        Self::default()
    }

    /// Kept in a folder, which is made when the first result is.
    pub fn in_directory(directory: &Path) -> Self {
        Self {
            directory: Some(directory.to_owned()),
            read: AtomicUsize::new(0),
        }
    }

    /// How many results were there already.
    pub fn read(&self) -> usize {
        self.read.load(Ordering::Relaxed)
    }

    /// What was kept under `key`, or what `make` makes, which is then kept. `name` makes the file easier to find.
    pub(crate) fn get<T>(
        &self,
        name: &str,
        key: &str,
        from: impl Fn(&[f64]) -> Option<T>,
        make: impl FnOnce() -> (T, Vec<f64>),
    ) -> T {
        let Some(directory) = &self.directory else {
            return make().0;
        };
        let hash = blake3::hash(format!("{} {key}", surroundings()).as_bytes()).to_hex();
        let file = directory.join(format!("{name}-{}.bin", &hash[..24]));
        let kept = fs::read(&file).ok().and_then(|bytes| numbers(&bytes));
        if let Some(result) = kept.and_then(|numbers| from(&numbers)) {
            self.read.fetch_add(1, Ordering::Relaxed);
            return result;
        }
        let (result, numbers) = make();
        keep(&file, &bytes(&numbers));
        result
    }
}

/// Writes a file that is renamed when it is whole. A folder that cannot be written costs time and nothing else.
pub(crate) fn keep(file: &Path, bytes: &[u8]) {
    // Two threads, or tests side by side, may have made the same: each writes a part of its own.
    let turn = PARTS.fetch_add(1, Ordering::Relaxed);
    let part = file.with_extension(format!("{}-{turn}.part", std::process::id()));
    let written = fs::create_dir_all(file.parent().unwrap_or(Path::new(".")))
        .and_then(|()| fs::write(&part, bytes))
        .and_then(|()| fs::rename(&part, file));
    if let Err(error) = written {
        eprintln!("{}: not kept: {error}", file.display());
    }
}

/// What every result follows from.
fn surroundings() -> String {
    let profile = if cfg!(debug_assertions) {
        "debug"
    } else {
        "release"
    };
    let sources = [env!("TAUT_METHOD_SOURCES"), env!("TAUT_LAB_SOURCES")];
    let compiler = env!("TAUT_COMPILER");
    format!(
        "{sources:?} {compiler} {profile} {}",
        provenance::processor()
    )
}

/// Names a recipe with its scene, motion, settings and extent.
pub(crate) fn recipe_key(recipe: &Recipe) -> String {
    format!(
        "{recipe:?} {} {} {} {} {:?}",
        reference::content(recipe),
        recipe.phases,
        recipe.check_every,
        recipe.scene.speed,
        recipe.scene.settings
    )
}

fn bytes(numbers: &[f64]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    let check = blake3::hash(&bytes);
    bytes.extend(check.as_bytes());
    bytes
}

fn numbers(bytes: &[u8]) -> Option<Vec<f64>> {
    let (content, check) = bytes.split_last_chunk::<32>()?;
    if blake3::hash(content).as_bytes() != check {
        return None;
    }
    let (numbers, over) = content.strip_prefix(&MAGIC)?.as_chunks::<8>();
    let numbers = numbers.iter().map(|n| f64::from_le_bytes(*n)).collect();
    over.is_empty().then_some(numbers)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn a_file_is_the_same_to_the_bit_or_none() {
        let whole = bytes(&[1.0 / 3.0, f64::NEG_INFINITY]);
        assert_eq!(numbers(&whole), Some(vec![1.0 / 3.0, f64::NEG_INFINITY]));
        assert_eq!(numbers(&whole[..whole.len() - 1]), None);
        let mut bent = whole.clone();
        bent[10] ^= 1;
        assert_eq!(numbers(&bent), None);
        assert_eq!(numbers(b""), None);
    }

    #[test]
    fn what_is_kept_is_not_made_again_and_what_is_broken_is() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let made = Cell::new(0);
        let get = |key: &str| {
            let store = Store::in_directory(folder.path());
            let make = || {
                made.set(made.get() + 1);
                (7.0, vec![7.0])
            };
            let result = store.get("R00", key, |numbers| numbers.first().copied(), make);
            (result, store.read(), made.get())
        };
        assert_eq!(get("a"), (7.0, 0, 1));
        assert_eq!(get("a"), (7.0, 1, 1));
        assert_eq!(get("b"), (7.0, 0, 2));
        for entry in fs::read_dir(folder.path()).expect("the folder is there") {
            fs::write(entry.expect("an entry").path(), b"torn").expect("it can be written");
        }
        assert_eq!(get("a"), (7.0, 0, 3));
    }
}
