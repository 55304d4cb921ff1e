//! What a weld holds, as one number, by which it is known again.

use sha2::{Digest, Sha256};
use trueline_dataset::{Measured, Recording};

/// What a recording holds, as one number: stamps, poses, features and stripes, whatever file they came from.
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
