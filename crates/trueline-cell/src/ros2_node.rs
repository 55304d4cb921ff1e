//! A node of ROS 2: poses and profiles in, points in base out, each at its true exposure.
//!
//! `ros2-client` makes the node, so that `ros2 node list` shows it. Its inputs are read by [`Ros2Source`] and as raw bytes. All
//! stamps are those in the headers, as in the bag of the calibration.

use crate::live_placer::{LivePlacer, PlacedKind, PlacedPoints};
use crate::ros2_dds::{Reader, Unpark, other, participant, reader};
use crate::ros2_messages::{DiagnosticArray, DiagnosticStatus, Header, Level, TfMessage, Time};
use crate::ros2_publishers::Publishers;
use crate::ros2_source::{Ros2Source, Ros2Topic};
use crate::stream_lag::StreamLag;
use ros2_client::{Context, Node, NodeName, NodeOptions};
use rustdds::QosPolicyBuilder;
use rustdds::policy::Reliability;
use std::future::Future;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Poll, Waker};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use trueline_dataset::{Profile, ProfilePoint};
use trueline_geometry::Pose;
use trueline_live::HostClock;
use trueline_live::robot_source::RobotSource;
use trueline_mcap::message::{decode, kind};
use trueline_mcap::{Content, Kind, ProfileEntry};
use trueline_vision::profile::{ProfileJoint, ProfileStream};

/// Interval between checks for profiles.
const LOOK: Duration = Duration::from_millis(2);
/// Interval between diagnoses.
const DIAGNOSE_EVERY: Duration = Duration::from_secs(1);
/// Silence after which poses have ended.
const SILENCE: Duration = Duration::from_secs(1);

/// Inputs and names of a node.
#[derive(Clone, Debug)]
pub struct Ros2NodeSettings {
    /// The node's name, and the prefix of its topics.
    pub name: String,
    /// Topic of the robot's poses; domain and network are the node's.
    pub poses: Ros2Topic,
    /// The topic of profiles.
    pub profiles: String,
    /// Type of its messages: PointCloud2 or LaserScan.
    pub profiles_type: String,
    /// Names of the frames of base, tool and sensor.
    pub frames: [String; 3],
    /// The joint whose seam is searched in the profiles; `None` for the one that they show.
    pub joint: Option<ProfileJoint>,
}

/// The calibration in use by a node.
pub struct Placing {
    /// Placer of the points.
    pub placer: LivePlacer,
    /// Pose of the sensor on the tool; `None` for a sensor beside the robot.
    pub tool_from_sensor: Option<Pose>,
}

/// What `trueline watch` says of the calibration in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WatchVerdict {
    /// No change is seen.
    Good,
    /// A change within the tolerance.
    WithinTolerance,
    /// An alarm.
    Alarm,
    /// The verdict cannot be read.
    Unknown,
}

/// Number of messages so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ros2NodeCounts {
    /// Poses.
    pub poses: u64,
    /// Profiles.
    pub profiles: u64,
    /// Profiles whose points were published in base.
    pub placed: u64,
    /// Seam points that were published in base.
    pub seam_points: u64,
    /// Messages that cannot be decoded.
    pub unreadable: u64,
}

/// A node that is registered in its domain.
pub struct Ros2Node {
    settings: Ros2NodeSettings,
    placing: Placing,
    poses: Ros2Source,
    profiles: Reader,
    seams: ProfileStream,
    out: Publishers,
    counts: Ros2NodeCounts,
    last_pose: Option<Instant>,
    /// Of poses, and of profiles.
    lags: [StreamLag; 2],
    trouble: Option<String>,
    verdict: Option<(WatchVerdict, String)>,
    clock: HostClock,
    spinner: Option<JoinHandle<()>>,
    node: Node,
}

