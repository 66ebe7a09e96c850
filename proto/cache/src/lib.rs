//! Files of the user's cache, each named by a hash.
//!
//! A file is written beside its place and renamed, and checked when it is read: two processes may share a directory, and a file that was
//! damaged or tampered with is removed and made again. Beyond its size the cache lets those go that were used longest ago. A cache that cannot be
//! used is done without.
#![forbid(unsafe_code)]

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// Ending of a file that is being written.
const UNFINISHED: &str = ".part";
/// Age from which on an unfinished file was left behind by a process that died.
const ABANDONED: Duration = Duration::from_secs(3600);

/// A directory of files of one kind.
#[derive(Debug)]
pub struct FileCache {
    directory: PathBuf,
    ending: &'static str,
    max_bytes: u64,
}

/// Tells the unfinished files of this process apart.
static WRITES: AtomicU64 = AtomicU64::new(0);

/// What the cache has under a name.
#[derive(Debug, PartialEq, Eq)]
pub enum Cached {
    /// These bytes, which are good.
    Bytes(Vec<u8>),
    /// Nothing.
    Missing,
    /// A file whose content is something else; it is removed.
    Damaged,
}

impl FileCache {
    /// The cache in `directory`, which is made if it is not there, readable by this account alone. Its files end with `ending` (".tmsh") and have at
    /// most `max_bytes` together.
    ///
    /// # Errors
    /// When there can be no such directory.
    pub fn open(
        directory: impl Into<PathBuf>,
        ending: &'static str,
        max_bytes: u64,
    ) -> io::Result<FileCache> {
        let directory = directory.into();
        let mut make = fs::DirBuilder::new();
        make.recursive(true);
        #[cfg(unix)]
        std::os::unix::fs::DirBuilderExt::mode(&mut make, 0o700);
        make.create(&directory)?;
        Ok(FileCache {
            directory,
            ending,
            max_bytes,
        })
    }

    /// Where the user's cache of this name is: `$XDG_CACHE_HOME/taut/NAME`, else `~/.cache/taut/NAME`; `None` for a user without either.
    ///
    /// Source: XDG Base Directory Specification, version 0.8 (a relative path is ignored).
    pub fn default_directory(name: &str) -> Option<PathBuf> {
        let absolute = |variable| {
            let path = std::env::var_os(variable).map(PathBuf::from);
            path.filter(|path| path.is_absolute())
        };
        let base = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")))?;
        Some(base.join("taut").join(name))
    }

    /// Where it is.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The file of `hash`, 64 hex digits, if it has at most `limit` bytes and these are `good`; else it is removed.
    pub fn read(&self, hash: &str, limit: usize, good: impl FnOnce(&[u8]) -> bool) -> Cached {
        let path = self.path_of(hash);
        let Ok(file) = File::open(&path) else {
            return Cached::Missing;
        };
        let mut bytes = Vec::new();
        // One byte more than any file has tells an oversized one.
        let read = (&file).take(limit as u64 + 1).read_to_end(&mut bytes);
        if read.is_err() || bytes.len() > limit || !good(&bytes) {
            let _ = fs::remove_file(&path); // another process may have been faster, and a directory is left alone
            return Cached::Damaged;
        }
        // Used now: it goes last. A file of another account keeps its age.
        let _ = file.set_modified(SystemTime::now());
        Cached::Bytes(bytes)
    }

    /// Keeps bytes that are good for `hash`, 64 hex digits.
    ///
    /// # Errors
    /// What the system says; nothing is left half-written then.
    pub fn write(&self, hash: &str, bytes: &[u8]) -> io::Result<()> {
        if bytes.len() as u64 > self.max_bytes {
            return Ok(()); // it alone is more than the cache may have
        }
        let number = WRITES.fetch_add(1, Ordering::Relaxed);
        let unfinished = self.directory.join(format!(
            "{hash}-{}-{number}{UNFINISHED}",
            std::process::id()
        ));
        let written = File::create_new(&unfinished)
            .and_then(|mut file| file.write_all(bytes))
            .and_then(|()| fs::rename(&unfinished, self.path_of(hash)));
        if let Err(error) = written {
            let _ = fs::remove_file(&unfinished); // it may not even have been made
            return Err(error);
        }
        self.trim(hash);
        Ok(())
    }

    /// Removes those used longest ago until the rest fits, but not `newest`; and what dead processes left.
    fn trim(&self, newest: &str) {
        let Ok(entries) = fs::read_dir(&self.directory) else {
            return;
        };
        let now = SystemTime::now();
        let newest = self.path_of(newest);
        let mut total = 0;
        let mut files = Vec::new();
        for entry in entries.flatten() {
            let path = entry.path();
            let Ok(metadata) = entry.metadata() else {
                continue; // removed by another process just now
            };
            let used = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            if self.is_ours(&path) {
                total += metadata.len();
                if path != newest {
                    files.push((used, metadata.len(), path));
                }
            } else if is_unfinished(&path)
                && now.duration_since(used).is_ok_and(|age| age > ABANDONED)
            {
                let _ = fs::remove_file(&path); // another process may have been faster
            }
        }
        files.sort();
        for (_, length, path) in files {
            if total <= self.max_bytes {
                return;
            }
            let _ = fs::remove_file(&path); // the same
            total -= length;
        }
    }

