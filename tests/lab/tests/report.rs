//! The report of a few recipes, and a run that is interrupted and goes on.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use taut_lab::method::Method;
use taut_lab::recipes::{Extent, all, named};
use taut_lab::row::Verdict;
use taut_lab::run::{Plan, Results};
use taut_lab::store::Store;
use taut_lab::sweeps::{Runs, SWEEPS, Sweep, csv};

/// How long the first result may take on a machine that others load.
const PATIENCE: Duration = Duration::from_secs(120);

fn sweep(name: &str) -> Sweep {
    let found = SWEEPS.iter().find(|sweep| sweep.name == name);
    *found.expect("a sweep of this name")
}

fn plan(sweeps: Vec<Sweep>) -> Plan {
    Plan {
        extent: Extent::Quick,
        recipes: Some(vec!["R03".into(), "R09".into(), "R10b".into()]),
        methods: vec![Method::Ours, Method::Penalty],
        sweeps,
        maps: false,
        threads: 2,
    }
}

fn text(file: &Path) -> String {
    fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

#[test]
fn the_page_stands_alone_and_has_every_case_point_and_miss() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let results = plan(vec![sweep("rate"), sweep("solvers")]).run(&Store::none());
    results
        .write(folder.path(), true)
        .expect("files are written");
    let page = text(&folder.path().join("report.html"));
    // The name space of SVG is a name, not a place on the network.
    let others = page.replace("http://www.w3.org/2000/svg", "");
    for outside in ["http", "src=", "@import", "<script"] {
        assert!(!others.contains(outside), "the page needs {outside}");
    }
    for link in others.split("href=\"").skip(1) {
        let target = link.split('"').next().expect("a target");
        let there = match target.strip_prefix('#') {
            Some(id) => {
                page.contains(&format!("id={id}>")) || page.contains(&format!("id=\"{id}\""))
            }
            None => folder.path().join(target).is_file(),
        };
        assert!(there, "{target} is not there");
    }
    // A dot or a cross of two lines for every outcome and point of a sweep that has an error.
    let outcomes = results.outcomes.iter().filter(|o| {
        let felt = o.worst(taut_lab::measure::Measure::JndP95);
        !felt.is_nan()
    });
    let points = results.sweeps.iter().flat_map(|(_, points)| points);
    let dots = page.matches("<circle").count();
    let crosses = page.matches("cross").count();
    assert!(dots > 0 && crosses < dots, "{dots}, {crosses}");
    // And the picture of all: a point for each method and rate, and its legend.
    let overview = taut_lab::overview::summaries(&results.rows, &results.outcomes).len() + 3;
    assert!(dots <= outcomes.count() + points.clone().count() + overview);
    assert!(dots >= points.filter(|point| !point.error.is_nan()).count());
    assert!(
        results.rows.iter().any(|row| row.verdict == Verdict::Fail),
        "penalty pops through"
    );
    for name in [
        "processor",
        "compiler",
        "crates",
        "commit",
        "date",
        "command",
    ] {
        assert!(page.contains(&format!("<th>{name}<td>")), "{name}");
    }
    // The lines that a cell names are those of its rows.
    let rows = text(&folder.path().join("rows.csv"));
    let first = rows
        .lines()
        .position(|line| line.starts_with("R09") && line.contains("penalty"));
    let first = first.expect("penalty was run") + 1;
    assert!(page.contains(&format!("lines {first} to ")), "line {first}");
}

/// What is open or failed of this project's own is named at the top, with its line.
#[test]
fn a_miss_of_our_own_is_named() {
    // R10b has a line that is open.
    let of_one = Plan {
        recipes: Some(vec!["R02".into()]),
        ..plan(Vec::new())
    };
    let mut results = of_one.run(&Store::none());
    let before = taut_lab::page::html(&results).expect("a page");
    assert!(
        before.contains("<p>None.</p>"),
        "ours misses nothing of this one"
    );
    let ours = |row: &taut_lab::row::Row| row.method == "ours" && row.rate == Some(1000);
    let index = results.rows.iter().position(ours).expect("ours was run");
    results.rows[index].verdict = Verdict::Open("a reason <of mine>");
    let after = taut_lab::page::html(&results).expect("a page");
    assert!(!after.contains("<p>None.</p>"));
    assert!(after.contains(&format!("open: a reason &lt;of mine&gt;<td>{}", index + 2)));
}

