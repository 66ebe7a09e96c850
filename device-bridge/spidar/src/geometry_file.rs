//! Reading a geometry file: TOML, every fault with its line, and the nearest key for one that is unknown.

use nalgebra::{Point3, Rotation3, Vector3};
use toml::de::{DeTable, DeValue};

use crate::STRINGS;
use crate::geometry::Geometry;
use crate::toml_reader::{GeometryProblem, Range, Reader};

/// Points of a device lie within this box, m: a larger number is in millimetres by mistake.
const LARGEST_COORDINATE: f64 = 20.0;

/// Why a geometry file could not be used: every fault found, in the order of the file, what is missing last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GeometryError {
    /// The file's name.
    pub file: String,
    /// At least one.
    pub problems: Vec<GeometryProblem>,
}

impl std::error::Error for GeometryError {}

impl std::fmt::Display for GeometryError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(first) = self.problems.first() {
            write!(f, "{}:{}: {}", self.file, first.line, first.text)?;
        }
        match self.problems.len() {
            0 | 1 => Ok(()),
            n => write!(f, " (and {} more)", n - 1),
        }
    }
}

pub(crate) fn read(file: &str, text: &str) -> Result<Geometry, GeometryError> {
    let mut reader = Reader {
        text,
        problems: Vec::new(),
    };
    let (table, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let words: Vec<&str> = error.message().lines().map(str::trim).collect();
        let at = error.span().map_or(0, |span| span.start);
        reader.complain(at, format!("is no valid TOML here: {}", words.join(", ")));
    }
    let geometry = reader.geometry(table.get_ref());
    // A key that is missing is often one that was misspelt: that comes first.
    reader
        .problems
        .sort_by_key(|problem| (problem.text.contains("is missing"), problem.line));
    match geometry {
        Some(geometry) if reader.problems.is_empty() => Ok(geometry),
        _ => Err(GeometryError {
            file: file.to_owned(),
            problems: reader.problems,
        }),
    }
}

