//! Sampling times of both streams: as stamped, or by their clocks.

use crate::config::{Config, ResidualKind, Stamps};
use crate::input::clock_line::SILENCE_TICKS;
use crate::input::clock_model::{self, StreamClock, Ticks};
use crate::order_statistics::median;
use std::collections::BTreeMap;
use trueline_dataset::Recording;
use trueline_dataset::picture_rows::PicturesOfRows;

/// The stamps of one stream, one for each sample, rising, without duplicates.
#[derive(Clone, Debug)]
pub struct Stream {
    /// As recorded, s since the start of the recording.
    pub recorded_s: Vec<f64>,
    /// The underlying clock, if they come from a regular tick.
    pub clock: Option<StreamClock>,
    /// Samples that repeat the previous stamp: several rows of one sample, or a row recorded twice.
    pub doubles: usize,
    /// Resolution of the stamps if it is coarser than the sampling, s.
    pub grain_s: Option<f64>,
    /// First stamp of each joined recording except the first, s.
    pub joined_from_s: Vec<f64>,
}

/// The stamps of robot and images.
#[derive(Clone, Debug)]
pub struct Sampling {
    /// Robot poses.
    pub robot: Stream,
    /// Images: features of one image count once.
    pub images: Stream,
}

/// The streams that use clock times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dejittered {
    /// Robot poses.
    pub robot: bool,
    /// Images.
    pub images: bool,
}

/// Properties of a stream's stamps, and their treatment.
#[derive(Clone, Debug, PartialEq)]
pub struct StampReport {
    /// Number of samples with a stamp of their own.
    pub count: usize,
    /// Rows that repeat the stamp of the row before.
    pub doubles: usize,
    /// Median time between stamps, s.
    pub median_period_s: f64,
    /// Longest time between stamps, s.
    pub longest_gap_s: f64,
    /// Sampling period of the clock, s. `None` if no constant sampling period was found.
    pub period_s: Option<f64>,
    /// Standard deviation of the stamps about that clock, s.
    pub jitter_s: Option<f64>,
    /// Samples missing between the first and the last, over all joined recordings.
    pub missing: Option<usize>,
    /// Pauses of more than four periods.
    pub silences: usize,
    /// Rate of the device's clock against the receiver's, ppm, if device stamps are recorded.
    pub device_drift_ppm: Option<f64>,
    /// Whether delays are one-sided, so that the clock follows their floor.
    pub one_sided: bool,
    /// Median and largest lateness of the stamps against that clock, s.
    pub lateness_s: Option<[f64; 2]>,
    /// Largest deviation of the clock from a regular tick, if it wanders, s.
    pub wander_s: Option<f64>,
    /// Steps of the receive clock: time and height, s.
    pub steps: Vec<(f64, f64)>,
    /// Whether the only step was removed from the clock.
    pub step_taken_out: bool,
    /// Resolution of the stamps if it is coarser than the sampling, s.
    pub grain_s: Option<f64>,
    /// Whether the sampling times come from the clock.
    pub dejittered: bool,
}

/// Finer resolution is negligible, ns.
const COARSE_GRAIN_NS: i64 = 500_000;

/// Rows over which rounded stamps stay within a grain of a regular tick. With lost rows they do not.
const GRAIN_WINDOW: usize = 200;

/// Largest range about a regular tick, in grains. Rounding gives one grain, and jitter and the fit of the tick add to it.
const STRAYS: f64 = 1.4;

/// Usual steps of fewer grains may be single ticks of a clock that ticks in grains, with lost rows between.
const MANY_GRAINS: i64 = 3;

/// RMS distance from a regular tick, in grains, without lost rows: 0.29 from rounding, and jitter of up to half a grain.
const STRAYS_RMS: f64 = 0.6;

/// With this number of different step lengths, each of at least 1 % of the steps, the steps are not lost rows of a regular clock.
const MANY_STEPS: usize = 6;

