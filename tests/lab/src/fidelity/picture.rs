//! What a scene needs, in one picture: for each scene every setting by its cost, the cheapest that is within the budget, and what the scene chose.

use std::error::Error;

use plotters::prelude::*;

use super::sweep::{BUDGET, Swept};
use crate::plot::{self, Area, Drawn};

/// Pixels: width, a scene's line, head and foot, the column of names, the column of ratios.
const WIDTH: i32 = 960;
const LINE: i32 = 34;
const HEAD: i32 = 104;
const FOOT: i32 = 46;
const NAMES: i32 = 190;
const RATIOS: i32 = 130;
const OVER: RGBColor = RGBColor(214, 150, 150);
const WITHIN: RGBColor = RGBColor(120, 170, 120);
const CHOSEN: RGBColor = RGBColor(0, 90, 170);
const GREY: RGBColor = RGBColor(225, 225, 225);

/// Costs at the ends of the axis, whole powers of ten.
fn ends(swept: &[Swept]) -> [f64; 2] {
    let costs = || swept.iter().flat_map(|s| s.all.iter().map(|m| m.cost));
    let least = costs().fold(f64::INFINITY, f64::min).log10().floor();
    let most = costs().fold(1.0, f64::max).log10().ceil();
    [least, most.max(least + 1.0)]
}

/// The picture as a text; a row for each scene.
pub(crate) fn svg(swept: &[Swept]) -> Result<String, Box<dyn Error>> {
    let height = HEAD + FOOT + LINE * swept.len() as i32;
    plot::svg((WIDTH as u32, height as u32), |root| {
        root.fill(&WHITE)?;
        let picture = Picture {
            root: root.clone(),
            ends: ends(swept),
        };
        picture.head()?;
        picture.axis(height - FOOT)?;
        for (index, s) in swept.iter().enumerate() {
            picture.row(HEAD + LINE * index as i32 + LINE / 2, s)?;
        }
        Ok(())
    })
}

struct Picture<'a> {
    root: Area<'a>,
    ends: [f64; 2],
}

impl Picture<'_> {
    fn write(&self, text: &str, at: (i32, i32), size: i32, ink: RGBColor) -> Drawn {
        let style = ("sans-serif", size).into_font().color(&ink);
        Ok(self.root.draw(&Text::new(text.to_owned(), at, style))?)
    }

    fn place(&self, cost: f64) -> i32 {
        let [least, most] = self.ends;
        let share = (cost.log10() - least) / (most - least);
        NAMES + (share * f64::from(WIDTH - NAMES - RATIOS)) as i32
    }

    fn head(&self) -> Drawn {
        self.write(
            &format!("What a scene needs: cost of every setting, error within J = {BUDGET} or not"),
            (16, 8),
            19,
            BLACK,
        )?;
        for (x, ink, said) in [
            (16, OVER, "over the budget"),
            (156, WITHIN, "within it"),
            (256, BLACK, "the cheapest within it"),
            (436, CHOSEN, "what the scene chose by itself"),
        ] {
            let dot = Circle::new((x + 6, 48), 5, ink.filled());
            self.root.draw(&dot)?;
            self.write(said, (x + 16, 40), 14, BLACK)?;
        }
        let at = (WIDTH - RATIOS - 10, HEAD - 26);
        self.write("chosen over cheapest", at, 13, BLACK)
    }

    /// `foot`: where the rows end.
    fn axis(&self, foot: i32) -> Drawn {
        let [least, most] = self.ends;
        for decade in least as i32..=most as i32 {
            let cost = 10_f64.powi(decade);
            let x = self.place(cost);
            let line = vec![(x, HEAD - 8), (x, foot + 4)];
            let line = PathElement::new(line, GREY.stroke_width(1));
            self.root.draw(&line)?;
            self.write(&format!("{cost:.0}"), (x - 12, foot + 8), 13, BLACK)?;
        }
        self.write(
            "cost, nominal microseconds of the god-object loop a second",
            (NAMES, foot + FOOT - 20),
            14,
            BLACK,
        )
    }

    fn row(&self, y: i32, s: &Swept) -> Drawn {
        self.write(&s.name, (16, y - 8), 14, BLACK)?;
        // Those within lie above the line, the others below it.
        for setting in &s.all {
            let (up, ink) = if setting.j <= BUDGET {
                (-6, WITHIN)
            } else {
                (6, OVER)
            };
            let dot = Circle::new((self.place(setting.cost), y + up), 3, ink.filled());
            self.root.draw(&dot)?;
        }
        if let Some(best) = s.cheapest() {
            let dot = Circle::new((self.place(best.cost), y - 6), 5, BLACK.filled());
            self.root.draw(&dot)?;
        }
        let up = if s.is_within() { -6 } else { 6 };
        let at = (self.place(s.auto.cost), y + up);
        let ring = Circle::new(at, 8, CHOSEN.stroke_width(2));
        self.root.draw(&ring)?;
        let said = match (s.is_within(), s.ratio()) {
            (true, Some(ratio)) => format!("{ratio:.2}"),
            (false, Some(_)) => "over the budget".to_owned(),
            (_, None) => "none is within".to_owned(),
        };
        self.write(&said, (WIDTH - RATIOS + 10, y - 8), 14, BLACK)
    }
}
