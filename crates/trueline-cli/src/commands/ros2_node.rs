//! `trueline ros2-node`.

use crate::args::Ros2NodeArgs;
use crate::commands::history;
use crate::failure::Failure;
use crate::planned_scan::read_text;
use crate::{interrupt, live_placing, output};
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant, SystemTime};
use trueline::open::OpenError;
use trueline_cell::{Placing, Ros2Node, Ros2NodeSettings, Ros2Topic, TRANSFORMS, WatchVerdict};
use trueline_dataset::sensor_toml;
use trueline_vision::Joint;
use trueline_vision::profile::ProfileJoint;
use trueline_watch::State;

/// Interval between checks of the calibration's file and of Ctrl-C.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Runs the command.
pub(crate) fn run(args: &Ros2NodeArgs) -> Result<ExitCode, Failure> {
    let (placing, mut changed) = (placing(args)?, changed(&args.calibration));
    interrupt::watch()?;
    let mut node = Ros2Node::open(settings(args)?, placing).map_err(|error| {
        let hint = "`ros2 topic list -t` shows topics and types; the network's address is one of this PC";
        Failure::new(format!("the node cannot be opened: {error}"), hint)
    })?;
    if !args.quiet {
        output::words(&format!("node /{} publishes /{0}/points (Ctrl-C ends)", args.name));
    }
    let begun = Instant::now();
    let say = |text: &str| {
        if !args.quiet {
            output::words(text);
        }
    };
    while interrupt::times() == 0 && args.for_s.is_none_or(|longest| begun.elapsed() < longest) {
        if let Some((verdict, words)) = args.state.as_deref().map(verdict) {
            node.watched(verdict, words);
        }
        node.run_for(LOOK_EVERY, &mut |news| say(news)).map_err(|error| {
            Failure::new(format!("the node ended: {error}"), "--frames names two frames of one tree")
        })?;
        let now = self::changed(&args.calibration);
        if now != changed {
            changed = now;
            match self::placing(args) {
                Ok(placing) => {
                    node.place_with(placing);
                    say("the calibration was read again");
                }
                // The file may be half written; the previous calibration stays in use.
                Err(failure) => say(&format!("{failure}; the previous calibration stays in use")),
            }
        }
    }
    let counts = node.counts();
    say(&format!(
        "{} poses, {} profiles, {} of them placed, {} seam points, {} messages that could not be read",
        counts.poses, counts.profiles, counts.placed, counts.seam_points, counts.unreadable
    ));
    Ok(ExitCode::SUCCESS)
}

fn changed(file: &Path) -> Option<SystemTime> {
    std::fs::metadata(file).and_then(|about| about.modified()).ok()
}

/// The verdict on the calibration in use by the last weld.
fn verdict(state: &Path) -> (WatchVerdict, String) {
    match history::verdict(state) {
        Ok((State::Good, words)) => (WatchVerdict::Good, words),
        Ok((State::WithinTolerance, words)) => (WatchVerdict::WithinTolerance, words),
        Ok((State::Alarm, words)) => (WatchVerdict::Alarm, words),
        Err(_) => (WatchVerdict::Unknown, format!("{} cannot be read", state.display())),
    }
}

fn placing(args: &Ros2NodeArgs) -> Result<Placing, Failure> {
    let text = read_text(&args.sensor)?;
    let sensor = sensor_toml::parse_file(&args.sensor, &text)?;
    let (placer, tool_from_sensor) = live_placing::of(&args.calibration, &sensor, &text)?;
    Ok(Placing { placer, tool_from_sensor })
}

fn profile_joint(joint: Joint) -> Result<ProfileJoint, Failure> {
    ProfileJoint::of(joint).ok_or_else(|| {
        let error = OpenError::NotInProfiles(joint);
        Failure::new(error.to_string(), error.hint())
    })
}

fn settings(args: &Ros2NodeArgs) -> Result<Ros2NodeSettings, Failure> {
    let urdf = args.urdf.as_deref().map(read_text).transpose()?;
    let is_transforms = args.poses.trim_start_matches('/') == "tf";
    let usual = match (&urdf, is_transforms) {
        (Some(_), _) => "sensor_msgs/msg/JointState",
        (None, true) => TRANSFORMS,
        (None, false) => "geometry_msgs/msg/PoseStamped",
    };
    let message = args.poses_type.clone().unwrap_or_else(|| usual.to_owned());
    // A pose states its frame itself.
    let frames = (urdf.is_some() || message == TRANSFORMS).then(|| args.frames.clone());
    let [base, tool] = args.frames.clone();
    Ok(Ros2NodeSettings {
        name: args.name.clone(),
        poses: Ros2Topic {
            topic: args.poses.clone(),
            message,
            frames,
            urdf,
            domain: args.domain,
            network: args.network,
        },
        profiles: args.profiles.clone(),
        profiles_type: args.profiles_type.clone(),
        frames: [base, tool, args.sensor_frame.clone()],
        joint: args.joint.map(profile_joint).transpose()?,
    })
}
