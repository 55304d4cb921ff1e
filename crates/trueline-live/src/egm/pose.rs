//! Poses as EGM writes them: millimetres, and an attitude in one of two forms.

use super::wire::{Numbers, WireError, Writer, read};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use trueline_geometry::Pose;

/// `EgmPose`, as received.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EgmPose {
    /// `pos`, mm.
    pub position_mm: Option<[f64; 3]>,
    /// `orient`, (w, x, y, z).
    pub quaternion_wxyz: Option<[f64; 4]>,
    /// `euler`: angles about x, y and z, deg; the rotation is Rz·Ry·Rx.
    pub euler_xyz_deg: Option<[f64; 3]>,
}

/// Why an `EgmPose` is not a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PoseError {
    /// No position, or no attitude in either form.
    #[error("position or attitude is missing")]
    Missing,
    /// Not a number, or infinite.
    #[error("a coordinate is not finite")]
    NotFinite,
    /// A quaternion that is no rotation.
    #[error("the quaternion does not have length 1")]
    NotUnit,
}

/// A quaternion may be this far from length 1: RobotWare sends at least six digits, others round more.
const NORM_TOLERANCE: f64 = 1e-3;

/// Two forms of one attitude may be this far apart before it is told, rad: printed digits explain no more.
pub(crate) const ATTITUDES_AGREE_RAD: f64 = 1e-4;

impl EgmPose {
    /// Both forms of the attitude, as RobotWare sends them.
    #[must_use]
    pub fn full(pose: &Pose) -> Self {
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        Self { euler_xyz_deg: Some([roll, pitch, yaw].map(f64::to_degrees)), ..Self::with_quaternion(pose) }
    }

    /// Position and quaternion: unlike Euler angles, these have one meaning for every receiver.
    #[must_use]
    pub fn with_quaternion(pose: &Pose) -> Self {
        let (p, q) = (pose.translation.vector * 1e3, pose.rotation.quaternion());
        Self {
            position_mm: Some([p.x, p.y, p.z]),
            quaternion_wxyz: Some([q.w, q.i, q.j, q.k]),
            euler_xyz_deg: None,
        }
    }

    /// The pose, m. Where both forms of the attitude are there, Euler angles count, as the protocol has it; but
    /// neither may be senseless.
    ///
    /// # Errors
    /// What is missing or senseless.
    pub fn pose(&self) -> Result<Pose, PoseError> {
        let position_mm = finite(self.position_mm.ok_or(PoseError::Missing)?)?;
        let by_quaternion = self.quaternion_wxyz.map(rotation_of).transpose()?;
        let by_euler = self.euler_xyz_deg.map(rotation_of_euler).transpose()?;
        let rotation = by_euler.or(by_quaternion).ok_or(PoseError::Missing)?;
        Ok(Pose::from_parts((Vector3::from(position_mm) * 1e-3).into(), rotation))
    }

    /// Whether there are two attitudes and they differ by more than their digits.
    #[must_use]
    pub(crate) fn contradicts_itself(&self) -> bool {
        let (Some(Ok(q)), Some(Ok(e))) =
            (self.quaternion_wxyz.map(rotation_of), self.euler_xyz_deg.map(rotation_of_euler))
        else {
            return false;
        };
        q.angle_to(&e) > ATTITUDES_AGREE_RAD
    }

    pub(super) fn decode(bytes: &[u8]) -> Result<Self, WireError> {
        let mut pose = Self::default();
        read("EgmPose", bytes, |field, found| {
            match field {
                1 => pose.position_mm = Some(whole("EgmCartesian", found.bytes()?)?),
                2 => pose.quaternion_wxyz = Some(whole("EgmQuaternion", found.bytes()?)?),
                3 => pose.euler_xyz_deg = Some(whole("EgmEuler", found.bytes()?)?),
                _ => {}
            }
            Ok(())
        })?;
        Ok(pose)
    }

    pub(super) fn encode(&self, out: &mut Writer) {
        let mut part = |field, values: Option<&[f64]>| {
            if let Some(values) = values {
                out.message(field, |out| out.doubles(1, values));
            }
        };
        part(1, self.position_mm.as_ref().map(<[f64; 3]>::as_slice));
        part(2, self.quaternion_wxyz.as_ref().map(<[f64; 4]>::as_slice));
        part(3, self.euler_xyz_deg.as_ref().map(<[f64; 3]>::as_slice));
    }
}

fn finite<const N: usize>(values: [f64; N]) -> Result<[f64; N], PoseError> {
    if values.iter().all(|v| v.is_finite()) { Ok(values) } else { Err(PoseError::NotFinite) }
}

fn rotation_of(wxyz: [f64; 4]) -> Result<UnitQuaternion<f64>, PoseError> {
    let [w, x, y, z] = finite(wxyz)?;
    let quaternion = Quaternion::new(w, x, y, z);
    if (quaternion.norm() - 1.0).abs() > NORM_TOLERANCE {
        return Err(PoseError::NotUnit);
    }
    Ok(UnitQuaternion::new_normalize(quaternion))
}

fn rotation_of_euler(xyz_deg: [f64; 3]) -> Result<UnitQuaternion<f64>, PoseError> {
    let [x, y, z] = finite(xyz_deg)?.map(f64::to_radians);
    Ok(UnitQuaternion::from_euler_angles(x, y, z))
}

/// `N` coordinates in fields 1 to `N`, all of them.
fn whole<const N: usize>(message: &'static str, bytes: &[u8]) -> Result<[f64; N], WireError> {
    let mut values = [None; N];
    read(message, bytes, |field, found| {
        if let Some(place) = (field as usize).checked_sub(1).and_then(|k| values.get_mut(k)) {
            *place = Some(found.double()?);
        }
        Ok(())
    })?;
    let mut whole = [0.0; N];
    for (place, value) in whole.iter_mut().zip(values) {
        *place = value.ok_or(WireError::Incomplete { message, field: "coordinates" })?;
    }
    Ok(whole)
}

/// Angles of the joints, deg, of at most six axes.
pub type Axes = Numbers<6>;

pub(super) fn axes(message: &'static str, bytes: &[u8]) -> Result<Axes, WireError> {
    let mut axes = Axes::default();
    read(message, bytes, |field, found| if field == 1 { axes.add(&found) } else { Ok(()) })?;
    Ok(axes)
}
