//! External axes in the forms of robots and programs: a joint, or a frame with its z axis along the axis.

use crate::export::number::{deg, m, mm, unit, wxyz};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, UnitVector3, Vector3};
use trueline_dataset::Carries;
use trueline_dataset::result_file::AxisEntry;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::AxisKind;
use trueline_geometry::euler::ZYX_INTRINSIC;

/// One way to write an axis.
#[derive(Clone, Copy, Debug)]
pub struct AxisForm {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its name in a report.
    pub title: &'static str,
    /// Units and frame, in words.
    pub convention: &'static str,
    write: fn(&PlacedAxis) -> Option<String>,
}

/// Why an axis cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoAxis {
    /// The scan does not determine its place.
    #[error("the scan does not determine the place of the axis")]
    NotShown,
    /// The form is for rotary axes that carry the part.
    #[error("the form is for rotary axes that carry the part")]
    NotOfThisForm,
}

/// All of them.
pub const AXES: [AxisForm; 3] = [
    AxisForm {
        name: "axis-urdf",
        title: "Axis as URDF",
        convention: "a joint in the robot's base (in the tool if it carries the sensor): origin in m, the axis's direction, positive right-handed; put in the limits of yours",
        write: urdf,
    },
    AxisForm {
        name: "axis-kuka",
        title: "Axis as KUKA FRAME",
        convention: "a KRL FRAME in the robot's root whose z axis is the axis, for the root point of an external kinematic: mm; A, B, C in degrees about z, then the new y, then the new x",
        write: kuka,
    },
    AxisForm {
        name: "axis-abb",
        title: "Axis as ABB base frame",
        convention: "the base frame of a mechanical unit (MOC.cfg) whose z axis is the axis: position in m, quaternion u0 = w; in the frame of the robot's base",
        write: abb,
    },
];

/// The form of a name.
#[must_use]
pub fn axis_named(name: &str) -> Option<&'static AxisForm> {
    AXES.iter().find(|form| form.name == name)
}

impl AxisForm {
    /// The text.
    ///
    /// # Errors
    /// An axis at an unknown place, or of a kind that the form does not support.
    pub fn text(&self, entry: &AxisEntry) -> Result<String, NoAxis> {
        let axis = entry.known().ok_or(NoAxis::NotShown)?;
        let placed = PlacedAxis {
            name: entry.name.clone(),
            kind: axis.kind,
            carries: Carries::named(&entry.carries).ok_or(NoAxis::NotShown)?,
            direction: axis.direction,
            point_m: axis.point_m,
        };
        (self.write)(&placed).ok_or(NoAxis::NotOfThisForm)
    }
}

/// An axis at a known place.
struct PlacedAxis {
    name: String,
    kind: AxisKind,
    carries: Carries,
    direction: UnitVector3<f64>,
    point_m: Vector3<f64>,
}

impl PlacedAxis {
    /// Whether it is a table: controllers know its frame.
    fn is_table(&self) -> bool {
        self.kind == AxisKind::Rotary && self.carries == Carries::Part
    }

    /// Axes of a frame in base: z is the direction, and x is as near as possible to that of base, or to y if z is that.
    fn rotation(&self) -> UnitQuaternion<f64> {
        let z = self.direction.into_inner();
        // Nearer to it than 8°, x of base gives no reliable direction perpendicular to z.
        const ALONG: f64 = 0.99;
        let towards = if z.x.abs() < ALONG { Vector3::x() } else { Vector3::y() };
        let x = (towards - z * z.dot(&towards)).normalize();
        let axes = Matrix3::from_columns(&[x, z.cross(&x), z]);
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
    }
}

