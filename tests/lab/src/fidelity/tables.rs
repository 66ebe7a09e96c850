//! Tables and files of the sweeps.

use std::fmt::Write as _;

use super::sweep::{BUDGET, Measured, Swept};

/// The choice of each scene beside the cheapest setting within the budget.
pub fn table(swept: &[Swept]) -> String {
    let mut text = format!(
        "{:<17} {:>7} {:>9} {:>6} {:>9} {:>11} {:>10} {:>9} {:>10} {:>6}  budget J <= {BUDGET}\n",
        "scene",
        "rate Hz",
        "tol um",
        "rounds",
        "mesh um",
        "J predicted",
        "J measured",
        "cost us/s",
        "least us/s",
        "ratio"
    );
    for s in swept {
        let (auto, best) = (&s.auto, s.cheapest());
        let number = |value: Option<f64>, places: usize| {
            value.map_or("-".to_owned(), |v| format!("{v:.places$}"))
        };
        let verdict = match (s.is_within(), best) {
            (true, _) => "within".to_owned(),
            (false, Some(_)) => "OVER although some are within".to_owned(),
            (false, None) => format!("over; so is every setting, least J {:.2}", s.least_error()),
        };
        let _ = writeln!(
            text,
            "{:<17} {:>7} {:>9.3} {:>6} {:>9.1} {:>11.3} {:>10.3} {:>9.0} {:>10} {:>6}  {verdict}",
            s.name,
            auto.setting.rate,
            auto.setting.gap_tolerance * 1e6,
            auto.setting.rounds,
            auto.setting.mesh_error * 1e6,
            s.predicted_j,
            auto.j,
            auto.cost,
            number(best.map(|b| b.cost), 0),
            number(s.ratio(), 2),
        );
    }
    text
}

/// The choice of each scene as Markdown, with its cost over the least as `ratio` says.
pub(super) fn markdown(
    first: &str,
    swept: &[Swept],
    ratio: impl Fn(&Swept) -> Option<f64>,
) -> String {
    let mut text = format!(
        "| {first} | rate, Hz | rounds | J predicted | J measured | cost over the least within the budget | verdict |\n| --- | --- | --- | --- | --- | --- | --- |\n"
    );
    for s in swept {
        let verdict = match (s.is_within(), s.cheapest()) {
            (true, _) => "within",
            (false, Some(_)) => "**over, though some setting is within**",
            (false, None) => "over, as every setting is",
        };
        let ratio = ratio(s).map_or("–".to_owned(), |r| format!("{r:.2}"));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.3} | {:.3} | {ratio} | {verdict} |",
            s.name, s.auto.setting.rate, s.auto.setting.rounds, s.predicted_j, s.auto.j
        );
    }
    text
}

/// CSV of the choices within a time: what was predicted and measured of them, and the least error of any
/// setting that fast.
pub fn within_times(swept: &[Swept]) -> String {
    let mut text =
        "scene,time_us,rate_hz,rounds,predicted_us,measured_us,predicted_j,j,least_j_that_fast\n"
            .to_owned();
    for s in swept {
        for timed in &s.timed {
            let (plan, auto) = (&timed.plan, &timed.auto);
            let _ = writeln!(
                text,
                "{},{},{},{},{:.3},{:.3},{:.6},{:.6},{:.6}",
                s.name,
                timed.time_us,
                auto.setting.rate,
                auto.setting.rounds,
                plan.predicted_update_us,
                auto.update_us(),
                plan.predicted_j,
                auto.j,
                s.least_error_within(timed.time_us)
            );
        }
    }
    text
}

fn fields(m: &Measured) -> String {
    let s = &m.setting;
    format!(
        "{},{:e},{},{:e},{:.6},{:.6},{:.6},{:.6},{:.3}",
        s.rate,
        s.gap_tolerance,
        s.rounds,
        s.mesh_error,
        m.j,
        m.percentiles[0],
        m.percentiles[1],
        m.first,
        m.cost
    )
}

/// CSV of every setting.
pub fn every_setting(swept: &[Swept]) -> String {
    let mut text =
        "scene,rate_hz,gap_tolerance_m,rounds,mesh_error_m,j,j_p95,j_p99,j_first,cost_us_per_s\n"
            .to_owned();
    for s in swept {
        for measured in &s.all {
            let _ = writeln!(text, "{},{}", s.name, fields(measured));
        }
    }
    text
}

/// CSV of the choices.
pub fn choices(swept: &[Swept]) -> String {
    let mut text =
        "scene,chosen_by,rate_hz,gap_tolerance_m,rounds,mesh_error_m,j,j_p95,j_p99,j_first,cost_us_per_s,predicted_j\n"
            .to_owned();
    for s in swept {
        let _ = writeln!(
            text,
            "{},auto,{},{:.6}",
            s.name,
            fields(&s.auto),
            s.predicted_j
        );
        if let Some(best) = s.cheapest() {
            let _ = writeln!(text, "{},sweep,{},", s.name, fields(best));
        }
    }
    text
}
