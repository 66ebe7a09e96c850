//! The league of engines: its picture and its table, from the committed rows of `scripts/league`.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plotters::prelude::*;

use crate::plot::{self, Area, Drawn};
use crate::recipe::JND_BUDGET;

/// The committed rows.
const ROWS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../docs/pictures/league.csv"
);
/// A body with facets may rest on this facet or the next: shown, and not counted.
const MANY_RESTS: [&str; 2] = ["cylinder in groove", "ball on ball"];
const OWN: &str = "taut";
const COLOURS: [RGBColor; 7] = [
    RGBColor(0xc0, 0x39, 0x2b),
    RGBColor(0x1f, 0x5f, 0xa8),
    RGBColor(0x2e, 0x8b, 0x57),
    RGBColor(0x8e, 0x5e, 0xa2),
    RGBColor(0x5a, 0xa7, 0xd6),
    RGBColor(0xb9, 0x8b, 0xc9),
    RGBColor(0x8c, 0x6d, 0x31),
];
/// Pixels: a panel, its foot, names of scenes, a cell, names of engines.
const PANEL: (u32, u32) = (500, 470);
const FOOT: u32 = 40;
const NAMES: i32 = 190;
const CELL: (i32, i32) = (84, 29);
const HEAD: i32 = 60;

/// One engine in one scene.
struct Row {
    engine: String,
    scene: String,
    /// By the name of the column; what was not measured is absent.
    figures: Vec<(String, f64)>,
}

impl Row {
    fn get(&self, column: &str) -> Option<f64> {
        let named = |(name, _): &&(String, f64)| name == column;
        self.figures.iter().find(named).map(|(_, value)| *value)
    }

    fn is_counted(&self) -> bool {
        !MANY_RESTS.contains(&self.scene.as_str())
    }
}

/// Rows of the engines that were judged, engines and scenes in the order in which they are shown.
struct League {
    rows: Vec<Row>,
    engines: Vec<String>,
    scenes: Vec<String>,
}

impl League {
    fn read(text: &str) -> Result<Self, Box<dyn Error>> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let names = reader.headers()?.clone();
        let place = |name: &str| {
            let place = names.iter().position(|column| column == name);
            place.ok_or_else(|| format!("the league's rows have no column `{name}`"))
        };
        let [engine, version, scene] = [place("engine")?, place("version")?, place("scene")?];
        let mut league = Self {
            rows: Vec::new(),
            engines: vec![OWN.to_owned()],
            scenes: Vec::new(),
        };
        for record in reader.records() {
            let record = record?;
            if record[version].is_empty() || &record[scene] == "wiring" {
                continue; // the oracle beside itself, and whether each engine presses as its spring says
            }
            let figures = names.iter().zip(&record).filter_map(|(name, text)| {
                let value = text.parse().ok()?;
                Some((name.to_owned(), value))
            });
            let row = Row {
                engine: record[engine].to_owned(),
                scene: record[scene].to_owned(),
                figures: figures.collect(),
            };
            if !league.engines.contains(&row.engine) {
                league.engines.push(row.engine.clone());
            }
            if !league.scenes.contains(&row.scene) {
                league.scenes.push(row.scene.clone());
            }
            league.rows.push(row);
        }
        league.engines[1..].sort();
        if league.engines.len() > COLOURS.len() {
            return Err(format!("the league's picture has {} colours", COLOURS.len()).into());
        }
        Ok(league)
    }

    fn of<'a>(&'a self, engine: &'a str) -> impl Iterator<Item = &'a Row> {
        self.rows.iter().filter(move |row| row.engine == engine)
    }

    fn row(&self, engine: &str, scene: &str) -> Option<&Row> {
        let is_asked = |row: &&Row| row.engine == engine && row.scene == scene;
        self.rows.iter().find(is_asked)
    }

    /// What an engine came to in the scenes that count.
    fn counted<'a>(&'a self, engine: &'a str, column: &'a str) -> impl Iterator<Item = f64> + 'a {
        let counted = self.of(engine).filter(|row| row.is_counted());
        counted.filter_map(move |row| row.get(column))
    }
}

/// Writes `league.svg` and `league.md`.
pub fn write(directory: &Path) -> Result<(), Box<dyn Error>> {
    let text = std::fs::read_to_string(ROWS).map_err(|error| format!("{ROWS}: {error}"))?;
    let league = League::read(&text)?;
    std::fs::create_dir_all(directory)?;
    std::fs::write(directory.join("league.svg"), svg(&league)?)?;
    std::fs::write(directory.join("league.md"), table(&league))?;
    Ok(())
}

