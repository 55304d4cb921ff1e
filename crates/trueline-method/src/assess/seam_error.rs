//! Predicted error of a later seam point in the tool frame, over the field that the scan visited, with its error budget.
//!
//! A point reported at s is placed at y = R_EC p(s) + p_EC, with p the corrected point of the sheet. Then dy = −\[R_EC p\]× δ + δt + R_EC ∂p/∂h dh.
//! At a speed v along the seam a time offset adds −v dt_d. With the covariance C of all unknowns the variance of a point is the trace of Y C Yᵀ. If
//! the sensor is held, its shape moves the estimate and the point alike, and both are added before squaring \[Schmidt1966\].

use crate::assess::levels::SystematicLevels;
use crate::assess::share::{Share, ShareOf};
use crate::assess::systematic::Systematic;
use crate::input::observations::{Observation, Observations};
use crate::order_statistics::quantile;
use crate::problem::parameters::{Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::problem::placement::placement;
use crate::problem::unknowns::Unknowns;
use crate::solve::seam_chart::with_shape;
use nalgebra::{DMatrix, Vector3};
use trueline_geometry::so3;
use trueline_lsq::Information;
use trueline_model::SheetField;

/// Seam error: one standard deviation, root mean square over the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamError {
    /// Total, m.
    pub rms_m: f64,
    /// Width and depth of the field, m.
    pub field_m: [f64; 2],
    /// Its budget. The squares add up.
    pub budget_m: SeamErrorBudget,
    /// Assumed levels of the systematic errors.
    pub levels: SystematicLevels,
    /// The unit direction in the tool in which it is largest, and its size there, m. `None` if only its size is predicted.
    pub weakest: Option<([f64; 3], f64)>,
}

impl SeamError {
    /// The largest part.
    #[must_use]
    pub fn mostly(&self) -> Largest {
        let budget = self.budget_m;
        let parts = [
            ("the noise of the scan", SCAN_LONGER, budget.noise),
            ("the stamps", "record the devices' own time stamps", budget.stamps),
            (
                "the sensor's own calibration",
                "state its uncertainty in sensor.toml, or change the stand-off more while scanning",
                budget.sensor,
            ),
            (
                "the robot's accuracy",
                "state accuracy_mm under [robot] in sensor.toml if it is better, or calibrate the robot",
                budget.robot,
            ),
            ("the seam's form", "scan a straighter edge, or the same seam back again", budget.seam_form),
            (
                "the detector's bias with the tilt",
                "add a pass with the sensor spun by 180° about its view",
                budget.feature_bias.hypot(budget.detector),
            ),
            ("the quantities held fixed", "estimate them too, or state a smaller uncertainty", budget.held),
            (
                "the radius of the edge",
                "state edge_radius_mm under [seam] in sensor.toml; it is 0 where two fitted lines cross",
                budget.edge_radius,
            ),
            (
                "the robot's lag behind its poses",
                "record measured poses instead of commanded ones",
                budget.pose_lag,
            ),
            ("the external axes", "let the axes swing while scanning", budget.axes),
        ];
        let [first, ..] = parts;
        let (name, remedy, size_m) = parts.into_iter().max_by(|a, b| a.2.total_cmp(&b.2)).unwrap_or(first);
        Largest { name, remedy, share: (size_m / self.rms_m).powi(2) }
    }

    /// Part from the scan alone: noise, stamps and the seam's form, m.
    #[must_use]
    pub fn scan_alone_m(&self) -> f64 {
        let SeamErrorBudget { noise, stamps, seam_form, .. } = self.budget_m;
        noise.hypot(stamps).hypot(seam_form)
    }
}

/// The largest part of a seam error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Largest {
    /// Its name.
    pub name: &'static str,
    /// What makes it smaller.
    pub remedy: &'static str,
    /// Its share of the variance.
    pub share: f64,
}

/// What makes the noise of a scan smaller.
const SCAN_LONGER: &str = "scan longer, with tilts of ±10° or more and more change of stand-off";

/// The parts of a seam error, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamErrorBudget {
    /// Random noise of features, robot and stamps.
    pub noise: f64,
    /// Uncertainty of the time offset from the stamps' common error.
    pub stamps: f64,
    /// The sensor's own calibration.
    pub sensor: f64,
    /// The robot's accuracy.
    pub robot: f64,
    /// The seam's bow, and its form beyond that.
    pub seam_form: f64,
    /// Remaining bias of the features with the tilt, if it is not a block of an adjustment.
    pub feature_bias: f64,
    /// Held quantities that are not known exactly.
    pub held: f64,
    /// The radius of the seam's edge.
    pub edge_radius: f64,
    /// The detector's bias with the tilt, as a block of an adjustment.
    pub detector: f64,
    /// The robot's lag behind its recorded poses.
    pub pose_lag: f64,
    /// Prior uncertainty of external axes.
    pub axes: f64,
}

