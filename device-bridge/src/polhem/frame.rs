//! Lines of 64 bytes, blank-padded, the last byte a line's end. The board ends its numbers with another one before it pads them.
//!
//! ```text
//!   from the board   x y z [mm]  tA lambda tD tE [rad]  info
//!   to the board     fx fy fz [mN]  2 0 0 0
//! ```
//!
//! The orientation is Rz(tA) Ry(-lambda) Rx(tD) Ry(tE). There is no checksum: a line counts only if it has its bytes and eight numbers in range.
//!
//! Lines of micro API 0.1 have 63 bytes. Two lines in a row tell which a board has, and it is answered in as many.
//!
//! Source: `haptikfabrikenapi` at b8d6c94, its micro API 0.2 (`uhaptikfabriken.h`).

use std::fmt::Write;

use nalgebra::{UnitQuaternion, Vector3};

/// Of a line, its end included.
pub(crate) const LINE: usize = 64;
/// Of a line of the older micro API.
const SHORT_LINE: usize = LINE - 1;
/// The command that goes with a force: 0 goes with currents, 1 sets counters.
const FORCE: i32 = 2;
/// Farthest cursor that is believed, mm along an axis: the workspace has a radius of 150.
const FARTHEST_MM: f64 = 500.0;
/// Largest angle, rad.
const LARGEST_ANGLE: f64 = 7.0;
/// Largest force that a line can say, mN.
const LARGEST_MN: f64 = 20_000.0;

/// What the board said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Of the cursor, m.
    pub position: [f64; 3],
    /// tA, lambda, tD, tE, rad.
    pub angles: [f64; 4],
    /// The board's own flags; not published which.
    pub info: i32,
}

impl Frame {
    /// Reads a line of 64 bytes, its end included; `None` where it has other bytes, not eight numbers, or one that cannot be.
    #[must_use]
    pub fn parse(line: &[u8]) -> Option<Self> {
        Self::of(line, LINE)
    }

    /// The same of a board whose lines have so many bytes.
    fn of(line: &[u8], bytes: usize) -> Option<Self> {
        let text = line.strip_suffix(b"\n")?;
        // Behind the numbers is another line's end; before them may be what is left of the line before.
        let text = text.trim_ascii();
        if line.len() != bytes || text.contains(&b'\n') {
            return None;
        }
        let text = str::from_utf8(text).ok()?;
        let mut words = text.split(' ').filter(|word| !word.is_empty());
        let mut numbers = [0.0_f64; 7];
        for number in &mut numbers {
            let word = words.next()?;
            // Digits alone: no `inf`, no exponent.
            let is_plain = word
                .bytes()
                .all(|byte| byte.is_ascii_digit() || b"+-.".contains(&byte));
            *number = word.parse().ok().filter(|_| is_plain)?;
        }
        let info = words.next()?.parse().ok()?;
        let [x, y, z, angles @ ..] = numbers;
        let fits = [x, y, z].iter().all(|mm| mm.abs() <= FARTHEST_MM)
            && angles.iter().all(|angle| angle.abs() <= LARGEST_ANGLE);
        (fits && words.next().is_none()).then_some(Self {
            position: [x, y, z].map(|mm| mm * 1e-3),
            angles,
            info,
        })
    }

    /// The newest line at the front of `buffer`, from which it and all before it are taken; what is no line is dropped. `length` is what the board's
    /// lines have: two in a row tell it, and until then none is taken for one.
    pub(crate) fn newest(buffer: &mut Vec<u8>, length: &mut Option<usize>) -> Option<Self> {
        let mut newest = None;
        loop {
            let read = |from: usize, bytes: usize| {
                let line = buffer.get(from..from + bytes)?;
                Self::of(line, bytes)
            };
            let in_a_row = |bytes: &usize| read(0, *bytes).and(read(*bytes, *bytes)).is_some();
            *length = length.or_else(|| [LINE, SHORT_LINE].into_iter().find(in_a_row));
            let taken = match length.and_then(|bytes| Some((read(0, bytes)?, bytes))) {
                Some((frame, bytes)) => {
                    newest = Some(frame);
                    bytes
                }
                None if buffer.len() < length.unwrap_or(2 * LINE) => return newest,
                // On from behind the next line's end.
                None => match buffer.iter().position(|byte| *byte == b'\n') {
                    Some(end) => end + 1,
                    None => return newest,
                },
            };
            buffer.drain(..taken);
        }
    }