fn urdf(axis: &PlacedAxis) -> Option<String> {
    let (parent, child) = match axis.carries {
        Carries::Part => ("base", format!("{}_part", axis.name)),
        Carries::Robot => ("world", "base".to_owned()),
        Carries::Sensor => ("flange", format!("{}_sensor", axis.name)),
    };
    let [x, y, z] = [0, 1, 2].map(|k| m(axis.point_m[k]));
    let [dx, dy, dz] = [0, 1, 2].map(|k| unit(axis.direction[k]));
    let (kind, limit) = match axis.kind {
        AxisKind::Rotary => ("continuous", ""),
        AxisKind::Linear => {
            ("prismatic", "\n  <limit lower=\"-1\" upper=\"1\" effort=\"0\" velocity=\"0\"/>")
        }
    };
    Some(format!(
        "<joint name=\"{}\" type=\"{kind}\">\n  <parent link=\"{parent}\"/>\n  <child link=\"{child}\"/>\n  \
         <origin xyz=\"{x} {y} {z}\" rpy=\"0 0 0\"/>\n  <axis xyz=\"{dx} {dy} {dz}\"/>{limit}\n</joint>",
        axis.name
    ))
}

fn kuka(axis: &PlacedAxis) -> Option<String> {
    axis.is_table().then(|| {
        let [x, y, z] = [0, 1, 2].map(|k| mm(axis.point_m[k] * MM_PER_M));
        let [a, b, c] = ZYX_INTRINSIC.angles(&axis.rotation()).map(deg);
        format!("DECL FRAME {}={{X {x},Y {y},Z {z},A {a},B {b},C {c}}}", axis.name)
    })
}

fn abb(axis: &PlacedAxis) -> Option<String> {
    axis.is_table().then(|| {
        let [x, y, z] = [0, 1, 2].map(|k| m(axis.point_m[k]));
        let [u0, u1, u2, u3] = wxyz(&axis.rotation()).map(unit);
        format!(
            "-name \"{}\" -base_frame_pos_x {x} -base_frame_pos_y {y} -base_frame_pos_z {z} -base_frame_orient_u0 {u0} \
             -base_frame_orient_u1 {u1} -base_frame_orient_u2 {u2} -base_frame_orient_u3 {u3}",
            axis.name
        )
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn table() -> AxisEntry {
        AxisEntry {
            name: "table".to_owned(),
            kind: "rotary".to_owned(),
            carries: "part".to_owned(),
            direction: Some([0.0, -0.6, 0.8]),
            point_mm: Some([800.0, -300.0, 150.0]),
            scale: 1.0,
            ..AxisEntry::default()
        }
    }

    #[test]
    fn frames_have_the_axis_as_their_z() {
        let axis = PlacedAxis {
            name: String::new(),
            kind: AxisKind::Rotary,
            carries: Carries::Part,
            direction: UnitVector3::new_normalize(Vector3::new(0.0, -0.6, 0.8)),
            point_m: Vector3::zeros(),
        };
        assert!((axis.rotation() * Vector3::z() - axis.direction.into_inner()).norm() < 1e-15);
        assert!((axis.rotation() * Vector3::x() - Vector3::x()).norm() < 1e-15);
        let along_x = PlacedAxis { direction: Vector3::x_axis(), ..axis };
        assert!((along_x.rotation() * Vector3::z() - Vector3::x()).norm() < 1e-15);
    }

    #[test]
    fn a_table_is_written_in_each_form() {
        let [urdf, kuka, abb] = AXES.map(|form| form.text(&table()).unwrap());
        assert!(
            urdf.contains("type=\"continuous\"")
                && urdf.contains("xyz=\"0.800000000 -0.300000000 0.150000000\""),
            "{urdf}"
        );
        // A turn by 36.87° about x takes z to (0, −0.6, 0.8).
        assert!(kuka.contains("X 800.000000,Y -300.000000") && kuka.contains("C 36.869897646"), "{kuka}");
        assert!(abb.contains("-base_frame_pos_x 0.800000000") && abb.contains("u0 0.948683298051"), "{abb}");
    }

    #[test]
    fn what_is_not_known_or_no_table_is_refused() {
        let hidden = AxisEntry { direction: None, ..table() };
        assert_eq!(AXES[1].text(&hidden), Err(NoAxis::NotShown));
        let track = AxisEntry { kind: "linear".to_owned(), carries: "robot".to_owned(), ..table() };
        assert_eq!(AXES[1].text(&track), Err(NoAxis::NotOfThisForm));
        assert!(AXES[0].text(&track).unwrap().contains("prismatic"));
    }
}