impl Ros2Node {
    /// Registers the node, and publishes the pose of the sensor.
    ///
    /// # Errors
    /// Topics of another type, a domain that DDS does not have, a name that ROS does not allow, or an error of the operating
    /// system.
    pub fn open(settings: Ros2NodeSettings, placing: Placing) -> io::Result<Self> {
        if kind(&settings.profiles_type, "cdr") != Kind::Profile {
            let hint = "use PointCloud2 or LaserScan";
            return Err(io::Error::other(format!("{} contains no profile: {hint}", settings.profiles_type)));
        }
        let clock = HostClock::start();
        let participant = participant(settings.poses.domain, settings.poses.network)?;
        let context = Context::from_domain_participant(participant.clone()).map_err(other)?;
        let name = NodeName::new("/", &settings.name).map_err(other)?;
        let mut node = context.new_node(name, NodeOptions::new()).map_err(other)?;
        let out = Publishers::of(&mut node, &settings.name)?;
        let spin = node.spinner().map_err(other)?.spin();
        let spinner = thread::Builder::new().name("ros2-node".to_owned()).spawn(move || {
            // At its end it only reports that the node is gone.
            let _ended = wait_for(spin);
        })?;
        let qos = QosPolicyBuilder::new().reliability(Reliability::BestEffort).build();
        let profiles = reader(&participant, &settings.profiles, &settings.profiles_type, &qos)?;
        let poses = Ros2Source::of(&participant, settings.poses.clone(), clock)?;
        let node = Self {
            seams: ProfileStream::new(settings.joint),
            settings,
            placing,
            poses,
            profiles,
            out,
            counts: Ros2NodeCounts::default(),
            last_pose: None,
            lags: Default::default(),
            trouble: None,
            verdict: None,
            clock,
            spinner: Some(spinner),
            node,
        };
        node.tell_sensor();
        Ok(node)
    }

    /// Messages so far.
    #[must_use]
    pub fn counts(&self) -> Ros2NodeCounts {
        self.counts
    }

    /// Uses another calibration from now on.
    pub fn place_with(&mut self, placing: Placing) {
        self.placing = placing;
        self.tell_sensor();
    }

    /// Puts the verdict of `trueline watch` among the diagnoses.
    pub fn watched(&mut self, verdict: WatchVerdict, words: String) {
        self.verdict = Some((verdict, words));
    }

    /// Places profiles for a duration. `tell` receives every event that concerns the user.
    ///
    /// # Errors
    /// A contradictory tree of transforms, or an error of DDS.
    pub fn run_for(&mut self, time: Duration, tell: &mut dyn FnMut(&str)) -> io::Result<()> {
        let until = Instant::now() + time;
        let mut diagnosed = Instant::now();
        while Instant::now() < until {
            self.hear_poses()?;
            self.hear_profiles()?;
            if let Some(news) = self.placing.placer.news() {
                tell(&news);
                self.trouble = (news != LivePlacer::AGAIN).then_some(news);
            }
            if diagnosed.elapsed() >= DIAGNOSE_EVERY {
                diagnosed = Instant::now();
                self.diagnose();
            }
        }
        self.diagnose();
        Ok(())
    }

    fn hear_poses(&mut self) -> io::Result<()> {
        let Self { poses, placing, out, settings, counts, last_pose, lags, .. } = self;
        let heard = poses.receive(LOOK, &mut |packet| match &packet.judged {
            Ok((pose, _)) => {
                counts.poses += 1;
                *last_pose = Some(Instant::now());
                lags[0].note(pose.device_ns, packet.arrival.read.wall_ns);
                let publish = |points: PlacedPoints<'_>| publish(out, settings, counts, points);
                placing.placer.pose(pose.device_ns, &pose.base_from_tool, publish);
            }
            Err(why) => counts.unreadable += u64::from(!why.is_needless()),
        });
        heard.map_err(other)
    }