    /// Where the file of this hash is, if it is there.
    pub fn path_of(&self, hash: &str) -> PathBuf {
        self.directory.join(format!("{hash}{}", self.ending))
    }

    /// Whatever else lies in the directory is left alone.
    fn is_ours(&self, path: &Path) -> bool {
        let name = path.file_name().and_then(|name| name.to_str());
        name.and_then(|name| name.strip_suffix(self.ending))
            .is_some_and(is_hash)
    }
}

fn is_unfinished(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    name.and_then(|name| name.strip_suffix(UNFINISHED))
        .and_then(|name| name.split('-').next())
        .is_some_and(is_hash)
}

fn is_hash(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|digit| digit.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(content: u8, length: usize) -> (String, Vec<u8>) {
        (format!("{content:064x}"), vec![content; length])
    }

    fn cache(max_bytes: u64) -> (tempfile::TempDir, FileCache) {
        let folder = tempfile::tempdir().expect("a folder");
        let cache =
            FileCache::open(folder.path().join("a/b"), ".tmsh", max_bytes).expect("a directory");
        (folder, cache)
    }

    fn read(cache: &FileCache, file: &(String, Vec<u8>)) -> Cached {
        cache.read(&file.0, 1 << 20, |bytes| bytes == file.1)
    }

    fn keep(cache: &FileCache, file: &(String, Vec<u8>)) {
        cache.write(&file.0, &file.1).expect("written");
    }

    fn files(cache: &FileCache) -> usize {
        fs::read_dir(cache.directory()).expect("there").count()
    }

    #[test]
    fn a_file_that_is_too_long_or_not_good_is_damaged_and_gone() {
        let (_folder, cache) = cache(1000);
        let kept = mesh(1, 100);
        for (limit, good) in [(99, true), (100, false)] {
            keep(&cache, &kept);
            assert_eq!(cache.read(&kept.0, limit, |_| good), Cached::Damaged);
            assert_eq!(files(&cache), 0);
        }
    }

    #[test]
    fn beyond_its_size_those_go_that_were_used_longest_ago() {
        let (_folder, cache) = cache(300);
        let all: Vec<_> = (1..=4).map(|content| mesh(content, 100)).collect();
        let hour = Duration::from_secs(3600);
        for (index, mesh) in all[..3].iter().enumerate() {
            keep(&cache, mesh);
            let old = SystemTime::now() - hour * (10 - index as u32);
            let file = File::options()
                .append(true)
                .open(cache.path_of(&mesh.0))
                .expect("kept");
            file.set_modified(old).expect("ours");
        }
        // The first is the oldest, until it is read.
        assert!(matches!(read(&cache, &all[0]), Cached::Bytes(_)));
        keep(&cache, &all[3]);
        assert_eq!(read(&cache, &all[1]), Cached::Missing);
        for index in [0, 2, 3] {
            assert!(matches!(read(&cache, &all[index]), Cached::Bytes(_)));
        }
        // What fits in no way is not kept, and drives nothing out.
        keep(&cache, &mesh(5, 301));
        assert_eq!(files(&cache), 3);
    }

    #[test]
    fn what_is_not_ours_stays_and_what_dead_nodes_left_goes() {
        let (_folder, cache) = cache(100);
        let theirs = cache.directory().join("notes.tmsh");
        fs::write(&theirs, [0; 500]).expect("written");
        let left = |number: u32| {
            let name = format!("{}-77-{number}{UNFINISHED}", mesh(8, 1).0);
            let path = cache.directory().join(name);
            fs::write(&path, [0; 50]).expect("written");
            path
        };
        let (dead, alive) = (left(1), left(2));
        let file = File::options().append(true).open(&dead).expect("there");
        file.set_modified(SystemTime::now() - 2 * ABANDONED)
            .expect("ours");
        keep(&cache, &mesh(1, 100));
        assert!(theirs.exists() && alive.exists() && !dead.exists());
    }

    #[test]
    fn many_writers_of_one_directory_never_show_half_a_mesh() {
        let (_folder, cache) = cache(1 << 30);
        let mesh = mesh(3, 200_000);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                let second = FileCache::open(cache.directory(), ".tmsh", 1 << 30)
                    .expect("the same directory");
                let mesh = &mesh;
                let work = move || {
                    for _ in 0..20 {
                        match read(&second, mesh) {
                            Cached::Bytes(bytes) => assert_eq!(bytes, mesh.1),
                            Cached::Missing => {}
                            Cached::Damaged => panic!("half a mesh was there"),
                        }
                        second.write(&mesh.0, &mesh.1).expect("written");
                    }
                };
                std::thread::Builder::new()
                    .name("writer".to_owned())
                    .spawn_scoped(scope, work)
                    .expect("a thread");
            }
        });
        assert!(matches!(read(&cache, &mesh), Cached::Bytes(_)));
    }
}
