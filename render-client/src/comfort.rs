//! What makes stereo pictures easier on the eyes: less separation, and a limit on what stands out.
//!
//! | symbol | name in code        | unit | meaning                                              |
//! |--------|---------------------|------|------------------------------------------------------|
//! | s      | `separation`        | m    | between the eyes that pictures are drawn for         |
//! | D      | `to_screen`         | m    | from the eye to the plane of the screen              |
//! | d      | `nearest`           | m    | from the eye to a point, along the screen's normal   |
//! | η      | `nearest_disparity` | rad  | angle between the eyes by which the point stands out |
//!
//! η = s/d − s/D for small angles, so what stands out by η at most is at d ≥ s / (η + s/D).
//! Screens make the eyes focus on D while they turn to d; the conflict tires. About one degree is
//! called comfortable over long viewing; near screens are borne with more, and behind the screen
//! the angle cannot pass s/D anyway.
//!
//! Source: Lambooij, IJsselsteijn, Fortuin, Heynderickx 2009, "Visual discomfort and visual fatigue
//! of stereoscopic displays: a review"; Shibata, Kim, Hoffman, Banks 2011, "The zone of comfort".

/// How stereo is eased.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comfort {
    /// Factor on the separation of the viewer's eyes, in [0, 1].
    pub separation_scale: f64,
    /// Most that anything stands out from a screen, in radians; `None` is no limit.
    pub nearest_disparity: Option<f64>,
}

impl Default for Comfort {
    /// Pictures as the world is: no scale, no limit.
    fn default() -> Self {
        Self {
            separation_scale: 1.0,
            nearest_disparity: None,
        }
    }
}

/// What is nearer to an eye is not drawn, and what is a little farther is drawn in part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearFade {
    /// Nothing nearer is drawn, in metres along the screen's normal; 0 is no limit.
    pub nothing: f64,
    /// From here on everything is drawn.
    pub everything: f64,
}

/// Distance at which all is drawn over that at which nothing is: what comes near fades, it does
/// not break off.
const FADE: f64 = 1.12;

impl Comfort {
    /// The fade for eyes `separation` metres apart (already scaled) and `to_screen` metres from the screen.
    pub fn near_fade(&self, separation: f64, to_screen: f64) -> NearFade {
        let none = NearFade {
            nothing: 0.0,
            everything: 0.0,
        };
        let Some(limit) = self.nearest_disparity else {
            return none;
        };
        let usable = limit > 0.0 && separation > 0.0 && to_screen > 0.0; // false for NaN: no limit
        if !usable {
            return none;
        }
        let nothing = separation / (limit + separation / to_screen);
        NearFade {
            nothing,
            // The screen's own plane is never faded: there is no disparity in it.
            everything: (FADE * nothing).min(to_screen),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_drawn_stands_out_by_the_limit_at_most(
            separation in 0.01..0.08f64, to_screen in 0.3..4.0f64, degrees in 0.2..10.0f64,
            beyond in 1.0..20.0f64,
        ) {
            let limit = degrees.to_radians();
            let comfort = Comfort { nearest_disparity: Some(limit), ..Comfort::default() };
            let fade = comfort.near_fade(separation, to_screen);
            prop_assert!(0.0 < fade.nothing && fade.nothing < to_screen);
            prop_assert!(fade.nothing < fade.everything && fade.everything <= to_screen);
            // A point before the middle of the eyes, by the true angles that the eyes turn.
            let turned = |distance: f64| 2.0 * (0.5 * separation / distance).atan();
            let drawn = fade.nothing * beyond;
            prop_assert!(turned(drawn) - turned(to_screen) <= limit * (1.0 + 1e-9));
        }
    }

    #[test]
    fn without_a_limit_or_without_stereo_nothing_fades() {
        let limited = Comfort {
            nearest_disparity: Some(0.02),
            ..Comfort::default()
        };
        assert_eq!(Comfort::default().near_fade(0.064, 1.0).nothing, 0.0);
        assert_eq!(limited.near_fade(0.0, 1.0).nothing, 0.0);
        assert_eq!(limited.near_fade(f64::NAN, 1.0).nothing, 0.0);
    }
}
