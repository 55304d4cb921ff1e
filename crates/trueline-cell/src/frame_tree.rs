//! The pose of one frame in another, from the transforms of a tree as they come.
//!
//! Transforms that are published together share their stamps and are composed at just these. A moving transform that has another rhythm than
//! the rest is interpolated between two of its samples, never beyond them or across a gap: a pose then waits for the later one. What a tree
//! may not be (a loop, a frame with two parents, a static transform that changes) ends the stream instead of giving poses of something else.

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

/// The tree, as far as it is known.
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

/// What is known of a transform at a time.
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
    /// Why this is no tree.
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

    /// What is worth telling of it, a sentence each.
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use nalgebra::Vector3;
    use trueline_geometry::so3;

    const MS: i64 = 1_000_000;

    fn transform(parent: &str, child: &str, stamp_ms: i64, parent_from_child: Pose) -> StampedTransform {
        let (parent, child) = (parent.to_owned(), child.to_owned());
        StampedTransform { stamp_ns: stamp_ms * MS, parent, child, parent_from_child }
    }

    fn pose(seed: f64) -> Pose {
        let turn = so3::exp(&Vector3::new(seed.sin(), (1.3 * seed).cos(), 0.4));
        Pose::from_parts(Vector3::new(seed, 0.2 * seed, -0.3).into(), turn)
    }

    fn near(found: &Pose, wanted: &Pose) {
        assert!((found.translation.vector - wanted.translation.vector).norm() < 1e-12);
        // An angle is the arc cosine of a cosine near one: to the root of its rounding.
        assert!(found.rotation.angle_to(&wanted.rotation) < 1e-7);
    }

    /// base ← world → rail (moving) → flange (moving) → tool, with the base's own place in the world static.
    #[test]
    fn a_chain_is_composed_up_from_the_base_and_down_to_the_tool() {
        let mut tree = FrameTree::new("/base", "tool");
        assert_eq!(tree.add(&[transform("flange", "tool", 0, pose(1.0))], true), Ok(NewPoses::default()));
        assert!(tree.notes()[0].contains("no transforms lead"), "{:?}", tree.notes());
        tree.add(&[transform("world", "base", 0, pose(2.0))], true).unwrap();
        for k in 0..10 {
            let (rail, flange) = (pose(0.1 * k as f64), pose(3.0 + 0.2 * k as f64));
            // Another arm in the same message is not on the way.
            let message = [
                transform("world", "other", 4 * k, pose(9.0 + k as f64)),
                transform("rail", "flange", 4 * k, flange),
                transform("world", "rail", 4 * k, rail),
            ];
            let found = tree.add(&message, false).unwrap();
            let [(stamp_ns, base_from_tool)] = found.poses[..] else { panic!("{k}: {found:?}") };
            assert_eq!((stamp_ns, found.began_anew), (4 * k * MS, false));
            near(&base_from_tool, &(pose(2.0).inverse() * rail * flange * pose(1.0)));
        }
        assert_eq!(tree.notes(), ["`tool` in `base`, composed of 4 transforms, 2 of them moving"]);
        // Once is enough of a stamp.
        assert_eq!(tree.add(&[transform("world", "rail", 36, pose(0.9))], false), Ok(NewPoses::default()));
    }

    #[test]
    fn transforms_of_another_rhythm_are_interpolated_and_never_beyond_their_samples() {
        let mut tree = FrameTree::new("world", "tool");
        let rail = |ms: i64| Pose::translation(0.001 * ms as f64, 0.0, 0.0);
        let tool = |ms: i64| Pose::translation(0.0, 0.002 * ms as f64, 0.0);
        let mut found = Vec::new();
        for ms in 0..40 {
            if ms % 10 == 5 {
                found.extend(tree.add(&[transform("world", "rail", ms, rail(ms))], false).unwrap().poses);
            }
            if ms % 4 == 0 {
                found.extend(tree.add(&[transform("rail", "tool", ms, tool(ms))], false).unwrap().poses);
            }
        }
        // From when the rail is known to move to its last sample at 35 ms, at the stamps of both.
        let stamps: Vec<i64> = found.iter().map(|(ns, _)| ns / MS).collect();
        assert_eq!(stamps, [8, 12, 15, 16, 20, 24, 25, 28, 32, 35]);
        for (ns, pose) in &found {
            near(pose, &(rail(ns / MS) * tool(ns / MS)));
        }
        assert!(
            tree.notes().iter().any(|note| note.starts_with("10 poses have a transform that was")),
            "{:?}",
            tree.notes()
        );
    }

    #[test]
    fn a_link_that_falls_silent_gives_no_poses_and_says_so() {
        let mut tree = FrameTree::new("world", "tool");
        let mut poses = 0;
        for ms in (0..4000).step_by(10) {
            let mut message = vec![transform("rail", "tool", ms, pose(0.001 * ms as f64))];
            if ms < 1000 {
                message.push(transform("world", "rail", ms, pose(0.002 * ms as f64)));
            }
            poses += tree.add(&message, false).unwrap().poses.len();
        }
        assert_eq!(poses, 100);
        assert!(tree.notes().iter().any(|note| note.contains("stamps were left out")), "{:?}", tree.notes());
    }

    #[test]
    fn what_is_no_tree_is_refused_by_name() {
        let moving = |tree: &mut FrameTree, parent: &str, child: &str| {
            tree.add(&[transform(parent, child, 0, pose(1.0))], false)
        };
        let mut tree = FrameTree::new("a", "d");
        for [parent, child] in [["a", "b"], ["b", "c"], ["c", "d"]] {
            moving(&mut tree, parent, child).unwrap();
        }
        assert_eq!(moving(&mut tree, "d", "a"), Err(TreeError::Loop("a → d → c → b → a".to_owned())));
        let mut tree = FrameTree::new("a", "d");
        assert!(matches!(moving(&mut tree, "d", "d"), Err(TreeError::Loop(_))));
        let mut tree = FrameTree::new("a", "d");
        moving(&mut tree, "a", "b").unwrap();
        assert!(matches!(moving(&mut tree, "x", "b"), Err(TreeError::TwoParents { .. })));
        let still = |tree: &mut FrameTree, seed: f64| tree.add(&[transform("b", "c", 0, pose(seed))], true);
        still(&mut tree, 1.0).unwrap();
        // Another publisher repeats it.
        still(&mut tree, 1.0).unwrap();
        assert_eq!(still(&mut tree, 1.1), Err(TreeError::StaticChanged("c".to_owned())));
        assert_eq!(moving(&mut tree, "b", "c"), Err(TreeError::Both("c".to_owned())));
    }

    #[test]
    fn time_that_goes_back_begins_a_new_stream_and_a_little_late_is_left() {
        let mut tree = FrameTree::new("world", "tool");
        let mut at =
            |ms: i64| tree.add(&[transform("world", "tool", ms, pose(0.001 * ms as f64))], false).unwrap();
        assert_eq!(at(10_000).poses.len() + at(10_004).poses.len() + at(10_008).poses.len(), 3);
        assert_eq!(at(10_002), NewPoses::default());
        let anew = at(20);
        assert!(anew.began_anew && anew.poses.len() == 1, "{anew:?}");
        assert_eq!(at(24).poses.len(), 1);
    }

    #[test]
    fn a_flood_of_frames_ends_it() {
        let mut tree = FrameTree::new("a", "b");
        let flood: Vec<_> =
            (0..=MOST_FRAMES).map(|k| transform("a", &format!("x{k}"), 0, pose(1.0))).collect();
        assert_eq!(tree.add(&flood, false), Err(TreeError::Flood));
    }
}
