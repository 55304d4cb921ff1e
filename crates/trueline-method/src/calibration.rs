//! The result: findings and verdict.
//!
//! An unobservable quantity cannot be read as a number by accident. [`Calibration::time_offset`] and similar methods return the estimate with its
//! uncertainty, or an error with the motion that makes the quantity observable.

use crate::assess::file_frame::HandEyeOfFile;
use crate::assess::observability::{Group, Unobservable};
use crate::findings::Findings;
use crate::input::stops::Stops;
use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION, line_index};
use crate::verdict::{self, Axis, Reason, Status, Verdict, Warning};
use nalgebra::{DMatrix, SMatrix, UnitQuaternion};
use std::ops::Range;
use trueline_dataset::result_file::SensorFileEntry;
use trueline_geometry::{Line, Pose};

/// A finished calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The findings.
    pub findings: Findings,
    /// Whether it can be accepted.
    pub verdict: Verdict,
}

/// The time offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeOffset {
    /// Image stamp minus exposure time, s.
    pub value_s: f64,
    /// Standard deviation, s. `None` if it was held.
    pub sigma_s: Option<f64>,
}

/// A component of the hand-eye translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Translation {
    /// Along the tool's axis, m.
    pub value_m: f64,
    /// Standard deviation, m. `None` if it was held.
    pub sigma_m: Option<f64>,
}

/// The hand-eye transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandEye {
    /// Maps camera coordinates to tool coordinates, m.
    pub tool_from_camera: Pose,
    /// Covariance of (δ, δt): left rotation about the tool's axes, rad, then translation, m. Zero if it was held.
    pub covariance: SMatrix<f64, 6, 6>,
}

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineEstimate {
    /// In base, m.
    pub line_in_base: Line,
    /// Covariance of its two turns, rad, and two offsets, m, about its cross axes.
    pub covariance: SMatrix<f64, 4, 4>,
}

impl Calibration {
    /// The same with a sensor that was held because its file was written from this scan.
    #[must_use]
    pub(crate) fn with_sensor_of_its_own_scan(mut self) -> Self {
        self.findings.sensor_of_its_own_scan = true;
        Self { verdict: verdict::of(&self.findings), findings: self.findings }
    }

    /// The same for a robot that stood at each reading.
    #[must_use]
    pub(crate) fn at_stops(mut self, stops: Stops) -> Self {
        self.findings.stops = Some(stops);
        Self { verdict: verdict::of(&self.findings), findings: self.findings }
    }

    /// Whether it can be accepted.
    #[must_use]
    pub fn status(&self) -> Status {
        self.verdict.status()
    }

    /// Reasons against acceptance. Empty if it is accepted.
    #[must_use]
    pub fn reasons(&self) -> &[Reason] {
        &self.verdict.reasons
    }

