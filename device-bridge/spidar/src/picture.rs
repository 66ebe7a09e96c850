//! The workspace map as an SVG picture: three slices of position, three of rotation.

use std::fmt::Write as _;

use crate::Geometry;
use crate::workspace::{Slice, WorkspaceMap, WorkspaceSummary};

/// Edge of one slice's drawing, px.
const EDGE: f64 = 300.0;
/// Space around the drawings, px.
const MARGIN: f64 = 70.0;
/// Height of the title, px.
const TITLE: f64 = 104.0;
/// Space for one legend, px.
const LEGEND: f64 = 130.0;
/// Colours from weak to strong, dark to bright, told apart by lightness alone, too.
const COLOURS: [&str; 8] = [
    "#2b1a4d", "#443983", "#31688e", "#21918c", "#35b779", "#90d743", "#d8e219", "#fde725",
];
/// Where the strings cannot all be taut.
const NOT_TAUT: &str = "#dddddd";
const AXES: [&str; 3] = ["x", "y", "z"];
/// Millimetres in a metre.
const MM: f64 = 1e3;

/// Draws the map of a device, with its figures, as the text of an SVG file.
#[must_use]
pub fn picture(geometry: &Geometry, summary: &WorkspaceSummary, map: &WorkspaceMap) -> String {
    let width = 3.0 * EDGE + 4.0 * MARGIN + LEGEND;
    let height = TITLE + 2.0 * (EDGE + MARGIN);
    let mut svg = String::new();
    let drawn = draw(&mut svg, geometry, summary, map, width, height);
    debug_assert!(drawn.is_ok(), "writing to a string cannot fail");
    svg
}

fn draw(
    svg: &mut String,
    geometry: &Geometry,
    summary: &WorkspaceSummary,
    map: &WorkspaceMap,
    width: f64,
    height: f64,
) -> std::fmt::Result {
    write!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    )?;
    let centre = &summary.centre;
    let title = format!("{}: what can be rendered where", escaped(&geometry.name));
    text(svg, MARGIN, 30.0, "start", 20, &title)?;
    let figures = format!(
        "At the centre: {:.1} N and {:.3} N m along the weakest axis ({:.1} N and {:.3} N m along the weakest of 26 directions). Strings {} to {} N.",
        centre.axis_force.size,
        centre.axis_torque.size,
        centre.weakest_force.size,
        centre.weakest_torque.size,
        geometry.tension_min,
        geometry.tension_max,
    );
    text(svg, MARGIN, 54.0, "start", 13, &figures)?;
    let taut = format!(
        "All strings taut without any wrench at {:.0} % of the poses within {:.0} mm and {:.0} degrees. Grey: they cannot be, or the grip is at a motor (red).",
        100.0 * summary.ball_pretension,
        MM * summary.ball_radius,
        summary.ball_rotation.to_degrees(),
    );
    text(svg, MARGIN, 74.0, "start", 13, &taut)?;

    for (row, turned) in [false, true].into_iter().enumerate() {
        let slices = || map.slices.iter().filter(|slice| slice.turned == turned);
        let values = slices().flat_map(|slice| slice.values.iter().flatten());
        let most = values.copied().fold(0.0, f64::max);
        let top = TITLE + row as f64 * (EDGE + MARGIN);
        for (column, slice) in slices().enumerate() {
            let left = MARGIN + column as f64 * (EDGE + MARGIN);
            panel(svg, geometry, slice, left, top, most)?;
        }
        let left = MARGIN + 3.0 * (EDGE + MARGIN) - 0.3 * MARGIN;
        legend(svg, turned, left, top, most)?;
    }
    svg.write_str("</svg>\n")
}

fn panel(
    svg: &mut String,
    geometry: &Geometry,
    slice: &Slice,
    left: f64,
    top: f64,
    most: f64,
) -> std::fmt::Result {
    // One scale for both axes, so that the frame keeps its shape.
    let extent = slice.extent_right.max(slice.extent_up);
    let (half_right, half_up) = (
        0.5 * EDGE * slice.extent_right / extent,
        0.5 * EDGE * slice.extent_up / extent,
    );
    let (middle, centre) = (left + 0.5 * EDGE, top + 0.5 * EDGE);
    let cell = 2.0 / slice.cells as f64;
    for row in 0..slice.cells {
        let values = &slice.values[row * slice.cells..(row + 1) * slice.cells];
        let y = centre + half_up * (1.0 - cell * (row as f64 + 1.0));
        // Neighbours of one colour are one rectangle.
        let mut start = 0;
        while start < slice.cells {
            let fill = colour(values[start], most);
            let same = |value: &&Option<f64>| colour(**value, most) == fill;
            let run = values[start..].iter().take_while(same).count();
            let x = middle + half_right * (cell * start as f64 - 1.0);
            writeln!(
                svg,
                "<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{fill}\" shape-rendering=\"crispEdges\"/>",
                half_right * cell * run as f64,
                half_up * cell,
            )?;
            start += run;
        }
    }
    writeln!(
        svg,
        "<rect x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"none\" stroke=\"#444444\"/>",
        middle - half_right,
        centre - half_up,
        2.0 * half_right,
        2.0 * half_up,
    )?;
    if !slice.turned {
        for motor in &geometry.motors {
            let x = middle + half_right * motor[slice.right] / slice.extent_right;
            let y = centre - half_up * motor[slice.up] / slice.extent_up;
            writeln!(
                svg,
                "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"4\" fill=\"#c02020\"/>"
            )?;
        }
    }
    labels(svg, slice, (middle, centre), (half_right, half_up))
}

