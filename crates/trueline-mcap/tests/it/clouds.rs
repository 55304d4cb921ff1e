//! Clouds as an MCAP file, read by the library of its authors.

use foxglove::messages::PointCloud;
use prost::Message;
use std::io::Cursor;
use trueline_mcap::{CLOUD_TOPIC, CloudFile};

#[test]
fn every_frame_is_a_message_with_all_its_columns() {
    let mut bytes = Cursor::new(Vec::new());
    let mut file = CloudFile::create(&mut bytes, &["intensity", "sigma"]).unwrap();
    let frames: Vec<(i64, Vec<f64>)> =
        (0..4).map(|k| (1_700_000_000_000_000_001 + k, vec![0.5 + k as f64; 5 * k as usize])).collect();
    for (exposed_ns, numbers) in &frames {
        file.frame(*exposed_ns, numbers).unwrap();
    }
    file.finish().unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(bytes.get_ref()).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.len(), frames.len());
    for (message, (exposed_ns, numbers)) in messages.iter().zip(&frames) {
        assert_eq!(message.channel.topic, CLOUD_TOPIC);
        assert_eq!(message.log_time, *exposed_ns as u64);
        let cloud = PointCloud::decode(&*message.data).unwrap();
        let names: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["x", "y", "z", "intensity", "sigma"]);
        assert_eq!((cloud.frame_id.as_str(), cloud.point_stride), ("base", 40));
        let read: Vec<f64> =
            cloud.data.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap())).collect();
        assert_eq!(&read, numbers);
    }
}