/// The common divisor of all stamps, ns, if it is coarse and a result of rounding. Either the stamps follow a regular tick within a grain, or they
/// arrive with a jitter of many grains. If rows are lost from a clock of just that period, the deviation from a regular tick grows in steps of few
/// lengths.
fn grain_ns(stamps_ns: &[i64]) -> Option<i64> {
    let steps: Vec<i64> = stamps_ns.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0).collect();
    let first = *steps.first()?;
    let gcd = |a: i64, b: i64| {
        let (mut a, mut b) = (a, b);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    // In microseconds, because seconds written with few digits are not exact.
    let grain = steps.iter().fold(0, |grain, step| gcd(grain, (step + 500) / 1000)) * 1000;
    // If a grain is longer than a period, some stamps are equal and all other steps alike.
    let differ = stamps_ns.windows(2).any(|w| (w[1] - w[0] - first).abs() > 1000);
    if grain < COARSE_GRAIN_NS || !differ {
        return None;
    }
    if usual_step_ns(stamps_ns) >= MANY_GRAINS * grain && has_many_steps(&steps) {
        return Some(grain);
    }
    let windows: Vec<&[i64]> = stamps_ns.chunks(GRAIN_WINDOW).filter(|window| is_ragged(window)).collect();
    let is_even = |window: &&&[i64]| {
        let Strays { range_ns, rms_ns } = strays(window);
        let usual = usual_step_ns(window);
        if usual >= MANY_GRAINS * grain {
            rms_ns <= STRAYS_RMS * grain as f64
        } else {
            range_ns <= STRAYS * grain as f64
        }
    };
    let even = windows.iter().filter(is_even).count();
    (even > 0 && even * 10 >= windows.len() * 8).then_some(grain)
}

fn has_many_steps(steps: &[i64]) -> bool {
    let mut steps = steps.to_vec();
    steps.sort_unstable();
    let alike = steps.chunk_by(|a, b| b - a <= 1000);
    steps.len() >= GRAIN_WINDOW
        && alike.filter(|chunk| chunk.len() * 100 >= steps.len()).count() >= MANY_STEPS
}

/// Whether more than one step in fifty is unusual. An occasional lost row is no rounding.
fn is_ragged(stamps_ns: &[i64]) -> bool {
    let steps = stamps_ns.len() - 1;
    if steps < GRAIN_WINDOW / 4 {
        return false;
    }
    let usual = usual_step_ns(stamps_ns);
    let others = stamps_ns.windows(2).filter(|w| (w[1] - w[0] - usual).abs() > 1000).count();
    others * 50 > steps
}

/// Median step of two stamps or more.
fn usual_step_ns(stamps_ns: &[i64]) -> i64 {
    let mut steps: Vec<i64> = stamps_ns.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_unstable();
    steps[steps.len() / 2]
}

/// Deviation of stamps from a regular tick over a window.
struct Strays {
    /// From the earliest to the latest, ns.
    range_ns: f64,
    /// RMS, ns.
    rms_ns: f64,
}

fn strays(stamps_ns: &[i64]) -> Strays {
    let n = stamps_ns.len() as f64;
    let at = |k: usize| (stamps_ns[k] - stamps_ns[0]) as f64;
    let centre = 0.5 * (n - 1.0);
    let mean = (0..stamps_ns.len()).map(at).sum::<f64>() / n;
    let slope = (0..stamps_ns.len()).map(|k| (k as f64 - centre) * (at(k) - mean)).sum::<f64>()
        / (n * (n * n - 1.0) / 12.0);
    let off = |k: usize| at(k) - mean - slope * (k as f64 - centre);
    let (least, most, squares) = (0..stamps_ns.len())
        .map(off)
        .fold((f64::INFINITY, f64::NEG_INFINITY, 0.0), |(a, b, sum), x| (a.min(x), b.max(x), sum + x * x));
    Strays { range_ns: most - least, rms_ns: (squares / n).sqrt() }
}

/// Samples that move by less than this fraction of a grain over a recording keep their place in it.
const SAME_PLACE: f64 = 0.5;
/// Assumed jitter of an image stamp if it cannot be measured, s.
const UNKNOWN_JITTER_S: f64 = 0.1e-3;

/// Ratio of the time variance of an interpolated pose to that of a sample, averaged over an interval: the mean of u² + (1 − u)².
const BRACKET_SHARE: f64 = 2.0 / 3.0;