impl SeamErrorBudget {
    /// From parts with their sources, m².
    fn of(squares_m2: &[(ShareOf, f64)]) -> Self {
        let part = |of: ShareOf| {
            let own = squares_m2.iter().filter(|(what, _)| *what == of).map(|(_, square)| square);
            own.fold(0.0, |sum, square| sum + square).sqrt()
        };
        Self {
            noise: part(ShareOf::Noise),
            stamps: part(ShareOf::Stamps),
            sensor: part(ShareOf::Sensor),
            robot: part(ShareOf::Robot),
            seam_form: part(ShareOf::SeamForm),
            feature_bias: 0.0,
            held: part(ShareOf::Held),
            edge_radius: part(ShareOf::EdgeRadius),
            detector: part(ShareOf::Detector),
            pose_lag: part(ShareOf::PoseLag),
            axes: part(ShareOf::Axes),
        }
    }
}

/// Inputs of a seam error.
pub struct SeamErrorSources<'a> {
    /// Hessian at the solution, with the prior.
    pub hessian: &'a DMatrix<f64>,
    /// Held unknowns.
    pub fixed: &'a [usize],
    /// Covariance from noise.
    pub noise: &'a DMatrix<f64>,
    /// Variance that the stamps add to the time offset, s².
    pub stamps_variance_s2: f64,
    /// Systematic errors.
    pub systematic: &'a Systematic,
    /// Their assumed levels.
    pub levels: SystematicLevels,
    /// Speed along the seam, m/s.
    pub speed_m_s: f64,
}

/// Fraction of the points that may lie beyond each end of the field.
const BEYOND: f64 = 0.02;

/// Predicts it. `None` if the field is empty or a required unknown is unobservable.
#[must_use]
pub fn predict(
    observations: &Observations,
    list: &[Observation],
    at: &Parameters,
    sources: &SeamErrorSources<'_>,
) -> Option<SeamError> {
    let field = Field::of(observations, list, at, sources.speed_m_s)?;
    let unknowns = at.unknowns();
    let mean_square = |columns: &DMatrix<f64>| field.mean_square(columns, None);
    let noise = field.mean_trace(sources.noise);
    let [all, without_bow, alone] = model_shares(&field, sources, &unknowns)?;
    let stamps = field.along.norm_squared() * sources.stamps_variance_s2;
    let held_sensor = field.mean_square(&sources.systematic.sensor, Some(&sources.systematic.sensor_shape));
    let parts = SeamErrorBudget {
        noise: (noise * alone / all).sqrt(),
        stamps: stamps.sqrt(),
        sensor: (noise * ((without_bow - alone) / all).max(0.0) + held_sensor).sqrt(),
        robot: mean_square(&sources.systematic.robot).sqrt(),
        seam_form: (noise * ((all - without_bow) / all).max(0.0)).sqrt(),
        feature_bias: mean_square(&sources.systematic.feature_bias).sqrt(),
        held: mean_square(&sources.systematic.held).sqrt(),
        edge_radius: 0.0,
        detector: 0.0,
        pose_lag: 0.0,
        axes: 0.0,
    };
    let SeamErrorBudget { sensor, robot, seam_form, feature_bias, held, .. } = parts;
    let squares = [parts.noise, parts.stamps, sensor, robot, seam_form, feature_bias, held];
    let rms_m = squares.iter().map(|part| part * part).sum::<f64>().sqrt();
    Some(SeamError { rms_m, field_m: field.size_m, budget_m: parts, levels: sources.levels, weakest: None })
}

/// The same inputs from an adjustment.
pub(crate) struct SharedError<'a> {
    /// Covariance from noise.
    pub noise: &'a DMatrix<f64>,
    /// Variance that the stamps add to the time offset, s².
    pub stamps_variance_s2: f64,
    /// Systematic errors.
    pub shares: &'a [Share],
    /// Their assumed levels.
    pub levels: SystematicLevels,
    /// Speed along the seam, m/s.
    pub speed_m_s: f64,
}

/// The same for an adjustment, whose parts add up. `None` if the field is empty.
#[must_use]
pub(crate) fn of_shares(
    observations: &Observations,
    list: &[Observation],
    at: &Parameters,
    sources: &SharedError<'_>,
) -> Option<SeamError> {
    let field = Field::of(observations, list, at, sources.speed_m_s)?;
    let stamps_m2 = field.along.norm_squared() * sources.stamps_variance_s2;
    let mut squares_m2 =
        vec![(ShareOf::Noise, field.mean_trace(sources.noise)), (ShareOf::Stamps, stamps_m2)];
    let of_share = |share: &Share| (share.of, field.mean_square(&share.columns, share.shape.as_ref()));
    squares_m2.extend(sources.shares.iter().map(of_share));
    Some(SeamError {
        rms_m: squares_m2.iter().map(|(_, square)| square).sum::<f64>().sqrt(),
        field_m: field.size_m,
        budget_m: SeamErrorBudget::of(&squares_m2),
        levels: sources.levels,
        weakest: Some(field.weakest(sources)),
    })
}

