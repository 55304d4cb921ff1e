//! The topics that the node publishes, and their messages.

use crate::live_placer::{PlacedKind, PlacedPoints};
use crate::ros2_dds::other;
use crate::ros2_marker::Marker;
use crate::ros2_messages::{DiagnosticArray, Header, PointCloud2, TfMessage, Time};
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::{MessageTypeName, Name, Node, Publisher, QosProfile};
use serde::Serialize;
use std::io;

/// Seam points that viewers show; of more, the oldest are replaced.
const SEAM_POINTS: i32 = 1000;

/// The publishers. A message may be lost, without a subscriber or to a slow one: the next is more useful than this one.
pub(crate) struct Publishers {
    points: Publisher<PointCloud2>,
    profile: Publisher<PointCloud2>,
    seam: Publisher<Marker>,
    transform: Publisher<TfMessage>,
    diagnostics: Publisher<DiagnosticArray>,
    next_seam_point: i32,
}

impl Publishers {
    /// Those of a node, under its name.
    ///
    /// # Errors
    /// A name that ROS does not allow, or an error of DDS.
    pub(crate) fn of(node: &mut Node, name: &str) -> io::Result<Self> {
        let latest = QosProfile::publisher_default()
            .reliability_reliable(WhenFull::Fail)
            .history(History::KeepLast { depth: 10 });
        // Seam points are found by the second: all of one second are sent at once.
        let many = latest.clone().history(History::KeepLast { depth: SEAM_POINTS as usize });
        let kept = latest.clone().durability(Durability::TransientLocal);
        let own = |topic: &str| format!("/{name}/{topic}");
        Ok(Self {
            points: publisher(node, &own("points"), ("sensor_msgs", "PointCloud2"), &latest)?,
            profile: publisher(node, &own("profile"), ("sensor_msgs", "PointCloud2"), &latest)?,
            seam: publisher(node, &own("seam"), ("visualization_msgs", "Marker"), &many)?,
            transform: publisher(node, "/tf_static", ("tf2_msgs", "TFMessage"), &kept)?,
            diagnostics: publisher(node, "/diagnostics", ("diagnostic_msgs", "DiagnosticArray"), &latest)?,
            next_seam_point: 0,
        })
    }

    /// A profile in the sensor's frame, m.
    pub(crate) fn profile(&self, header: Header, points: &[[f64; 2]]) {
        let points = points.iter().map(|[x_m, z_m]| [*x_m, 0.0, *z_m]);
        let _sent = self.profile.publish(PointCloud2::of(header, ["x", "y", "z"], points));
    }

    /// Points in base: those of a profile, or of the seam.
    pub(crate) fn placed(&mut self, base: &str, points: PlacedPoints<'_>) {
        let header = Header { stamp: Time::of(points.exposed_ns), frame_id: base.to_owned() };
        let each = points.in_base_m.iter().zip(points.sigma_m);
        match points.kind {
            PlacedKind::Profile => {
                let numbers =
                    each.zip(points.after_s).map(|(([x, y, z], sigma), t)| [*x, *y, *z, *t, *sigma]);
                let cloud = PointCloud2::of(header, ["x", "y", "z", "t", "sigma"], numbers);
                let _sent = self.points.publish(cloud);
            }
            PlacedKind::Seam => {
                for (in_base_m, sigma_m) in each {
                    let id = self.next_seam_point;
                    self.next_seam_point = (id + 1) % SEAM_POINTS;
                    let _sent =
                        self.seam.publish(Marker::point(header.clone(), "seam", id, *in_base_m, *sigma_m));
                }
            }
        }
    }

    /// A transform that does not change. A lost one is sent again with the next calibration; the queue of this topic is
    /// never full.
    pub(crate) fn transform(&self, transform: TfMessage) {
        let _sent = self.transform.publish(transform);
    }

    pub(crate) fn diagnostics(&self, diagnoses: DiagnosticArray) {
        let _sent = self.diagnostics.publish(diagnoses);
    }
}

fn publisher<M: Serialize>(
    node: &mut Node,
    topic: &str,
    (package, message): (&str, &str),
    qos: &QosProfile,
) -> io::Result<Publisher<M>> {
    let name = Name::parse(topic).map_err(other)?;
    let topic = node.create_topic(&name, MessageTypeName::new(package, message), qos).map_err(other)?;
    node.create_publisher(&topic, None).map_err(other)
}
