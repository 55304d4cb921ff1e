//! Poses composed from the transforms of a tree, and trees that are none.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use trueline_cell::frame_tree::{FrameTree, NewPoses, TreeError};
use trueline_geometry::Pose;
use trueline_mcap::message::StampedTransform;

const MS: i64 = 1_000_000;

fn transform(parent: &str, child: &str, stamp_ms: i64, parent_from_child: Pose) -> StampedTransform {
    let (parent, child) = (parent.to_owned(), child.to_owned());
    StampedTransform { stamp_ns: stamp_ms * MS, parent, child, parent_from_child }
}

fn pose(seed: f64) -> Pose {
    Pose::new([seed, 0.2 * seed, -0.3].into(), [seed.sin(), (1.3 * seed).cos(), 0.4].into())
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
    let flood: Vec<_> = (0..=10_000).map(|k| transform("a", &format!("x{k}"), 0, pose(1.0))).collect();
    assert_eq!(tree.add(&flood, false), Err(TreeError::Flood));
}