impl Stream {
    fn new(stamps_ns: &[i64], origin_ns: i64, device_ns: &[Option<i64>], counter: &[Option<u64>]) -> Self {
        let first_of_each: Vec<usize> =
            (0..stamps_ns.len()).filter(|&k| k == 0 || stamps_ns[k] != stamps_ns[k - 1]).collect();
        let seconds = |ns: i64, from: i64| (ns - from) as f64 * 1e-9;
        let recorded_s: Vec<f64> = first_of_each.iter().map(|&k| seconds(stamps_ns[k], origin_ns)).collect();
        let device: Option<Vec<i64>> = first_of_each.iter().map(|&k| *device_ns.get(k)?).collect();
        let device_s: Option<Vec<f64>> =
            device.map(|device| device.iter().map(|&ns| seconds(ns, device[0])).collect());
        let counter: Option<Vec<u64>> = first_of_each.iter().map(|&k| *counter.get(k)?).collect();
        let ticks = match (&device_s, &counter) {
            (Some(device), _) => Ticks::Device(device),
            (None, Some(counter)) => Ticks::Counter(counter),
            (None, None) => Ticks::Counted,
        };
        let clock = clock_model::fit(&recorded_s, ticks);
        let doubles = stamps_ns.len() - recorded_s.len();
        Self { doubles, recorded_s, clock, grain_s: None, joined_from_s: Vec::new() }
    }

    /// For recordings joined at these stamps.
    fn joined_from(self, stamps_ns: &[i64], origin_ns: i64) -> Self {
        let joined_from_s = stamps_ns.iter().map(|ns| (ns - origin_ns) as f64 * 1e-9).collect();
        Self { joined_from_s, ..self }
    }

    /// The stamps of each of them, s.
    fn recordings_s(&self) -> impl Iterator<Item = &[f64]> {
        let starts = self.joined_from_s.iter().map(|from_s| self.recorded_s.partition_point(|s| s < from_s));
        let ends = starts.clone().chain([self.recorded_s.len()]);
        [0].into_iter().chain(starts).zip(ends).map(|(start, end)| &self.recorded_s[start..end])
    }

    /// Takes the clock of a stream that contains all of its stamps and others.
    fn with_clock_of(self, all: &Self) -> Self {
        let of = |stamp_s: &f64| all.recorded_s.partition_point(|s| s < stamp_s);
        let clock = all.clock.as_ref().map(|clock| StreamClock {
            regular_s: self.recorded_s.iter().map(|stamp_s| clock.regular_s[of(stamp_s)]).collect(),
            ..clock.clone()
        });
        Self { clock, ..self }
    }

    /// With the grain of these stamps.
    fn with_grain(self, stamps_ns: &[i64]) -> Self {
        Self { grain_s: grain_ns(stamps_ns).map(|ns| ns as f64 * 1e-9), ..self }
    }

    /// Standard deviation of a stamp as used, s.
    fn jitter_s(&self, dejittered: bool) -> Option<f64> {
        if dejittered { Some(0.0) } else { self.clock.as_ref().map(|clock| clock.jitter_s) }
    }

    /// Standard deviation of the common error of all sampling times, s.
    fn phase_sigma_s(&self, dejittered: bool) -> f64 {
        let phase_s = self.clock.as_ref().filter(|_| dejittered).map_or(0.0, |clock| clock.phase_sigma_s);
        // The direction of rounding is unknown, so the mean is off by up to half a grain on either side. If all samples were taken at the same place
        // between two grains, or only the earliest stamps are used, it is off by up to a whole grain.
        let by_earliest = dejittered && self.clock.as_ref().is_some_and(StreamClock::is_one_sided);
        let of_grain = |grain_s: f64| {
            let is_whole = by_earliest || self.ticks_with(grain_s);
            grain_s / if is_whole { 3.0_f64 } else { 12.0 }.sqrt()
        };
        phase_s.hypot(self.grain_s.map_or(0.0, of_grain))
    }

    /// Whether samples come in whole multiples of a grain and therefore keep their place in it over the recording.
    fn ticks_with(&self, grain_s: f64) -> bool {
        let drifts = |clock: &StreamClock| {
            let grains = clock.period_s / grain_s;
            (grains - grains.round()).abs() * self.recorded_s.len() as f64
        };
        self.clock.as_ref().is_some_and(|clock| drifts(clock) < SAME_PLACE)
    }