/// What the page foretells is what its own clock brings, and it says by which clock and error it is made.
#[test]
fn failures_that_the_page_predicts_are_seen() {
    let late = Plan {
        recipes: Some(vec!["R11".into()]),
        methods: vec![Method::Paper],
        ..plan(Vec::new())
    };
    let page = taut_lab::page::html(&late.run(&Store::none())).expect("a page");
    let section = |id: &str| {
        let from = page.split(&format!("id={id}>")).nth(1).expect(id);
        from.split("<h2").next().expect("its end")
    };
    let predicted = section("predicted");
    assert_eq!(predicted.matches("class=\"pass key\"").count(), 2);
    assert!(!predicted.contains("class=\"fail key\""), "{predicted}");
    for said in ["ripple", taut_lab::costs::machine()] {
        assert!(section("reading").contains(said), "{said}");
    }
}

/// A trace is what the run was: the one of penalty loses the plate that ours is held by, at the limit of the force.
#[test]
fn a_trace_shows_the_fall_through_the_plate() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let results = plan(Vec::new()).run(&Store::none());
    results
        .write(folder.path(), true)
        .expect("files are written");
    let traces = text(&folder.path().join("traces.csv"));
    let last = |method: &str| -> f64 {
        let mut its = traces
            .lines()
            .filter(|line| line.contains(&format!(",{method},")));
        let line = its
            .next_back()
            .unwrap_or_else(|| panic!("no trace of {method}"));
        let value = line.rsplit(',').next().expect("a last column");
        value.parse().expect("a number")
    };
    let (right, ours, penalty) = (last("right answer"), last("ours"), last("penalty"));
    assert!(
        (ours - right).abs() <= 1e-6 * right,
        "{ours} N, not {right} N"
    );
    assert!(penalty.abs() < 0.1 * right, "{penalty} N: it is through");
    // And the headline names the line that it misses.
    let its = |score: &&taut_lab::score::Score| score.method == Method::Penalty && score.rate == 70;
    let score = results.scores.iter().find(its).expect("it was run");
    assert!(score.headline().contains("astray"), "{}", score.headline());
    let page = text(&folder.path().join("report.html"));
    for section in ["matrix", "predicted", "traces", "scope", "reading"] {
        assert!(page.contains(&format!("id={section}>")), "{section}");
    }
    // Every method of the plan in a line of the picture, and the right answer.
    let window = page.split("id=traces>").nth(1).expect("the section");
    let window = window.split("<h2").next().expect("its end");
    assert!(window.matches("<polyline").count() > results.traces.len());
}

#[test]
fn sweeps_name_recipes_that_are_there_and_settings_that_are_valid() {
    let recipes = all(Extent::Quick);
    for sweep in SWEEPS {
        let Runs::Settings(cases, variants) = sweep.runs else {
            continue;
        };
        for (name, case) in cases {
            let recipe = named(&recipes, name, case);
            for variant in variants() {
                let fitted = recipe.scene.fitted(1.0 / f64::from(variant.rate));
                let settings = (variant.settings)(fitted);
                assert_eq!(
                    settings.validate(),
                    Ok(()),
                    "{}: {}",
                    sweep.name,
                    variant.label
                );
            }
        }
    }
}

/// Without look-ahead, the force begins deeper than with it at every rate; slower updates are never felt less by the paper's cone.
#[test]
fn the_sweep_of_look_ahead_sees_late_contact() {
    let recipes = all(Extent::Quick);
    let look_ahead = sweep("look-ahead");
    let only = Sweep {
        runs: match look_ahead.runs {
            Runs::Settings(_, variants) => Runs::Settings(&[("R11", "0.3 m/s")], variants),
            own => own,
        },
        ..look_ahead
    };
    let points = only.run(Extent::Quick, &recipes, &Store::none(), 2, || ());
    let error = |setting: &str| {
        let point = points.iter().find(|point| point.setting == setting);
        point.expect("a point").error
    };
    for rate in [70, 300, 1000] {
        let (on, off) = (
            error(&format!("on, {rate} Hz")),
            error(&format!("off, {rate} Hz")),
        );
        assert!(on < 0.5 * off, "{rate} Hz: {on} with, {off} without");
    }
    assert!(error("off, 70 Hz") > error("off, 1000 Hz"));
    assert_eq!(csv(&only, &points).lines().count(), 1 + points.len());
}

