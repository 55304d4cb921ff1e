//! The joints between two frames of a robot, from its URDF.

use crate::Pose;
use crate::arm::six_axes::{AXES, Arm, Joint as ArmJoint};
use nalgebra::{Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use std::f64::consts::PI;

/// Reason that a URDF cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UrdfError {
    /// It cannot be read, or has a joint that one number does not describe.
    #[error("the URDF cannot be used: {why}")]
    Unusable {
        /// The fault.
        why: String,
    },
    /// Several frames without anything mounted on them.
    #[error("the URDF has several frames that nothing is mounted on: {}", ends.join(", "))]
    SeveralEnds {
        /// Those frames.
        ends: Vec<String>,
    },
    /// A frame that is not there.
    #[error("no frame `{frame}`; there are: {}", known.join(", "))]
    UnknownFrame {
        /// The requested frame.
        frame: String,
        /// All frames.
        known: Vec<String>,
    },
}

/// The joints between two frames of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// The fixed frame.
    pub base: String,
    /// The frame of the pose.
    pub tool: String,
    /// From the base to the tool.
    joints: Vec<Joint>,
}

#[derive(Clone, Debug, PartialEq)]
struct Joint {
    name: String,
    parent: String,
    child: String,
    /// The pose of the joint's frame in its parent's, at position zero.
    parent_from_joint: Pose,
    motion: Motion,
    follows: Option<Follows>,
    limits: Limits,
}

/// Motion of a joint, if the file states it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Limits {
    range: Option<[f64; 2]>,
    speed: Option<f64>,
    acceleration: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    None,
    /// About an axis of the joint's frame, rad.
    Turns(Unit<Vector3<f64>>),
    /// Along an axis of the joint's frame, m.
    Slides(Unit<Vector3<f64>>),
    /// A motion that one number does not describe.
    Free,
}

/// A joint that follows another one: position = multiplier · other + offset.
#[derive(Clone, Debug, PartialEq)]
struct Follows {
    other: String,
    multiplier: f64,
    offset: f64,
}

impl Chain {
    /// The joints from `base` to `tool`. Without names, from the root of the tree to its only end.
    ///
    /// # Errors
    /// No URDF; frames that are missing or not in one chain; several ends and no name; joints that one number does not
    /// describe.
    pub fn of(urdf: &str, base: Option<&str>, tool: Option<&str>) -> Result<Self, UrdfError> {
        let wrong = |why: String| UrdfError::Unusable { why };
        let document = Document::parse(urdf).map_err(|error| wrong(error.to_string()))?;
        let robot = document.root_element();
        let nodes = robot.children().filter(|node| node.has_tag_name("joint"));
        let joints: Vec<Joint> = nodes.map(|node| joint(&node).map_err(wrong)).collect::<Result<_, _>>()?;
        let tool = match tool {
            Some(tool) => frame_name(tool),
            None => only_end(&joints)?,
        };
        check_is_there(&tool, &joints)?;
        let base = base.map(frame_name);
        if let Some(base) = &base {
            check_is_there(base, &joints)?;
        }
        let mut chain = Vec::new();
        let mut at = tool.clone();
        while base.as_deref() != Some(&at) {
            match joints.iter().find(|joint| joint.child == at) {
                // A tree has no more steps than joints: more steps are a circle.
                Some(_) if chain.len() == joints.len() => {
                    return Err(wrong("its joints form a circle".to_owned()));
                }
                Some(joint) => {
                    at = joint.parent.clone();
                    chain.push(joint.clone());
                }
                None => break,
            }
        }
        if base.as_ref().is_some_and(|base| *base != at) {
            return Err(wrong(format!("frame `{tool}` is not mounted on `{}`", base.unwrap_or_default())));
        }
        if let Some(free) = chain.iter().find(|joint| joint.motion == Motion::Free) {
            return Err(wrong(format!(
                "joint `{}` is neither fixed, revolute, continuous nor prismatic",
                free.name
            )));
        }
        chain.reverse();
        Ok(Self { base: at, tool, joints: chain })
    }

