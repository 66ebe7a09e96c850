//! R27: a bunny on a bunny: approached, slid, an ear pressed in, twisted. The meshes are test data; without them there is no recipe.

use std::f64::consts::PI;

use god_object::Pose;
use nalgebra::Vector3;
use taut_method_tests::solids::{body, mesh, obstacle};
use taut_scene::{data_file, read_mesh};

use super::Extent;
use super::bodies::{sound_and, turns};
use crate::clock::RATES;
use crate::measure::Measure;
use crate::method::{Method, Scene};
use crate::recipe::{Ideal, OURS, Open, Recipe, open_for};
use crate::row::Row;

/// Of 5,000 triangles.
const FILE: &str = "bunny_5k.ply";
/// That of the paper.
const LARGE: &str = "bunny_27k.ply";
const SIZE: f64 = 0.15;
/// Where the held one is at the start and when it is pressed, m above the other: their centres.
const APART: f64 = 0.2;
const PRESSED: f64 = 0.115;
/// N: the recipe asks to compare and to record, and names no line. This one is two hundredths of the 10 N that press here, less than
/// a third of the 7 % that is just felt of them.
const FORCE_ERROR: f64 = 0.2;

/// Says why there is none, where there is none.
pub(super) fn unavailable(extent: Extent) -> Vec<Row> {
    let row = Row::new("R27", FILE, "all methods");
    if data_file(FILE).is_none() {
        vec![row.out_of_scope(format!("test data are not there: {FILE}"))]
    } else if extent == Extent::Quick {
        vec![row.out_of_scope("minutes: in the full extent only")]
    } else {
        Vec::new()
    }
}

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let files = [FILE, LARGE].iter().filter(|_| extent == Extent::Full);
    files.filter_map(|file| recipe(file)).collect()
}

/// What no method keeps here, taut's neither.
fn open(file: &str) -> Vec<Open> {
    let ripple = "small steps of the right answer, from facet to facet, come up to 2 ms late, and each fills a window of ripple";
    let mut lines = open_for(OURS, &RATES, &[Measure::JndP95, Measure::JndShare], ripple);
    if file == LARGE {
        let fork = "at rest 15 um from the surface, or an update late, the body takes the other branch of a fork of the right answer";
        let line = &[Measure::ForceP95];
        lines.extend(open_for(&[Method::OursByDefault], &RATES, line, fork));
        lines.extend(open_for(&[Method::Ours], &[70, 300], line, fork));
    }
    lines
}

/// With the mesh of the paper; `None` where it is not there.
pub(crate) fn large() -> Option<Recipe> {
    recipe(LARGE)
}

fn recipe(file: &str) -> Option<Recipe> {
    let raw = read_mesh(&data_file(file)?).unwrap_or_else(|error| panic!("{error}"));
    let thousands = (raw.triangles.len() + 500) / 1000;
    let bunny = mesh(raw);
    let obstacles = [obstacle("bunny", bunny.clone(), Pose::identity())];
    let device = |time: f64| {
        // Down in half a second; sideways along the back; then a twist.
        let down = (time / 0.5).min(1.0);
        let slide = ((time - 0.6) / 0.6).clamp(0.0, 1.0);
        let twist = ((time - 1.3) / 0.4).clamp(0.0, 1.0);
        let smooth = |share: f64| 0.5 - 0.5 * (PI * share).cos();
        let height = APART + (PRESSED - APART) * smooth(down);
        Pose::new(
            Vector3::new(0.03 * smooth(slide), height, 0.01 * smooth(slide)),
            Vector3::new(0.0, 0.4, 0.1) * smooth(twist),
        )
    };
    let scene = Scene::new(body(bunny), obstacles, SIZE, 0.27, device(0.0));
    let case = (
        "R27",
        format!("bunny on bunny, {thousands},000 triangles each"),
    );
    let about = "free forms: approach, slide, press, twist";
    Some(Recipe {
        ideal: Ideal::Oracle,
        lines: sound_and(|_| [Measure::ForceP95.at_most(FORCE_ERROR)]),
        check_every: 10,
        out_of_scope: turns,
        open: open(file),
        ..Recipe::new(case, about, scene, 1.8, device)
    })
}