/// Rows and points without their times.
fn answers(results: &Results) -> String {
    let rows = taut_lab::report::rows_csv(&results.rows);
    let points = results.sweeps.iter().flat_map(|(_, points)| points);
    points.fold(rows, |text, p| {
        format!(
            "{text}{} {} {:?} {:?}\n",
            p.recipe, p.setting, p.error, p.measures
        )
    })
}

#[test]
fn results_that_were_kept_are_the_same() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // Without the dear one.
    let plan = Plan {
        recipes: Some(vec!["R03".into(), "R10b".into()]),
        ..plan(vec![sweep("rounds")])
    };
    let fresh = plan.run(&Store::none());
    let first = Store::in_directory(folder.path());
    let kept = plan.run(&first);
    let second = Store::in_directory(folder.path());
    let again = plan.run(&second);
    assert_eq!(first.read(), 0);
    let sweep_runs: usize = plan
        .sweeps
        .iter()
        .map(|sweep| sweep.count(plan.extent))
        .sum();
    assert_eq!(second.read(), again.outcomes.len() + sweep_runs);
    assert_eq!(answers(&fresh), answers(&kept));
    assert_eq!(answers(&kept), answers(&again));
    // Times, too, are those of the run that was made.
    assert!(
        kept.outcomes
            .iter()
            .zip(&again.outcomes)
            .all(|(a, b)| a.measured.times == b.measured.times)
    );
}

fn laboratory(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut-lab"));
    command.args(["--quick", "--out"]).arg(folder).args([
        "R02",
        "R11",
        "--method",
        "paper",
        "--method",
        "virtual coupling",
    ]);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

#[test]
fn a_run_that_was_interrupted_goes_on_and_gets_the_same_rows() {
    let [whole, broken] = [(), ()].map(|()| tempfile::tempdir().expect("a temporary folder"));
    let finished = || {
        let files = fs::read_dir(broken.path().join("done"))
            .into_iter()
            .flatten();
        let names = files.map(|file| file.expect("an entry").path());
        names
            .filter(|name| name.extension().is_some_and(|e| e == "bin"))
            .collect::<Vec<_>>()
    };
    let mut running = laboratory(broken.path()).spawn().expect("it starts");
    let begun = Instant::now();
    while finished().len() < 3 {
        assert!(begun.elapsed() < PATIENCE, "no results after {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
    running.kill().expect("it was still running");
    running.wait().expect("it ended");
    assert!(
        !broken.path().join("rows.csv").exists(),
        "it was over before it was interrupted"
    );
    let before = finished();
    let written = |file: &Path| {
        fs::metadata(file)
            .and_then(|m| m.modified())
            .expect("a time")
    };
    let times: Vec<_> = before.iter().map(|file| written(file)).collect();

    let resumed = laboratory(broken.path()).output().expect("it starts");
    let uninterrupted = laboratory(whole.path()).output().expect("it starts");
    for ended in [&resumed, &uninterrupted] {
        assert!(
            ended.status.success(),
            "{}",
            String::from_utf8_lossy(&ended.stderr)
        );
        assert!(ended.stderr.is_empty(), "progress, though nobody looks on");
    }
    for file in ["rows.csv", "measures.csv", "trials.csv", "table.md"] {
        let [resumed, uninterrupted] =
            [&broken, &whole].map(|folder| text(&folder.path().join(file)));
        assert!(resumed == uninterrupted, "{file} differs");
    }
    let after: Vec<_> = before.iter().map(|file| written(file)).collect();
    assert_eq!(times, after, "what was finished was run again");
    assert!(finished().len() > before.len());
}