    /// Whether the tool moves with a joint.
    #[must_use]
    pub fn moves_with(&self, joint: &str) -> bool {
        self.joints.iter().any(|known| known.motion != Motion::None && known.moved_by() == joint)
    }

    /// `base_from_tool` at positions by name; `None` if no moving joint is known.
    ///
    /// # Errors
    /// The name of a missing joint while others are known.
    pub fn base_from_tool(&self, position: impl Fn(&str) -> Option<f64>) -> Result<Option<Pose>, String> {
        let moving = || self.joints.iter().filter(|joint| joint.motion != Motion::None).map(Joint::moved_by);
        if !moving().any(|name| position(name).is_some()) {
            return Ok(None);
        }
        if let Some(missing) = moving().find(|name| position(name).is_none()) {
            return Err(missing.to_owned());
        }
        let pose = |joint: &Joint| joint.pose(position(joint.moved_by()).unwrap_or(0.0));
        Ok(Some(self.joints.iter().map(pose).fold(Pose::identity(), |from, next| from * next)))
    }

    /// The same as an arm with the limits in the file.
    ///
    /// # Errors
    /// Not six revolute joints in series, or one without range or speed.
    pub fn arm(&self) -> Result<Arm, UrdfError> {
        let wrong = |why: String| UrdfError::Unusable { why };
        let mut before = Pose::identity();
        let mut joints = Vec::with_capacity(AXES);
        for joint in &self.joints {
            before *= joint.parent_from_joint;
            match joint.motion {
                Motion::None => {}
                Motion::Turns(axis) if joint.follows.is_none() => {
                    joints.push(joint.in_arm(before, axis).map_err(wrong)?);
                    before = Pose::identity();
                }
                _ => return Err(wrong(format!("joint `{}` is not an independent rotary joint", joint.name))),
            }
        }
        let count = joints.len();
        let joints = joints
            .try_into()
            .map_err(|_| wrong(format!("an arm has {AXES} joints that turn, this has {count}")))?;
        Ok(Arm { joints, last_from_flange: before })
    }
}

impl Joint {
    fn in_arm(&self, before: Pose, axis: Unit<Vector3<f64>>) -> Result<ArmJoint, String> {
        let lacks = |what: &str| format!("joint `{}` has no limit of its {what}", self.name);
        Ok(ArmJoint {
            before,
            axis,
            range_rad: self.limits.range.ok_or_else(|| lacks("range"))?,
            speed_rad_s: self.limits.speed.ok_or_else(|| lacks("speed"))?,
            acceleration_rad_s2: self.limits.acceleration,
        })
    }

    /// The joint that determines this one's position.
    fn moved_by(&self) -> &str {
        self.follows.as_ref().map_or(&self.name, |follows| &follows.other)
    }

    /// `parent_from_child` at a position of the joint that moves it.
    fn pose(&self, position: f64) -> Pose {
        let at = self.follows.as_ref().map_or(position, |f| f.multiplier * position + f.offset);
        let moved = match self.motion {
            Motion::None | Motion::Free => Pose::identity(),
            Motion::Turns(axis) => {
                Pose::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&axis, at))
            }
            Motion::Slides(axis) => {
                Pose::from_parts((axis.into_inner() * at).into(), UnitQuaternion::identity())
            }
        };
        self.parent_from_joint * moved
    }
}

