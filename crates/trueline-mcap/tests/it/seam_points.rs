//! Seam points in base as an MCAP file, read by the library of its authors.

use foxglove::messages::PointCloud;
use prost::Message;
use trueline_mcap::{ImagePoints, SEAM_TOPIC, seam_points};

#[test]
fn every_image_is_a_cloud_at_its_exposure() {
    let images: Vec<ImagePoints> = (0..3)
        .map(|k: u32| ImagePoints {
            exposed_ns: 1_700_000_000_123_456_789 + i64::from(k) * 33_000_000,
            in_base_m: (0..=k).map(|n| [1.15 + f64::from(n), -0.08, f64::from(k) / 3.0]).collect(),
        })
        .collect();
    let bytes = seam_points(&images).unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.len(), images.len());
    for (message, image) in messages.iter().zip(&images) {
        assert_eq!(message.channel.topic, SEAM_TOPIC);
        assert_eq!(message.channel.schema.as_ref().unwrap().name, "foxglove.PointCloud");
        assert_eq!(message.log_time, image.exposed_ns as u64);
        let cloud = PointCloud::decode(&*message.data).unwrap();
        assert_eq!((cloud.frame_id.as_str(), cloud.point_stride, cloud.fields.len()), ("base", 24, 3));
        let numbers: Vec<f64> =
            cloud.data.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap())).collect();
        assert_eq!(numbers, image.in_base_m.concat());
    }
}
