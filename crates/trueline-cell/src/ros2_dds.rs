//! DDS as ROS 2 uses it: names, and messages as raw bytes.

use rustdds::dds::adapters::no_key::{Decode, DefaultDecoder, DeserializerAdapter};
use rustdds::no_key::SimpleDataReader;
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, QosPolicies, RepresentationIdentifier, TopicKind,
};
use std::convert::Infallible;
use std::io;
use std::net::IpAddr;
use std::sync::Arc;
use std::task::Wake;
use std::thread::Thread;

/// Ports of higher domains belong to the operating system.
const LARGEST_DOMAIN: u16 = 232;

/// Time that a writer waits before it may drop a message.
pub(crate) const PATIENCE: rustdds::Duration = rustdds::Duration::from_millis(100);

/// A reader of raw messages.
pub(crate) type Reader = SimpleDataReader<Vec<u8>, AsItCame>;

/// This program in a domain, on a single network.
///
/// # Errors
/// A domain that DDS does not have, or an error of the operating system.
pub(crate) fn participant(domain: u16, network: IpAddr) -> io::Result<DomainParticipant> {
    if domain > LARGEST_DOMAIN {
        return Err(io::Error::other(format!("ROS_DOMAIN_ID is 0 to {LARGEST_DOMAIN}")));
    }
    DomainParticipantBuilder::new(domain)
        .with_only_networks([network])
        .same_host_loopback(network.is_loopback())
        .build()
        .map_err(other)
}

/// A reader of a topic of ROS.
pub(crate) fn reader(
    participant: &DomainParticipant,
    topic: &str,
    message: &str,
    qos: &QosPolicies,
) -> io::Result<Reader> {
    let named = format!("rt/{}", topic.trim_start_matches('/'));
    let dds = participant.create_topic(named, dds_type(message), qos, TopicKind::NoKey).map_err(other)?;
    let subscriber = participant.create_subscriber(qos).map_err(other)?;
    subscriber.create_simple_datareader_no_key(&dds, Some(qos.clone())).map_err(other)
}

/// Wraps an error of DDS.
pub(crate) fn other(error: impl std::fmt::Display) -> io::Error {
    io::Error::other(error.to_string())
}

/// `geometry_msgs/msg/PoseStamped` is `geometry_msgs::msg::dds_::PoseStamped_`.
pub(crate) fn dds_type(message: &str) -> String {
    let (package, name) = message.split_once('/').unwrap_or((message, ""));
    format!("{package}::msg::dds_::{}_", name.trim_start_matches("msg/"))
}

/// Wakes a thread.
pub(crate) struct Unpark(pub(crate) Thread);

impl Wake for Unpark {
    fn wake(self: Arc<Self>) {
        self.0.unpark();
    }
}

/// A message's bytes with the header that states their encoding, as in a bag.
pub(crate) struct AsItCame;

impl DeserializerAdapter<Vec<u8>> for AsItCame {
    type Error = Infallible;
    type Decoded = Vec<u8>;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: Vec<u8>) -> Vec<u8> {
        decoded
    }
}

impl DefaultDecoder<Vec<u8>> for AsItCame {
    type Decoder = WithHead;
    const DECODER: WithHead = WithHead;
}

#[derive(Clone)]
pub(crate) struct WithHead;

impl Decode<'_, Vec<u8>> for WithHead {
    type Error = Infallible;

    fn decode_bytes(self, bytes: &[u8], encoding: RepresentationIdentifier) -> Result<Vec<u8>, Infallible> {
        let little = u8::from(encoding == RepresentationIdentifier::CDR_LE);
        Ok([&[0, little, 0, 0], bytes].concat())
    }
}