/// Mean squared error with everything free, with the bow known, and with bow and shape known, from the model alone.
fn model_shares(field: &Field, sources: &SeamErrorSources<'_>, unknowns: &Unknowns) -> Option<[f64; 3]> {
    let bows = unknowns.bow(0).start..unknowns.bow(unknowns.lines).start;
    let shape = unknowns.shape();
    let share = |known: Vec<usize>| {
        let fixed = [sources.fixed, &known[..]].concat();
        let covariance = Information::new(sources.hessian, &fixed, 0.0)?.covariance();
        Some(field.mean_trace(&covariance))
    };
    Some([share(Vec::new())?, share(bows.clone().collect())?, share(bows.chain(shape).collect())?])
}

/// The rectangle of the sheet that a scan visited, without its outermost points. `None` without points.
#[must_use]
pub fn visited_field(observations: &Observations, list: &[Observation]) -> Option<SheetField> {
    let range = |axis: usize| {
        let values = || list.iter().map(|o| observations.sheet.coordinates(&o.point_in_camera)[axis]);
        Some([quantile(values(), BEYOND)?, quantile(values(), 1.0 - BEYOND)?])
    };
    Some(SheetField { width_m: range(0)?, depth_m: range(1)? })
}

/// Points of the field, with their Jacobians.
struct Field {
    size_m: [f64; 2],
    /// Y of each point (3 × unknowns).
    slopes: Vec<DMatrix<f64>>,
    /// ∂y/∂h of each point (3 × 5), even if the shape is not an unknown.
    by_shape: Vec<DMatrix<f64>>,
    /// ∂y/∂t_d.
    along: Vector3<f64>,
}

impl Field {
    fn of(
        observations: &Observations,
        list: &[Observation],
        at: &Parameters,
        speed_m_s: f64,
    ) -> Option<Self> {
        let field = visited_field(observations, list)?;
        let middle = list.get(list.len() / 2)?;
        let base_from_tool = placement(observations, middle, at)?.base_from_tool.rotation;
        let along = base_from_tool.inverse() * at.lines.first()?.direction() * -speed_m_s;
        let (unknowns, shaped) = (at.unknowns(), with_shape(observations, at.clone()));
        let shape = shaped.shape?;
        let turn = at.tool_from_camera.rotation.to_rotation_matrix().into_inner();
        let (mut slopes, mut by_shape) = (Vec::new(), Vec::new());
        for there in field.grid() {
            let d_shape = turn * observations.sheet.axes() * shape.d_corrected_d_shape(&there)?;
            let point = observations.sheet.point(&shape.corrected(&there).0);
            let mut slope = DMatrix::zeros(3, unknowns.dimension());
            slope.view_mut((0, TIME_OFFSET), (3, 1)).copy_from(&along);
            slope.view_mut((0, ROTATION), (3, 3)).copy_from(&-so3::hat(&(turn * point)));
            slope.view_mut((0, TRANSLATION), (3, 3)).fill_with_identity();
            for (column, k) in unknowns.shape().enumerate() {
                slope.view_mut((0, k), (3, 1)).copy_from(&d_shape.column(column));
            }
            slopes.push(slope);
            by_shape.push(DMatrix::from_column_slice(3, 5, d_shape.as_slice()));
        }
        Some(Self { size_m: field.size_m(), slopes, by_shape, along })
    }

    /// The principal direction of the mean of Y C Yᵀ, and the standard deviation along it.
    fn weakest(&self, sources: &SharedError<'_>) -> ([f64; 3], f64) {
        let mut mean = self.along * self.along.transpose() * sources.stamps_variance_s2;
        for (y, y_shape) in self.slopes.iter().zip(&self.by_shape) {
            let mut there = y * sources.noise * y.transpose();
            for share in sources.shares {
                let moved = y * &share.columns;
                let moved = share.shape.as_ref().map_or(moved.clone(), |shape| &moved + y_shape * shape);
                there += &moved * moved.transpose();
            }
            mean += there.fixed_view::<3, 3>(0, 0) / self.slopes.len() as f64;
        }
        let eigen = mean.symmetric_eigen();
        let largest = eigen.eigenvalues.imax();
        let direction: Vector3<f64> = eigen.eigenvectors.column(largest).into();
        (direction.into(), eigen.eigenvalues[largest].max(0.0).sqrt())
    }

    /// Mean over the points of trace(Y C Yᵀ).
    fn mean_trace(&self, covariance: &DMatrix<f64>) -> f64 {
        let traces = self.slopes.iter().map(|y| (y * covariance * y.transpose()).trace().max(0.0));
        traces.sum::<f64>() / self.slopes.len() as f64
    }

    /// Mean over the points of |Y X + Y_s S|² for columns X of the tangent and S of the shape.
    fn mean_square(&self, columns: &DMatrix<f64>, shapes: Option<&DMatrix<f64>>) -> f64 {
        let squares = self.slopes.iter().zip(&self.by_shape).map(|(y, y_shape)| {
            let moved = y * columns;
            shapes.map_or_else(|| moved.norm_squared(), |s| (&moved + y_shape * s).norm_squared())
        });
        squares.sum::<f64>() / self.slopes.len() as f64
    }
}