impl Reader<'_> {
    fn geometry(&mut self, root: &DeTable<'_>) -> Option<Geometry> {
        const KEYS: [&str; 6] = ["name", "assumed", "turned", "motor", "grip", "string"];
        self.known(root, "the file", &KEYS);
        let name = self.text_of(root, "name");
        let assumed = self.texts(root, "assumed");
        let turned = self.vector(root, "the file", "turned", Range::Within(360.0), 0, false);
        let motor = self.motor(root);
        let grip = self.grip(root);
        let strings = self.strings(root)?;
        let (motor, grip) = (motor?, grip?);

        let angles = turned.unwrap_or_default().map(f64::to_radians);
        let turn = Rotation3::from_scaled_axis(angles);
        let point = |p: &Vector3<f64>| Point3::from(turn * p);
        Some(Geometry {
            name: name?,
            assumed,
            motors: strings.each_ref().map(|string| point(&string.motor)),
            grips: strings.each_ref().map(|string| point(&string.grip)),
            metres_per_count: strings.each_ref().map(|string| {
                let sign = if string.reversed { -1.0 } else { 1.0 };
                sign * motor.metres_per_count
            }),
            tension_min: motor.tension_min,
            tension_max: motor.tension_max,
            volts_per_newton: motor.volts_per_newton,
            winding: strings
                .each_ref()
                .map(|string| if string.current_reversed { -1.0 } else { 1.0 }),
            motor_inertia: motor.inertia,
            drum_radius: motor.drum_radius,
            motor_time_constant: motor.time_constant,
            grip_mass: grip.0,
            grip_damping: grip.1,
        })
    }

    fn motor(&mut self, root: &DeTable<'_>) -> Option<Motor> {
        const NAME: &str = "[motor]";
        const KEYS: [&str; 7] = [
            "metres_per_count",
            "tension_min",
            "tension_max",
            "volts_per_newton",
            "inertia",
            "drum_radius",
            "time_constant",
        ];
        let (table, at) = self.table(root, "motor")?;
        self.known(table, NAME, &KEYS);
        let mut number = |key, range| self.number(table, NAME, key, range, at);
        let (metres_per_count, tension_min, tension_max, inertia, drum_radius, time_constant) = (
            number("metres_per_count", Range::Positive),
            number("tension_min", Range::NotNegative),
            number("tension_max", Range::Positive),
            number("inertia", Range::NotNegative),
            number("drum_radius", Range::Positive),
            number("time_constant", Range::NotNegative),
        );
        let volts_per_newton = table
            .contains_key("volts_per_newton")
            .then(|| self.number(table, NAME, "volts_per_newton", Range::Positive, at))
            .flatten();
        let motor = Motor {
            metres_per_count: metres_per_count?,
            tension_min: tension_min?,
            tension_max: tension_max?,
            volts_per_newton,
            inertia: inertia?,
            drum_radius: drum_radius?,
            time_constant: time_constant?,
        };
        if motor.tension_min >= motor.tension_max {
            let at = table
                .get("tension_min")
                .map_or(at, |value| value.span().start);
            let text = format!(
                "`tension_min` in {NAME} is {}, but must be below `tension_max`, which is {}",
                motor.tension_min, motor.tension_max
            );
            self.complain(at, text);
            return None;
        }
        Some(motor)
    }

    fn grip(&mut self, root: &DeTable<'_>) -> Option<(f64, f64)> {
        const NAME: &str = "[grip]";
        let (table, at) = self.table(root, "grip")?;
        self.known(table, NAME, &["mass", "damping"]);
        let mass = self.number(table, NAME, "mass", Range::Positive, at);
        let damping = self.number(table, NAME, "damping", Range::NotNegative, at);
        Some((mass?, damping?))
    }

    fn strings(&mut self, root: &DeTable<'_>) -> Option<[TiedString; STRINGS]> {
        const NAME: &str = "[[string]]";
        let Some(entry) = root.get("string") else {
            self.complain(0, format!("{NAME} is missing; write {STRINGS} of them"));
            return None;
        };
        let at = entry.span().start;
        let DeValue::Array(items) = entry.get_ref() else {
            self.complain(
                at,
                format!("`string` must be a list of tables; write {NAME}"),
            );
            return None;
        };
        if items.len() != STRINGS {
            let text = format!("there are {} {NAME}, but must be {STRINGS}", items.len());
            self.complain(at, text);
        }
        let strings: Vec<Option<TiedString>> = items
            .iter()
            .map(|item| {
                let DeValue::Table(table) = item.get_ref() else {
                    self.complain(item.span().start, format!("must be a table; write {NAME}"));
                    return None;
                };
                self.string(table, item.span().start)
            })
            .collect();
        let strings: Option<Vec<TiedString>> = strings.into_iter().collect();
        let strings: [TiedString; STRINGS] = strings?.try_into().ok()?;
        if strings.iter().all(|string| string.grip.norm() == 0.0) {
            let text = "every `grip` lies at the grip's centre, so that no torque can be rendered; check the numbers";
            self.complain(at, text);
            return None;
        }
        Some(strings)
    }

    fn string(&mut self, table: &DeTable<'_>, at: usize) -> Option<TiedString> {
        const NAME: &str = "[[string]]";
        self.known(
            table,
            NAME,
            &["motor", "grip", "reversed", "current_reversed"],
        );
        let range = Range::Within(LARGEST_COORDINATE);
        let motor = self.vector(table, NAME, "motor", range, at, true);
        let grip = self.vector(table, NAME, "grip", range, at, true);
        let reversed = self.flag(table, NAME, "reversed");
        let current_reversed = self.flag(table, NAME, "current_reversed");
        let (reversed, current_reversed) = (reversed?, current_reversed?);
        let (motor, grip) = (motor?, grip?);
        if (motor - grip).norm() == 0.0 {
            self.complain(
                at,
                format!("`motor` and `grip` of this {NAME} are one point"),
            );
            return None;
        }
        Some(TiedString {
            motor,
            grip,
            reversed,
            current_reversed,
        })
    }

    /// A key that is true or false, false without it; `None` where it is neither.
    fn flag(&mut self, table: &DeTable<'_>, name: &str, key: &str) -> Option<bool> {
        let Some(entry) = table.get(key) else {
            return Some(false);
        };
        if let DeValue::Boolean(flag) = entry.get_ref() {
            return Some(*flag);
        }
        let text = format!("`{key}` in {name} must be true or false");
        self.complain(entry.span().start, text);
        None
    }
}