    /// Whether its stamps are certainly not the sampling times: late on one side, or rounded differently from sample to sample.
    fn is_of_arrival(&self) -> bool {
        let is_of_arrival = |clock: &StreamClock| {
            let explains = |grain_s: f64| clock.lateness.spread_s < STRAYS_RMS * grain_s;
            let is_rounded = |grain_s: f64| explains(grain_s) && !self.ticks_with(grain_s);
            self.grain_s.is_some_and(is_rounded) || clock.lateness.is_of_arrival()
        };
        self.clock.as_ref().is_some_and(is_of_arrival)
    }

    /// Standard deviation of the rate of the underlying clock, parts per million.
    #[must_use]
    pub(crate) fn rate_sigma_ppm(&self, dejittered: bool) -> f64 {
        let Some(clock) = self.clock.as_ref().filter(|_| dejittered) else { return 0.0 };
        let lasts_s = self.recorded_s[self.recorded_s.len() - 1] - self.recorded_s[0];
        // Slope of a line through n equally spaced points.
        clock.jitter_s * (12.0 / self.recorded_s.len() as f64).sqrt() / lasts_s * 1e6
    }

    /// Figures for the report.
    #[must_use]
    pub fn report(&self, dejittered: bool) -> StampReport {
        let steps = || self.recordings_s().flat_map(|stamps_s| stamps_s.windows(2).map(|w| w[1] - w[0]));
        let missing = |clock: &StreamClock| {
            self.recordings_s().map(|stamps_s| clock_model::missing(stamps_s, clock.period_s)).sum()
        };
        let median_period_s = median(steps()).unwrap_or(0.0);
        let longest_gap_s = steps().fold(0.0, f64::max);
        let clock = self.clock.as_ref();
        let silence_s = SILENCE_TICKS * clock.map_or(median_period_s, |c| c.period_s);
        StampReport {
            count: self.recorded_s.len(),
            doubles: self.doubles,
            median_period_s,
            longest_gap_s,
            period_s: clock.map(|c| c.period_s),
            jitter_s: clock.map(|c| c.jitter_s),
            missing: clock.map(missing),
            silences: steps().filter(|step| *step > silence_s).count(),
            device_drift_ppm: clock.and_then(|c| c.device_drift_ppm),
            one_sided: clock.is_some_and(StreamClock::is_one_sided),
            lateness_s: clock.map(|c| [c.lateness.median_s, c.lateness.most_s]),
            wander_s: clock.map(|c| c.wander_s).filter(|wander_s| *wander_s > 0.0),
            steps: clock.map_or_else(Vec::new, |c| c.steps.clone()),
            step_taken_out: clock.is_some_and(|c| c.step_taken_out),
            grain_s: self.grain_s,
            dejittered,
        }
    }
}

/// Stamps (ns, rising) and counters of all images of a recording, if some show stripes and no seam point. A clock fitted to the seam points alone
/// has little information on these. `None` if there are none, or if device stamps determine the clock.
fn with_stripes_alone(recording: &Recording) -> Option<(Vec<i64>, Vec<Option<u64>>)> {
    if recording.stripes.is_empty() || recording.features.iter().any(|f| f.device_ns.is_some()) {
        return None;
    }
    let names = PicturesOfRows::of(recording).ok()?;
    let features = recording.features.iter().map(|f| (names.of_feature(f), (f.stamp_ns, f.frame)));
    let mut pictures: BTreeMap<i64, (i64, Option<u64>)> = features.collect();
    let with_seam = pictures.len();
    for stripe in &recording.stripes {
        pictures.entry(names.of_stripe(stripe)).or_insert((stripe.stamp_ns, stripe.frame));
    }
    if pictures.len() == with_seam {
        return None;
    }
    let mut pictures: Vec<(i64, Option<u64>)> = pictures.into_values().collect();
    pictures.sort_unstable();
    Some(pictures.into_iter().unzip())
}