    /// The line of it; `None` where it is too long.
    #[must_use]
    pub fn line(&self) -> Option<[u8; LINE]> {
        let [x, y, z] = self.position.map(|metres| metres * 1e3);
        let [a, b, c, d] = self.angles;
        let numbers = format!(
            "{x:.3} {y:.3} {z:.3} {a:.4} {b:.4} {c:.4} {d:.4} {}\n",
            self.info
        );
        padded(&numbers)
    }

    /// The orientation of the grip.
    #[must_use]
    pub fn orientation(&self) -> UnitQuaternion<f64> {
        let [a, lambda, d, e] = self.angles;
        let about = UnitQuaternion::from_axis_angle;
        about(&Vector3::z_axis(), a)
            * about(&Vector3::y_axis(), -lambda)
            * about(&Vector3::x_axis(), d)
            * about(&Vector3::y_axis(), e)
    }
}

/// The line that commands a force, N; zero where it is not finite. A board that speaks in lines of 63 bytes takes the same with a blank less.
#[must_use]
pub fn force_frame(force: &[f64; 3]) -> [u8; LINE] {
    let is_finite = force.iter().all(|part| part.is_finite());
    let [x, y, z] = force.map(|newtons| {
        let limited = (newtons * 1e3).round().clamp(-LARGEST_MN, LARGEST_MN);
        if is_finite { limited as i32 } else { 0 }
    });
    let mut text = String::with_capacity(LINE);
    let _ = write!(text, "{x} {y} {z} {FORCE} 0 0 0");
    padded(&text).unwrap_or([b' '; LINE]) // six digits each: it fits
}

/// [`force_frame`] in 63 bytes: a blank less.
pub(crate) fn short_force_frame(force: &[f64; 3]) -> [u8; SHORT_LINE] {
    let frame = force_frame(force);
    let mut short = [b'\n'; SHORT_LINE];
    short[..SHORT_LINE - 1].copy_from_slice(&frame[..SHORT_LINE - 1]);
    short
}

/// The force that a line commands, N; `None` where it is none.
#[must_use]
pub fn read_force(line: &[u8]) -> Option<[f64; 3]> {
    let text = line.strip_suffix(b"\n").filter(|_| line.len() == LINE)?;
    let words: Vec<i32> = str::from_utf8(text)
        .ok()?
        .split(' ')
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().ok())
        .collect::<Option<_>>()?;
    let &[x, y, z, FORCE, _, _, _] = &words[..] else {
        return None;
    };
    Some([x, y, z].map(|millinewtons| f64::from(millinewtons) * 1e-3))
}

