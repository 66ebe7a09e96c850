//! The quick extent twice: every table is the same byte for byte, whoever ran what on how many threads. Only times differ.
//! A part of it in every run; the whole, with the maps, by `cargo test --release -p taut-lab --test all identical:: -- --ignored`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use taut_lab::crew;
use taut_lab::method::Method;
use taut_lab::recipes::Extent;
use taut_lab::run::Plan;
use taut_lab::store::Store;
use taut_lab::sweeps::SWEEPS;

/// Numbers of threads of the two runs.
const THREADS: [usize; 2] = [1, 4];
/// The file that holds nothing but times, and the picture and the page that show them.
const TIMES: [&str; 3] = ["times.csv", "report.html", "svg"];

/// Some recipes, all of them where none is named, of these methods.
type Part<'p> = (Option<&'p [&'p str]>, &'p [Method]);

/// What is written, file by file, without the columns of times.
fn run(threads: usize, (recipes, methods): Part<'_>, folder: &Path) -> BTreeMap<String, String> {
    let plan = Plan {
        extent: Extent::Quick,
        recipes: recipes.map(|names| names.iter().map(|name| (*name).to_owned()).collect()),
        methods: methods.into(),
        sweeps: if recipes.is_none() {
            SWEEPS.into()
        } else {
            Vec::new()
        },
        maps: recipes.is_none(),
        threads,
    };
    let results = plan.run(&Store::none());
    results.write(folder, false).expect("files are written");
    let files = fs::read_dir(folder).expect("the folder is there");
    let files = files.map(|file| file.expect("an entry").path());
    files
        .map(|file| {
            let name = file.file_name().expect("a name").to_string_lossy();
            let text = fs::read_to_string(&file).expect("a text");
            (name.into_owned(), without_times(&text))
        })
        .filter(|(name, _)| !TIMES.iter().any(|times| name.ends_with(times)))
        .collect()
}

/// The columns before the first one of times, which are the last of a file: their names end with `_us` and its quartiles, or say what follows
/// from them.
fn without_times(text: &str) -> String {
    let head = text.lines().next().unwrap_or("");
    let is_time = |name: &str| name.contains("_us") || name == "on_front";
    let times = head.split(',').filter(|name| is_time(name)).count();
    let kept = |line: &str| {
        let mut rest = line;
        for _ in 0..times {
            rest = rest.rsplit_once(',').map_or(rest, |(before, _)| before);
        }
        rest.to_owned() + "\n"
    };
    text.lines().map(kept).collect()
}

#[test]
fn tables_of_a_part_are_the_same_byte_for_byte_on_any_number_of_threads() {
    // Closed forms, ghost contacts, and one under closed-loop control.
    are_the_same((Some(&["R02", "R13", "R16"]), &Method::ALL));
}

#[test]
fn tables_of_thin_plates_are_the_same_on_any_number_of_threads() {
    // The dearest of the quick extent: of the method that looks at the way, and of one that looks at its end.
    let methods = [Method::Ours, Method::Penalty];
    are_the_same((Some(&["R09", "R11"]), &methods));
}

#[test]
#[ignore = "ten minutes of two cores"]
fn tables_of_the_quick_extent_are_the_same_byte_for_byte_on_any_number_of_threads() {
    are_the_same((None, &Method::ALL));
}

fn are_the_same(part: Part<'_>) {
    let folders = THREADS.map(|_| tempfile::tempdir().expect("a temporary folder"));
    // Side by side: each disturbs the times of the other, and nothing else.
    let both: Vec<_> = THREADS.iter().zip(&folders).collect();
    let runs = crew::map(2, &both, |(threads, folder)| {
        run(**threads, part, folder.path())
    });
    let [first, second] = [&runs[0], &runs[1]];
    let names: Vec<_> = first.keys().collect();
    for wanted in [
        "table.md",
        "rows.csv",
        "measures.csv",
        "trials.csv",
        "chart.csv",
    ] {
        assert!(first.contains_key(wanted), "{wanted} of {names:?}");
    }
    assert_eq!(names, second.keys().collect::<Vec<_>>());
    for (name, text) in first {
        assert!(text.lines().count() > 1, "{name} is empty");
        let other = &second[name];
        let differs = text.lines().zip(other.lines()).find(|(a, b)| a != b);
        assert!(text == other, "{name} differs: {differs:?}");
    }
}

#[test]
fn a_column_of_times_is_taken_away_and_no_other() {
    let text = "a,\"b, c\",j,update_p99_us,on_front\n1,\"2, 3\",4,5.0,true\n";
    assert_eq!(without_times(text), "a,\"b, c\",j\n1,\"2, 3\",4\n");
    assert_eq!(without_times("a,b\n1,2\n"), "a,b\n1,2\n");
}
