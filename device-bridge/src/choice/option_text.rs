//! One option of a device, as it was written, against what the driver takes.

use std::str::FromStr;

use super::UnknownDevice;

/// Similarity (Jaro-Winkler, 0 to 1) from which a name is offered for an unknown one.
const SUGGESTION_SIMILARITY: f64 = 0.7;

/// One option as it was written; each question that names it takes its value.
pub(super) struct OptionText<'a> {
    device: &'static str,
    pub(super) name: &'a str,
    pub(super) value: &'a str,
    known: Vec<&'static str>,
}

impl<'a> OptionText<'a> {
    pub(super) fn new(device: &'static str, text: &'a str) -> Self {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        Self {
            device,
            name: name.trim(),
            value: value.trim(),
            known: Vec::new(),
        }
    }

    /// The value, if this is the option.
    pub(super) fn asked(&mut self, option: &'static str) -> Option<&'a str> {
        self.known.push(option);
        (self.name == option).then_some(self.value)
    }

    pub(super) fn wrong(&self, option: &'static str, wanted: impl Into<String>) -> UnknownDevice {
        UnknownDevice::Value {
            device: self.device,
            option,
            value: self.value.to_owned(),
            wanted: wanted.into(),
        }
    }

    pub(super) fn number(
        &mut self,
        option: &'static str,
        low: f64,
        high: f64,
        target: &mut f64,
    ) -> Result<(), UnknownDevice> {
        let Some(value) = self.asked(option) else {
            return Ok(());
        };
        match value.parse() {
            Ok(number) if (low..=high).contains(&number) => *target = number,
            _ => return Err(self.wrong(option, format!("a number from {low} to {high}"))),
        }
        Ok(())
    }

    pub(super) fn choice<T: Copy>(
        &mut self,
        option: &'static str,
        choices: &[(&'static str, T)],
        target: &mut T,
    ) -> Result<(), UnknownDevice> {
        let Some(value) = self.asked(option) else {
            return Ok(());
        };
        match choices.iter().find(|(name, _)| *name == value) {
            Some((_, choice)) => *target = *choice,
            None => {
                let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
                return Err(self.wrong(option, names.join(" or ")));
            }
        }
        Ok(())
    }

    pub(super) fn parsed<T: FromStr>(
        &mut self,
        option: &'static str,
        wanted: &str,
        target: &mut T,
    ) -> Result<(), UnknownDevice> {
        let Some(value) = self.asked(option) else {
            return Ok(());
        };
        *target = value.parse().map_err(|_| self.wrong(option, wanted))?;
        Ok(())
    }

    pub(super) fn finish(self) -> Result<(), UnknownDevice> {
        if self.known.contains(&self.name) {
            return Ok(());
        }
        Err(UnknownDevice::Option {
            device: self.device,
            option: self.name.to_owned(),
            hint: nearest(self.name, self.known.iter().copied()),
            known: self.known.join(", "),
        })
    }
}

/// "; did you mean `x`?" for the most similar name, if one is similar.
pub(super) fn nearest(name: &str, names: impl Iterator<Item = &'static str>) -> String {
    names
        .map(|known| (strsim::jaro_winkler(name, known), known))
        .filter(|(similarity, _)| *similarity >= SUGGESTION_SIMILARITY)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(String::new, |(_, known)| {
            format!(" (did you mean `{known}`?)")
        })
}
