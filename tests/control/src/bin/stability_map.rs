//! Maps of the critical stiffness: simulated with the real coupling, beside the eigenvalues and the rule of the literature.
//!
//! `cargo run --release -p taut-control-tests --bin stability_map -- DIRECTORY` writes `stability-maps.svg` and `.csv` there.
//! Three panels: against the delay of the force, the rate of the samples, the damping of the device; what a panel does not sweep
//! is 0.2 kg, 1 N s/m, 1 kHz, one tick of delay, nobody holds.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;
use taut_control_tests::recipes::wall_stability::Case;
use taut_plant::HandPreset;
use taut_plant::stability::linear_limit;

/// Pixels.
const SIZE: (u32, u32) = (1500, 520);
/// Points of a line, and simulated ones.
const POINTS: [u32; 2] = [60, 9];
/// Curves of a panel: who holds the device, and damping of the wall, N s/m.
const CURVES: [(&str, HandPreset, f64); 3] = [
    ("nobody holds", HandPreset::Released, 0.0),
    ("nobody holds, B = 5 N s/m", HandPreset::Released, 5.0),
    ("light hand", HandPreset::Light, 0.0),
];
const COLOURS: [RGBColor; 3] = [
    RGBColor(0, 90, 160),
    RGBColor(200, 90, 0),
    RGBColor(0, 130, 80),
];

/// One panel: what is swept, from where to where, and a case at a place.
struct Panel {
    name: &'static str,
    axis: &'static str,
    from: f64,
    to: f64,
    case: fn(f64) -> Case,
}

impl Panel {
    /// The case at a place, held so, against a wall of this damping, N s/m.
    fn held(&self, at: f64, hand: HandPreset, virtual_damping: f64) -> Case {
        Case {
            hand,
            virtual_damping,
            ..(self.case)(at)
        }
    }

    /// So many places, evenly on a logarithmic axis.
    fn places(&self, count: u32) -> impl Iterator<Item = f64> {
        (0..count).map(move |i| {
            let share = f64::from(i) / f64::from(count - 1);
            self.from * (self.to / self.from).powf(share)
        })
    }
}

const PANELS: [Panel; 3] = [
    Panel {
        name: "delay",
        axis: "delay of the force, ms",
        from: 0.25,
        to: 8.0,
        case: |ms| Case {
            delay: ms * 1e-3,
            ..Case::STANDARD
        },
    },
    Panel {
        name: "rate",
        axis: "rate, kHz (one tick of delay)",
        from: 0.25,
        to: 4.0,
        case: |khz| Case {
            delay: 1e-3 / khz,
            period: 1e-3 / khz,
            ..Case::STANDARD
        },
    },
    Panel {
        name: "damping",
        axis: "damping of the device, N s/m",
        from: 0.1,
        to: 10.0,
        case: |damping| Case {
            damping,
            ..Case::STANDARD
        },
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let directory = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "docs/pictures".into());
    let directory = Path::new(&directory);
    let svg = directory.join("stability-maps.svg");
    let root = SVGBackend::new(&svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let root = root.titled(
        "Critical stiffness of a wall: eigenvalues (lines), rule (b + B + b_h)/(T/2 + t_d) (dashed), simulation with the coupling (points)",
        ("sans-serif", 19),
    )?;
    let mut csv = String::from(
        "panel,at,hand,virtual_damping_n_s_per_m,by_eigenvalues_n_per_m,by_rule_n_per_m,by_simulation_n_per_m\n",
    );
    for (area, panel) in root.split_evenly((1, PANELS.len())).iter().zip(&PANELS) {
        draw(area, panel, &mut csv)?;
    }
    root.present()?;
    std::fs::write(directory.join("stability-maps.csv"), csv)?;
    println!("{}", svg.display());
    Ok(())
}

fn draw(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    panel: &Panel,
    csv: &mut String,
) -> Result<(), Box<dyn Error>> {
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(66)
        .build_cartesian_2d(
            (panel.from * 0.9..panel.to * 1.1).log_scale(),
            (50.0..60_000.0).log_scale(),
        )?;
    chart
        .configure_mesh()
        .x_desc(panel.axis)
        .x_labels(5)
        .y_desc("critical stiffness, N/m")
        .label_style(("sans-serif", 15))
        .y_label_formatter(&|k| format!("{k:.0}"))
        .light_line_style(RGBColor(235, 235, 235))
        .draw()?;
    for ((label, hand, virtual_damping), colour) in CURVES.into_iter().zip(COLOURS) {
        let case = |at: f64| panel.held(at, hand, virtual_damping);
        let line = || panel.places(POINTS[0]);
        let exact: Vec<_> = line().map(|at| (at, case(at).by_eigenvalues())).collect();
        let rule: Vec<_> = line().map(|at| (at, by_rule(&case(at)))).collect();
        let simulated = simulate(panel, hand, virtual_damping, csv)?;
        chart
            .draw_series(LineSeries::new(exact, colour.stroke_width(2)))?
            .label(label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        chart.draw_series(DashedLineSeries::new(rule, 5, 5, colour.mix(0.7).into()))?;
        chart.draw_series(
            simulated
                .into_iter()
                .map(|point| Circle::new(point, 4, colour.filled())),
        )?;
    }
    if panel.name == "delay" {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.9))
            .border_style(RGBColor(200, 200, 200))
            .label_font(("sans-serif", 15))
            .draw()?;
    }
    Ok(())
}

/// The points of a curve; each is a row of the CSV too.
fn simulate(
    panel: &Panel,
    hand: HandPreset,
    virtual_damping: f64,
    csv: &mut String,
) -> Result<Vec<(f64, f64)>, std::fmt::Error> {
    let mut points = Vec::new();
    for at in panel.places(POINTS[1]) {
        let case = panel.held(at, hand, virtual_damping);
        let measured = case.by_simulation();
        let (by_eigenvalues, by_rule) = (case.by_eigenvalues(), by_rule(&case));
        writeln!(
            csv,
            "{},{at:.4},{hand},{virtual_damping},{by_eigenvalues:.1},{by_rule:.1},{measured:.1}",
            panel.name
        )?;
        points.push((at, measured));
    }
    Ok(points)
}

fn by_rule(case: &Case) -> f64 {
    let hand = taut_plant::Hand::from(case.hand);
    linear_limit(
        case.damping + hand.damping,
        case.virtual_damping,
        case.period,
        case.delay,
    )
}
