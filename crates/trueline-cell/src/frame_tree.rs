//! The pose of one frame in another, from the transforms of a tree as they come.
//!
//! Transforms that are published together share their stamps and are composed at just these. A moving
//! transform that has another rhythm than the rest is interpolated between two of its samples, never beyond
//! them or across a gap: a pose then waits for the later one. A tree with a loop, a frame with two parents or
//! a static transform that changes ends the stream. Otherwise it would give poses of another frame.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use trueline_geometry::Pose;
use trueline_mcap::message::StampedTransform;

/// How long samples are kept, and stamps wait for the other transforms, ns.
const MEMORY_NS: i64 = 1_000_000_000;
/// Samples further apart are not interpolated between, ns.
const WIDEST_GAP_NS: i64 = 500_000_000;
/// Frames that are remembered: more is a flood.
const MOST_FRAMES: usize = 10_000;
/// Samples of one transform that are kept.
const MOST_SAMPLES: usize = 4096;

/// Why a tree gives no poses any more.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TreeError {
    /// Frames that are each other's parents.
    #[error("the frames form a loop: {0}")]
    Loop(String),
    /// A frame with two parents.
    #[error(
        "the frame `{child}` has two parents, `{first}` and `{second}`: two publishers contradict each other"
    )]
    TwoParents {
        /// The frame.
        child: String,
        /// One.
        first: String,
        /// The other.
        second: String,
    },
    /// A static transform that is not.
    #[error("the static transform of `{0}` changed: poses before and after it are of different frames")]
    StaticChanged(String),
    /// The same transform as a static and as a moving one.
    #[error("the transform of `{0}` is published both as static and as moving")]
    Both(String),
    /// Too many frames.
    #[error("more than {MOST_FRAMES} frames")]
    Flood,
}

#[derive(Clone, Debug)]
struct Link {
    parent: String,
    is_static: bool,
    varies: bool,
    /// By rising stamp; of a static transform one.
    samples: VecDeque<(i64, Pose)>,
}

/// The tree, as far as known.
#[derive(Clone, Debug)]
pub struct FrameTree {
    base: String,
    tool: String,
    links: BTreeMap<String, Link>,
    /// Frames to go up through from the base and from the tool until they meet.
    way: Option<[Vec<String>; 2]>,
    pending: BTreeSet<i64>,
    newest_ns: i64,
    emitted_ns: i64,
    left_out: u64,
    interpolated: u64,
    behind: u64,
}

/// Knowledge of a transform at a time.
enum At {
    Known(Pose, bool),
    NotYet,
    Never,
}

/// Poses that became known with a message.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NewPoses {
    /// Stamp in ns, and `base_from_tool`.
    pub poses: Vec<(i64, Pose)>,
    /// Time went back by more than samples are kept for: the stream began anew.
    pub began_anew: bool,
}

impl FrameTree {
    /// Of a tool's frame in a base's, by their names.
    #[must_use]
    pub fn new(base: &str, tool: &str) -> Self {
        Self {
            base: base.trim_start_matches('/').to_owned(),
            tool: tool.trim_start_matches('/').to_owned(),
            links: BTreeMap::new(),
            way: None,
            pending: BTreeSet::new(),
            newest_ns: i64::MIN,
            emitted_ns: i64::MIN,
            left_out: 0,
            interpolated: 0,
            behind: 0,
        }
    }

    /// Takes the transforms of a message.
    ///
    /// # Errors
    /// The reason why this is not a tree.
    pub fn add(&mut self, transforms: &[StampedTransform], is_static: bool) -> Result<NewPoses, TreeError> {
        let mut began_anew = false;
        for transform in transforms {
            began_anew |= !is_static && self.begins_anew(transform.stamp_ns);
            self.insert(transform, is_static)?;
        }
        Ok(NewPoses { poses: self.compose(), began_anew })
    }