fn padded(text: &str) -> Option<[u8; LINE]> {
    let mut line = [b' '; LINE];
    line[LINE - 1] = b'\n';
    line.get_mut(..text.len())
        .filter(|_| text.len() < LINE)?
        .copy_from_slice(text.as_bytes());
    Some(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> Vec<u8> {
        format!("{text:<63}\n").into_bytes()
    }

    #[test]
    fn a_line_is_read_to_the_letter() {
        let frame = Frame::parse(&line("12.5 -3.25 0.125 0.1 -0.2 0.3 -0.4 1")).expect("a line");
        let micrometres = frame.position.map(|part| (part * 1e6).round());
        assert_eq!(micrometres, [12_500.0, -3250.0, 125.0]);
        assert_eq!((frame.angles, frame.info), ([0.1, -0.2, 0.3, -0.4], 1));
        assert_eq!(
            frame.line().map(|line| line.to_vec()),
            Some(line(
                "12.500 -3.250 0.125 0.1000 -0.2000 0.3000 -0.4000 1\n"
            ))
        );
        let turned = Frame {
            angles: [0.5, 0.0, 0.0, 0.0],
            ..frame
        }
        .orientation();
        assert!((turned.scaled_axis() - Vector3::z() * 0.5).norm() < 1e-12);
        let turned = Frame {
            angles: [0.0, 0.5, 0.0, 0.0],
            ..frame
        }
        .orientation();
        assert!((turned.scaled_axis() + Vector3::y() * 0.5).norm() < 1e-12);
        assert_eq!(
            force_frame(&[1.0, -0.5, 0.0004])[..],
            line("1000 -500 0 2 0 0 0")[..]
        );
        assert_eq!(
            force_frame(&[f64::NAN, 1.0, 1.0])[..],
            line("0 0 0 2 0 0 0")[..]
        );
        assert_eq!(
            read_force(&force_frame(&[1.0, -0.5, 0.25])),
            Some([1.0, -0.5, 0.25])
        );
    }

    #[test]
    fn what_is_no_line_is_refused() {
        let good = line("12.5 -3.25 0.125 0.1 -0.2 0.3 -0.4 1");
        for at in 0..good.len() {
            assert_eq!(Frame::parse(&good[..at]), None, "cut at {at}");
            let mut long = good.clone();
            long.insert(at, b' ');
            assert_eq!(Frame::parse(&long), None);
        }
        assert!(Frame::parse(&line("1 2 3 0 0 0 0 0")).is_some());
        for text in [
            "1 2 3 0 0 0 0",
            "1 2 3 0 0 0 0 0 0",
            "1 2 3 0 0 0 nan 0",
            "1 2 inf 0 0 0 0 0",
            "1 2 3e2 0 0 0 0 0",
            "1 2 900 0 0 0 0 0",
            "1 2 3 0 0 0 70 0",
        ] {
            assert_eq!(Frame::parse(&line(text)), None, "{text}");
        }
        assert_eq!(read_force(&line("1 2 3 2 0 0")), None);
        assert_eq!(read_force(&line("1 2 3 0 0 0 0")), None, "currents");
    }

    #[test]
    fn lines_are_found_again_after_a_byte_too_few_or_too_many() {
        let frame = |info: i32| Frame {
            position: [0.0125, -0.00325, 0.5],
            angles: [0.1, -0.2, 0.3, -0.4],
            info,
        };
        let line = |info: i32| frame(info).line().expect("short enough").to_vec();
        for at in 0..LINE {
            for is_lost in [false, true] {
                let mut broken = line(1);
                if is_lost {
                    broken.remove(at);
                } else {
                    broken.insert(at, b'7');
                }
                let (mut buffer, mut length) = (Vec::new(), None);
                let mut found = Vec::new();
                let [a, b, c, d, e] = [0, 2, 3, 4, 5].map(line);
                for bytes in [a.clone(), a, broken, b, c, d, e] {
                    buffer.extend(bytes);
                    found.extend(Frame::newest(&mut buffer, &mut length));
                }
                let is_good = |read: &Frame| Frame::parse(&line(read.info)) == Some(*read);
                assert!(found.iter().all(is_good), "at {at}: {found:?}");
                assert_eq!(found.last().map(|read| read.info), Some(5), "at {at}");
            }
        }
    }

    /// As the vendor's program writes it: numbers of a fixed width, an end, blanks, another end.
    fn published(info: i32, bytes: usize) -> Vec<u8> {
        let numbers =
            format!(" -59.276   13.383 -148.002  0.0919 -1.8483  1.0370 -1.9512 {info}\n");
        format!("{numbers:<width$}\n", width = bytes - 1).into_bytes()
    }

    #[test]
    fn two_lines_in_a_row_tell_whether_a_board_has_64_bytes_or_63() {
        for bytes in [LINE, SHORT_LINE] {
            for joined in 0..bytes {
                let mut buffer = published(0, bytes).split_off(joined);
                let mut length = None;
                let mut found = Vec::new();
                for info in 1..6 {
                    buffer.extend(published(info, bytes));
                    found.extend(Frame::newest(&mut buffer, &mut length));
                }
                assert_eq!(length, Some(bytes), "joined at {joined}");
                let infos: Vec<i32> = found.iter().map(|frame| frame.info).collect();
                assert!(infos.ends_with(&[3, 4, 5]), "{infos:?} at {joined}");
                let is_right = |frame: &Frame| (frame.position[0] + 0.059_276).abs() < 1e-12;
                assert!(found.iter().all(is_right), "{found:?}");
            }
        }
        let said = short_force_frame(&[1.0, -0.5, 0.25]);
        assert_eq!(
            said[..],
            format!("{:<62}\n", "1000 -500 250 2 0 0 0").into_bytes()
        );
    }
}
