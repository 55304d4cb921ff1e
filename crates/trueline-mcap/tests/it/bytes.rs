//! Bytes of strangers: understood or refused, never more.

use crate::common;

use common::{T0, compressed_image, png, pose, pose_stamped, ros1_text, tf};
use proptest::prelude::*;
use trueline_mcap::message::ros_cursor::RosCursor;
use trueline_mcap::{Content, ContentError, message};

const SCHEMAS: [(&str, &str); 18] = [
    ("geometry_msgs/msg/PoseStamped", "cdr"),
    ("geometry_msgs/msg/TransformStamped", "cdr"),
    ("tf2_msgs/msg/TFMessage", "cdr"),
    ("sensor_msgs/msg/JointState", "cdr"),
    ("sensor_msgs/msg/Image", "cdr"),
    ("sensor_msgs/msg/CompressedImage", "cdr"),
    ("geometry_msgs/PoseStamped", "ros1"),
    ("tf2_msgs/TFMessage", "ros1"),
    ("sensor_msgs/JointState", "ros1"),
    ("sensor_msgs/Image", "ros1"),
    ("sensor_msgs/CompressedImage", "ros1"),
    ("foxglove.PoseInFrame", "protobuf"),
    ("foxglove.FrameTransform", "protobuf"),
    ("foxglove.FrameTransforms", "protobuf"),
    ("foxglove.RawImage", "protobuf"),
    ("foxglove.CompressedImage", "protobuf"),
    ("trueline.Frame", "protobuf"),
    ("trueline.Features", "protobuf"),
];

/// A ROS 2 message, field by field: the opposite of the cursor, written apart from it.
struct Cdr {
    bytes: Vec<u8>,
    big: bool,
    most: usize,
}

impl Cdr {
    fn new(representation: u8) -> Self {
        let big = representation.is_multiple_of(2);
        Self { bytes: vec![0, representation, 0, 0], big, most: if representation < 2 { 8 } else { 4 } }
    }

    fn number(mut self, big_endian: &[u8]) -> Self {
        while !(self.bytes.len() - 4).is_multiple_of(big_endian.len().min(self.most)) {
            self.bytes.push(0xaa);
        }
        let mut number = big_endian.to_vec();
        if !self.big {
            number.reverse();
        }
        self.bytes.extend(number);
        self
    }

    fn text(self, text: &str) -> Self {
        let mut next = self.number(&(text.len() as u32 + 1).to_be_bytes());
        next.bytes.extend(text.as_bytes());
        next.bytes.push(0);
        next
    }

