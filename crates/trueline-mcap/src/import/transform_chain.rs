//! From transforms between many frames to one pose over time.
//!
//! Transforms that are published together share their stamps, and are composed at just these. A moving transform without a
//! sample at the stamp of another one is interpolated between its own samples, never beyond them or across a gap. Otherwise
//! the stamp is left out and counted.

use crate::import_error::ImportError;
use crate::read::survey::LinkSurvey;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use trueline_dataset::stamp::seconds;
use trueline_geometry::{Pose, Trajectory};

/// One transform on the way from the base to the tool.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Step {
    pub parent: String,
    pub child: String,
    /// The way leads from the child to the parent.
    pub inverse: bool,
    pub is_static: bool,
}

/// A transform's samples, ns and `parent_from_child`, in the order in which they were recorded.
pub(super) type Samples = Vec<(i64, Pose)>;

/// The way from one frame to another.
pub(super) fn path(links: &[&LinkSurvey], base: &str, tool: &str) -> Result<Vec<Step>, ImportError> {
    let known: BTreeSet<&str> = links.iter().flat_map(|l| [l.parent.as_str(), l.child.as_str()]).collect();
    for frame in [base, tool] {
        if !known.contains(frame) {
            let (frame, known) = (frame.to_owned(), known.iter().map(|f| (*f).to_owned()).collect());
            return Err(ImportError::UnknownFrame { frame, known });
        }
    }
    // Breadth first from the base; how each frame was come to.
    let mut reached: BTreeMap<&str, Option<Step>> = BTreeMap::from([(base, None)]);
    let mut next = VecDeque::from([base]);
    while let Some(frame) = next.pop_front() {
        for link in links {
            let (to, inverse) = match (link.parent == frame, link.child == frame) {
                (true, _) => (link.child.as_str(), false),
                (_, true) => (link.parent.as_str(), true),
                _ => continue,
            };
            if !reached.contains_key(to) {
                let (parent, child, is_static) = (link.parent.clone(), link.child.clone(), link.is_static());
                reached.insert(to, Some(Step { parent, child, inverse, is_static }));
                next.push_back(to);
            }
        }
    }
    let mut steps = Vec::new();
    let mut at = tool;
    while let Some(Some(step)) = reached.get(at) {
        one_parent(links, &step.child)?;
        at = if step.inverse { &step.child } else { &step.parent };
        steps.push(step.clone());
    }
    if at != base || steps.is_empty() {
        return Err(ImportError::NoChain { base: base.to_owned(), tool: tool.to_owned() });
    }
    steps.reverse();
    Ok(steps)
}

fn one_parent(links: &[&LinkSurvey], child: &str) -> Result<(), ImportError> {
    let parents: Vec<String> =
        links.iter().filter(|link| link.child == child).map(|link| link.parent.clone()).collect();
    if parents.len() > 1 {
        return Err(ImportError::SeveralParents { child: child.to_owned(), parents });
    }
    Ok(())
}

/// Poses over time, and the use of the stamps.
#[derive(Clone, Debug, Default)]
pub(super) struct Composed {
    /// Stamp in ns, and the pose.
    pub poses: Vec<(i64, Pose)>,
    /// Stamps without a value of every transform.
    pub left_out: usize,
    /// Stamps at which one was interpolated.
    pub interpolated: usize,
    /// Samples that repeat a stamp of their transform; the later one counts.
    pub repeated: usize,
    /// Samples that were recorded behind later ones.
    pub late: usize,
}

/// Composes the transforms along the way at the stamps of those that move; `None` if none does.
pub(crate) fn compose(steps: &[Step], samples: Vec<Samples>) -> Result<Option<Composed>, ImportError> {
    let mut composed = Composed::default();
    let mut links = Vec::new();
    for (step, samples) in steps.iter().zip(samples) {
        links.push(Link::new(step, samples, &mut composed)?);
    }
    let varies = links.iter().any(|link| link.varies);
    let stamps: BTreeSet<i64> = links
        .iter()
        .filter(|link| !link.is_static && (link.varies || !varies))
        .flat_map(|link| link.samples.iter().map(|(stamp, _)| *stamp))
        .collect();
    let Some(&origin) = stamps.first() else {
        return Ok(None);
    };
    for link in &mut links {
        link.prepare(&stamps, origin);
    }
    for stamp in stamps {
        let found: Option<Vec<(Pose, bool)>> = links.iter().map(|link| link.at(stamp, origin)).collect();
        match found {
            Some(found) => {
                composed.interpolated += usize::from(found.iter().any(|(_, interpolated)| *interpolated));
                composed
                    .poses
                    .push((stamp, found.iter().fold(Pose::identity(), |pose, (link, _)| pose * link)));
            }
            None => composed.left_out += 1,
        }
    }
    Ok(Some(composed))
}

/// A step with its samples by rising stamp.
struct Link {
    inverse: bool,
    is_static: bool,
    varies: bool,
    samples: Samples,
    between: Option<Trajectory>,
}

impl Link {
    fn new(step: &Step, mut samples: Samples, composed: &mut Composed) -> Result<Self, ImportError> {
        let varies = samples.windows(2).any(|w| w[0].1 != w[1].1);
        if step.is_static && varies {
            return Err(ImportError::StaticChanged { link: format!("{} → {}", step.parent, step.child) });
        }
        if !step.is_static {
            composed.late += crate::import::in_order::late(samples.iter().map(|(stamp, _)| *stamp));
        }
        samples.sort_by_key(|(stamp, _)| *stamp);
        let before = samples.len();
        // Of equal stamps the last stays.
        samples.reverse();
        samples.dedup_by_key(|(stamp, _)| *stamp);
        samples.reverse();
        if !step.is_static {
            composed.repeated += before - samples.len();
        }
        Ok(Self { inverse: step.inverse, is_static: step.is_static, varies, samples, between: None })
    }

    /// Makes ready for stamps that are not its own.
    fn prepare(&mut self, stamps: &BTreeSet<i64>, origin: i64) {
        if !self.varies || self.samples.len() == stamps.len() {
            return;
        }
        let times = self.samples.iter().map(|(stamp, _)| seconds(stamp - origin)).collect();
        let poses: Vec<Pose> = self.samples.iter().map(|(_, pose)| *pose).collect();
        // One sample alone cannot be interpolated: it holds at its own stamp.
        self.between = Trajectory::new(times, &poses).ok();
    }

    /// The transform at a stamp in the direction of the way, and whether it was interpolated.
    fn at(&self, stamp: i64, origin: i64) -> Option<(Pose, bool)> {
        let (pose, interpolated) = if self.varies {
            match self.samples.binary_search_by_key(&stamp, |(stamp, _)| *stamp) {
                Ok(k) => (self.samples[k].1, false),
                Err(_) => (self.between.as_ref()?.pose_at(seconds(stamp - origin))?, true),
            }
        } else {
            (self.samples.first()?.1, false)
        };
        Some((if self.inverse { pose.inverse() } else { pose }, interpolated))
    }
}
