//! Bodies that must not touch: spheres about cables, torch and sensor against the planes of the plates.

use crate::mounted_arm::MountedArm;
use nalgebra::{Point3, UnitVector3, Vector3};
use trueline_geometry::Pose;
use trueline_geometry::arm::{AXES, Angles};

/// Carrier of a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// The tool.
    Tool,
    /// The link after a joint of the arm, counted from 0.
    Joint(usize),
}

/// A sphere about something that moves with the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    /// The body's name.
    pub name: String,
    /// The part that it moves with.
    pub carrier: Carrier,
    /// Its middle in that frame, m.
    pub at_m: Vector3<f64>,
    /// Its radius, m.
    pub radius_m: f64,
}

/// A plate: a plane that nothing may come through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    /// A point of it in base, m.
    pub point_m: Vector3<f64>,
    /// Into the free side.
    pub normal: UnitVector3<f64>,
    /// From the seam into the plate, roughly; `None` if not stated.
    pub toward: Option<UnitVector3<f64>>,
}

/// Spheres and plates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surroundings {
    /// Moving bodies.
    pub spheres: Vec<Sphere>,
    /// Fixed bodies.
    pub plates: Vec<Plate>,
    /// Required clearance between them, m: the plates are as far off as the guess may be.
    pub clearance_m: f64,
}

impl Surroundings {
    /// Whether there is nothing to check.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.spheres.is_empty() || self.plates.is_empty()
    }

    /// Least distance of a sphere from a plate at a pose of the tool, m; negative inside. Spheres of joints need the arm's angles.
    #[must_use]
    pub fn distance_m(&self, base_from_tool: &Pose, arm: Option<(&MountedArm, &Angles)>) -> f64 {
        let joints = arm.map(|(mounted, angles)| {
            mounted.arm.state(angles).base_from_joint.map(|joint| mounted.base_from_arm * joint)
        });
        let frame = |carrier: Carrier| match carrier {
            Carrier::Tool => Some(*base_from_tool),
            Carrier::Joint(k) => joints.as_ref().map(|joints| joints[k.min(AXES - 1)]),
        };
        let mut least = f64::INFINITY;
        for sphere in &self.spheres {
            let Some(frame) = frame(sphere.carrier) else { continue };
            let middle = (frame * Point3::from(sphere.at_m)).coords;
            for plate in &self.plates {
                least = least.min(plate.normal.dot(&(middle - plate.point_m)) - sphere.radius_m);
            }
        }
        least
    }
}
