//! The stability calculator on the command line: one axis of a device, by key and value.
//!
//! `cargo run --release -p taut-plant --example stability_limits -- mass=0.2 damping=1 friction=0.02 resolution=29e-6 delay=1e-3`
//!
//! Keys: mass (kg), damping (N s/m), friction (N), resolution (m), rate (Hz, 1000), delay (s), lag (s), wall-damping (N s/m), hand
//! (released, light, firm, arm); about an axis the same numbers in kg m^2, N m and rad, with `about=1`.

use std::process::ExitCode;

use taut_plant::stability::{DeclaredAxis, SampledLoop};
use taut_plant::{Hand, HandPreset};

fn main() -> ExitCode {
    match judged() {
        Ok(text) => {
            println!("{text}");
            ExitCode::SUCCESS
        }
        Err(text) => {
            eprintln!("{text}");
            ExitCode::from(2)
        }
    }
}

fn judged() -> Result<String, String> {
    let mut axis = SampledLoop::at_period(1e-3);
    let (mut coulomb, mut resolution, mut hand, mut about) =
        (0.0, 0.0, HandPreset::Released, false);
    for argument in std::env::args().skip(1) {
        let (key, value) = argument
            .split_once('=')
            .ok_or(format!("`{argument}` is no key=value"))?;
        let number = || {
            value
                .parse::<f64>()
                .ok()
                .filter(|x| x.is_finite() && *x >= 0.0)
                .ok_or(format!("`{value}` is no number for {key}"))
        };
        match key {
            "mass" => axis.mass = number()?,
            "damping" => axis.damping = number()?,
            "friction" => coulomb = number()?,
            "resolution" => resolution = number()?,
            "rate" => axis.period = number()?.recip(),
            "delay" => axis.delay = number()?,
            "lag" => axis.motor_lag = number()?,
            "wall-damping" => axis.virtual_damping = number()?,
            "hand" => hand = value.parse().map_err(|error| format!("{error}"))?,
            "about" => about = number()? != 0.0,
            _ => return Err(format!("there is no key `{key}`")),
        }
    }
    if axis.mass == 0.0 {
        return Err("give at least mass=KG".to_owned());
    }
    let held = Hand::from(hand);
    let declared = DeclaredAxis {
        sampled: if about {
            axis.held_about(&held)
        } else {
            axis.held_along(&held)
        },
        coulomb,
        resolution,
    };
    let unit = if about { "N m/rad" } else { "N/m" };
    let verdict = declared.verdict();
    Ok(format!(
        "largest stable stiffness, {hand} hand: {:.1} {unit}; limited by {}\nlargest passive stiffness, any hand: {:.1} {unit}; limited by {}",
        verdict.stable, verdict.stable_limit, verdict.passive, verdict.passive_limit
    ))
}
