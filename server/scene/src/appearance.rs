//! How a body looks: as its scene says, else as its mesh file says, else as bodies of its kind do.

use serde::Serialize;

/// Colour and finish of a body; what is `None` nobody has said. All numbers are 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Appearance {
    /// Linear red, green and blue.
    pub color: Option<[f32; 3]>,
    /// 0 is a mirror, 1 is matt.
    pub roughness: Option<f32>,
    /// 0 is a dielectric, 1 a metal.
    pub metallic: Option<f32>,
    /// 0 is invisible, 1 is opaque.
    pub opacity: Option<f32>,
}

impl Appearance {
    /// This one, key by key, and `other` where it says nothing.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            color: self.color.or(other.color),
            roughness: self.roughness.or(other.roughness),
            metallic: self.metallic.or(other.metallic),
            opacity: self.opacity.or(other.opacity),
        }
    }
}

/// Linear light of one sRGB value, both 0 to 1 (IEC 61966-2-1).
pub(crate) fn linear(value: f64) -> f64 {
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

/// The sRGB value of linear light, both 0 to 1: the inverse of [`linear`].
pub(crate) fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

/// The colour that `#rrggbb` or a name of CSS says; `None` if the text is none.
pub(crate) fn colour_of_text(text: &str) -> Option<[f32; 3]> {
    let Some(digits) = text.strip_prefix('#') else {
        // Of CSS the names are taken, and no functions; the crate takes digits without `#`, too, and no name is made of those.
        let is_name = text.bytes().all(|letter| letter.is_ascii_alphabetic())
            && !text.bytes().all(|letter| letter.is_ascii_hexdigit());
        let named = csscolorparser::parse(text).ok().filter(|_| is_name)?;
        let parts = [named.r, named.g, named.b];
        let is_opaque = named.a >= 1.0; // `transparent` is no colour
        return is_opaque.then(|| parts.map(|part| linear(f64::from(part)) as f32));
    };
    if digits.len() != 6 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let all = u32::from_str_radix(digits, 16).ok()?;
    let part = |shift: u32| linear(f64::from((all >> shift) & 0xff) / 255.0) as f32;
    Some([part(16), part(8), part(0)])
}

/// sRGB of a linear colour, 0 to 1, in 8 bits.
pub fn srgb(colour: [f32; 3]) -> [u8; 3] {
    colour.map(|part| (encoded(f64::from(part)) * 255.0).round() as u8)
}

/// `#rrggbb` of a colour, rounded to 8 bits.
pub(crate) fn text_of_colour(colour: [f32; 3]) -> String {
    let [red, green, blue] = srgb(colour);
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_text_of_a_colour_comes_back() {
        for value in 0..=255_u8 {
            let text = format!("#{value:02x}{:02x}7f", 255 - value);
            let colour = colour_of_text(&text).unwrap();
            assert_eq!(text_of_colour(colour), text);
        }
        assert_eq!(colour_of_text("#FFffFF"), Some([1.0; 3]));
        let [half, ..] = colour_of_text("#808080").unwrap();
        assert!((half - 0.2159).abs() < 1e-4, "{half}");
    }

    #[test]
    fn names_of_css_are_colours() {
        for (name, text) in [
            ("red", "#ff0000"),
            ("Red", "#ff0000"),
            ("steelblue", "#4682b4"),
            ("RebeccaPurple", "#663399"),
            ("grey", "#808080"),
            ("black", "#000000"),
        ] {
            let colour = colour_of_text(name).unwrap();
            assert_eq!(text_of_colour(colour), text, "{name}");
        }
    }

    #[test]
    fn what_is_no_colour_is_none() {
        for text in [
            "redd",
            "transparent",
            "currentcolor",
            "none",
            "",
            "rgb(1,2,3)",
            "abc",
            "fff",
            "808080",
            "#80808",
            "#8080800",
            "#80808g",
            "#+80808",
            "#8080é",
        ] {
            assert_eq!(colour_of_text(text), None, "{text}");
        }
    }
}
