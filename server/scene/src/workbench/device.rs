//! The device in the user's hand: the kinds and keys of [`taut_kinds::KINDS`], out of the file.

use taut_kinds::{Chosen, KINDS, Key, Kind, KindId, Takes, Value};
use taut_plant::HandPreset;

use super::parts::Files;
use super::spec::Device;
use crate::document::{Range, Section, table};
use crate::scene::pose_of;

/// The device of a workbench that says nothing of it.
const SIMULATED: Device = Device::Simulated {
    hand: None,
    path: None,
    tremor: 0.0,
    seed: 0,
    strings: None,
};

/// Reads `[device]`.
pub(super) fn device(root: &Section<'_>, files: &Files<'_>) -> Option<Device> {
    table(root, "device", |section| device_of(section, files)).unwrap_or(Some(SIMULATED))
}

fn device_of(section: &Section<'_>, files: &Files<'_>) -> Option<Device> {
    section.require("kind", "kind = \"simulated\"");
    let kinds = KINDS.each_ref().map(|kind| (kind.name, kind));
    let Some(kind) = section.choice("kind", &kinds) else {
        // Which keys belong here depends on the kind: complain of nothing else.
        for key in KINDS.iter().flat_map(Kind::every_key) {
            section.has(key.name);
        }
        return None;
    };
    let chosen = keys_of(kind, section, files, &[])?;
    Some(match kind.id {
        KindId::Simulated => Device::Simulated {
            hand: chosen.named("hand", &HandPreset::NAMED),
            path: chosen.file("path").map(Into::into),
            tremor: chosen.number("tremor").unwrap_or(0.0),
            seed: chosen.whole("seed").unwrap_or(0).unsigned_abs(),
            strings: chosen.text("strings").map(str::to_owned),
        },
        KindId::Trace => Device::Trace {
            path: chosen.file("path")?.to_owned(),
            repeat: chosen.yes("loop").unwrap_or(false),
        },
        KindId::Mouse | KindId::Remote => Device::Remote,
        KindId::Haply
        | KindId::Spidar
        | KindId::Polhem
        | KindId::Wooden
        | KindId::Plugin
        | KindId::Python
        | KindId::SpaceMouse
        | KindId::Vrpn => Device::Driver(Box::new(chosen)),
    })
}

/// The keys of `kind`, but for those of `without`; every fault is noted.
pub(super) fn keys_of(
    kind: &'static Kind,
    section: &Section<'_>,
    files: &Files<'_>,
    without: &[&str],
) -> Option<Chosen> {
    let (mut chosen, mut is_whole) = (Chosen::plain(kind), true);
    if let Some(place) = kind.place.as_ref().filter(|_| kind.needs_place) {
        let example = format!("{} = \"{}\"", place.name, kind.place_example);
        is_whole = section.required_text(place.name, &example).is_some();
    }
    for key in kind.every_key().filter(|key| !without.contains(&key.name)) {
        if let Some(value) = value(section, key, files) {
            chosen.set(key.name, value);
        }
    }
    is_whole.then_some(chosen)
}

fn value(section: &Section<'_>, key: &Key, files: &Files<'_>) -> Option<Value> {
    let name = key.name;
    match key.takes {
        Takes::Number(low, high) => section
            .number(name, Range::Between(low, high))
            .map(Value::Number),
        Takes::Whole(low, high) => section.integer(name, low, high).map(Value::Whole),
        Takes::OneOf(words) => {
            let words: Vec<_> = words.iter().map(|word| (*word, *word)).collect();
            section.choice(name, &words).map(Value::Word)
        }
        Takes::YesOrNo => section.boolean(name).map(Value::Yes),
        Takes::Pose => table(section, name, pose_of).flatten().map(Value::Pose),
        Takes::File => files.path(section, name).map(Value::File),
        Takes::NameOrFile(_) => {
            let named = section.text(name)?;
            Some(Value::Text(files.named(named)))
        }
        Takes::Axes | Takes::RightHandedAxes | Takes::Text(_) | Takes::Service | Takes::Tracker => {
            let text = section.text(name)?;
            let value = key.takes.read(text);
            if value.is_none() {
                let wanted = key.takes.wanted();
                section.fault(name, format_args!("is \"{text}\", but must be {wanted}"));
            }
            value
        }
    }
}