    fn begins_anew(&mut self, stamp_ns: i64) -> bool {
        if self.newest_ns.saturating_sub(stamp_ns) <= MEMORY_NS {
            self.newest_ns = self.newest_ns.max(stamp_ns);
            return false;
        }
        self.links.values_mut().filter(|link| !link.is_static).for_each(|link| link.samples.clear());
        self.pending.clear();
        (self.newest_ns, self.emitted_ns) = (stamp_ns, i64::MIN);
        true
    }

    fn insert(&mut self, transform: &StampedTransform, is_static: bool) -> Result<(), TreeError> {
        let StampedTransform { stamp_ns, parent, child, parent_from_child } = transform;
        let child_name = || child.clone();
        let is_full = self.links.len() >= MOST_FRAMES;
        match self.links.get_mut(child) {
            None if is_full => return Err(TreeError::Flood),
            None => {
                let samples = VecDeque::from([(*stamp_ns, *parent_from_child)]);
                let link = Link { parent: parent.clone(), is_static, varies: false, samples };
                self.links.insert(child_name(), link);
                if let Err(error) = self.refuse_a_loop(child) {
                    self.links.remove(child);
                    return Err(error);
                }
                self.way = self.find_way();
            }
            Some(link) if link.parent != *parent => {
                let (first, second) = (link.parent.clone(), parent.clone());
                return Err(TreeError::TwoParents { child: child_name(), first, second });
            }
            Some(link) if link.is_static != is_static => return Err(TreeError::Both(child_name())),
            Some(link) if is_static => {
                // A publisher that comes later repeats it.
                if link.samples.front().is_some_and(|(_, known)| known != parent_from_child) {
                    return Err(TreeError::StaticChanged(child_name()));
                }
            }
            Some(link) => self.behind += u64::from(!link.append(*stamp_ns, parent_from_child)),
        }
        let is_on_way = self.way.iter().flatten().flatten().any(|name| name == child);
        if !is_static && is_on_way && *stamp_ns > self.emitted_ns {
            self.pending.insert(*stamp_ns);
        }
        Ok(())
    }

    /// Every other frame was in no loop before this one came.
    fn refuse_a_loop(&self, child: &str) -> Result<(), TreeError> {
        let mut names = vec![child];
        while let Some(link) = names.last().and_then(|name| self.links.get(*name)) {
            names.push(&link.parent);
            if link.parent == child {
                return Err(TreeError::Loop(names.join(" → ")));
            }
        }
        Ok(())
    }

    /// A frame and all above it.
    fn upwards(&self, frame: &str) -> Vec<String> {
        let mut names = vec![frame.to_owned()];
        while let Some(link) = names.last().and_then(|name| self.links.get(name)) {
            names.push(link.parent.clone());
        }
        names
    }

    fn find_way(&self) -> Option<[Vec<String>; 2]> {
        let [mut of_base, mut of_tool] = [&self.base, &self.tool].map(|frame| self.upwards(frame));
        let meets = of_base.iter().position(|name| of_tool.contains(name))?;
        of_base.truncate(meets + 1);
        let met = of_base.pop()?;
        of_tool.truncate(of_tool.iter().position(|name| *name == met)?);
        Some([of_base, of_tool])
    }

    fn compose(&mut self) -> Vec<(i64, Pose)> {
        let mut poses = Vec::new();
        // A transform that is published although it does not move needs no poses at its stamps.
        let is_moving = |link: &Link| !link.is_static && link.varies;
        let moves = self.on_way().any(is_moving);
        while let Some(stamp_ns) = self.pending.first().copied() {
            let drives = |link: &Link| !link.is_static && (link.varies || !moves) && link.has(stamp_ns);
            if !self.on_way().any(drives) {
                self.pending.pop_first();
                continue;
            }
            match self.pose_at(stamp_ns) {
                At::NotYet if self.newest_ns.saturating_sub(stamp_ns) < MEMORY_NS => break,
                At::NotYet | At::Never => self.left_out += 1,
                At::Known(pose, interpolated) => {
                    self.interpolated += u64::from(interpolated);
                    poses.push((stamp_ns, pose));
                }
            }
            self.pending.pop_first();
            self.emitted_ns = stamp_ns;
        }
        poses
    }

