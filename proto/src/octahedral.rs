//! Unit vectors in four bytes: the octahedral map, 2 × i16, error below 1e-4 rad.
//!
//! Source: Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors".

/// Largest value of a coordinate of the octahedral map: the square's half side.
const OCTAHEDRAL_SCALE: f32 = i16::MAX as f32;

/// Folds a direction onto a square: |x| + |y| + |z| = 1, lower half turned outwards. `None` if it has no direction.
pub(crate) fn octahedral_from_normal([x, y, z]: [f32; 3]) -> Option<[i16; 2]> {
    let sum = x.abs() + y.abs() + z.abs();
    let usable = sum > 0.0 && sum.is_finite(); // false for NaN
    if !usable {
        return None;
    }
    let (u, v) = (x / sum, y / sum);
    let (u, v) = if z >= 0.0 { (u, v) } else { fold(u, v) };
    Some([u, v].map(|coordinate| (coordinate * OCTAHEDRAL_SCALE).round() as i16))
}

/// The unit normal of a point of the square; any point gives one.
pub(crate) fn normal_from_octahedral(coordinates: [i16; 2]) -> [f32; 3] {
    let [u, v] = coordinates.map(|value| (f32::from(value) / OCTAHEDRAL_SCALE).max(-1.0));
    let z = 1.0 - u.abs() - v.abs();
    let (x, y) = if z >= 0.0 { (u, v) } else { fold(u, v) };
    let norm = (x * x + y * y + z * z).sqrt(); // at least 1/√3
    [x / norm, y / norm, z / norm]
}

fn fold(u: f32, v: f32) -> (f32, f32) {
    (
        (1.0 - v.abs()) * 1.0_f32.copysign(u),
        (1.0 - u.abs()) * 1.0_f32.copysign(v),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_normal_comes_back_within_a_ten_thousandth_of_a_radian() {
        for i in 0..50 {
            for j in 0..100 {
                let (polar, azimuth) = (
                    i as f32 / 49.0 * std::f32::consts::PI,
                    j as f32 / 100.0 * std::f32::consts::TAU,
                );
                let normal = [
                    polar.sin() * azimuth.cos(),
                    polar.sin() * azimuth.sin(),
                    polar.cos(),
                ];
                let back = octahedral_from_normal(normal)
                    .map(normal_from_octahedral)
                    .unwrap_or_default();
                let off: f32 = normal.iter().zip(back).map(|(a, b)| (a - b).powi(2)).sum();
                assert!(off.sqrt() < 1e-4, "{normal:?} became {back:?}");
            }
        }
    }

    #[test]
    fn a_normal_without_direction_is_not_sent() {
        assert_eq!(octahedral_from_normal([0.0; 3]), None);
        assert_eq!(octahedral_from_normal([f32::NAN, 0.0, 1.0]), None);
    }
}
