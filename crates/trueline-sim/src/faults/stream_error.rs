//! Streams with wrong stamps or rows.

use super::fault::StreamError;
use crate::noise::Noise;
use crate::scenario::Scenario;
use std::f64::consts::TAU;
use trueline_dataset::{Feature, Recording};

impl StreamError {
    /// Spoils the streams of a recording.
    pub(crate) fn apply(self, recording: &mut Recording, scenario: &Scenario, seed: u64) {
        let duration_s = scenario.timing.duration_s;
        let features = &mut recording.features;
        let start_ns = scenario.timing.start_ns;
        let part = move |stamp_ns: i64| (stamp_ns - start_ns) as f64 * 1e-9 / duration_s;
        match self {
            Self::ImageGrain { grain_s } => features.iter_mut().for_each(|f| cut(&mut f.stamp_ns, grain_s)),
            Self::RobotGrain { grain_s } => {
                recording.robot.iter_mut().for_each(|s| cut(&mut s.stamp_ns, grain_s));
            }
            Self::OffsetDrift { change_s } => shift(features, |ns| change_s * (part(ns) - 0.5)),
            Self::OffsetSwing { amplitude_s } => shift(features, |ns| amplitude_s * (TAU * part(ns)).sin()),
            Self::OffsetStep { step_s } => shift(features, |ns| if part(ns) >= 0.5 { step_s } else { 0.0 }),
            Self::DoubledFrames { share } => double(features, Noise::new(seed, STREAM), share),
            Self::UncountedLosses { share } => lose(features, Noise::new(seed, STREAM), share),
            Self::FrameSlip { frames } => {
                let by_s = frames * scenario.timing.frame_period_s;
                shift(features, |ns| if part(ns) >= 0.5 { by_s } else { 0.0 });
            }
            Self::LateArrival { mean_s } => arrive_late(features, Noise::new(seed, STREAM), mean_s),
        }
    }
}

/// Stream of random numbers for random errors of frames.
const STREAM: u64 = 22;

fn cut(stamp_ns: &mut i64, grain_s: f64) {
    let grain_ns = (grain_s * 1e9).round() as i64;
    *stamp_ns -= stamp_ns.rem_euclid(grain_ns.max(1));
}

fn shift(features: &mut [Feature], by_s: impl Fn(i64) -> f64) {
    for feature in features {
        feature.stamp_ns += (by_s(feature.stamp_ns) * 1e9).round() as i64;
    }
}

fn double(features: &mut [Feature], mut chance: Noise, share: f64) {
    for k in 1..features.len() {
        if chance.happens(share) && features[k].line == features[k - 1].line {
            features[k].measured = features[k - 1].measured;
        }
    }
}

fn lose(features: &mut Vec<Feature>, mut chance: Noise, share: f64) {
    let (mut last, mut lost, mut losses) = (None, false, 0);
    features.retain_mut(|feature| {
        if last != feature.frame {
            last = feature.frame;
            lost = chance.happens(share);
            losses += u64::from(lost);
        }
        feature.frame = feature.frame.map(|frame| frame - losses.min(frame));
        !lost
    });
}

fn arrive_late(features: &mut [Feature], mut chance: Noise, mean_s: f64) {
    let mut last_ns = i64::MIN;
    let (mut frame_ns, mut delay_s) = (i64::MIN, 0.0);
    for feature in features {
        if feature.stamp_ns != frame_ns {
            frame_ns = feature.stamp_ns;
            delay_s = -mean_s * chance.uniform(f64::MIN_POSITIVE, 1.0).ln();
        }
        feature.stamp_ns = last_ns.max(feature.stamp_ns + (delay_s * 1e9).round() as i64);
        last_ns = feature.stamp_ns;
    }
}
