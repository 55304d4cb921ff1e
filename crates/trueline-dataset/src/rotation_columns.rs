//! The forms in which a table can hold rotations, found by the names of its columns.
//!
//! | columns | form |
//! |---|---|
//! | `qw qx qy qz`; `q1 q2 q3 q4` | quaternion by name; ABB's, whose first is w |
//! | `a_deg b_deg c_deg` | KUKA: z, y', x'' |
//! | `w_deg p_deg r_deg`; `roll_deg pitch_deg yaw_deg` | FANUC; URDF: fixed x, y, z |
//! | `rx_rad ry_rad rz_rad` | rotation vector, as UR writes it |
//! | `r11` … `r33` | matrix, row by row |
//! | `euler_zyx_intrinsic_1_deg`, `_2_deg`, `_3_deg` | any sequence, by its name |
//!
//! `rx_deg` is not among them: it means two different rotations on two robots.

use crate::error::{Error, Problem};
use crate::table::{self, ColumnSpec, Table, required};
use crate::unit::Quantity;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use trueline_geometry::euler::{XYZ_FIXED, ZYX_INTRINSIC};
use trueline_geometry::{EulerSequence, so3};

/// A quaternion may be this far from length 1: four printed digits are.
const NORM_TOLERANCE: f64 = 1e-3;

/// Converts (w, x, y, z) to a rotation, or returns its length.
///
/// # Errors
/// A length that printing cannot explain.
pub fn unit_quaternion(wxyz: [f64; 4]) -> Result<UnitQuaternion<f64>, Problem> {
    let q = Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    let norm = q.norm();
    if (norm - 1.0).abs() > NORM_TOLERANCE || !norm.is_finite() {
        return Err(Problem::QuaternionNotUnit { norm });
    }
    Ok(UnitQuaternion::new_normalize(q))
}

/// Meaning of a rotation's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RotationForm {
    /// w, x, y, z.
    Quaternion,
    /// Three angles.
    Euler(EulerSequence),
    /// Axis times angle.
    RotationVector,
    /// Nine elements, row by row.
    Matrix,
}

/// The columns of a table that hold its rotations.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RotationColumns {
    /// Their meaning.
    pub form: RotationForm,
    /// Their names without unit.
    pub names: Vec<String>,
}

const PLAIN_NAMES: [(RotationForm, &[&str]); 7] = [
    (RotationForm::Quaternion, &["qw", "qx", "qy", "qz"]),
    (RotationForm::Quaternion, &["q1", "q2", "q3", "q4"]),
    (RotationForm::Euler(ZYX_INTRINSIC), &["a", "b", "c"]),
    (RotationForm::Euler(XYZ_FIXED), &["w", "p", "r"]),
    (RotationForm::Euler(XYZ_FIXED), &["roll", "pitch", "yaw"]),
    (RotationForm::RotationVector, &["rx", "ry", "rz"]),
    (RotationForm::Matrix, &["r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"]),
];

/// Elements of a printed matrix may differ from those of a rotation by this: four printed digits do.
const MATRIX_TOLERANCE: f64 = 1e-3;

impl RotationForm {
    fn quantity(self) -> Quantity {
        match self {
            Self::Euler(_) => Quantity::Angle,
            Self::RotationVector => Quantity::RotationVector,
            Self::Quaternion | Self::Matrix => Quantity::Plain,
        }
    }
}

impl RotationColumns {
    /// Finds the one form that a header has. If no form is complete, the most complete one, to name the missing columns.
    ///
    /// # Errors
    /// No rotation, two of them, or angles with a meaning that depends on the robot.
    pub(crate) fn find(header: &[String]) -> Result<Self, Problem> {
        let mut forms: Vec<Self> = PLAIN_NAMES
            .iter()
            .map(|(form, names)| Self { form: *form, names: names.iter().map(|&n| n.to_owned()).collect() })
            .collect();
        forms.extend(header.iter().find_map(|name| Self::of_named_sequence(name)));
        let present = |columns: &Self| columns.names.iter().filter(|n| columns.is_there(n, header)).count();
        let complete: Vec<&Self> = forms.iter().filter(|f| present(f) == f.names.len()).collect();
        match complete[..] {
            [one] => Ok(one.clone()),
            [first, second, ..] => {
                Err(Problem::TwoRotations { first: first.names.join(", "), second: second.names.join(", ") })
            }
            [] => {
                let most = forms.iter().rev().max_by_key(|form| present(form)).filter(|f| present(f) > 0);
                most.cloned().ok_or_else(|| match header.iter().any(|name| name == "rx_deg") {
                    true => Problem::AmbiguousAngles,
                    false => Problem::NoRotation { found: header.join(", ") },
                })
            }
        }
    }

