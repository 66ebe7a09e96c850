//! Bunnies: updates of one that a hand slides over the other, and searches for the time of impact of given motions.

use std::collections::HashMap;

use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact,
};
use god_object::{Mesh, Pose, Vector6};
use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion};
use taut_method_tests::variants::bunnies::{SLIDES, Slide, load};
use taut_method_tests::variants::measure::quantile;
use taut_scene::data_file;
use taut_test_kit::thread_cpu_us;

/// The cases whose name begins with `case`; the dense one only where it is named.
pub(crate) fn run(case: &str, repeats: usize, hands: u64) {
    let chosen: Vec<&Slide> = SLIDES
        .iter()
        .filter(|slide| slide.name.starts_with(case))
        .filter(|slide| slide.subdivisions == 0 || slide.name == case)
        .collect();
    let motions = "motions".starts_with(case);
    if chosen.is_empty() && !motions {
        return;
    }
    let Some(bunny) = load("bunny_27k.ply") else {
        println!("bunnies skipped: TAUT_DATA does not name a folder with bunny_27k.ply");
        return;
    };
    for slide in chosen {
        run_slide(slide, &bunny, repeats, hands);
    }
    if motions {
        run_motions(repeats);
    }
}

fn run_slide(slide: &Slide, bunny: &Mesh, repeats: usize, hands: u64) {
    let world = slide.world(bunny);
    let runs: Vec<[Vec<f64>; 2]> = (0..repeats)
        .map(|_| slide.times(&world, thread_cpu_us))
        .collect();
    let times: Vec<[f64; 4]> = runs.iter().map(|[times, _]| quantiles(times)).collect();
    print_medians(slide.name, &times);
    if let Some([_, work]) = runs.first() {
        print_medians(&format!("{} work", slide.name), &[quantiles(work)]);
    }
    let errors = slide.errors(&world, hands);
    let share = |of| 100.0 * quantile(&errors, of);
    println!(
        "{:20} force off by {:.2} % at p90, {:.2} % at p99, {:.2} % at p99.9, {:.2} % at most, of {} sets of {hands} hands",
        "",
        share(0.9),
        share(0.99),
        share(0.999),
        share(1.0),
        errors.len()
    );
}

/// The motions of `bunny_contacts.csv` on a fresh workspace each: time of a search, and whether it was right.
fn run_motions(repeats: usize) {
    let text = data_file("bunny_contacts.csv").and_then(|path| std::fs::read_to_string(path).ok());
    let Some(text) = text else {
        println!("motions skipped: bunny_contacts.csv is not there");
        return;
    };
    let settings = AdvancementSettings {
        minimum_gap: 1e-6,
        gap_tolerance: 1e-7,
        ..AdvancementSettings::default()
    };
    let (mut times, mut contacts, mut missed, mut late) = (Vec::new(), 0, 0, 0);
    let mut meshes: HashMap<String, Mesh> = HashMap::new();
    for line in text.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let bunny = meshes
            .entry(fields[0].to_owned())
            .or_insert_with(|| load(fields[0]).expect("the mesh lies beside its motions"));
        let n: Vec<f64> = fields[2..15]
            .iter()
            .map(|f| f.parse().expect("a number"))
            .collect();
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(n[6], n[3], n[4], n[5]));
        let motion = Motion {
            start: Pose::from_parts(Translation3::new(n[0], n[1], n[2]), rotation),
            displacement: Vector6::from_column_slice(&n[7..13]),
            reference_point: Point3::origin(),
        };
        let mut found = TimeOfImpact::Separated;
        let searches: Vec<f64> = (0..repeats)
            .map(|_| {
                let mut workspace = CollisionWorkspace::new();
                let clock = thread_cpu_us();
                let still = Pose::identity();
                let work = &mut Work::default();
                found = time_of_impact(
                    &*bunny,
                    &motion,
                    &*bunny,
                    &still,
                    &settings,
                    &mut workspace,
                    work,
                );
                thread_cpu_us() - clock
            })
            .collect();
        times.push(quantile(&searches, 0.5));
        if let Ok(truth) = fields[15].parse::<f64>() {
            contacts += 1;
            match found {
                TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => {
                    late += u32::from(time > truth);
                }
                TimeOfImpact::Separated => missed += 1,
                TimeOfImpact::Overlapping => {}
            }
        }
    }
    print_medians("motions", &[quantiles(&times)]);
    println!(
        "{:20} {} motions, {contacts} contacts, {missed} missed, {late} late",
        "",
        times.len()
    );
}

fn quantiles(times: &[f64]) -> [f64; 4] {
    [0.5, 0.99, 0.999, 1.0].map(|share| quantile(times, share))
}

fn print_medians(name: &str, runs: &[[f64; 4]]) {
    let median = |k: usize| {
        let values: Vec<f64> = runs.iter().map(|run| run[k]).collect();
        quantile(&values, 0.5)
    };
    println!(
        "{name:20} p50 {:.1}  p99 {:.1}  p99.9 {:.1}  max {:.1} us",
        median(0),
        median(1),
        median(2),
        median(3)
    );
}
