//! Which of the topics and frames of a recording are meant: the user's word, or the only possibility. Never a guess.

use crate::import::choice::Choice;
use crate::import::transform_chain::{Step, path};
use crate::import_error::ImportError;
use crate::message::content::Kind;
use crate::message::spatial::frame_name;
use crate::read::survey::{LinkSurvey, Survey, TopicSurvey, is_static_topic};
use crate::wire::frame_names::{BASE, TOOL};
use std::collections::BTreeSet;
use trueline_geometry::arm::urdf;

/// Source of the robot's poses.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum RobotSource {
    /// In a recording of trueline.
    Own,
    /// In a topic of poses, told in a frame.
    Poses { topic: String, base: Option<String> },
    /// In transforms.
    Chain(Chain),
    /// In joint angles.
    Joints { topic: String, arm: urdf::Chain },
}

/// Transforms that lead from one frame to another.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chain {
    pub base: String,
    pub tool: String,
    /// The one topic of moving transforms, if the user named one.
    pub only: Option<String>,
    pub steps: Vec<Step>,
}

/// The topic of the pose in a recording of trueline.
pub(crate) const OWN_POSES: &str = "/tf";

/// The chosen topics and frames.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chosen {
    pub robot: RobotSource,
    pub pictures: Option<String>,
    /// The topic of whole profiles.
    pub profiles: Option<String>,
}

impl Chosen {
    /// Decides, by the recording's content and the user's choice.
    pub(super) fn of(survey: &Survey, choice: &Choice) -> Result<Self, ImportError> {
        let seen = seen(survey, choice)?;
        let is_profile = |topic: &String| {
            survey.topics.iter().any(|known| known.name == *topic && known.kind == Kind::Profile)
        };
        let (profiles, pictures) = match seen {
            Some(topic) if is_profile(&topic) => (Some(topic), None),
            pictures => (None, pictures),
        };
        Ok(Self { robot: robot(survey, choice)?, pictures, profiles })
    }
}

fn names(survey: &Survey, kinds: &[Kind]) -> Vec<String> {
    let topics = survey.topics.iter().filter(|topic| kinds.contains(&topic.kind));
    topics.map(|topic| topic.name.clone()).collect()
}

/// The topic of the sensor's readings.
fn seen(survey: &Survey, choice: &Choice) -> Result<Option<String>, ImportError> {
    const WANTED: &str = "pictures or profiles";
    let mut candidates = names(survey, &[Kind::Picture, Kind::Profile]);
    if let Some(topic) = choice.image_topic.clone() {
        let is_there = candidates.contains(&topic);
        return if is_there {
            Ok(Some(topic))
        } else {
            Err(ImportError::NoTopic { topic, wanted: WANTED, candidates })
        };
    }
    if candidates.len() > 1 {
        return Err(ImportError::SeveralTopics { wanted: WANTED, candidates });
    }
    Ok(candidates.pop())
}

fn robot(survey: &Survey, choice: &Choice) -> Result<RobotSource, ImportError> {
    if let Some(urdf) = &choice.urdf {
        return joints(survey, choice, urdf);
    }
    if let Some(topic) = &choice.pose_topic {
        return named_robot(survey, choice, topic);
    }
    if survey.is_own && survey.topics.iter().any(|t| t.name == OWN_POSES && t.kind == Kind::Transforms) {
        return own_robot(choice);
    }
    let mut poses = names(survey, &[Kind::Pose]);
    let moving = survey.links.iter().any(|link| !link.is_static());
    // Only transforms have a tool.
    if moving && (poses.is_empty() || choice.tool_frame.is_some()) {
        return chain(survey, choice, None);
    }
    if moving || poses.len() > 1 {
        poses.extend(names(survey, &[Kind::Transforms]));
        return Err(ImportError::SeveralTopics { wanted: "robot poses", candidates: poses });
    }
    match poses.pop() {
        Some(topic) => Ok(RobotSource::Poses { topic, base: frame(choice.base_frame.as_ref()) }),
        None => Err(no_robot(survey)),
    }
}

