//! `[operator]`: the page from which a person arms and disarms. Off unless the file says otherwise, and on the loopback address always: there is no
//! key that lets other machines in.

use std::path::PathBuf;

use super::parts::{Files, port};
use super::token::read_token;
use crate::document::Section;

/// Most scenes to choose from.
const MAX_SCENES: usize = 100;

/// The operator's page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Operator {
    /// Whether there is one.
    pub enabled: bool,
    /// TCP port of the loopback address; 0 takes a free one.
    pub port: u16,
    /// File with the token that those who act must show; without it each start has a token of its own.
    pub token_file: Option<PathBuf>,
    /// Scenes that may be chosen from the page: shipped ones by name, else files.
    pub scenes: Vec<String>,
    /// Folder of the recordings that are begun from the page, each a folder named by its date; without it none is begun there.
    pub recordings: Option<PathBuf>,
}

impl Default for Operator {
    fn default() -> Self {
        Self {
            enabled: false,
            port: 4861,
            token_file: None,
            scenes: Vec::new(),
            recordings: None,
        }
    }
}

impl Operator {
    /// The token, if the file names one.
    ///
    /// # Errors
    /// A sentence, where its file cannot be read or holds none.
    pub fn token(&self) -> Result<Option<String>, String> {
        let file = self.token_file.as_deref();
        file.map(|file| read_token("operator", file)).transpose()
    }
}

pub(super) fn operator(section: &Section<'_>, files: &Files<'_>) -> Operator {
    let default = Operator::default();
    Operator {
        enabled: section.boolean("enabled").unwrap_or(false),
        port: port(section, "port", default.port),
        token_file: files.path(section, "token_file"),
        scenes: scenes(section, files),
        recordings: files.path(section, "recordings"),
    }
}

fn scenes(section: &Section<'_>, files: &Files<'_>) -> Vec<String> {
    let named = section.texts("scenes").unwrap_or_default();
    if let Some((_, at)) = named.get(MAX_SCENES) {
        let text = format!("`scenes` in [operator] names more than {MAX_SCENES}; leave some out");
        section.complain(at, text);
    }
    named
        .into_iter()
        .take(MAX_SCENES)
        .map(|(name, at)| {
            if name.is_empty() {
                let text = "a scene in [operator] has no name; write a shipped one's, or a file";
                section.complain(at, text);
            }
            files.scene(name)
        })
        .collect()
}