fn labels(
    svg: &mut String,
    slice: &Slice,
    (middle, centre): (f64, f64),
    (half_right, half_up): (f64, f64),
) -> std::fmt::Result {
    let (what, unit, factor) = if slice.turned {
        ("turned about", "deg", 1.0_f64.to_degrees())
    } else {
        ("moved along", "mm", MM)
    };
    let below = centre + half_up + 16.0;
    let name = format!("{what} {} ({unit})", AXES[slice.right]);
    text(svg, middle, below + 16.0, "middle", 13, &name)?;
    for share in [-1.0, 0.0, 1.0] {
        let figure = format!("{:.0}", share * slice.extent_right * factor);
        text(
            svg,
            middle + share * half_right,
            below,
            "middle",
            11,
            &figure,
        )?;
        let figure = format!("{:.0}", share * slice.extent_up * factor);
        let (x, y) = (middle - half_right - 6.0, centre - share * half_up + 4.0);
        text(svg, x, y, "end", 11, &figure)?;
    }
    let (x, y) = (middle - half_right - 40.0, centre);
    writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 {x:.1} {y:.1})\">{what} {} ({unit})</text>",
        AXES[slice.up]
    )
}

fn legend(svg: &mut String, turned: bool, left: f64, top: f64, most: f64) -> std::fmt::Result {
    let (what, unit, digits) = if turned {
        ("Pure torque,", "N m", 3)
    } else {
        ("Pure force,", "N", 1)
    };
    text(svg, left, top + 14.0, "start", 13, what)?;
    text(svg, left, top + 30.0, "start", 13, "weakest of 26")?;
    text(svg, left, top + 46.0, "start", 13, "directions")?;
    let step = 26.0;
    for (k, fill) in COLOURS.iter().enumerate() {
        let y = top + 60.0 + step * (COLOURS.len() - 1 - k) as f64;
        let at = |k: usize| most * k as f64 / COLOURS.len() as f64;
        writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{y:.1}\" width=\"22\" height=\"{step}\" fill=\"{fill}\"/>"
        )?;
        let range = format!("{:.digits$} to {:.digits$} {unit}", at(k), at(k + 1));
        text(svg, left + 28.0, y + 17.0, "start", 11, &range)?;
    }
    let y = top + 68.0 + step * COLOURS.len() as f64;
    writeln!(
        svg,
        "<rect x=\"{left:.1}\" y=\"{y:.1}\" width=\"22\" height=\"{step}\" fill=\"{NOT_TAUT}\"/>"
    )?;
    text(svg, left + 28.0, y + 17.0, "start", 11, "not taut")
}

fn colour(value: Option<f64>, most: f64) -> &'static str {
    let Some(value) = value else {
        return NOT_TAUT;
    };
    let share = if most > 0.0 { value / most } else { 0.0 };
    // Saturates: NaN is 0.
    let band = (share * COLOURS.len() as f64) as usize;
    COLOURS[band.min(COLOURS.len() - 1)]
}

fn text(
    svg: &mut String,
    x: f64,
    y: f64,
    anchor: &str,
    size: u32,
    words: &str,
) -> std::fmt::Result {
    writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-size=\"{size}\">{words}</text>"
    )
}

/// Text that may stand between tags.
fn escaped(words: &str) -> String {
    words
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::{summary, workspace_map};

    #[test]
    fn a_picture_shows_both_kinds_of_slices_and_where_nothing_goes() {
        let mut geometry = Geometry::shipped("g6x5r").expect("shipped");
        geometry.name = "a <b> & c".into();
        let svg = picture(&geometry, &summary(&geometry), &workspace_map(&geometry));
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
        assert!(svg.contains("a &lt;b&gt; &amp; c"));
        for part in ["moved along x", "turned about z", NOT_TAUT, COLOURS[7]] {
            assert!(svg.contains(part), "{part}");
        }
        assert_eq!(svg.matches("<circle").count(), 3 * 8);
    }

    #[test]
    fn colours_go_from_weak_to_strong_and_a_broken_figure_is_weak() {
        assert_eq!(colour(None, 1.0), NOT_TAUT);
        assert_eq!(colour(Some(0.0), 1.0), COLOURS[0]);
        assert_eq!(colour(Some(1.0), 1.0), COLOURS[7]);
        assert_eq!(colour(Some(f64::NAN), 1.0), COLOURS[0]);
    }
}