    fn on_way(&self) -> impl Iterator<Item = &Link> {
        self.way.iter().flatten().flatten().filter_map(|name| self.links.get(name))
    }

    fn pose_at(&self, stamp_ns: i64) -> At {
        let Some([of_base, of_tool]) = &self.way else { return At::NotYet };
        let mut interpolated = false;
        let mut sides = [Pose::identity(); 2];
        for (side, names) in sides.iter_mut().zip([of_base, of_tool]) {
            for name in names {
                match self.links.get(name).map_or(At::NotYet, |link| link.at(stamp_ns)) {
                    At::Known(parent_from_child, between) => {
                        *side = parent_from_child * *side;
                        interpolated |= between;
                    }
                    other => return other,
                }
            }
        }
        let [common_from_base, common_from_tool] = sides;
        At::Known(common_from_base.inverse() * common_from_tool, interpolated)
    }

    /// Remarks for the user, a sentence each.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        match &self.way {
            Some(way) => {
                let moving = self.on_way().filter(|link| !link.is_static).count();
                let all: usize = way.iter().map(Vec::len).sum();
                notes.push(format!(
                    "`{}` in `{}`, composed of {all} transforms, {moving} of them moving",
                    self.tool, self.base
                ));
                if moving == 0 {
                    notes.push("no transform between the two moves: nothing is recorded".to_owned());
                }
            }
            None => notes.push(format!(
                "no transforms lead from `{}` to `{}`: known are {} and {}",
                self.base,
                self.tool,
                self.upwards(&self.base).join(" → "),
                self.upwards(&self.tool).join(" → ")
            )),
        }
        for (count, what) in [
            (self.left_out, "stamps were left out: not all transforms were known then"),
            (self.interpolated, "poses have a transform that was interpolated between its samples"),
            (self.behind, "transforms came behind later ones and were not used"),
        ] {
            if count > 0 {
                notes.push(format!("{count} {what}"));
            }
        }
        notes
    }
}

impl Link {
    /// Whether the sample is newer than all before.
    fn append(&mut self, stamp_ns: i64, parent_from_child: &Pose) -> bool {
        if let Some((last_ns, last)) = self.samples.back() {
            if stamp_ns <= *last_ns {
                return false;
            }
            self.varies |= last != parent_from_child;
        }
        self.samples.push_back((stamp_ns, *parent_from_child));
        let is_old = |(at_ns, _): &(i64, Pose)| stamp_ns - at_ns > 2 * MEMORY_NS;
        while self.samples.len() > MOST_SAMPLES
            || (self.samples.len() > 2 && self.samples.front().is_some_and(is_old))
        {
            self.samples.pop_front();
        }
        true
    }

    fn has(&self, stamp_ns: i64) -> bool {
        self.samples.binary_search_by_key(&stamp_ns, |(at_ns, _)| *at_ns).is_ok()
    }

    fn at(&self, stamp_ns: i64) -> At {
        if self.is_static {
            return self.samples.front().map_or(At::NotYet, |(_, pose)| At::Known(*pose, false));
        }
        let later = self.samples.partition_point(|(at_ns, _)| *at_ns < stamp_ns);
        let (before, after) =
            (later.checked_sub(1).and_then(|k| self.samples.get(k)), self.samples.get(later));
        match (before, after) {
            (_, Some((at_ns, pose))) if *at_ns == stamp_ns => At::Known(*pose, false),
            (Some((from_ns, from)), Some((to_ns, to))) if to_ns - from_ns <= WIDEST_GAP_NS => {
                let share = (stamp_ns - from_ns) as f64 / (to_ns - from_ns) as f64;
                At::Known(from.lerp_slerp(to, share), true)
            }
            (_, None) => At::NotYet,
            (_, Some(_)) => At::Never,
        }
    }
}
