//! The rule for quaternions in files: `w x y z`, unit.

use nalgebra::{Quaternion, UnitQuaternion};

/// How far from 1 the norm of a quaternion in a file may be. Farther off it was not meant as a rotation; nearer ones are
/// digits that were cut, and are normalised.
pub const NORM_TOLERANCE: f64 = 1e-3;

/// A rotation from `w x y z`, or a sentence on why it is none.
pub fn unit_quaternion(wxyz: [f64; 4]) -> Result<UnitQuaternion<f64>, String> {
    let [w, x, y, z] = wxyz;
    let quaternion = Quaternion::new(w, x, y, z);
    let norm = quaternion.norm();
    let near_one = (norm - 1.0).abs() <= NORM_TOLERANCE; // false for NaN
    if !near_one {
        return Err(format!(
            "the quaternion has norm {norm}, but must have 1 within {NORM_TOLERANCE}; write w x y z of a unit quaternion"
        ));
    }
    Ok(UnitQuaternion::new_normalize(quaternion))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cut_digits_are_normalised_and_worse_is_refused() {
        let rotation = unit_quaternion([0.8, 0.6001, 0.0, 0.0]).unwrap();
        assert!((rotation.norm() - 1.0).abs() < 1e-15);
        assert!(unit_quaternion([1.0 + 0.99e-3, 0.0, 0.0, 0.0]).is_ok());
        for bad in [
            [1.0 + 1.01e-3, 0.0, 0.0, 0.0],
            [0.0; 4],
            [f64::NAN, 0.0, 0.0, 0.0],
            [f64::INFINITY, 0.0, 0.0, 0.0],
        ] {
            assert!(
                unit_quaternion(bad).unwrap_err().contains("norm"),
                "{bad:?}"
            );
        }
    }
}
