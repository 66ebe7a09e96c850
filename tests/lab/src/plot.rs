//! One panel of error against time or another cost, both logarithmic, with the Pareto front and lines of reference.

use std::error::Error;

use plotters::coord::Shift;
use plotters::prelude::*;

/// What is drawn on: a picture or a part of it.
pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Drawn = Result<(), Box<dyn Error>>;

/// A picture as a text that can stand in a page.
pub(crate) fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<String, Box<dyn Error>> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    draw(&area)?;
    area.present()?;
    drop(area);
    Ok(text)
}

/// Size of a panel, pixels.
pub(crate) const PANEL: (u32, u32) = (460, 340);

/// One point.
#[derive(Clone, Debug)]
pub(crate) struct Mark {
    /// Cost and error.
    pub(crate) place: (f64, f64),
    /// Least and largest error over the start phases; the same twice where there is one alone.
    pub(crate) band: [f64; 2],
    pub(crate) colour: RGBColor,
    /// Radius, pixels.
    pub(crate) size: i32,
    /// A dot; else a cross.
    pub(crate) passes: bool,
    /// Beside it; empty where its colour says enough.
    pub(crate) label: String,
}

/// Axes of a panel. What lies beyond is drawn at the border.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) title: String,
    /// Of the costs.
    pub(crate) costs: [f64; 2],
    /// What they are.
    pub(crate) cost: &'static str,
    /// A cost that is marked by a line.
    pub(crate) cost_line: Option<f64>,
    pub(crate) errors: [f64; 2],
    /// Of the errors.
    pub(crate) unit: &'static str,
    /// An error that is marked by a line.
    pub(crate) error_line: Option<f64>,
}

/// Errors are drawn a little above the border.
const LIFT: f64 = 1.4;

impl Frame {
    fn shown(&self, (cost, error): (f64, f64)) -> (f64, f64) {
        (
            cost.clamp(self.costs[0], self.costs[1]),
            error.clamp(self.errors[0] * LIFT, self.errors[1]),
        )
    }

    /// Draws marks and their front.
    pub(crate) fn draw(&self, area: &Area<'_>, marks: &[Mark]) -> Drawn {
        let ([left, right], [bottom, top]) = (self.costs, self.errors);
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .margin_right(26) // half of the last label
            .caption(&self.title, ("sans-serif", 17))
            .x_label_area_size(34)
            .y_label_area_size(58)
            .build_cartesian_2d((left..right).log_scale(), (bottom..top).log_scale())?;
        chart
            .configure_mesh()
            .x_desc(self.cost)
            .y_desc(self.unit)
            .x_labels(5)
            .y_labels(6)
            .y_label_formatter(&|error| format!("{error:e}"))
            .label_style(("sans-serif", 13))
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(238, 238, 238))
            .draw()?;
        let grey = RGBColor(120, 120, 120).stroke_width(1);
        if let Some(error) = self.error_line {
            chart.draw_series(LineSeries::new([(left, error), (right, error)], grey))?;
            let label = Text::new("J = 1", (2, -14), ("sans-serif", 12));
            chart.draw_series([EmptyElement::at((left, error)) + label])?;
        }
        if let Some(cost) = self.cost_line.filter(|cost| *cost < right) {
            let line = [(cost, bottom), (cost, top)];
            chart.draw_series(LineSeries::new(line, grey))?;
        }
        let places: Vec<_> = marks.iter().map(|mark| mark.place).collect();
        let front = front(&places).into_iter().map(|place| self.shown(place));
        chart.draw_series(LineSeries::new(front, BLACK.stroke_width(1)))?;
        for mark in marks {
            let place = self.shown(mark.place);
            let band = mark.band.map(|error| self.shown((mark.place.0, error)));
            if band[0] != band[1] {
                let faint = mark.colour.mix(0.35).stroke_width(3);
                chart.draw_series(LineSeries::new(band, faint))?;
            }
            if mark.passes {
                chart.draw_series([Circle::new(place, mark.size, mark.colour.filled())])?;
            } else {
                let ink = mark.colour.stroke_width(2);
                chart.draw_series([Cross::new(place, mark.size, ink)])?;
            }
            if !mark.label.is_empty() {
                let style = ("sans-serif", 11).into_font().color(&mark.colour);
                let beside = EmptyElement::at(place)
                    + Text::new(mark.label.clone(), (mark.size + 2, -6), style);
                chart.draw_series([beside])?;
            }
        }
        Ok(())
    }

    /// The panel alone, as a text that can stand in a page.
    pub(crate) fn svg(&self, marks: &[Mark]) -> Result<String, Box<dyn Error>> {
        svg(PANEL, |area| self.draw(area, marks))
    }
}

/// Those that no other one beats in time and error, by time.
pub(crate) fn front(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    sorted.retain(|(_, error)| {
        let better = *error < least; // false for NaN
        if better {
            least = *error;
        }
        better
    });
    sorted
}

#[cfg(test)]
mod tests {
    use super::front;

    #[test]
    fn the_front_has_what_nothing_beats() {
        let points = [
            (1.0, 5.0),
            (2.0, 6.0),
            (3.0, 1.0),
            (3.0, 2.0),
            (4.0, f64::NAN),
        ];
        assert_eq!(front(&points), [(1.0, 5.0), (3.0, 1.0)]);
    }
}
