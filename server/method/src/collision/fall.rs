//! When a height that falls, faster and faster, becomes negative.

/// The first h >= 0 at which `height + speed h - bend h^2` becomes negative; infinite when it never does, 0 for NaN.
#[inline]
pub(crate) fn time_to_fall(height: f64, speed: f64, bend: f64) -> f64 {
    let above = height >= 0.0; // false for NaN
    if !above {
        return 0.0;
    }
    let discriminant = speed * speed + 4.0 * bend * height;
    let known = |time: f64| if time.is_nan() { 0.0 } else { time };
    if speed < 0.0 {
        // No real root: the path bends away in time.
        return if discriminant < 0.0 {
            f64::INFINITY
        } else {
            known(2.0 * height / (discriminant.sqrt() - speed))
        };
    }
    if bend <= 0.0 && speed >= 0.0 {
        f64::INFINITY
    } else {
        known((speed + discriminant.sqrt()) / (2.0 * bend))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_ends_at_the_first_root() {
        for (height, speed, bend) in [
            (1.0, -2.0, 0.5),
            (1.0, 2.0, 0.5),
            (1.0, 0.0, 0.25),
            (1.0, -3.0, -1.0),
            (1e-9, -1.0, 1e-3),
        ] {
            let h = time_to_fall(height, speed, bend);
            let value: f64 = height + speed * h - bend * h * h;
            assert!(
                value.abs() < 1e-12 && h > 0.0,
                "{height} {speed} {bend}: {h}"
            );
            for k in 1..100 {
                let t = h * f64::from(k) / 100.0;
                assert!(height + speed * t - bend * t * t > 0.0);
            }
        }
    }

    #[test]
    fn tangential_and_departing_paths_never_fall_and_nan_does_at_once() {
        assert_eq!(time_to_fall(1e-6, 0.0, 0.0), f64::INFINITY);
        assert_eq!(time_to_fall(0.0, 1.0, 0.0), f64::INFINITY);
        assert_eq!(time_to_fall(1.0, -0.1, -1.0), f64::INFINITY);
        for (height, speed, bend) in [
            (f64::NAN, 1.0, 0.0),
            (1.0, f64::NAN, 1.0),
            (1.0, f64::NAN, -1.0),
            (1.0, -1.0, f64::NAN),
            (1.0, 1.0, f64::NAN),
        ] {
            assert_eq!(time_to_fall(height, speed, bend), 0.0);
        }
    }
}