    /// Warnings.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.verdict.warnings
    }

    /// The time offset of image stamps as recorded.
    ///
    /// # Errors
    /// [`Unobservable`] if the scan does not determine it.
    pub fn time_offset(&self) -> Result<TimeOffset, Unobservable> {
        self.known(Group::TimeOffset, TIME_OFFSET..ROTATION)?;
        let value_s = self.recorded_time_offset_s();
        Ok(TimeOffset { value_s, sigma_s: self.sigma(TIME_OFFSET) })
    }

    /// The hand-eye transform with its covariance, for the sensor file as stated, or after [`Calibration::for_corrected_sensor`] for the corrected
    /// one.
    ///
    /// # Errors
    /// [`Unobservable`] if part of it is unobservable: of rotation and translation the one that lists directions.
    pub fn tool_from_camera(&self) -> Result<HandEye, Unobservable> {
        let rotation = self.known(Group::Rotation, ROTATION..TRANSLATION).err();
        let translation = self.known(Group::Translation, TRANSLATION..LINES).err();
        let missing = rotation.into_iter().chain(translation);
        if let Some(missing) = missing.min_by_key(|missing| missing.directions.is_empty()) {
            return Err(missing);
        }
        let covariance = SMatrix::from_fn(|i, j| self.covariance(ROTATION + i, ROTATION + j).unwrap_or(0.0));
        Ok(HandEye { tool_from_camera: *self.file_tool_from_camera(), covariance })
    }

    /// The hand-eye rotation. Single components of it are no quaternion.
    ///
    /// # Errors
    /// [`Unobservable`] if part of it is unobservable.
    pub fn rotation(&self) -> Result<UnitQuaternion<f64>, Unobservable> {
        self.known(Group::Rotation, ROTATION..TRANSLATION)?;
        Ok(self.file_tool_from_camera().rotation)
    }

    /// One component of the hand-eye translation.
    ///
    /// # Errors
    /// [`Unobservable`] if the scan does not determine it.
    pub fn translation(&self, axis: Axis) -> Result<Translation, Unobservable> {
        let component = TRANSLATION + axis as usize;
        self.known(Group::Translation, component..component + 1)?;
        let value_m = self.file_tool_from_camera().translation.vector[axis as usize];
        Ok(Translation { value_m, sigma_m: self.sigma(component) })
    }

    /// A line, by its number among the features.
    ///
    /// # Errors
    /// [`Unobservable`] if part of it is unobservable, or the scan has no such line.
    pub fn line(&self, number: usize) -> Result<LineEstimate, Unobservable> {
        let missing = || self.missing(Group::Line(number));
        let line_in_base = *self.best_fit().lines.get(number).ok_or_else(missing)?;
        let first = line_index(number);
        self.known(Group::Line(number), first..line_index(number + 1))?;
        let covariance = SMatrix::from_fn(|i, j| self.covariance(first + i, first + j).unwrap_or(0.0));
        Ok(LineEstimate { line_in_base, covariance })
    }

    /// The same with the hand-eye transform of the corrected sensor, which was written as `file`. `None` if nothing is corrected.
    #[must_use]
    pub fn for_corrected_sensor(self, file: SensorFileEntry) -> Option<Self> {
        let unknowns = self.findings.unknowns.for_corrected_sensor(file)?;
        let findings = Findings { unknowns, ..self.findings };
        Some(Self { findings, ..self })
    }

    /// The value of [`Calibration::tool_from_camera`], even if it is unobservable. For drawing.
    #[must_use]
    pub fn file_tool_from_camera(&self) -> &Pose {
        &self.findings.unknowns.of_file.tool_from_camera
    }

    /// Another answer to the same scan, for the same sensor file, with its covariance: a rival, or an intermediate result.
    #[must_use]
    pub fn for_file(&self, other: &Parameters, covariance: &DMatrix<f64>) -> HandEyeOfFile {
        let frame = self.findings.unknowns.file_frame_by(other);
        HandEyeOfFile::of(frame, other, covariance, covariance)
    }

    /// The transform of another answer to the same scan, for the same sensor file.
    #[must_use]
    pub fn file_pose(&self, other: &Parameters) -> Pose {
        other.tool_from_camera * self.findings.unknowns.file_frame_by(other).camera_from_file
    }

    /// The unknowns at the end of the solve. Unobservable ones are arbitrary numbers, and the hand-eye transform belongs to the sensor with its
    /// shape. For drawing and diagnosis only. The other methods give the results.
    #[must_use]
    pub fn best_fit(&self) -> &Parameters {
        &self.findings.unknowns.parameters
    }

    /// The time offset of image stamps as recorded, s: true exposure = stamp − this. [`Calibration::is_known`] states whether it is determined.
    #[must_use]
    pub fn recorded_time_offset_s(&self) -> f64 {
        self.in_recorded_stamps_s(self.best_fit().time_offset_s)
    }

    /// A time offset of the estimate, converted to image stamps as recorded, s.
    #[must_use]
    pub fn in_recorded_stamps_s(&self, time_offset_s: f64) -> f64 {
        time_offset_s + self.findings.streams.images_ahead_s
    }

    /// The covariance at [`Calibration::best_fit`], of all components of the tangent in SI units, including unobservable ones.
    #[must_use]
    pub fn best_fit_covariance(&self) -> &DMatrix<f64> {
        &self.findings.unknowns.covariance
    }

    /// The random part of [`Calibration::best_fit_covariance`].
    #[must_use]
    pub fn best_fit_noise_covariance(&self) -> &DMatrix<f64> {
        &self.findings.unknowns.noise_covariance
    }

    /// Standard deviation of a component of the tangent, SI. `None` if it was held or is unobservable.
    #[must_use]
    pub fn sigma(&self, component: usize) -> Option<f64> {
        self.findings.unknowns.sigma(component)
    }

    /// Its random part: noise of features, robot and stamps.
    #[must_use]
    pub fn noise_sigma(&self, component: usize) -> Option<f64> {
        self.findings.unknowns.noise_sigma(component)
    }

    /// Covariance of two components of the tangent, SI. `None` if one was held or is unobservable.
    #[must_use]
    pub fn covariance(&self, row: usize, column: usize) -> Option<f64> {
        self.findings.unknowns.covariance(row, column)
    }

    /// Whether a component is determined: it was held, or it is observable.
    #[must_use]
    pub fn is_known(&self, component: usize) -> bool {
        self.findings.unknowns.is_known(component)
    }

    fn known(&self, group: Group, mut components: Range<usize>) -> Result<(), Unobservable> {
        if components.all(|k| self.is_known(k)) { Ok(()) } else { Err(self.missing(group)) }
    }

    /// The unobservable directions of a group. None if it is known only together with others.
    fn missing(&self, group: Group) -> Unobservable {
        let named = self.findings.unknowns.observability.unobservable.iter().find(|u| u.group == group);
        named.cloned().unwrap_or(Unobservable { group, directions: Vec::new() })
    }
}