impl Sampling {
    /// The stamps of a recording with their clocks.
    #[must_use]
    pub fn of(recording: &Recording, origin_ns: i64) -> Self {
        let robot = &recording.robot;
        let robot_stamps: Vec<i64> = robot.iter().map(|s| s.stamp_ns).collect();
        let robot_device: Vec<Option<i64>> = robot.iter().map(|s| s.device_ns).collect();
        let features = &recording.features;
        let image_stamps: Vec<i64> = features.iter().map(|f| f.stamp_ns).collect();
        let image_device: Vec<Option<i64>> = features.iter().map(|f| f.device_ns).collect();
        let counter: Vec<Option<u64>> = features.iter().map(|f| f.frame).collect();
        // Duplicate robot rows, and several lines of one image, have equal stamps without rounding.
        let mut rows = robot_stamps.clone();
        rows.dedup();
        let line = features.first().map_or(0, |first| first.line);
        let pictures: Vec<i64> = features.iter().filter(|f| f.line == line).map(|f| f.stamp_ns).collect();
        let stream = |stamps_ns: &[i64], device_ns: &[Option<i64>], counter: &[Option<u64>]| {
            Stream::new(stamps_ns, origin_ns, device_ns, counter)
                .joined_from(&recording.joined_from_ns, origin_ns)
        };
        let images = stream(&image_stamps, &image_device, &counter).with_grain(&pictures);
        Self {
            robot: stream(&robot_stamps, &robot_device, &[]).with_grain(&rows),
            images: match with_stripes_alone(recording) {
                Some((stamps_ns, counter)) => images.with_clock_of(&stream(&stamps_ns, &[], &counter)),
                None => images,
            },
        }
    }

    /// Expected jitter of an exposure relative to the robot's time, s.
    #[must_use]
    pub fn stamp_sigma_s(&self, config: &Config, dejittered: Dejittered) -> f64 {
        let images = config.stamp_sigma_s.or(self.images.jitter_s(dejittered.images));
        let robot = self.robot.jitter_s(dejittered.robot).unwrap_or(0.0);
        images.unwrap_or(UNKNOWN_JITTER_S).hypot(robot * BRACKET_SHARE.sqrt())
    }

    /// Standard deviation of the clock rates after regularisation, parts per million.
    #[must_use]
    pub(crate) fn rate_sigma_ppm(&self, dejittered: Dejittered) -> f64 {
        self.robot.rate_sigma_ppm(dejittered.robot).hypot(self.images.rate_sigma_ppm(dejittered.images))
    }

    /// Standard deviation of the time offset from the phases of the regularised clocks, s.
    #[must_use]
    pub(crate) fn phase_sigma_s(&self, dejittered: Dejittered) -> f64 {
        self.robot.phase_sigma_s(dejittered.robot).hypot(self.images.phase_sigma_s(dejittered.images))
    }

    /// Sampling times of the robot, s since the start of the recording.
    #[must_use]
    pub fn robot_times_s(&self, dejittered: Dejittered) -> &[f64] {
        let clock = self.robot.clock.as_ref().filter(|_| dejittered.robot);
        clock.map_or(&self.robot.recorded_s, |clock| &clock.regular_s)
    }

    /// Sampling times of the images, one for each image, s since the start of the recording.
    #[must_use]
    pub fn image_times_s(&self, dejittered: Dejittered) -> &[f64] {
        let clock = self.images.clock.as_ref().filter(|_| dejittered.images);
        clock.map_or(&self.images.recorded_s, |clock| &clock.regular_s)
    }

    /// Frame interval if image times come from a frame counter, s.
    #[must_use]
    pub(crate) fn image_tick_s(&self, dejittered: Dejittered) -> Option<f64> {
        self.images.clock.as_ref().filter(|_| dejittered.images).map(|clock| clock.period_s)
    }

    /// The streams that use clock times before any fit, because their stamps certainly date the arrival.
    #[must_use]
    pub fn of_arrival(&self, config: &Config) -> Dejittered {
        if config.stamps == Stamps::Auto && config.residual == ResidualKind::Sheet {
            Dejittered { robot: self.robot.is_of_arrival(), images: self.images.is_of_arrival() }
        } else {
            Dejittered::default()
        }
    }

    /// The candidates to try beyond those streams, in order. Each is compared with the best so far.
    #[must_use]
    pub fn candidates(&self, config: &Config) -> Vec<Dejittered> {
        let possible = Dejittered { robot: self.robot.clock.is_some(), images: self.images.clock.is_some() };
        let first = self.of_arrival(config);
        let mut list = match config.stamps {
            Stamps::Regular => vec![possible],
            Stamps::Auto if config.residual == ResidualKind::Sheet => {
                vec![Dejittered { images: possible.images, ..first }, possible]
            }
            Stamps::Auto | Stamps::Raw => Vec::new(),
        };
        list.retain(|treatment| *treatment != first);
        list.dedup();
        list
    }
}
