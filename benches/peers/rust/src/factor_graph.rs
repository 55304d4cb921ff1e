//! The same residual for tiny-solver, a factor-graph library with dual numbers.

use std::collections::HashMap;
use tiny_nalgebra::{self as na, DVector, Matrix3, RealField, Vector3};
use tiny_solver::Optimizer;
use trueline_method::Parameters;
use trueline_method::problem::line_problem::LineProblem;
use trueline_geometry::Segment;

struct Sighting {
    elapsed_at_start: f64,
    start_offset_s: f64,
    segment: Segment,
    point: [f64; 3],
    whitener: [f64; 3],
    rotation: [f64; 4],
    translation: [f64; 3],
    anchor: [f64; 3],
    axes: [[f64; 3]; 3],
    sheet: [[f64; 3]; 3],
}

fn constant<T: RealField>(v: [f64; 3]) -> Vector3<T> {
    Vector3::new(na::convert(v[0]), na::convert(v[1]), na::convert(v[2]))
}

/// Exp as a matrix, by its series: turns are small here, and dual numbers have no square root of zero.
fn exp<T: RealField>(w: &Vector3<T>) -> Matrix3<T> {
    let c = |x: f64| na::convert::<f64, T>(x);
    let x = w.norm_squared();
    let a = c(1.0) - x.clone() * (c(1.0 / 6.0) - x.clone() * (c(1.0 / 120.0) - x.clone() * c(1.0 / 5040.0)));
    let b =
        c(0.5) - x.clone() * (c(1.0 / 24.0) - x.clone() * (c(1.0 / 720.0) - x.clone() * c(1.0 / 40320.0)));
    let hat = w.cross_matrix();
    Matrix3::identity() + hat.clone() * a + hat.clone() * hat * b
}

fn matrix<T: RealField>(q: [f64; 4]) -> Matrix3<T> {
    let q = na::UnitQuaternion::from_quaternion(na::Quaternion::new(q[0], q[1], q[2], q[3]));
    q.to_rotation_matrix().into_inner().map(na::convert)
}

impl<T: RealField> tiny_solver::factors::Factor<T> for Sighting {
    fn residual_func(&self, params: &[DVector<T>]) -> DVector<T> {
        let three = |k: usize, first: usize| {
            Vector3::new(params[k][first].clone(), params[k][first + 1].clone(), params[k][first + 2].clone())
        };
        let s = &self.segment;
        let elapsed =
            na::convert::<f64, T>(self.elapsed_at_start + self.start_offset_s) - params[0][0].clone();
        let q = s.base_from_tool.rotation;
        let base_from_tool =
            matrix::<T>([q.w, q.i, q.j, q.k]) * exp(&(constant::<T>(s.body_rate.into()) * elapsed.clone()));
        let tool_from_camera = exp(&three(1, 0)) * matrix::<T>(self.rotation);
        let translation = constant::<T>(self.translation) + three(2, 0);
        let tool = constant::<T>(s.base_from_tool.translation.vector.into())
            + constant::<T>(s.velocity.into()) * elapsed;
        let point = &base_from_tool * (&tool_from_camera * constant::<T>(self.point) + translation) + tool;
        let (u1, u2, u3) =
            (constant::<T>(self.axes[0]), constant::<T>(self.axes[1]), constant::<T>(self.axes[2]));
        let line = &params[3];
        let turn = &u2 * line[0].clone() + &u3 * line[1].clone();
        let direction = exp(&turn) * u1;
        let anchor = constant::<T>(self.anchor) + &u2 * line[2].clone() + &u3 * line[3].clone();
        let base_from_camera = base_from_tool * tool_from_camera;
        let axis = |k: usize| &base_from_camera * constant::<T>(self.sheet[k]);
        let (x, y, n) = (axis(0), axis(1), axis(2));
        let from_anchor = point - anchor;
        let along = n.dot(&from_anchor) / n.dot(&direction);
        let off = from_anchor - direction * along;
        let (r1, r2) = (x.dot(&off), y.dot(&off));
        let w = |k: usize| na::convert::<f64, T>(self.whitener[k]);
        DVector::from_vec(vec![w(0) * r1.clone(), w(1) * r1 + w(2) * r2])
    }
}

/// Solves from the start; time offset, rotation vector and translation relative to it.
///
/// A sighting keeps the segment it is in at the solution: this library would have to search anew for each evaluation.
pub fn solve(problem: &LineProblem<'_>, start: &Parameters, at: &Parameters) -> Option<([f64; 7], f64)> {
    let trajectory = &problem.observations.robot.trajectory;
    let sheet = &problem.observations.sheet;
    let (x, y) = (sheet.axes().column(0).into_owned(), sheet.axes().column(1).into_owned());
    let mut graph = tiny_solver::Problem::new();
    for (o, w) in problem.selected() {
        let index = trajectory.bracket(o.stamp_s - at.time_offset_s)?;
        let segment = trajectory.segments()[index];
        let line = &start.lines[o.line as usize];
        let axes = line.axes();
        let rotation = crate::exported::wxyz(&start.tool_from_camera.rotation);
        let sighting = Sighting {
            elapsed_at_start: o.stamp_s - start.time_offset_s - segment.start,
            start_offset_s: start.time_offset_s,
            segment,
            point: o.point_in_camera.into(),
            whitener: w.0.map(f64::from),
            rotation,
            translation: start.tool_from_camera.translation.vector.into(),
            anchor: (*line.anchor()).into(),
            axes: [0, 1, 2].map(|k| axes.column(k).into_owned().into()),
            sheet: [x.into(), y.into(), x.cross(&y).into()],
        };
        let own = format!("line {}", o.line);
        graph.add_residual_block(2, &["offset", "rotation", "translation", &own], Box::new(sighting), None);
    }
    let mut initial = HashMap::from([
        ("offset".to_owned(), DVector::from_element(1, start.time_offset_s)),
        ("rotation".to_owned(), DVector::zeros(3)),
        ("translation".to_owned(), DVector::zeros(3)),
    ]);
    for line in 0..start.lines.len() {
        initial.insert(format!("line {line}"), DVector::zeros(4));
    }
    let options = tiny_solver::OptimizerOptions {
        min_abs_error_decrease_threshold: 1e-9,
        min_rel_error_decrease_threshold: 1e-15,
        ..tiny_solver::OptimizerOptions::default()
    };
    let began = std::time::Instant::now();
    let result = tiny_solver::GaussNewtonOptimizer::new().optimize(&graph, &initial, Some(options))?;
    let seconds = began.elapsed().as_secs_f64();
    let mut found = [0.0; 7];
    found[0] = result["offset"][0];
    for k in 0..3 {
        found[1 + k] = result["rotation"][k];
        found[4 + k] = result["translation"][k];
    }
    Some((found, seconds))
}