/// The middle one, of two the mean; none of none.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<_> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len().checked_sub(1)? / 2;
    Some((values[middle] + values[values.len() / 2]) / 2.0)
}

/// Three digits.
fn brief(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    if (0..6).contains(&digits) {
        format!("{value:.*}", digits as usize)
    } else if digits < 0 && digits > -4 {
        format!("{value:.0}")
    } else {
        format!("{value:.1e}")
    }
}

/// "median / worst"; empty where there is nothing.
fn both(values: &[f64]) -> String {
    median(values.iter().copied()).map_or(String::new(), |middle| {
        let worst = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        format!("{} / {}", brief(middle), brief(worst))
    })
}

fn table(league: &League) -> String {
    const COLUMNS: [(&str, &str); 8] = [
        ("angle, degrees", "angle_deg_p95"),
        ("force error, N", "force_error_n_p95"),
        ("penetration, um", "penetration_um_max"),
        ("place, um", "place_um_p95"),
        ("axial force, N", "axial_n_p95"),
        ("us, p50", "us_p50"),
        ("us, p99", "us_p99"),
        ("us, max", "us_max"),
    ];
    let mut text = String::from("| engine | J | J of taut in the same scenes |");
    for (title, _) in COLUMNS {
        let _ = write!(text, " {title} |");
    }
    text.push_str(" J > 0.5 | J > 1 | cannot | scenes |\n|");
    text.push_str(&" --- |".repeat(COLUMNS.len() + 7));
    text.push('\n');
    for engine in &league.engines {
        let felt: Vec<_> = league.counted(engine, "j_p95").collect();
        let there: Vec<_> = league.of(engine).filter(|row| row.is_counted()).collect();
        let own: Vec<_> = there
            .iter()
            .filter(|row| row.get("j_p95").is_some())
            .filter_map(|row| league.row(OWN, &row.scene)?.get("j_p95"))
            .collect();
        let _ = write!(text, "| {engine} | {} | {} |", both(&felt), both(&own));
        for (_, column) in COLUMNS {
            let values: Vec<_> = league.counted(engine, column).collect();
            let _ = write!(text, " {} |", both(&values));
        }
        let above = |line: f64| felt.iter().filter(|j| **j > line).count();
        let all = there.len();
        let _ = writeln!(
            text,
            " {} | {} | {} | {all} |",
            above(JND_BUDGET),
            above(1.0),
            all - felt.len()
        );
    }
    text
}

/// Error against cost on the left, every engine in every scene on the right.
fn svg(league: &League) -> Result<String, Box<dyn Error>> {
    let cells = NAMES + CELL.0 * league.engines.len() as i32;
    let rows = HEAD + CELL.1 * league.scenes.len() as i32;
    let size = (PANEL.0 + cells as u32 + 16, PANEL.1.max(rows as u32) + FOOT);
    plot::svg(size, |root| {
        root.fill(&WHITE)?;
        let (left, right) = root.split_horizontally(PANEL.0);
        draw_costs(league, &left)?;
        draw_scenes(league, &right)
    })
}

fn draw_costs(league: &League, area: &Area<'_>) -> Drawn {
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .caption(
            "Small dots: scenes. Large: their median",
            ("sans-serif", 16),
        )
        .x_label_area_size(40)
        .y_label_area_size(58)
        .build_cartesian_2d((10.0..1e4).log_scale(), (1e-3..20.0).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("CPU time of a millisecond of the hand, median, us")
        .y_desc("error felt: J, 95th percentile")
        .y_label_formatter(&|error| format!("{error:e}"))
        .label_style(("sans-serif", 13))
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(238, 238, 238))
        .draw()?;
    for (ends, place, said) in [
        (
            [(10.0, 1.0), (1e4, 1.0)],
            (10.0, 1.0),
            "J = 1: just noticeable",
        ),
        ([(1e3, 1e-3), (1e3, 20.0)], (1e3, 1.4e-3), "real time"),
    ] {
        chart.draw_series(LineSeries::new(ends, BLACK.stroke_width(1)))?;
        let text = Text::new(said, (4, -15), ("sans-serif", 13));
        chart.draw_series([EmptyElement::at(place) + text])?;
    }
    for (engine, colour) in league.engines.iter().zip(COLOURS) {
        let scenes = league.of(engine).filter(|row| row.is_counted());
        let dots = scenes.filter_map(|row| Some((row.get("us_p50")?, row.get("j_p95")?)));
        chart.draw_series(dots.map(|place| Circle::new(place, 3, colour.mix(0.45).filled())))?;
        let middle = median(league.counted(engine, "us_p50"));
        let Some(place) = middle.zip(median(league.counted(engine, "j_p95"))) else {
            continue; // it could not run any of them
        };
        let dot = Circle::new(place, 7, colour.filled());
        chart.draw_series([dot])?;
    }
    Ok(())
}

