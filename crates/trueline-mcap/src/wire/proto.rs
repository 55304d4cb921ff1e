//! The messages of trueline's own topics, as protocol buffers. Numbers of fields are never used for anything else.

use prost::Message;

/// `trueline.RobotDatagram`; `robot` is an `abb.egm.EgmRobot` as it came.
#[derive(Clone, PartialEq, Message)]
pub(super) struct RobotDatagram {
    #[prost(bytes = "vec", tag = "1")]
    pub robot: Vec<u8>,
    #[prost(string, tag = "2")]
    pub source: String,
    #[prost(int64, optional, tag = "3")]
    pub kernel_wall_ns: Option<i64>,
    #[prost(int64, tag = "4")]
    pub read_wall_ns: i64,
    #[prost(int64, tag = "5")]
    pub steady_ns: i64,
    #[prost(int64, tag = "6")]
    pub device_ns: i64,
    #[prost(int64, optional, tag = "7")]
    pub ptp_ns: Option<i64>,
}

/// `trueline.RobotPacket`
#[derive(Clone, PartialEq, Message)]
pub(super) struct RobotPacket {
    #[prost(bytes = "vec", tag = "1")]
    pub packet: Vec<u8>,
    #[prost(string, tag = "2")]
    pub source: String,
    #[prost(int64, optional, tag = "3")]
    pub kernel_wall_ns: Option<i64>,
    #[prost(int64, tag = "4")]
    pub read_wall_ns: i64,
    #[prost(int64, tag = "5")]
    pub steady_ns: i64,
    #[prost(int64, tag = "6")]
    pub device_ns: i64,
}

/// `trueline.RejectedDatagram`
#[derive(Clone, PartialEq, Message)]
pub(super) struct RejectedDatagram {
    #[prost(bytes = "vec", tag = "1")]
    pub datagram: Vec<u8>,
    #[prost(string, tag = "2")]
    pub source: String,
    #[prost(int64, tag = "3")]
    pub steady_ns: i64,
    #[prost(string, tag = "4")]
    pub reason: String,
}

/// `trueline.Answer`; `sensor` is an `abb.egm.EgmSensor` as it was sent.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Answer {
    #[prost(bytes = "vec", tag = "1")]
    pub sensor: Vec<u8>,
    #[prost(string, tag = "2")]
    pub destination: String,
    #[prost(int64, tag = "3")]
    pub steady_ns: i64,
    #[prost(uint32, tag = "4")]
    pub sequence: u32,
}

/// `trueline.Inputs`: what stood before a change of the robot's digital inputs, and after it.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Inputs {
    #[prost(int64, tag = "1")]
    pub before_ns: i64,
    #[prost(int64, tag = "2")]
    pub steady_ns: i64,
    #[prost(int64, tag = "3")]
    pub device_before_ns: i64,
    #[prost(int64, tag = "4")]
    pub device_ns: i64,
    #[prost(uint64, tag = "5")]
    pub bits_before: u64,
    #[prost(uint64, tag = "6")]
    pub bits: u64,
}

/// `trueline.Clock`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Clock {
    #[prost(int64, tag = "1")]
    pub steady_ns: i64,
    #[prost(int64, tag = "2")]
    pub wall_ns: i64,
}

/// `trueline.Frame`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Frame {
    #[prost(uint64, tag = "1")]
    pub frame: u64,
    #[prost(int64, tag = "2")]
    pub stamp_ns: i64,
    #[prost(int64, optional, tag = "3")]
    pub first_packet_ns: Option<i64>,
    #[prost(int64, optional, tag = "4")]
    pub complete_ns: Option<i64>,
    #[prost(int64, optional, tag = "5")]
    pub device_ns: Option<i64>,
    #[prost(double, optional, tag = "6")]
    pub exposure_us: Option<f64>,
    #[prost(string, tag = "7")]
    pub status: String,
    #[prost(uint64, tag = "8")]
    pub picture_bytes: u64,
    #[prost(int64, optional, tag = "9")]
    pub encoder: Option<i64>,
    #[prost(uint64, optional, tag = "10")]
    pub lines: Option<u64>,
    #[prost(int64, optional, tag = "11")]
    pub counter: Option<i64>,
    #[prost(uint64, optional, tag = "12")]
    pub camera_frame: Option<u64>,
}

/// `trueline.Features`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Features {
    #[prost(message, repeated, tag = "1")]
    pub features: Vec<Feature>,
}

/// `trueline.Feature`: exactly one of `pixel` (2 numbers, px), `point` (3, m) and `profile` (2, m) has numbers.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Feature {
    #[prost(int64, tag = "1")]
    pub stamp_ns: i64,
    #[prost(uint32, tag = "2")]
    pub line: u32,
    #[prost(uint64, optional, tag = "3")]
    pub frame: Option<u64>,
    #[prost(int64, optional, tag = "4")]
    pub device_ns: Option<i64>,
    #[prost(double, repeated, tag = "5")]
    pub pixel: Vec<f64>,
    #[prost(double, repeated, tag = "6")]
    pub point: Vec<f64>,
    #[prost(double, repeated, tag = "7")]
    pub profile: Vec<f64>,
    #[prost(double, repeated, tag = "8")]
    pub sigma: Vec<f64>,
    #[prost(double, tag = "9")]
    pub correlation: f64,
}