fn joint(node: &Node<'_, '_>) -> Result<Joint, String> {
    let name = node.attribute("name").ok_or("a joint has no name")?;
    let child_of = |tag: &str| node.children().find(|child| child.has_tag_name(tag));
    let link = |tag: &str| {
        let link = child_of(tag).and_then(|node| node.attribute("link").map(frame_name));
        link.ok_or_else(|| format!("joint `{name}` has no {tag}"))
    };
    let three =
        |tag: &str, key: &str, usual: [f64; 3]| match child_of(tag).and_then(|node| node.attribute(key)) {
            Some(text) => numbers(text)
                .ok_or_else(|| format!("joint `{name}`: {tag} {key}=\"{text}\" are not three numbers")),
            None => Ok(usual),
        };
    let [x, y, z] = three("origin", "xyz", [0.0; 3])?;
    let [roll, pitch, yaw] = three("origin", "rpy", [0.0; 3])?;
    let axis = || {
        let axis = Vector3::from(three("axis", "xyz", [1.0, 0.0, 0.0])?);
        Unit::try_new(axis, 1e-9).ok_or_else(|| format!("joint `{name}` has an axis of length zero"))
    };
    let motion = match node.attribute("type").unwrap_or_default() {
        "fixed" => Motion::None,
        "revolute" | "continuous" => Motion::Turns(axis()?),
        "prismatic" => Motion::Slides(axis()?),
        _ => Motion::Free,
    };
    let limits = limits(name, child_of("limit"), node.attribute("type") == Some("continuous"))?;
    let follows = child_of("mimic").map(|node| {
        let number = |key: &str, usual: f64| match node.attribute(key) {
            Some(text) => text
                .trim()
                .parse()
                .map_err(|_| format!("joint `{name}`: mimic {key}=\"{text}\" is not a number")),
            None => Ok(usual),
        };
        let other =
            node.attribute("joint").ok_or_else(|| format!("joint `{name}` mimics no joint"))?.to_owned();
        Ok::<_, String>(Follows {
            other,
            multiplier: number("multiplier", 1.0)?,
            offset: number("offset", 0.0)?,
        })
    });
    Ok(Joint {
        name: name.to_owned(),
        parent: link("parent")?,
        child: link("child")?,
        // Roll, pitch and yaw are about fixed axes, in this order.
        parent_from_joint: Pose::from_parts(
            Translation3::new(x, y, z),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        ),
        motion,
        follows: follows.transpose()?,
        limits,
    })
}

/// The limits of a joint. A continuous one is limited to one turn on either side.
fn limits(name: &str, node: Option<Node<'_, '_>>, is_continuous: bool) -> Result<Limits, String> {
    let number = |key: &str| match node.and_then(|node| node.attribute(key)) {
        Some(text) => {
            let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
            number.map(Some).ok_or_else(|| format!("joint `{name}`: limit {key}=\"{text}\" is not a number"))
        }
        None => Ok(None),
    };
    let range = match (number("lower")?, number("upper")?) {
        _ if is_continuous => Some([-2.0 * PI, 2.0 * PI]),
        (Some(low), Some(high)) if low < high => Some([low, high]),
        (Some(low), Some(high)) => {
            return Err(format!("joint `{name}`: its limits {low} and {high} leave nothing"));
        }
        _ => None,
    };
    let speed = number("velocity")?.filter(|speed: &f64| *speed > 0.0);
    Ok(Limits { range, speed, acceleration: number("acceleration")?.filter(|most: &f64| *most > 0.0) })
}

/// The name of a frame. ROS 1 wrote `/base` where ROS 2 writes `base`.
fn frame_name(name: &str) -> String {
    name.strip_prefix('/').unwrap_or(name).to_owned()
}

/// Three finite numbers between blanks.
fn numbers(text: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text
        .split_whitespace()
        .map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()))
        .collect();
    numbers?.try_into().ok()
}

/// The only frame without anything mounted on it.
fn only_end(joints: &[Joint]) -> Result<String, UrdfError> {
    let is_end = |frame: &&String| joints.iter().all(|joint| joint.parent != **frame);
    let ends: Vec<&String> = joints.iter().map(|joint| &joint.child).filter(is_end).collect();
    match ends.as_slice() {
        [end] => Ok((*end).clone()),
        [] => Err(UrdfError::Unusable { why: "there is no joint in it".to_owned() }),
        ends => Err(UrdfError::SeveralEnds { ends: ends.iter().map(|end| (*end).clone()).collect() }),
    }
}

fn check_is_there(frame: &str, joints: &[Joint]) -> Result<(), UrdfError> {
    let frames = || joints.iter().flat_map(|joint| [&joint.parent, &joint.child]);
    if frames().any(|known| known == frame) {
        return Ok(());
    }
    let mut known: Vec<String> = frames().cloned().collect();
    known.sort();
    known.dedup();
    Err(UrdfError::UnknownFrame { frame: frame.to_owned(), known })
}
