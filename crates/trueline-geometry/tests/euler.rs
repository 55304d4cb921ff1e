//! Tests angles of robots against scipy's `Rotation`, and against each other.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;
use trueline_geometry::euler::{
    EulerSequence, NoSequence, XYZ_FIXED, XYZ_INTRINSIC, ZYX_INTRINSIC, ZYZ_INTRINSIC,
};
use trueline_geometry::so3;

fn quaternion([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// Quaternions are given to nine decimals: an angle of 2e-9 at most.
const PRINTED: f64 = 3e-9;

#[test]
fn angles_of_every_maker_are_the_rotation_of_the_table() {
    let cases = [
        (ZYX_INTRINSIC, [10.0, 20.0, 30.0], [0.951548525, 0.239298338, 0.189307857, 0.038134576]),
        (ZYX_INTRINSIC, [-170.0, 5.0, 179.0], [0.042691904, -0.087448672, 0.995175470, 0.012486590]),
        (XYZ_FIXED, [10.0, 20.0, 30.0], [0.951548525, 0.038134576, 0.189307857, 0.239298338]),
        (XYZ_FIXED, [179.0, 5.0, -170.0], [0.042691904, -0.087448672, 0.995175470, 0.012486590]),
        (XYZ_INTRINSIC, [10.0, 20.0, 30.0], [0.943714364, 0.127679441, 0.144878125, 0.268535823]),
        (XYZ_INTRINSIC, [179.0, 5.0, -170.0], [0.044211592, 0.086690277, 0.995241821, -0.004883519]),
        (ZYZ_INTRINSIC, [10.0, 20.0, 30.0], [0.925416578, 0.030153690, 0.171010072, 0.336824089]),
        (ZYX_INTRINSIC, [40.0, 90.0, 10.0], [0.683012702, -0.183012702, 0.683012702, 0.183012702]),
    ];
    for (sequence, degrees, wxyz) in cases {
        let found = sequence.rotation(degrees.map(f64::to_radians));
        // The comparison is most sensitive at half a turn: 1e-9 of w there is 2e-9 rad.
        assert!(found.angle_to(&quaternion(wxyz)) < PRINTED, "{sequence} {degrees:?}: {found}");
    }
    for (rotation_vector, wxyz) in [
        ([2.0, -2.0, 0.5], [0.134249101, 0.690007353, -0.690007353, 0.172501838]),
        // Longer than π, as some controllers write it.
        ([0.0, 3.0, -1.0], [0.010342319, 0.0, -0.948632559, 0.316210853]),
    ] {
        let found = so3::exp(&Vector3::from(rotation_vector));
        assert!(found.angle_to(&quaternion(wxyz)) < PRINTED, "{rotation_vector:?}: {found}");
    }
}

#[test]
fn the_same_rotation_has_the_angles_of_the_table_in_every_sequence() {
    let rotation = quaternion([0.729383791, 0.150630140, 0.166590790, 0.646186781]);
    let cases = [
        (ZYX_INTRINSIC, [83.713024, 2.771150, 25.819737]),
        (XYZ_FIXED, [25.819737, 2.771150, 83.713024]),
        (XYZ_INTRINSIC, [0.282733, 25.956437, 83.012566]),
        (ZYZ_INTRINSIC, [-0.580786, 25.957870, 83.658513]),
    ];
    for (sequence, degrees) in cases {
        let found = sequence.angles(&rotation).map(f64::to_degrees);
        // Printed to 1e-6°.
        assert!(found.iter().zip(degrees).all(|(a, b)| (a - b).abs() < 6e-7), "{sequence}: {found:?}");
    }
}

#[test]
fn at_the_singularity_the_last_angle_is_zero_and_the_rotation_is_the_same() {
    let upright = ZYX_INTRINSIC.rotation([40.0_f64, 90.0, 10.0].map(f64::to_radians));
    let [a, b, c] = ZYX_INTRINSIC.angles(&upright).map(f64::to_degrees);
    assert!((a - 30.0).abs() < 1e-6 && (b - 90.0).abs() < 1e-6 && c == 0.0, "{a} {b} {c}");
    let straight_down = ZYZ_INTRINSIC.rotation([0.3, 0.0, 0.4]);
    let [first, middle, last] = ZYZ_INTRINSIC.angles(&straight_down);
    assert!((first - 0.7).abs() < 1e-9 && middle.abs() < 1e-9 && last == 0.0);
}

#[test]
fn names_are_read_and_written_and_nothing_is_assumed() {
    for name in ["zyx-intrinsic", "xyz-fixed", "zyz-intrinsic", "yxz-fixed"] {
        assert_eq!(name.parse::<EulerSequence>().unwrap().to_string(), name);
    }
    assert_eq!("xyz-extrinsic".parse::<EulerSequence>(), Ok(XYZ_FIXED));
    for bad in ["zyx", "zyx-", "zzx-fixed", "xyzx-fixed", "abc-fixed", "xyz-moving", ""] {
        assert_eq!(bad.parse::<EulerSequence>(), Err(NoSequence), "{bad}");
    }
}

proptest! {
    /// The round trip through angles reproduces the rotation, in all 24 sequences.
    #[test]
    fn angles_make_the_same_rotation_again(w in -1.0..1.0f64, x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64) {
        prop_assume!(w * w + x * x + y * y + z * z > 1e-2);
        let rotation = quaternion([w, x, y, z]);
        for letters in ["xyz", "yzx", "zxy", "xzy", "zyx", "yxz", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz"] {
            for kind in ["intrinsic", "fixed"] {
                let sequence: EulerSequence = format!("{letters}-{kind}").parse().unwrap();
                let again = sequence.rotation(sequence.angles(&rotation));
                // 1e-16 of the matrix over a level of 1e-9 or more.
                prop_assert!(again.angle_to(&rotation) < 2e-7, "{}: {}", sequence, again.angle_to(&rotation));
            }
        }
    }
}
