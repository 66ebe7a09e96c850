//! False positives and earliness of continuous collision detection against its gap, as CSV and a picture:
//! `cargo run --release -p god-object --example collision_queries [DIRECTORY]`, `docs/pictures` when none is named.
//!
//! The query sets, as motions of rigid bodies, are judged by exact arithmetic, the motions of bunnies by the times of first contact in `bunny_contacts.csv`. No
//! contact may be missed or late; how early it is found, and how many near misses count as contacts, is the price of the gap.
//! Times are CPU time of the thread, the best of [`REPEATS`].
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "an example reads files and writes a picture; the method does neither"
)]

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/exact_collision/mod.rs"]
mod exact_collision;
#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/geometry_shapes/mod.rs"]
mod geometry_shapes;

use std::collections::HashMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;

use exact_collision::{Outcome, Query, answer, first_contact, judge, query_sets};
use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact,
};
use god_object::nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion};
use god_object::{Mesh, Pose, Vector6};
use plotters::coord::Shift;
use plotters::prelude::*;
use taut_test_kit::thread_cpu_us;

const RELATIVE_GAPS: [f64; 11] = [
    1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12,
];
/// Minimum gaps of the bunnies of 0.15 m, m.
const BUNNY_GAPS: [f64; 5] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
/// Longest side of the bunnies, m.
const BUNNY_SIZE: f64 = 0.15;
/// Each query is timed so often; the best counts.
const REPEATS: usize = 5;
const SETS: [&str; 2] = ["vertex-face and edge-edge queries", "bunny on bunny"];
/// What the axes of gaps show.
const GAPS: std::ops::Range<f64> = 1e-12..1e-2;
/// Below what a chart with a logarithmic axis can show, a fraction of the motion.
const LEAST_EARLINESS: f64 = 1e-17;

/// What came of all queries, or all motions, at one gap.
struct Row {
    set: &'static str,
    relative_gap: f64,
    queries: usize,
    contacts: usize,
    missed: usize,
    late: usize,
    false_positives: usize,
    earliness: [f64; 3],
    times: [f64; 3],
}

fn main() -> Result<(), Box<dyn Error>> {
    let directory = std::env::args_os().nth(1).map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/pictures"),
        PathBuf::from,
    );
    let data = geometry_shapes::data_dir();
    let queries = query_sets(data.as_deref()).ok_or("the query sets are not there")?;
    let queries: Vec<_> = queries.iter().map(Query::rigid).collect();
    let truths: Vec<_> = queries
        .iter()
        .map(|query| first_contact(query.kind, &query.start, &query.end))
        .collect();
    let mut rows: Vec<Row> = RELATIVE_GAPS
        .iter()
        .map(|gap| queries_at(&queries, &truths, *gap))
        .collect();
    rows.extend(bunnies()?);

    let mut csv = String::from(
        "set,relative_gap,queries,contacts,missed,late,false_positives,earliness_p50,earliness_p99,earliness_max,us_p50,us_p99,us_max\n",
    );
    for row in &rows {
        let [e50, e99, e100] = row.earliness;
        let [t50, t99, t100] = row.times;
        writeln!(
            csv,
            "{},{:e},{},{},{},{},{},{e50:.3e},{e99:.3e},{e100:.3e},{t50:.2},{t99:.2},{t100:.2}",
            row.set,
            row.relative_gap,
            row.queries,
            row.contacts,
            row.missed,
            row.late,
            row.false_positives
        )?;
    }
    print!("{csv}");
    std::fs::write(directory.join("collision-queries.csv"), &csv)?;
    draw(&directory.join("collision-queries.svg"), &rows)
}

fn queries_at(queries: &[Query], truths: &[Option<[f64; 2]>], relative_gap: f64) -> Row {
    let (mut earliness, mut times) = (Vec::new(), Vec::new());
    let (mut missed, mut late, mut false_positives) = (0, 0, 0);
    for (query, truth) in queries.iter().zip(truths) {
        let mut found = TimeOfImpact::Separated;
        let best = (0..REPEATS).fold(f64::INFINITY, |best, _| {
            let start = thread_cpu_us();
            found = std::hint::black_box(answer(std::hint::black_box(query), relative_gap));
            best.min(thread_cpu_us() - start)
        });
        times.push(best);
        match judge(found, *truth) {
            Outcome::Free => {}
            Outcome::FalsePositive { .. } => false_positives += 1,
            Outcome::Found { earliness: e, .. } => earliness.push(e),
            Outcome::Late { .. } => late += 1,
            Outcome::Missed => missed += 1,
        }
    }
    Row {
        set: SETS[0],
        relative_gap,
        queries: queries.len(),
        contacts: truths.iter().flatten().count(),
        missed,
        late,
        false_positives,
        earliness: percentiles(&mut earliness),
        times: percentiles(&mut times),
    }
}

/// A motion of `bunny_contacts.csv`: the mesh's name, the motion, the time of first contact if there is one.
type BunnyMotion = (String, Motion, Option<f64>);