    fn hear_profiles(&mut self) -> io::Result<()> {
        let Self { profiles, placing, out, settings, counts, seams, lags, clock, .. } = self;
        while let Some(change) = profiles.try_take_one().map_err(other)? {
            let Ok(Content::Profile(profile)) = decode(&settings.profiles_type, "cdr", &change.sample) else {
                counts.unreadable += 1;
                continue;
            };
            counts.profiles += 1;
            let stamp_ns = profile.stamp_ns;
            lags[1].note(stamp_ns, clock.read().wall_ns);
            let exposed = Time::of(placing.placer.exposed_ns(stamp_ns));
            out.profile(Header { stamp: exposed, frame_id: settings.frames[2].clone() }, &profile.points);
            let point = |[x_m, z_m]: &[f64; 2]| ProfilePoint { x_m: *x_m, z_m: *z_m, intensity: None };
            let points = profile.points.iter().map(point).collect();
            let columns = profile.points.into_iter().map(Some).collect();
            let entry = ProfileEntry { profile: counts.profiles, stamp_ns, columns };
            placing.placer.profile(&entry, |points| publish(out, settings, counts, points));
            let seen = Profile { stamp_ns, frame: Some(entry.profile), points };
            for feature in seams.push(seen) {
                placing.placer.seam(&feature, |points| publish(out, settings, counts, points));
            }
        }
        Ok(())
    }

    fn tell_sensor(&self) {
        let Some(tool_from_sensor) = &self.placing.tool_from_sensor else { return };
        let [_, tool, sensor] = &self.settings.frames;
        self.out.transform(TfMessage::of(self.header(tool), sensor, tool_from_sensor));
    }

    fn header(&self, frame: &str) -> Header {
        Header { stamp: Time::of(self.clock.read().steady_ns), frame_id: frame.to_owned() }
    }

    fn diagnose(&mut self) {
        let silent = self.last_pose.map(|at| at.elapsed());
        let (level, message) = match (silent, &self.trouble) {
            (None, _) => (Level::Stale, "no pose received".to_owned()),
            (Some(silent), _) if silent > SILENCE => {
                (Level::Stale, format!("no pose for {:.1} s", silent.as_secs_f64()))
            }
            (Some(_), Some(trouble)) => (Level::Warn, trouble.clone()),
            (Some(_), None) => (Level::Ok, "points are placed".to_owned()),
        };
        let Ros2NodeCounts { poses, profiles, placed, seam_points, unreadable } = self.counts;
        let [of_poses, of_profiles] = self.lags.each_mut().map(StreamLag::report);
        let values = [
            ("poses", poses.to_string()),
            ("profiles", profiles.to_string()),
            ("profiles placed", placed.to_string()),
            ("seam points", seam_points.to_string()),
            ("unreadable messages", unreadable.to_string()),
            ("delay of poses", of_poses),
            ("delay of profiles", of_profiles),
        ];
        let name = |what: &str| format!("{}: {what}", self.settings.name);
        let mut status = vec![DiagnosticStatus::of(name("points in base"), level, message, &values)];
        status.extend(self.verdict.as_ref().map(|(verdict, words)| {
            let level = match verdict {
                WatchVerdict::Good => Level::Ok,
                WatchVerdict::WithinTolerance => Level::Warn,
                WatchVerdict::Alarm => Level::Error,
                WatchVerdict::Unknown => Level::Stale,
            };
            DiagnosticStatus::of(name("calibration"), level, words.clone(), &[])
        }));
        self.out.diagnostics(DiagnosticArray { header: self.header(""), status });
    }
}

impl Drop for Ros2Node {
    fn drop(&mut self) {
        self.node.stop_spinner();
        if let Some(spinner) = self.spinner.take() {
            let _panicked = spinner.join();
        }
    }
}

fn publish(
    out: &mut Publishers,
    settings: &Ros2NodeSettings,
    counts: &mut Ros2NodeCounts,
    points: PlacedPoints<'_>,
) {
    match points.kind {
        PlacedKind::Profile => counts.placed += 1,
        PlacedKind::Seam => counts.seam_points += points.in_base_m.len() as u64,
    }
    out.placed(&settings.frames[0], points);
}

/// Runs a future in this thread.
fn wait_for<F: Future>(future: F) -> F::Output {
    let waker = Waker::from(Arc::new(Unpark(thread::current())));
    let mut context = std::task::Context::from_waker(&waker);
    let mut future = pin!(future);
    loop {
        match future.as_mut().poll(&mut context) {
            Poll::Ready(output) => return output,
            Poll::Pending => thread::park(),
        }
    }
}
