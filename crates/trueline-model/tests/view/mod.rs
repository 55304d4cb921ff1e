//! A random sensor on a moving robot.
#![allow(dead_code, reason = "each test uses its part of it")]

use nalgebra::{DVector, UnitVector3, Vector2, Vector3};
use proptest::prelude::*;
use trueline_geometry::{Line, Plane, Pose, Segment, Trajectory, se3, so3};
use trueline_model::{LaserSheet, Placement, SheetShape};

/// One exposure of a sensor.
#[derive(Clone, Debug)]
pub(crate) struct View {
    pub segment: Segment,
    pub exposure: f64,
    pub tool_from_camera: Pose,
    pub sheet: LaserSheet,
    /// The measured point, sheet coordinates, m.
    pub in_sheet: Vector2<f64>,
}

/// A vector in a cube.
pub(crate) fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

/// Any attitude of robot and sensor within the working field.
pub(crate) fn view() -> impl Strategy<Value = View> {
    let robot = (vector(3.0), vector(1.5), vector(0.01), vector(0.001), 0.0..0.004_f64);
    let sensor = (vector(3.0), vector(0.2), -0.02..0.02_f64, -0.02..0.02_f64);
    (robot, sensor).prop_map(|(robot, sensor)| {
        let start = se3::from_parts(so3::exp(&robot.0), robot.1);
        let end = se3::from_parts(start.rotation * so3::exp(&robot.2), robot.1 + robot.3);
        let trajectory = Trajectory::new(vec![0.0, 0.004], &[start, end]).unwrap();
        View {
            segment: *trajectory.segment(0).unwrap(),
            exposure: robot.4,
            tool_from_camera: se3::from_parts(so3::exp(&sensor.0), sensor.1),
            sheet: LaserSheet::from_plane(Plane::from_height(0.036, 2.12, 0.13).unwrap()),
            in_sheet: Vector2::new(sensor.2, 0.05 + sensor.3),
        }
    })
}

/// A shape of the sensor within some percent.
pub(crate) fn shape() -> impl Strategy<Value = SheetShape> {
    (vector(0.03), vector(0.5)).prop_map(|(scales, keystone)| SheetShape {
        h: [scales.x, scales.y, scales.z, keystone.x, keystone.y],
        origin_m: [0.003, 0.045],
    })
}

impl View {
    pub(crate) fn placement(&self) -> Placement {
        self.stepped(&DVector::zeros(7))
    }

    /// Perturbs (t_d, rotation, translation), the first seven of a step, by the conventions.
    pub(crate) fn stepped(&self, step: &DVector<f64>) -> Placement {
        let three = |k: usize| Vector3::new(step[k], step[k + 1], step[k + 2]);
        let tool_from_camera = se3::retract_decoupled(&self.tool_from_camera, &three(1), &three(4));
        Placement::new(&self.segment, self.exposure - step[0], &tool_from_camera)
    }

    pub(crate) fn point_in_camera(&self) -> Vector3<f64> {
        self.sheet.point(&self.in_sheet)
    }

    /// A line along the sheet's normal, rotated by `turn`, that misses the point by `miss`.
    pub(crate) fn line(&self, turn: &Vector3<f64>, miss: &Vector3<f64>) -> Line {
        let placement = self.placement();
        let normal = placement.base_from_camera() * self.sheet.plane().normal().into_inner();
        let direction = UnitVector3::new_normalize(so3::exp(turn) * normal);
        Line::new(placement.point_in_base(&self.point_in_camera()) + miss, &direction)
    }
}