fn bunny_motions() -> Result<Vec<BunnyMotion>, Box<dyn Error>> {
    let data = geometry_shapes::data_dir().ok_or("the test data are not there")?;
    let text = std::fs::read_to_string(data.join("bunny_contacts.csv"))?;
    let motion = |line: &str| -> Result<BunnyMotion, Box<dyn Error>> {
        let fields: Vec<&str> = line.split(',').collect();
        let n = fields[2..15]
            .iter()
            .map(|field| field.parse())
            .collect::<Result<Vec<f64>, _>>()?;
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(n[6], n[3], n[4], n[5]));
        let start = Pose::from_parts(Translation3::new(n[0], n[1], n[2]), rotation);
        let motion = Motion {
            start,
            displacement: Vector6::from_column_slice(&n[7..13]),
            reference_point: Point3::origin(),
        };
        Ok((fields[0].to_owned(), motion, fields[15].parse().ok()))
    };
    text.lines().skip(1).map(motion).collect()
}

fn bunnies() -> Result<Vec<Row>, Box<dyn Error>> {
    let motions = bunny_motions()?;
    let mut meshes: HashMap<&str, Mesh> = HashMap::new();
    for (name, _, _) in &motions {
        if !meshes.contains_key(name.as_str()) {
            let soup = geometry_shapes::read_ply(name).ok_or("a mesh is not there")?;
            meshes.insert(name, geometry_shapes::mesh(soup));
        }
    }
    let at = |minimum_gap: &f64| {
        let settings = AdvancementSettings {
            minimum_gap: *minimum_gap,
            gap_tolerance: 0.1 * minimum_gap,
            ..AdvancementSettings::default()
        };
        let (mut earliness, mut times) = (Vec::new(), Vec::new());
        let (mut missed, mut late, mut false_positives) = (0, 0, 0);
        for (name, motion, truth) in &motions {
            let mesh = &meshes[name.as_str()];
            let mut found = TimeOfImpact::Separated;
            let best = (0..REPEATS).fold(f64::INFINITY, |best, _| {
                let mut workspace = CollisionWorkspace::new();
                let start = thread_cpu_us();
                found = time_of_impact(
                    mesh,
                    motion,
                    mesh,
                    &Pose::identity(),
                    &settings,
                    &mut workspace,
                    &mut Work::default(),
                );
                best.min(thread_cpu_us() - start)
            });
            times.push(best);
            match judge(found, truth.map(|time| [time, time])) {
                Outcome::Free => {}
                Outcome::FalsePositive { .. } => false_positives += 1,
                Outcome::Found { earliness: e, .. } => earliness.push(e),
                Outcome::Late { .. } => late += 1,
                Outcome::Missed => missed += 1,
            }
        }
        Row {
            set: SETS[1],
            relative_gap: minimum_gap / BUNNY_SIZE,
            queries: motions.len(),
            contacts: motions.iter().filter(|(_, _, t)| t.is_some()).count(),
            missed,
            late,
            false_positives,
            earliness: percentiles(&mut earliness),
            times: percentiles(&mut times),
        }
    };
    Ok(BUNNY_GAPS.iter().map(at).collect())
}

/// p50, p99 and the greatest.
fn percentiles(values: &mut [f64]) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [0.5, 0.99, 1.0].map(|share| {
        let last = values.len().saturating_sub(1);
        values
            .get((last as f64 * share) as usize)
            .copied()
            .unwrap_or(0.0)
    })
}

fn draw(path: &std::path::Path, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let area = SVGBackend::new(path, (1100, 420)).into_drawing_area();
    area.fill(&WHITE)?;
    let panels = area.split_evenly((1, 2));
    draw_false_positives(&panels[0], rows)?;
    draw_earliness(&panels[1], rows)?;
    area.present()?;
    Ok(())
}

type Panel<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw_false_positives(panel: &Panel<'_>, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let mut chart = ChartBuilder::on(panel)
        .caption("near misses taken for contacts", ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(50)
        .build_cartesian_2d(GAPS.log_scale(), 0.0..15.0)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc("minimum gap / size")
        .y_desc("% of those without contact")
        .x_label_formatter(&|x| format!("{x:.0e}"))
        .draw()?;
    for (k, set) in SETS.iter().enumerate() {
        let colour = Palette99::pick(k).to_rgba();
        let share = |row: &Row| {
            100.0 * row.false_positives as f64 / (row.queries - row.contacts).max(1) as f64
        };
        let points = rows.iter().filter(|row| row.set == *set);
        chart
            .draw_series(LineSeries::new(
                points.map(|row| (row.relative_gap, share(row))),
                colour.stroke_width(2),
            ))?
            .label(*set)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .border_style(BLACK.mix(0.3))
        .background_style(WHITE)
        .draw()?;
    Ok(())
}

fn draw_earliness(panel: &Panel<'_>, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let mut chart = ChartBuilder::on(panel)
        .caption("how early a contact is found", ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d(GAPS.log_scale(), (LEAST_EARLINESS..1.0).log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc("minimum gap / size")
        .y_desc("fraction of the motion")
        .x_label_formatter(&|x| format!("{x:.0e}"))
        .y_label_formatter(&|y| format!("{y:.0e}"))
        .draw()?;
    for (k, set) in SETS.iter().enumerate() {
        for (which, name) in ["p50", "p99", "greatest"].iter().enumerate() {
            let colour = Palette99::pick(k).to_rgba().mix([0.4, 0.7, 1.0][which]);
            let points = rows.iter().filter(|row| row.set == *set);
            chart
                .draw_series(LineSeries::new(
                    points.map(|row| (row.relative_gap, row.earliness[which].max(LEAST_EARLINESS))),
                    colour.stroke_width(1 + which as u32),
                ))?
                .label(format!("{set}, {name}"))
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(1 + which as u32))
                });
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .border_style(BLACK.mix(0.3))
        .background_style(WHITE)
        .draw()?;
    Ok(())
}
