//! Mistakes in the robot's poses: axes that are swapped, reversed or in another unit, and Euler angles of another order or
//! sign.

use crate::diagnose::mistake::{Mistake, with_positions, with_rotations};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;
use trueline_dataset::{Recording, RobotSample};
use trueline_geometry::so3;

/// Mistakes in the poses, the most frequent first.
pub(crate) const POSE_MISTAKES: &[Mistake] = &[
    Mistake {
        name: "Euler angles ZYX read as XYZ",
        says: "the attitude was made from Euler angles in the wrong order: they are about z, then the new y, then the new x \
               (ZYX, as KUKA's A, B, C), and were composed as XYZ",
        mend: |r| Some(with_rotations(r, |p| zyx(xyz_angles(&p.base_from_tool.rotation)))),
    },
    Mistake {
        name: "Euler angles XYZ read as ZYX",
        says: "the attitude was made from Euler angles in the wrong order: they are about x, then the new y, then the new z \
               (XYZ), and were composed as ZYX",
        mend: |r| Some(with_rotations(r, |p| xyz(zyx_angles(&p.base_from_tool.rotation)))),
    },
    Mistake {
        name: "Euler angles first and last swapped",
        says: "the attitude was made from Euler angles whose first and last were swapped: KUKA's A is about z, B about y, C \
               about x",
        mend: |r| {
            Some(with_rotations(r, |p| {
                let [x, y, z] = zyx_angles(&p.base_from_tool.rotation);
                zyx([z, y, x])
            }))
        },
    },
    Mistake {
        name: "rotation vector read as Euler angles",
        says: "the attitude was made from a rotation vector (UR's rx, ry, rz) that was read as Euler angles \
            about x, y and z",
        mend: |r| Some(with_rotations(r, |p| so3::exp(&zyx_angles(&p.base_from_tool.rotation).into()))),
    },
    Mistake {
        name: "rotation vector read as Euler angles, beyond 90°",
        says: "the attitude was made from a rotation vector (UR's rx, ry, rz) that was read as Euler angles \
            about x, y and z",
        mend: |r| {
            Some(with_rotations(r, |p| {
                so3::exp(&beyond_right_angle(zyx_angles(&p.base_from_tool.rotation)).into())
            }))
        },
    },
    Mistake {
        name: "Euler angles read as a rotation vector",
        says: "the attitude was made from Euler angles about x, y and z that were read as a rotation vector",
        mend: |r| Some(with_rotations(r, |p| zyx(so3::log(&p.base_from_tool.rotation).into()))),
    },
    Mistake {
        name: "Euler angle about x reversed",
        says: "the attitude was made from Euler angles whose angle about x has the wrong sign",
        mend: |r| Some(with_angle_reversed(r, 0)),
    },
    Mistake {
        name: "Euler angle about y reversed",
        says: "the attitude was made from Euler angles whose angle about y has the wrong sign",
        mend: |r| Some(with_angle_reversed(r, 1)),
    },
    Mistake {
        name: "Euler angle about z reversed",
        says: "the attitude was made from Euler angles whose angle about z has the wrong sign",
        mend: |r| Some(with_angle_reversed(r, 2)),
    },
    Mistake {
        name: "robot x and y swapped",
        says: "the robot's positions have x and y swapped: check the columns' names",
        mend: |r| Some(with_swapped(r, 0, 1)),
    },
    Mistake {
        name: "robot y and z swapped",
        says: "the robot's positions have y and z swapped: check the columns' names",
        mend: |r| Some(with_swapped(r, 1, 2)),
    },
    Mistake {
        name: "robot x and z swapped",
        says: "the robot's positions have x and z swapped: check the columns' names",
        mend: |r| Some(with_swapped(r, 0, 2)),
    },
    Mistake {
        name: "robot x reversed",
        says: "the robot's x has the wrong sign",
        mend: |r| Some(with_axis_scaled(r, 0, -1.0)),
    },
    Mistake {
        name: "robot y reversed",
        says: "the robot's y has the wrong sign",
        mend: |r| Some(with_axis_scaled(r, 1, -1.0)),
    },
    Mistake {
        name: "robot z reversed",
        says: "the robot's z has the wrong sign",
        mend: |r| Some(with_axis_scaled(r, 2, -1.0)),
    },
    Mistake {
        name: "robot x in another unit",
        says: "the robot's x is 1000 times too small or too large: it has another unit than y and z",
        mend: |r| with_unit_of_others(r, 0),
    },
    Mistake {
        name: "robot y in another unit",
        says: "the robot's y is 1000 times too small or too large: it has another unit than x and z",
        mend: |r| with_unit_of_others(r, 1),
    },
    Mistake {
        name: "robot z in another unit",
        says: "the robot's z is 1000 times too small or too large: it has another unit than x and y",
        mend: |r| with_unit_of_others(r, 2),
    },
];