    fn f64(self, value: f64) -> Self {
        self.number(&value.to_bits().to_be_bytes())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn poses_come_back_in_every_form_of_cdr(
        form in 0..4_usize,
        s in any::<i32>(),
        ns in 0..1_000_000_000_u32,
        frame in "[a-z_ä]{0,9}",
        p in prop::array::uniform3(-1e3..1e3),
    ) {
        let mut cdr = Cdr::new([0, 1, 6, 7][form]);
        cdr = cdr.number(&s.to_be_bytes()).number(&ns.to_be_bytes()).text(&frame);
        for value in p.into_iter().chain([0.0, 0.6, 0.0, 0.8]) {
            cdr = cdr.f64(value);
        }
        let content = message::decode("geometry_msgs/msg/PoseStamped", "cdr", &cdr.bytes).unwrap();
        let Content::Pose(read) = content else { panic!("{content:?}") };
        prop_assert_eq!(read.stamp_ns, i64::from(s) * 1_000_000_000 + i64::from(ns));
        prop_assert_eq!(read.frame, frame);
        prop_assert_eq!(<[f64; 3]>::from(read.pose.translation.vector), p);
        prop_assert!((read.pose.rotation.j - 0.6).abs() < 1e-15);
        // Every shorter message is refused, and one with more than padding behind it.
        for cut in 0..cdr.bytes.len() {
            prop_assert!(message::decode("geometry_msgs/msg/PoseStamped", "cdr", &cdr.bytes[..cut]).is_err());
        }
        cdr.bytes.extend([0; 8]);
        let longer = message::decode("geometry_msgs/msg/PoseStamped", "cdr", &cdr.bytes);
        prop_assert_eq!(longer, Err(ContentError::TooLong { bytes: 8 }));
    }

    #[test]
    fn no_bytes_make_a_decoder_panic(
        which in 0..SCHEMAS.len(),
        representation in prop::sample::select(vec![0_u8, 1, 6, 7, 3]),
        bytes in prop::collection::vec(any::<u8>(), 0..400),
    ) {
        let (schema, encoding) = SCHEMAS[which];
        drop(message::decode(schema, encoding, &bytes));
        drop(message::decode(schema, encoding, &[&[0, representation, 0, 0], bytes.as_slice()].concat()));
    }

    /// Small numbers are lengths that nearly fit.
    #[test]
    fn no_lengths_make_a_decoder_panic(
        which in 0..SCHEMAS.len(),
        words in prop::collection::vec(prop_oneof![0..40_u32, any::<u32>()], 0..60),
    ) {
        let (schema, encoding) = SCHEMAS[which];
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        drop(message::decode(schema, encoding, &bytes));
        drop(message::decode(schema, encoding, &[&[0, 1, 0, 0], bytes.as_slice()].concat()));
    }

    #[test]
    fn no_change_of_a_good_message_makes_a_decoder_panic(
        which in 0..3_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        cut in any::<prop::sample::Index>(),
    ) {
        let good = [
            pose_stamped("", T0, "base", &pose(1)),
            tf("", &[(T0, "base", "tool", pose(1)), (T0, "tool", "camera", pose(2))]),
            compressed_image("", T0, "png", &png(3)),
        ];
        let mut bytes = good[which].bytes.clone();
        for (at, byte) in changes {
            *at.get_mut(&mut bytes) = byte;
        }
        drop(message::decode(good[which].schema, "ros1", &bytes));
        let end = cut.index(bytes.len());
        // A changed length may fit the remaining bytes: only truncation alone is sure to be refused.
        drop(message::decode(good[which].schema, "ros1", &bytes[..end]));
        prop_assert!(message::decode(good[which].schema, "ros1", &good[which].bytes[..end]).is_err());
    }

    /// For any requests in any order.
    #[test]
    fn no_reading_goes_behind_the_end(bytes in prop::collection::vec(any::<u8>(), 4..200), asked in prop::collection::vec(0..7, 0..40)) {
        for mut cursor in [Some(RosCursor::ros1(&bytes)), RosCursor::ros2(&bytes).ok()].into_iter().flatten() {
            for what in &asked {
                match what {
                    0 => drop(cursor.u8("a")),
                    1 => drop(cursor.u32("a")),
                    2 => drop(cursor.i32("a")),
                    3 => drop(cursor.f64("a")),
                    4 => drop(cursor.bytes("a")),
                    5 => drop(cursor.text("a")),
                    _ => drop(cursor.count(8, "a")),
                }
            }
        }
    }
}

#[test]
fn texts_end_as_they_should() {
    let read = |bytes: &[u8]| RosCursor::ros2(bytes).unwrap().text("it").map(str::to_owned);
    assert_eq!(read(&[0, 1, 0, 0, 2, 0, 0, 0, b'a', 0]), Ok("a".to_owned()));
    assert_eq!(read(&[0, 1, 0, 0, 0, 0, 0, 0]), Ok(String::new()));
    assert_eq!(read(&[0, 1, 0, 0, 1, 0, 0, 0, b'a']), Err(ContentError::NotText { field: "it" }));
    assert_eq!(read(&[0, 1, 0, 0, 2, 0, 0, 0, 0xff, 0]), Err(ContentError::NotText { field: "it" }));
    assert_eq!(RosCursor::ros1(&ros1_text("a")).text("it"), Ok("a"));
    assert_eq!(RosCursor::ros2(&[0, 2, 0, 0]).err(), Some(ContentError::Representation { found: 2 }));
    assert_eq!(RosCursor::ros2(&[0, 1, 0]).err(), Some(ContentError::CutOff { field: "the preamble" }));
}

#[test]
fn pictures_whose_size_does_not_fit_are_refused() {
    let image = |height: u32, width: u32, step: u32, bytes: usize| {
        let cdr = Cdr::new(1).number(&[0; 4]).number(&[0; 4]).text("camera");
        let mut cdr = cdr.number(&height.to_be_bytes()).number(&width.to_be_bytes()).text("mono8");
        cdr.bytes.push(0);
        cdr = cdr.number(&step.to_be_bytes()).number(&(bytes as u32).to_be_bytes());
        cdr.bytes.extend(vec![0; bytes]);
        message::decode("sensor_msgs/msg/Image", "cdr", &cdr.bytes)
    };
    assert!(image(3, 2, 2, 6).is_ok());
    assert!(image(3, 2, 4, 12).is_ok());
    for (height, width, step, bytes) in [
        (3, 2, 2, 5),
        (3, 2, 2, 7),
        (3, 3, 2, 6),
        (0, 2, 2, 0),
        (3, 0, 2, 6),
        (u32::MAX, u32::MAX, u32::MAX, 8),
    ] {
        let refused = image(height, width, step, bytes);
        assert!(matches!(refused, Err(ContentError::PictureSize { .. })), "{refused:?}");
    }
}