    /// Whether a name is that of a column of any form.
    #[must_use]
    pub(crate) fn is_one(name: &str) -> bool {
        let among = |(form, names): &(RotationForm, &[&str])| {
            names.iter().any(|n| table::is_one_of(name, &[required(n, form.quantity())]))
        };
        PLAIN_NAMES.iter().any(among) || Self::of_named_sequence(name).is_some()
    }

    /// The columns of `euler_zyx_intrinsic_2_deg`.
    fn of_named_sequence(name: &str) -> Option<Self> {
        let name = name.strip_prefix("euler_")?;
        let sequence = Quantity::Angle.suffixes().iter().find_map(|(unit, _)| name.strip_suffix(unit))?;
        let (sequence, _number) = sequence.rsplit_once('_')?;
        let form = RotationForm::Euler(sequence.parse().ok()?);
        Some(Self { form, names: (1..=3).map(|k| format!("euler_{sequence}_{k}")).collect() })
    }

    /// Whether a header has the column, even without its unit: that is an error of its own.
    fn is_there(&self, name: &str, header: &[String]) -> bool {
        let suffixes = self.form.quantity().suffixes();
        header
            .iter()
            .filter_map(|found| found.strip_prefix(name))
            .any(|rest| rest.is_empty() || suffixes.iter().any(|(s, _)| *s == rest))
    }

    /// Columns that a table needs for them.
    #[must_use]
    pub(crate) fn specs(&self) -> Vec<ColumnSpec<'_>> {
        self.names.iter().map(|name| required(name, self.form.quantity())).collect()
    }

    /// The rotation of the current row; its columns begin at `first`.
    ///
    /// # Errors
    /// Numbers that are missing, not finite, or no rotation.
    pub(crate) fn read(&self, table: &Table<'_>, first: usize) -> Result<UnitQuaternion<f64>, Error> {
        let at = |problem| table.error_in(first, problem);
        match self.form {
            RotationForm::Quaternion => unit_quaternion(numbers(table, first)?).map_err(at),
            RotationForm::Euler(sequence) => Ok(sequence.rotation(numbers(table, first)?)),
            RotationForm::RotationVector => Ok(so3::exp(&Vector3::from(numbers::<3>(table, first)?))),
            RotationForm::Matrix => {
                rotation_of(&Matrix3::from_row_slice(&numbers::<9>(table, first)?)).map_err(at)
            }
        }
    }
}

fn numbers<const N: usize>(table: &Table<'_>, first: usize) -> Result<[f64; N], Error> {
    let mut numbers = [0.0; N];
    for (k, number) in numbers.iter_mut().enumerate() {
        *number = table.required_number(first + k)?;
    }
    Ok(numbers)
}

/// The rotation that printed elements were, or how far they are from any.
fn rotation_of(matrix: &Matrix3<f64>) -> Result<UnitQuaternion<f64>, Problem> {
    let svd = matrix.svd(true, true);
    let nearest = svd.u.zip(svd.v_t).map(|(u, v_t)| u * v_t).unwrap_or_else(Matrix3::zeros);
    let error = (matrix - nearest).amax();
    // A mirrored matrix is as orthogonal as any.
    if error > MATRIX_TOLERANCE || nearest.determinant() < 0.0 {
        return Err(Problem::NoRotationMatrix {
            error: if nearest.determinant() < 0.0 { 2.0 } else { error },
        });
    }
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nearest)))
}