/// The topic of joint angles, and their meaning.
fn joints(survey: &Survey, choice: &Choice, urdf: &str) -> Result<RobotSource, ImportError> {
    const WANTED: &str = "joint angles";
    let mut candidates = names(survey, &[Kind::JointStates]);
    let topic = match &choice.pose_topic {
        Some(topic) if candidates.contains(topic) => topic.clone(),
        Some(topic) => {
            return Err(ImportError::NoTopic { topic: topic.clone(), wanted: WANTED, candidates });
        }
        None if candidates.len() > 1 => {
            return Err(ImportError::SeveralTopics { wanted: WANTED, candidates });
        }
        None => candidates.pop().ok_or(ImportError::NoJointAngles)?,
    };
    let arm = urdf::Chain::of(urdf, choice.base_frame.as_deref(), choice.tool_frame.as_deref())?;
    Ok(RobotSource::Joints { topic, arm })
}

fn no_robot(survey: &Survey) -> ImportError {
    match survey.topics.iter().find(|topic| topic.kind == Kind::JointStates) {
        Some(joints) => ImportError::OnlyJointAngles { topic: joints.name.clone() },
        None => {
            let words = |topic: &TopicSurvey| format!("{} ({})", topic.name, topic.schema);
            ImportError::NoRobot { topics: survey.topics.iter().map(words).collect() }
        }
    }
}

fn own_robot(choice: &Choice) -> Result<RobotSource, ImportError> {
    for (asked, known) in [(&choice.base_frame, BASE), (&choice.tool_frame, TOOL)] {
        if let Some(frame) = asked
            && frame != known
        {
            let known = vec![BASE.to_owned(), TOOL.to_owned()];
            return Err(ImportError::UnknownFrame { frame: frame.clone(), known });
        }
    }
    Ok(RobotSource::Own)
}

fn named_robot(survey: &Survey, choice: &Choice, topic: &str) -> Result<RobotSource, ImportError> {
    if survey.is_own && topic == OWN_POSES {
        return own_robot(choice);
    }
    match survey.topics.iter().find(|t| t.name == topic).map(|t| t.kind) {
        Some(Kind::Pose) => {
            Ok(RobotSource::Poses { topic: topic.to_owned(), base: frame(choice.base_frame.as_ref()) })
        }
        Some(Kind::Transforms) => chain(survey, choice, Some(topic)),
        Some(Kind::JointStates) => Err(ImportError::OnlyJointAngles { topic: topic.to_owned() }),
        _ => Err(ImportError::NoTopic {
            topic: topic.to_owned(),
            wanted: "robot poses",
            candidates: names(survey, &[Kind::Pose, Kind::Transforms]),
        }),
    }
}

fn frame(name: Option<&String>) -> Option<String> {
    name.map(|name| frame_name(name))
}

fn chain(survey: &Survey, choice: &Choice, only: Option<&str>) -> Result<RobotSource, ImportError> {
    let is_meant = |link: &&LinkSurvey| {
        only.is_none_or(|only| link.topics.iter().any(|topic| topic == only || is_static_topic(topic)))
    };
    let links: Vec<&LinkSurvey> = survey.links.iter().filter(is_meant).collect();
    let (base, tool) =
        match (links.as_slice(), frame(choice.base_frame.as_ref()), frame(choice.tool_frame.as_ref())) {
            (_, Some(base), Some(tool)) => (base, tool),
            ([link], base, tool) => {
                (base.unwrap_or_else(|| link.parent.clone()), tool.unwrap_or_else(|| link.child.clone()))
            }
            _ => {
                let words = links.iter().map(|l| l.words()).collect();
                return Err(ImportError::FramesNeeded { links: words, proposal: obvious_chain(&links) });
            }
        };
    let steps = path(&links, &base, &tool)?;
    Ok(RobotSource::Chain(Chain { base, tool, only: only.map(str::to_owned), steps }))
}

/// From the one frame without a parent to the one frame without a child that it leads to by a transform that moves.
fn obvious_chain(links: &[&LinkSurvey]) -> Option<[String; 2]> {
    let roots = links.iter().map(|l| &l.parent).filter(|frame| links.iter().all(|l| l.child != **frame));
    let roots: BTreeSet<&String> = roots.collect();
    let leaves = links.iter().map(|l| &l.child).filter(|frame| links.iter().all(|l| l.parent != **frame));
    let leaves: BTreeSet<&String> = leaves.collect();
    let mut moving =
        roots.iter().flat_map(|root| leaves.iter().map(move |leaf| (*root, *leaf))).filter(|(root, leaf)| {
            path(links, root, leaf).is_ok_and(|steps| steps.iter().any(|step| !step.is_static))
        });
    match (moving.next(), moving.next()) {
        (Some((root, leaf)), None) => Some([root.clone(), leaf.clone()]),
        _ => None,
    }
}
