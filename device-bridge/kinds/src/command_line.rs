//! `--device`: a kind, what it is at, and options after commas.

use crate::chosen::Chosen;
use crate::key::Key;
use crate::kind::Kind;
use crate::kinds::KINDS;

/// Similarity (Jaro-Winkler, 0 to 1) from which a name is offered for an unknown one.
const SUGGESTION_SIMILARITY: f64 = 0.7;

/// A text that chooses no device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnknownDevice {
    /// No kind of that name; the nearest, in a sentence's end, or nothing.
    #[error("there is no device `{0}`{1}; use {forms}", forms = names_and_forms())]
    Name(String, String),
    /// The kind needs more than its name: what to write.
    #[error("the device `{0}` is incomplete; write {1}")]
    Incomplete(&'static str, String),
    /// No such option.
    #[error("the device `{device}` has no option `{option}`{hint}; it has {known}")]
    Option {
        /// The kind.
        device: &'static str,
        /// What was written.
        option: String,
        /// The nearest option.
        hint: String,
        /// All of them.
        known: String,
    },
    /// A value that the option does not take.
    #[error("`{option}` of the device `{device}` is `{value}`, but must be {wanted}")]
    Value {
        /// The kind.
        device: &'static str,
        /// The option.
        option: String,
        /// What was written.
        value: String,
        /// What it takes.
        wanted: String,
    },
    /// The geometry of a string-driven device, which the driver reads.
    #[error("{0}")]
    Geometry(String),
}

/// Reads a device of the command line.
pub fn read_choice(text: &str) -> Result<Chosen, UnknownDevice> {
    let end = text.find([':', ',', '=']).unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    let named = || KINDS.iter().filter(|kind| kind.on_command_line);
    let Some(kind) = named().find(|kind| kind.name == name) else {
        let hint = nearest(name, named().map(|kind| kind.name));
        return Err(UnknownDevice::Name(text.to_owned(), hint));
    };
    let mut chosen = Chosen::plain(kind);
    let options = at(kind, rest, &mut chosen)?;
    let mut handed_on = Vec::new();
    for text in options.split(',').filter(|option| !option.is_empty()) {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        let (name, value) = (name.trim(), value.trim());
        match options_of(kind).find(|key| option_name(key) == name) {
            Some(key) => set(&mut chosen, key, value)?,
            None if kind.hands_on => handed_on.push(text),
            None => return Err(unknown_option(kind, name)),
        }
    }
    chosen.handed_on = handed_on.join(",");
    Ok(chosen)
}

/// What the kind is at: a file, a port, an address. Returns the options after it.
fn at<'t>(kind: &Kind, rest: &'t str, chosen: &mut Chosen) -> Result<&'t str, UnknownDevice> {
    let incomplete = || UnknownDevice::Incomplete(kind.name, kind.form());
    let sign = if kind.needs_place { ':' } else { '=' };
    let (Some(key), Some(text)) = (&kind.place, rest.strip_prefix(sign)) else {
        return match rest.strip_prefix(',') {
            Some(options) if !kind.needs_place && options_of(kind).next().is_some() => Ok(options),
            None if !kind.needs_place && rest.is_empty() => Ok(""),
            _ => Err(incomplete()),
        };
    };
    // Without options a comma belongs to the name.
    let (place, options) = match options_of(kind).next() {
        Some(_) => text.split_once(',').unwrap_or((text, "")),
        None => (text, ""),
    };
    if place.is_empty() && kind.needs_place {
        return Err(incomplete());
    }
    set(chosen, key, place)?;
    Ok(options)
}

fn set(chosen: &mut Chosen, key: &Key, text: &str) -> Result<(), UnknownDevice> {
    let Some(value) = key.takes.read(text) else {
        return Err(UnknownDevice::Value {
            device: chosen.kind.name,
            option: option_name(key),
            value: text.to_owned(),
            wanted: match key.takes.wanted() {
                wanted if chosen.kind.place.is_some_and(|place| place == *key) => {
                    format!("{wanted}: write {}", chosen.kind.form())
                }
                wanted => wanted,
            },
        });
    };
    chosen.set(key.name, value);
    Ok(())
}

/// The keys that the command line has, too.
pub(crate) fn options_of(kind: &Kind) -> impl Iterator<Item = &'static Key> {
    kind.keys.iter().filter(|key| !key.in_file_only)
}

pub(crate) fn option_name(key: &Key) -> String {
    key.name.replace('_', "-")
}

fn unknown_option(kind: &Kind, name: &str) -> UnknownDevice {
    let known: Vec<String> = options_of(kind).map(option_name).collect();
    UnknownDevice::Option {
        device: kind.name,
        option: name.to_owned(),
        hint: nearest(name, known.iter().map(String::as_str)),
        known: known.join(", "),
    }
}

