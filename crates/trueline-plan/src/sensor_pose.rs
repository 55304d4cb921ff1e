//! Pose of the sensor over the seam: stand-off, tilt and place of the seam in the sheet → a pose of the tool.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, UnitVector3, Vector2, Vector3};
use trueline_geometry::{Plane, Pose};

/// Planned place of the seam, and tilt of the sheet there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Point of the seam in base, m.
    pub seam_point: Vector3<f64>,
    /// Its place along the stripe, m from the middle of the view.
    pub stripe_m: f64,
    /// Its distance along the camera's axis, m.
    pub stand_off_m: f64,
    /// Work angle (about the seam), travel angle (about the stripe), spin (about the range direction), rad.
    pub tilt_rad: [f64; 3],
}

/// The sheet's own axes in the camera, and their directions in base without tilt.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorPose {
    /// Columns: along the stripe, normal of the sheet, range.
    camera_from_sheet: Rotation3<f64>,
    base_from_sheet: Rotation3<f64>,
    /// The same, and the inverse of the other, as quaternions.
    base_from_sheet_turn: UnitQuaternion<f64>,
    sheet_from_camera_turn: UnitQuaternion<f64>,
    plane: Plane,
    camera_from_tool: Pose,
}

impl SensorPose {
    fn new(
        camera_from_sheet: Rotation3<f64>,
        base_from_sheet: Rotation3<f64>,
        plane: Plane,
        tool_from_camera: &Pose,
    ) -> Self {
        Self {
            base_from_sheet_turn: UnitQuaternion::from_rotation_matrix(&base_from_sheet),
            sheet_from_camera_turn: UnitQuaternion::from_rotation_matrix(&camera_from_sheet.inverse()),
            camera_from_sheet,
            base_from_sheet,
            plane,
            camera_from_tool: tool_from_camera.inverse(),
        }
    }

    /// The pose of a sheet in the camera that looks along `approach` at a seam of direction `along`; `backward`
    /// turns it by half a turn about the approach.
    ///
    /// `None` if the sheet is square to the camera's axis (then it has no range), or the approach runs along the
    /// seam.
    #[must_use]
    pub fn looking(
        plane: Plane,
        tool_from_camera: &Pose,
        along: &UnitVector3<f64>,
        approach: &UnitVector3<f64>,
        backward: bool,
    ) -> Option<Self> {
        let range = approach.into_inner() - along.into_inner() * along.dot(approach);
        let range = range.try_normalize(1e-3)?;
        let across = if backward { -along.into_inner() } else { along.into_inner() };
        let axes = Matrix3::from_columns(&[across.cross(&range), across, range]);
        let base_from_sheet = Rotation3::from_matrix_unchecked(axes);
        let camera_from_sheet = sheet_axes(&plane)?;
        Some(Self::new(camera_from_sheet, base_from_sheet, plane, tool_from_camera))
    }

    /// The same with the attitude that the tool has in the middle of the scan.
    ///
    /// `None` as for [`SensorPose::looking`].
    #[must_use]
    pub(crate) fn with_attitude(
        plane: Plane,
        tool_from_camera: &Pose,
        base_from_tool: &UnitQuaternion<f64>,
    ) -> Option<Self> {
        let camera_from_sheet = sheet_axes(&plane)?;
        let base_from_camera = (base_from_tool * tool_from_camera.rotation).to_rotation_matrix();
        Some(Self::new(camera_from_sheet, base_from_camera * camera_from_sheet, plane, tool_from_camera))
    }

    /// The same over a seam of another direction, looked at along the same one; `None` where the two are one.
    #[must_use]
    pub(crate) fn turned(&self, from: &UnitVector3<f64>, to: &UnitVector3<f64>) -> Option<Self> {
        let approach = UnitVector3::new_normalize(self.range_in_base());
        let backward = (self.base_from_sheet * Vector3::y()).dot(from) < 0.0;
        Self::looking(self.plane, &self.camera_from_tool.inverse(), to, &approach, backward)
    }

    /// The same sheet on another mounting.
    #[must_use]
    pub(crate) fn carried_by(&self, tool_from_camera: &Pose) -> Self {
        Self { camera_from_tool: tool_from_camera.inverse(), ..self.clone() }
    }

    /// Attitude of the tool without tilt.
    #[must_use]
    pub fn nominal_attitude(&self) -> UnitQuaternion<f64> {
        let base_from_camera = self.base_from_sheet * self.camera_from_sheet.inverse();
        UnitQuaternion::from_rotation_matrix(&base_from_camera) * self.camera_from_tool.rotation
    }

    /// Unit vector from the sensor to the seam in base, without tilt.
    #[must_use]
    pub(crate) fn range_in_base(&self) -> Vector3<f64> {
        self.base_from_sheet * Vector3::z()
    }

    /// Unit vector along the stripe in the camera.
    #[must_use]
    pub fn stripe(&self) -> Vector3<f64> {
        self.camera_from_sheet * Vector3::x()
    }

    /// The point in the camera frame (m) where a station lets the seam appear.
    #[must_use]
    pub fn point_in_camera(&self, station: &Station) -> Vector3<f64> {
        let normal = self.plane.normal();
        let sideways = Vector2::new(normal.x, normal.y);
        // Of the sheet's points at this depth the one nearest to the camera's axis.
        let middle =
            sideways * ((self.plane.offset() - normal.z * station.stand_off_m) / sideways.norm_squared());
        Vector3::new(middle.x, middle.y, station.stand_off_m) + self.stripe() * station.stripe_m
    }

    /// Distance of the tool's origin from the axis of the range through a station's point of the seam, m: its lever when the
    /// sensor is spun there.
    #[must_use]
    pub(crate) fn lever_m(&self, station: &Station) -> f64 {
        let axis = self.camera_from_sheet * Vector3::z();
        let from_axis = self.camera_from_tool.translation.vector - self.point_in_camera(station);
        axis.cross(&from_axis).norm()
    }

    /// Pose of the tool at a station.
    #[must_use]
    pub fn base_from_tool(&self, station: &Station) -> Pose {
        let [work, travel, spin] = station.tilt_rad.map(|angle| (0.5 * angle).sin_cos());
        // Turns about the seam, the stripe and the range, as quaternions: no matrix need be turned into one.
        let about = |(sine, cosine): (f64, f64), k: usize| {
            let mut q = Quaternion::new(cosine, 0.0, 0.0, 0.0);
            q.coords[k] = sine;
            UnitQuaternion::new_unchecked(q)
        };
        let tilt = about(work, 1) * about(travel, 0) * about(spin, 2);
        let rotation = self.base_from_sheet_turn * tilt * self.sheet_from_camera_turn;
        let origin = station.seam_point - rotation * self.point_in_camera(station);
        Pose::from_parts(origin.into(), rotation) * self.camera_from_tool
    }
}

/// Axes of a sheet in the camera: stripe, normal, range; the range points away from the camera.
fn sheet_axes(plane: &Plane) -> Option<Rotation3<f64>> {
    let normal = plane.normal().into_inner();
    let range = (Vector3::z() - normal * normal.z).try_normalize(1e-2)?;
    // Of the two normals the one that points the way of the camera's y, or x.
    let forward = if normal.y.abs() > 1e-9 { normal.y } else { normal.x };
    let across = normal * forward.signum();
    Some(Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[across.cross(&range), across, range])))
}
