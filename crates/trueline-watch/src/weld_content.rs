//! The content of a weld as one number, to recognise it again.

use sha2::{Digest, Sha256};
use trueline_dataset::{Measured, Recording};

/// The content of a recording as one number: stamps, poses, features and stripes, independent of the file.
pub(crate) fn content(recording: &Recording) -> String {
    let mut hash = Sha256::new();
    for sample in &recording.robot {
        hash.update(sample.stamp_ns.to_le_bytes());
        let pose = &sample.base_from_tool;
        let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
        numbers.for_each(|x| hash.update(x.to_le_bytes()));
    }
    for feature in &recording.features {
        hash.update(feature.stamp_ns.to_le_bytes());
        hash.update(feature.line.to_le_bytes());
        numbers(&feature.measured).iter().for_each(|x| hash.update(x.to_le_bytes()));
    }
    for stripe in &recording.stripes {
        hash.update(stripe.stamp_ns.to_le_bytes());
        hash.update(stripe.plate.to_le_bytes());
        stripe
            .points
            .iter()
            .for_each(|point| numbers(point).iter().for_each(|x| hash.update(x.to_le_bytes())));
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

fn numbers(of: &Measured) -> &[f64] {
    match of {
        Measured::Pixel(numbers) | Measured::Profile(numbers) => numbers,
        Measured::Point(numbers) => numbers,
    }
}