struct Motor {
    metres_per_count: f64,
    tension_min: f64,
    tension_max: f64,
    volts_per_newton: Option<f64>,
    inertia: f64,
    drum_radius: f64,
    time_constant: f64,
}

struct TiedString {
    motor: Vector3<f64>,
    grip: Vector3<f64>,
    reversed: bool,
    /// The amplifier winds up with a negative input.
    current_reversed: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = include_str!("../devices/wb.toml");

    fn refused(text: &str) -> String {
        match read("my.toml", text) {
            Ok(_) => panic!("read without complaint"),
            Err(error) => error.to_string(),
        }
    }

    fn line_of(text: &str, part: &str) -> usize {
        let at = text.find(part).unwrap_or_else(|| panic!("{part} is there"));
        1 + text[..at].matches('\n').count()
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line_and_the_nearest_key() {
        let text = GOOD.replace("tension_max =", "tension_maks =");
        let line = line_of(&text, "tension_maks =");
        // The missing key is complained of at the table's head, the wrong one at its own line.
        assert!(refused(&text).starts_with(&format!("my.toml:{line}: unknown key `tension_maks`")));
        let Err(error) = read("my.toml", &text) else {
            panic!("refused");
        };
        assert!(error.problems.iter().any(|problem| problem.line == line
            && problem.text
                == "unknown key `tension_maks` in [motor]; did you mean `tension_max`?"));
        assert!(
            error
                .problems
                .iter()
                .any(|problem| problem.text == "`tension_max` is missing in [motor]")
        );
    }

    #[test]
    fn wrong_numbers_are_named_with_line_and_range() {
        for (from, to, part) in [
            (
                "metres_per_count = 2.924e-5",
                "metres_per_count = -1.0",
                "above zero",
            ),
            ("tension_min = 0.5", "tension_min = nan", "zero or above"),
            (
                "tension_min = 0.5",
                "tension_min = 30",
                "below `tension_max`",
            ),
            ("mass = 0.10", "mass = \"light\"", "a number"),
        ] {
            let text = GOOD.replace(from, to);
            let message = refused(&text);
            let start = format!("my.toml:{}:", line_of(&text, to));
            assert!(message.starts_with(&start), "{message}");
            assert!(message.contains(part), "{message}");
        }
        let millimetres = GOOD.replacen("motor = [-0.9", "motor = [-900.0", 1);
        let message = refused(&millimetres);
        assert!(message.contains("between -20 and 20"), "{message}");
    }

    #[test]
    fn missing_strings_and_broken_toml_are_refused() {
        let (text, _) = GOOD.rsplit_once("[[string]]").expect("strings");
        assert!(refused(text).contains("there are 7 [[string]], but must be 8"));
        assert!(refused("name = \"x").starts_with("my.toml:1: is no valid TOML"));
        assert!(refused("").contains("is missing"));
    }

    #[test]
    fn a_grip_without_levers_is_refused() {
        let text: String = GOOD
            .lines()
            .map(|line| {
                if line.starts_with("grip =") {
                    "grip = [0.0, 0.0, 0.0]\n".to_owned()
                } else {
                    format!("{line}\n")
                }
            })
            .collect();
        assert!(refused(&text).contains("no torque"));
    }
}