fn draw_scenes(league: &League, area: &Area<'_>) -> Drawn {
    let write = |text: &str, (x, y): (i32, i32)| {
        area.draw(&Text::new(text.to_owned(), (x, y), ("sans-serif", 13)))
    };
    let column = |index: usize| NAMES + CELL.0 * index as i32;
    for (index, (engine, colour)) in league.engines.iter().zip(COLOURS).enumerate() {
        let dot = Circle::new((column(index) + 12, 10), 7, colour.filled());
        area.draw(&dot)?;
        for (line, part) in engine.split(", ").enumerate() {
            write(part, (column(index) + 4, 22 + 16 * line as i32))?;
        }
    }
    for (index, scene) in league.scenes.iter().enumerate() {
        let top = HEAD + CELL.1 * index as i32;
        let star = MANY_RESTS.contains(&scene.as_str());
        write(
            &format!("{scene}{}", [" ", " *"][usize::from(star)]),
            (8, top + 7),
        )?;
        for (place, engine) in league.engines.iter().enumerate() {
            let row = league.row(engine, scene);
            let felt = row.and_then(|row| row.get("j_p95"));
            let ink = match felt {
                None => RGBColor(0xdd, 0xdd, 0xdd),
                Some(felt) if felt <= JND_BUDGET => RGBColor(0xbf, 0xe3, 0xc3),
                Some(felt) if felt <= 1.0 => RGBColor(0xfb, 0xe7, 0xa1),
                Some(_) => RGBColor(0xf2, 0xb5, 0xab),
            };
            let x = column(place);
            let cell = [(x, top), (x + CELL.0 - 2, top + CELL.1 - 2)];
            area.draw(&Rectangle::new(cell, ink.filled()))?;
            let said = felt.map(|felt| format!("{felt:.2}"));
            let said = said.or_else(|| row.map(|_| "cannot".to_owned()));
            write(&said.unwrap_or_default(), (x + 22, top + 7))?;
        }
    }
    let foot = HEAD + CELL.1 * league.scenes.len() as i32 + 10;
    write(
        "J, 95th percentile: green within the budget of 0.5, red above 1, grey not run.",
        (8, foot),
    )?;
    write(
        "*: several places of rest, shown and not counted",
        (8, foot + 17),
    )?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "engine,version,scene,settings,j_p95,us_p50,fault\n";

    #[test]
    fn medians_are_over_the_scenes_that_count() {
        let rows = [
            "taut,1,peg,default,0.02,40,",
            "taut,1,ball on ball,default,9,9000,",
            "taut,1,wiring,\"5 N: 5.0 N up, 0 N aside\",,,",
            "\"oracle, half steps\",,peg,,0.001,,",
            "\"Soft, fast\",2,peg,default,0.8,4,",
            "\"Soft, fast\",2,star,default,,,killed",
        ];
        let league = League::read(&(HEAD.to_owned() + &rows.join("\n"))).expect("rows");
        let lines: Vec<_> = table(&league).lines().map(str::to_owned).collect();
        assert_eq!(
            lines[2..],
            [
                "| taut | 0.0200 / 0.0200 | 0.0200 / 0.0200 |  |  |  |  |  | 40.0 / 40.0 |  |  | 0 | 0 | 0 | 1 |",
                "| Soft, fast | 0.800 / 0.800 | 0.0200 / 0.0200 |  |  |  |  |  | 4.00 / 4.00 |  |  | 1 | 0 | 1 | 2 |",
            ]
        );
        let svg = svg(&league).expect("a picture");
        for said in ["cannot", "0.80", "9.00", "ball on ball *"] {
            assert!(svg.contains(said), "{said}");
        }
        assert!(!svg.contains("wiring") && !svg.contains("oracle"));
    }

    #[test]
    fn a_table_without_a_column_that_is_needed_is_refused_by_name() {
        let error = League::read("engine,scene\ntaut,peg\n")
            .err()
            .expect("no version");
        assert_eq!(
            error.to_string(),
            "the league's rows have no column `version`"
        );
    }

    #[test]
    fn figures_have_three_digits() {
        let figures = [0.0, 1e-5, 0.0348, 1.0, 44.44, 280.0, 1143.0];
        let said = figures.map(brief);
        assert_eq!(
            said,
            ["0", "1.0e-5", "0.0348", "1.00", "44.4", "280", "1143"]
        );
    }
}
