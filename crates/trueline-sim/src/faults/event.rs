//! Things that happen once during a recording.

use super::fault::Event;
use crate::noise::Noise;
use crate::scenario::Scenario;
use crate::simulate;
use trueline_dataset::{Feature, Measured, Recording};

impl Event {
    /// Lets this happen in a recording; `None` for a scenario without a line.
    pub(crate) fn apply(self, recording: &mut Recording, scenario: &Scenario, seed: u64) -> Option<()> {
        let (start_ns, end_ns) = (recording.robot.first()?.stamp_ns, recording.robot.last()?.stamp_ns);
        let at = |part: f64| start_ns + ((end_ns - start_ns) as f64 * part) as i64;
        match self {
            Self::Bursts => bursts(&mut recording.features, scenario, seed),
            Self::SecondLine => {
                let astray = |f: &Feature| (at(0.4)..at(0.65)).contains(&f.stamp_ns);
                let edge = seen_on_line_beside(scenario, seed, 0.005)?;
                recording.features.retain(|f| f.line != 0 || !astray(f));
                recording.features.extend(edge.into_iter().filter(astray));
                recording.features.sort_by_key(|f| f.stamp_ns);
            }
            Self::RobotGaps => recording.robot.retain(|s| {
                ![0.3, 0.7].iter().any(|part| (at(*part)..at(*part) + 400_000_000).contains(&s.stamp_ns))
            }),
            Self::DuplicateRows => {
                let twice = |(k, sample)| std::iter::repeat_n(sample, if k % 50 == 7 { 2 } else { 1 });
                recording.robot = recording.robot.drain(..).enumerate().flat_map(twice).collect();
            }
            Self::RobotClockStep => {
                for sample in recording.robot.iter_mut().filter(|s| s.stamp_ns >= at(2.0 / 3.0)) {
                    sample.stamp_ns += 80_000_000;
                }
            }
            Self::LateImages => {
                for feature in recording.features.iter_mut().filter(|f| f.stamp_ns >= at(2.0 / 3.0)) {
                    feature.stamp_ns += 45_000_000;
                }
            }
        }
        Some(())
    }
}

fn bursts(features: &mut [Feature], scenario: &Scenario, seed: u64) {
    let mut noise = Noise::new(seed, 5);
    let count = features.len();
    for start in [count / 5, count / 2, 4 * count / 5] {
        // The bad points stand together, as a reflection does.
        let sheet = crate::capture::SheetAxes::of(&scenario.cell.sensor);
        let wrong = noise.outlier(&scenario.cell.sensor, &sheet);
        for feature in features.iter_mut().skip(start).take(20) {
            feature.measured = beside(wrong, noise.normal(1.0));
        }
    }
}

fn beside(measured: Measured, by: f64) -> Measured {
    match measured {
        Measured::Pixel([u, v]) => Measured::Pixel([u + by, v]),
        Measured::Profile([x, z]) => Measured::Profile([x + 1e-4 * by, z]),
        Measured::Point([x, y, z]) => Measured::Point([x + 1e-4 * by, y, z]),
    }
}

/// The same scan's view of a parallel line, under the label of the first.
fn seen_on_line_beside(scenario: &Scenario, seed: u64, by_m: f64) -> Option<Vec<Feature>> {
    let mut other = scenario.clone();
    let seam = scenario.cell.lines.first()?;
    // The path still follows the first line.
    other.cell.lines = vec![*seam, super::feature_error::line_beside(scenario, seam, by_m)];
    let seen = simulate(&other, seed)?.features;
    Some(seen.into_iter().filter(|f| f.line == 1).map(|f| Feature { line: 0, ..f }).collect())
}
