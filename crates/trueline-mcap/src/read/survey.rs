//! Content of a recording, before it is used.

use crate::import_error::ImportError;
use crate::message::content::{Content, Kind};
use crate::message::content_error::ContentError;
use crate::message::decode::{decode, kind};
use crate::read::bag::Bag;
use crate::read::bag_item::{BagItem, BagMessage};
use crate::read::damage::DamagedFile;
use crate::wire::about::{ABOUT_RECORD, SENSOR_ATTACHMENT};
use crate::wire::topics::PROFILE;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Content of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    /// Whether trueline made it.
    pub is_own: bool,
    /// Its topics by name.
    pub topics: Vec<TopicSurvey>,
    /// Its transforms by parent and child.
    pub links: Vec<LinkSurvey>,
    /// Its statements about itself, if trueline wrote it.
    pub about: BTreeMap<String, String>,
    /// The text of `sensor.toml` in it.
    pub sensor_toml: Option<String>,
    /// The fault.
    pub damages: Vec<DamagedFile>,
}

/// A topic.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicSurvey {
    /// Its name.
    pub name: String,
    /// The type of its messages.
    pub schema: String,
    /// How they are encoded.
    pub encoding: String,
    /// Their kind.
    pub kind: Kind,
    /// Their number.
    pub messages: u64,
    /// When the earliest was recorded, ns.
    pub first_ns: u64,
    /// When the latest was recorded, ns.
    pub last_ns: u64,
    /// Frames that its poses are in.
    pub frames: BTreeSet<String>,
    /// Poses or transforms that cannot be used.
    pub unusable: u64,
    /// Why the first of them cannot.
    pub problem: Option<ContentError>,
}

/// A transform.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkSurvey {
    /// The outer frame.
    pub parent: String,
    /// The inner frame.
    pub child: String,
    /// Topics that it is in.
    pub topics: BTreeSet<String>,
    /// Number of its publications.
    pub transforms: u64,
}

impl LinkSurvey {
    /// Whether it was published once and for all.
    #[must_use]
    pub fn is_static(&self) -> bool {
        self.topics.iter().all(|topic| is_static_topic(topic))
    }

    pub(crate) fn words(&self) -> String {
        format!("{} → {}", self.parent, self.child)
    }
}

/// Whether a topic's content holds for all times.
#[must_use]
pub(crate) fn is_static_topic(topic: &str) -> bool {
    topic.ends_with("tf_static")
}

/// Looks through a recording.
///
/// # Errors
/// Files that cannot be opened or are not a recording; other faults are in the survey.
pub fn survey(path: &Path) -> Result<Survey, ImportError> {
    of(&Bag::open(path)?)
}

pub(crate) fn of(bag: &Bag) -> Result<Survey, ImportError> {
    let mut counting = Counting::default();
    let damages = bag.read(&mut |item| {
        counting.add(item);
        Ok(())
    })?;
    let mut survey = counting.survey;
    survey.topics = counting.topics.into_values().collect();
    survey.links = counting.links.into_values().collect();
    // The header itself may be damaged.
    survey.is_own |= survey.topics.iter().any(|topic| topic.schema.starts_with("trueline."));
    survey.damages = damages;
    Ok(survey)
}

#[derive(Default)]
struct Counting {
    survey: Survey,
    topics: BTreeMap<(String, String, String), TopicSurvey>,
    links: BTreeMap<(String, String), LinkSurvey>,
}

impl Counting {
    fn add(&mut self, item: BagItem<'_>) {
        match item {
            BagItem::Message(message) => self.add_message(&message),
            BagItem::Profile(profile) => self.survey.is_own |= profile == PROFILE,
            BagItem::Metadata { name, values } if name == ABOUT_RECORD => {
                self.survey.about.clone_from(values);
            }
            BagItem::Attachment { name, data } if name == SENSOR_ATTACHMENT => {
                self.survey.sensor_toml = Some(String::from_utf8_lossy(data).into_owned());
            }
            BagItem::Metadata { .. } | BagItem::Attachment { .. } => {}
        }
    }

    fn add_message(&mut self, message: &BagMessage<'_>) {
        let key = (message.topic.to_owned(), message.schema.to_owned(), message.encoding.to_owned());
        let topic = self.topics.entry(key).or_insert_with_key(|(name, schema, encoding)| TopicSurvey {
            name: name.clone(),
            schema: schema.clone(),
            encoding: encoding.clone(),
            kind: kind(schema, encoding),
            messages: 0,
            first_ns: u64::MAX,
            last_ns: 0,
            frames: BTreeSet::new(),
            unusable: 0,
            problem: None,
        });
        topic.messages += 1;
        topic.first_ns = topic.first_ns.min(message.log_time);
        topic.last_ns = topic.last_ns.max(message.log_time);
        if !matches!(topic.kind, Kind::Pose | Kind::Transforms) {
            return;
        }
        match decode(message.schema, message.encoding, message.bytes) {
            Ok(Content::Pose(pose)) => drop(topic.frames.insert(pose.frame)),
            Ok(Content::Transforms(transforms)) => {
                for transform in transforms {
                    let key = (transform.parent, transform.child);
                    let link = self.links.entry(key).or_insert_with_key(|(parent, child)| LinkSurvey {
                        parent: parent.clone(),
                        child: child.clone(),
                        topics: BTreeSet::new(),
                        transforms: 0,
                    });
                    link.topics.insert(message.topic.to_owned());
                    link.transforms += 1;
                }
            }
            Ok(_) => {}
            Err(problem) => {
                topic.unusable += 1;
                topic.problem.get_or_insert(problem);
            }
        }
    }
}
