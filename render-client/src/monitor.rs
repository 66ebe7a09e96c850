//! Which monitor each window covers.

use std::collections::HashMap;

use taut_proto::scene::NodeDescription;

use crate::error::RenderError;

/// Where the windows of a node are to be.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Places {
    /// They cover their monitors.
    pub(crate) fullscreen: bool,
    /// Their monitors in order, by name or number; none leaves it to the window system.
    pub(crate) monitors: Vec<String>,
}

impl Places {
    /// As the workbench file says of a node.
    pub(crate) fn of(node: &NodeDescription) -> Self {
        let names = node.monitors.iter();
        Self {
            fullscreen: node.window.fullscreen,
            monitors: names.map(|name| name.raw().to_owned()).collect(),
        }
    }

    /// What these ask for; where they ask for nothing, `said`.
    pub(crate) fn or(&self, said: Self) -> Self {
        Self {
            fullscreen: self.fullscreen || said.fullscreen,
            monitors: if self.monitors.is_empty() {
                said.monitors
            } else {
                self.monitors.clone()
            },
        }
    }
}

/// The place, among the monitors there are, of window number `window`; `None` leaves it to the window system.
///
/// `wanted` names monitors in the order of the windows, by name (`DP-1`) or by number from 0. A window past its end
/// takes the monitor after that of the window before it, if there is one.
pub(crate) fn of_window(
    window: usize,
    wanted: &[String],
    known: &[Option<String>],
) -> Result<Option<usize>, RenderError> {
    let Some(last) = wanted.len().checked_sub(1) else {
        return Ok((window < known.len()).then_some(window));
    };
    let place = place_of(&wanted[window.min(last)], known)? + window.saturating_sub(last);
    Ok((place < known.len()).then_some(place))
}

/// Windows that cover nothing stand in columns, one on each monitor, the first above.
#[derive(Debug, Default)]
pub(crate) struct Columns(HashMap<Option<usize>, u32>);

impl Columns {
    /// How far below the upper edge of its monitor the next window begins, which is `height` high, both in pixels. `None`: the monitor that
    /// the window system takes where none is named.
    pub(crate) fn next(&mut self, monitor: Option<usize>, height: u32) -> u32 {
        let end = self.0.entry(monitor).or_default();
        let begin = *end;
        *end = begin.saturating_add(height);
        begin
    }
}

fn place_of(wanted: &str, known: &[Option<String>]) -> Result<usize, RenderError> {
    let named = known
        .iter()
        .position(|name| name.as_deref() == Some(wanted));
    let numbered = || wanted.parse().ok().filter(|place| *place < known.len());
    named.or_else(numbered).ok_or_else(|| {
        let name = |(place, name): (usize, &Option<String>)| match name {
            Some(name) => format!("{place} \"{name}\""),
            None => format!("{place} without a name"),
        };
        let list: Vec<String> = known.iter().enumerate().map(name).collect();
        RenderError::UnknownMonitor {
            wanted: wanted.to_owned(),
            known: if list.is_empty() {
                "none that the window system names".to_owned()
            } else {
                list.join(", ")
            },
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_proto::scene::{Stereo, WindowDescription};

    fn known() -> Vec<Option<String>> {
        vec![Some("eDP-1".into()), Some("DP-1".into()), None]
    }

    fn place(window: usize, wanted: &[&str]) -> Result<Option<usize>, RenderError> {
        let wanted: Vec<String> = wanted.iter().map(|&name| name.to_owned()).collect();
        of_window(window, &wanted, &known())
    }

    #[test]
    fn windows_cover_the_monitors_named_then_those_that_follow() {
        assert_eq!(place(0, &["DP-1"]).expect("known"), Some(1));
        assert_eq!(place(1, &["DP-1"]).expect("known"), Some(2));
        assert_eq!(place(2, &["DP-1"]).expect("none is left"), None);
        assert_eq!(place(1, &["2", "eDP-1"]).expect("known"), Some(0));
        assert_eq!(place(1, &[]).expect("in order"), Some(1));
        assert_eq!(place(5, &[]).expect("none is left"), None);
    }

    #[test]
    fn the_first_window_of_each_monitor_begins_at_its_upper_edge() {
        let mut columns = Columns::default();
        let begins = [Some(1), Some(2), Some(1), None, None].map(|on| columns.next(on, 1080));
        assert_eq!(begins, [0, 0, 1080, 0, 1080]);
    }

    #[test]
    fn windows_opened_anew_are_where_the_changed_workbench_file_says() {
        let mut node = NodeDescription {
            name: "wall".into(),
            screens: Vec::new(),
            stereo: Stereo::Mono,
            window: WindowDescription {
                width: 960,
                height: 640,
                fullscreen: false,
            },
            monitors: vec!["DP-1".into()],
        };
        let places = |fullscreen, monitor: &str| Places {
            fullscreen,
            monitors: vec![monitor.to_owned()],
        };
        let nothing_asked = Places::default();
        assert_eq!(
            nothing_asked.or(Places::of(&node)),
            places(false, "DP-1"),
            "at the start"
        );
        node.window.fullscreen = true;
        node.monitors = vec!["1".into()];
        let changed = Places::of(&node);
        assert_eq!(nothing_asked.or(changed.clone()), places(true, "1"));
        // What the command line says comes first, each time.
        let asked = places(false, "eDP-1");
        assert_eq!(asked.or(changed), places(true, "eDP-1"));
        let covering = Places {
            fullscreen: true,
            ..Places::default()
        };
        assert_eq!(covering.or(Places::default()), covering);
    }

    #[test]
    fn a_monitor_that_is_not_there_is_refused_with_those_that_are() {
        for wanted in ["HDMI-1", "3"] {
            let error = place(0, &[wanted]).expect_err("unknown").to_string();
            for part in [wanted, "0 \"eDP-1\"", "1 \"DP-1\"", "2 without a name"] {
                assert!(error.contains(part), "{part} in {error}");
            }
        }
    }
}