/// Rz Ry Rx of angles about x, y, z.
fn zyx([x, y, z]: [f64; 3]) -> UnitQuaternion<f64> {
    about(2, z) * about(1, y) * about(0, x)
}

/// Rx Ry Rz of angles about x, y, z.
fn xyz([x, y, z]: [f64; 3]) -> UnitQuaternion<f64> {
    about(0, x) * about(1, y) * about(2, z)
}

fn about(axis: usize, angle_rad: f64) -> UnitQuaternion<f64> {
    so3::exp(&Vector3::ith(axis, angle_rad))
}

/// The angles about x, y, z from which [`zyx`] makes a rotation.
fn zyx_angles(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    rotation.euler_angles().into()
}

/// The angles about x, y, z from which [`xyz`] makes a rotation: its inverse is Rz(−z) Ry(−y) Rx(−x).
fn xyz_angles(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    zyx_angles(&rotation.inverse()).map(|angle| -angle)
}

/// The other angles from which [`zyx`] makes the same rotation, with y beyond a right angle.
fn beyond_right_angle([x, y, z]: [f64; 3]) -> [f64; 3] {
    let turned = |angle: f64| if angle > 0.0 { angle - PI } else { angle + PI };
    [turned(x), if y > 0.0 { PI - y } else { -PI - y }, turned(z)]
}

fn with_angle_reversed(recording: &Recording, axis: usize) -> Recording {
    with_rotations(recording, |sample| {
        let mut angles = zyx_angles(&sample.base_from_tool.rotation);
        angles[axis] = -angles[axis];
        zyx(angles)
    })
}

fn with_swapped(recording: &Recording, one: usize, other: usize) -> Recording {
    with_positions(recording, |sample| {
        let mut position = sample.base_from_tool.translation.vector;
        position.swap_rows(one, other);
        position
    })
}

/// The recording with one axis of the positions scaled.
pub(super) fn with_axis_scaled(recording: &Recording, axis: usize, factor: f64) -> Recording {
    with_positions(recording, |sample| {
        let mut position = sample.base_from_tool.translation.vector;
        position[axis] *= factor;
        position
    })
}

/// Ratio of an axis's range to that of the others, or its inverse, above which the axis has another unit.
const OTHER_UNIT: f64 = 30.0;

/// One axis converted to the unit of the others, millimetres or metres. `None` if it has their unit.
fn with_unit_of_others(recording: &Recording, axis: usize) -> Option<Recording> {
    let largest = |axis: usize| {
        let of = |sample: &RobotSample| sample.base_from_tool.translation.vector[axis].abs();
        recording.robot.iter().map(of).fold(0.0, f64::max)
    };
    let others = (0..3).filter(|other| *other != axis).map(largest).fold(0.0, f64::max);
    let own = largest(axis);
    if own > 0.0 && own * OTHER_UNIT < others {
        return Some(with_axis_scaled(recording, axis, 1e3));
    }
    (own > OTHER_UNIT * others).then(|| with_axis_scaled(recording, axis, 1e-3))
}