/// " (did you mean `x`?)" for the most similar name, if one is similar.
fn nearest<'n>(name: &str, names: impl Iterator<Item = &'n str>) -> String {
    names
        .map(|known| (strsim::jaro_winkler(name, known), known))
        .filter(|(similarity, _)| *similarity >= SUGGESTION_SIMILARITY)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(String::new, |(_, known)| {
            format!(" (did you mean `{known}`?)")
        })
}

/// All kinds in short, in a sentence.
fn names_and_forms() -> String {
    let forms: Vec<String> = KINDS
        .iter()
        .filter(|kind| kind.on_command_line)
        .map(|kind| kind.short_form())
        .collect();
    match forms.split_last() {
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

/// What follows the arguments in `--help`: every kind with its options.
#[must_use]
pub fn device_help() -> String {
    let mut help = "Devices:\n".to_owned();
    for kind in KINDS.iter().filter(|kind| kind.on_command_line) {
        help += &format!("  {}\n      {}\n", kind.form(), kind.what);
    }
    help
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kind::KindId;

    fn error(text: &str) -> String {
        read_choice(text).expect_err(text).to_string()
    }

    #[test]
    fn every_kind_of_the_command_line_is_chosen_by_its_form() {
        for kind in KINDS.iter().filter(|kind| kind.on_command_line) {
            let text = kind
                .short_form()
                .replace("TRACKER@HOST", "Tracker0@host")
                .replace("FILE", "a.csv");
            let chosen = read_choice(&text).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(chosen.kind.id, kind.id);
            assert!(device_help().contains(&kind.form()) && device_help().contains(kind.what));
        }
        let chosen = read_choice("trace:a,b.csv").expect("a trace");
        assert_eq!(chosen.file("path"), Some("a,b.csv".as_ref()));
    }

    #[test]
    fn options_are_read_and_those_of_others_are_handed_on() {
        let chosen = read_choice("plugin:/l.so,side=left,scale=2,firm").expect("a plug-in");
        assert_eq!(chosen.kind.id, KindId::Plugin);
        assert_eq!(chosen.number("scale"), Some(2.0));
        assert_eq!(chosen.handed_on, "side=left,firm");
        let chosen = read_choice("space-mouse,dead-zone=0.2").expect("a cap");
        assert_eq!(chosen.number("dead_zone"), Some(0.2));
    }

    #[test]
    fn wrong_words_are_answered_with_the_right_ones() {
        for (text, part) in [
            ("spacemouse", "did you mean `space-mouse`?"),
            ("simulatd", "did you mean `simulated`?"),
            (
                "phantom",
                "use simulated, trace:FILE, haply, spidar:PORT, polhem:PORT, wooden, plugin:LIBRARY, python:FILE, space-mouse",
            ),
            ("remote", "there is no device `remote`"),
            ("spidar", "write spidar:PORT"),
            ("spidar:", "write spidar:PORT"),
            ("wooden,model=phantom", "must be woodenhaptics-2019 or"),
            ("polhem", "write polhem:PORT"),
            ("plugin", "write plugin:LIBRARY"),
            ("plugin:", "write plugin:LIBRARY"),
            ("plugin:,scale=1", "write plugin:LIBRARY"),
            ("plugin:/l.so,scale=0", "a number from 0.01 to 100"),
            ("python:,scale=1", "write python:FILE"),
            ("polhem:/dev/x,scal=1", "did you mean `scale`?"),
            ("spidar:/dev/x,axes=y x z", "right-handed"),
            ("haply=", "HOST or HOST:PORT: write haply[=HOST:PORT]"),
            ("haply:10001", "write haply[=HOST:PORT]"),
            ("haply=pc:1,grip=maybe", "must be yes or no"),
            ("haply,scale=0", "a number from 0.01 to 100"),
            ("haply,arms=1", "did you mean `arm`?"),
            ("trace:", "write trace:FILE"),
            ("trace", "write trace:FILE"),
            ("simulated,hand=firm", "it has strings"),
            ("simulated,strings", "must be g6x3r, g6x4r, g6x5r, wb or"),
            ("simulated:wb", "write simulated"),
            ("vrpn", "write vrpn:TRACKER@HOST"),
            ("vrpn:Tracker0", "DEVICE@HOST:PORT"),
            ("vrpn:T@h,sensors=1", "did you mean `sensor`?"),
            ("vrpn:T@h,axes=x y", "such as `x -z y`"),
            ("vrpn:T@h,mode=tpc", "must be tcp or udp"),
            ("vrpn:T@h,mount=1", "no option `mount`"),
            ("space-mouse,speed=fast", "a number from 0.001 to 10"),
            ("space-mouse,speed=NaN", "a number from 0.001 to 10"),
            ("space-mouse,sped=1", "did you mean `speed`?"),
            ("mouse,speed=1", "write mouse"),
        ] {
            let error = error(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
