//! Tests that regular clocks are found behind the stamps of ordinary receivers, and that irregular sources are left alone.
//!
//! The generator simulates arrivals forward: a source, its transport, and a receiver that stalls and stamps. It neither counts nor fits.

use trueline_method::input::clock_model::{StreamClock, Ticks, fit};

/// Deterministic noise.
struct Chance(u64);

impl Chance {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    fn exponential(&mut self, mean: f64) -> f64 {
        -mean * self.uniform().ln()
    }
}

/// A source and its receiver; times in s.
#[derive(Clone)]
struct Shop {
    period_s: f64,
    lasts_s: f64,
    /// Rate of the source's clock against the receiver's.
    skew: f64,
    /// Standard deviation of the half-normal lateness.
    late_s: f64,
    /// Share of packets with an exponential delay of 3 ms.
    late_packets: f64,
    /// The receiver stops for 15 ms about every 8 s. Then the queue arrives at once.
    stalls: bool,
    lost: f64,
    /// The receiver's clock steps by this in the middle.
    step_s: f64,
    /// Amplitude of the receiver clock's wander.
    wander_s: f64,
    /// Stamps are rounded to multiples of this. 0 for none.
    grain_s: f64,
}

/// The recording, and the times of the samples by the receiver's clock.
struct Stream {
    taken_s: Vec<f64>,
    stamps_s: Vec<f64>,
    counter: Vec<u64>,
}

const ORDINARY: Shop = Shop {
    period_s: 0.004,
    lasts_s: 30.0,
    skew: 50e-6,
    late_s: 0.12e-3,
    late_packets: 0.005,
    stalls: false,
    lost: 0.0,
    step_s: 0.0,
    wander_s: 0.0,
    grain_s: 0.0,
};

const CAMERA: Shop = Shop { period_s: 1.0 / 30.0, ..ORDINARY };

impl Shop {
    /// The receiver's clock at a time.
    fn receiver(&self, time_s: f64) -> f64 {
        let step_s = if time_s > 0.53 * self.lasts_s { self.step_s } else { 0.0 };
        // Two slow sines, neither of which is a line.
        let wander = (0.5 * time_s).sin() + 0.5 * (0.23 * time_s + 1.0).sin();
        time_s + step_s + self.wander_s * wander / 1.5
    }

    fn record(&self, seed: u64) -> Stream {
        let mut chance = Chance(seed);
        let phase_s = 3.0 + self.period_s * chance.uniform();
        let count = (self.lasts_s / self.period_s) as u64;
        let mut stream = Stream { taken_s: Vec::new(), stamps_s: Vec::new(), counter: Vec::new() };
        let mut free_s = 0.0;
        let mut next_stall_s = phase_s + chance.exponential(8.0);
        let mut stalled_until_s = 0.0;
        for k in 0..count {
            let time_s = phase_s + k as f64 * self.period_s * (1.0 + self.skew);
            if chance.uniform() < self.lost {
                continue;
            }
            let mut arrives_s = time_s + 0.2e-3 + self.late_s * chance.normal().abs();
            if chance.uniform() < self.late_packets {
                arrives_s += chance.exponential(3e-3);
            }
            if self.stalls && arrives_s > next_stall_s {
                stalled_until_s = next_stall_s + 0.015;
                next_stall_s += chance.exponential(8.0);
            }
            // A queue keeps the order, 15 µs apart.
            arrives_s = arrives_s.max(stalled_until_s).max(free_s + 15e-6);
            free_s = arrives_s;
            let stamp_s = self.receiver(arrives_s);
            let rounded =
                if self.grain_s > 0.0 { (stamp_s / self.grain_s).round() * self.grain_s } else { stamp_s };
            stream.stamps_s.push(rounded);
            stream.counter.push(k + 5);
            // By the receiver's clock with its step and wander.
            stream
                .taken_s
                .push(self.receiver(time_s) + if time_s > 0.53 * self.lasts_s { 0.0 } else { self.step_s });
        }
        stream
    }
}

/// Standard deviation of the fitted stamps from the truth without their common delay, s, and the share of stamps assigned to a wrong sample.
fn error_s(clock: &StreamClock, stream: &Stream) -> (f64, f64) {
    let mut off: Vec<f64> = clock.regular_s.iter().zip(&stream.taken_s).map(|(r, t)| r - t).collect();
    off.sort_by(f64::total_cmp);
    let middle = off[off.len() / 2];
    let own: Vec<f64> = off.iter().map(|o| o - middle).filter(|o| o.abs() < 0.4 * clock.period_s).collect();
    let others = 1.0 - own.len() as f64 / off.len() as f64;
    ((own.iter().map(|o| o * o).sum::<f64>() / own.len() as f64).sqrt(), others)
}

/// Largest error over some recordings, and the largest share of wrongly assigned stamps.
fn worst(shop: &Shop, with_counter: bool) -> (f64, f64) {
    let of = |seed| {
        let stream = shop.record(seed);
        let ticks = if with_counter { Ticks::Counter(&stream.counter) } else { Ticks::Counted };
        let clock = fit(&stream.stamps_s, ticks).unwrap_or_else(|| panic!("no clock of {seed}"));
        // Slope of a line through 900 stamps of 0.3 ms over 30 s: σ √12 / (T √n) = 1.2 ppm. The limit is four of that.
        assert!((clock.period_s / shop.period_s - 1.0 - shop.skew).abs() < 4.8e-6, "{}", clock.period_s);
        error_s(&clock, &stream)
    };
    (1..=12).map(of).fold((0.0, 0.0), |(a, b): (f64, f64), (x, y)| (a.max(x), b.max(y)))
}

/// Required accuracy: 0.01 to 5 µs at jitters of 60 to 250 µs.
const DESIGN_S: f64 = 5e-6;

#[test]
fn late_packets_and_stalls_leave_microseconds() {
    for late_s in [0.06e-3, 0.12e-3, 0.25e-3] {
        for (name, shop) in [("robot", ORDINARY), ("camera", CAMERA)] {
            for stalls in [false, true] {
                let shop = Shop { late_s, stalls, ..shop.clone() };
                let (error, others) = worst(&shop, false);
                assert!(error < DESIGN_S && others == 0.0, "{name} {late_s} {stalls}: {error} {others}");
            }
        }
    }
}

#[test]
fn lost_frames_are_counted_with_and_without_a_counter() {
    for (name, shop) in [("robot", ORDINARY), ("camera", CAMERA)] {
        for lost in [0.02, 0.05] {
            let shop = Shop { lost, stalls: true, ..shop.clone() };
            let (error, others) = worst(&shop, true);
            assert!(error < DESIGN_S && others == 0.0, "{name} {lost} counter: {error} {others}");
            // Without a counter it is unknown which of a queue's packets was lost, for 5 % of the packets in a queue.
            let (error, others) = worst(&shop, false);
            assert!(error < DESIGN_S && others < 0.005, "{name} {lost}: {error} {others}");
        }
    }
}

#[test]
fn one_step_of_the_clock_is_taken_out() {
    // Two medians of at least 400 stamps of 0.1 ms: 7 µs. The limit is four of that.
    let limit_s = 30e-6;
    for (name, shop, step_s) in
        [("robot", ORDINARY, -3e-3), ("robot", ORDINARY, 1.2e-3), ("camera", CAMERA, 3e-3)]
    {
        let shop = Shop { step_s, stalls: true, ..shop };
        let (error, others) = worst(&shop, false);
        assert!(error < limit_s && others == 0.0, "{name} {step_s}: {error} {others}");
        let clock = fit(&shop.record(3).stamps_s, Ticks::Counted).unwrap();
        assert!(clock.step_taken_out && (clock.steps[0].1 - step_s).abs() < limit_s, "{:?}", clock.steps);
    }
}

#[test]
fn rounded_stamps_show_the_even_tick() {
    let rounded = |shop: Shop| Shop { grain_s: 1e-3, lost: 0.02, skew: 20e-6, ..shop };
    let (error, others) = worst(&rounded(CAMERA), false);
    // Rounding is 0.29 ms. A line through 900 such stamps is off by 0.29/√900 = 10 µs on average. The limit is three of that.
    assert!(error < 30e-6 && others < 0.005, "{error} {others}");
    // A period of whole grains is rounded alike for a minute, so no line is better than the rounding.
    for seed in 1..=12 {
        let stream = rounded(ORDINARY).record(seed);
        let (error, others) = error_s(&fit(&stream.stamps_s, Ticks::Counted).unwrap(), &stream);
        assert!(error < 0.29e-3 && others < 0.005, "{seed}: {error} {others}");
    }
}

#[test]
fn a_wander_is_followed() {
    for wander_s in [0.4e-3, 1e-3] {
        for (name, shop) in [("robot", ORDINARY), ("camera", CAMERA)] {
            let shop = Shop { wander_s, skew: 0.0, ..shop };
            let stream = shop.record(4);
            let clock = fit(&stream.stamps_s, Ticks::Counted).unwrap();
            assert!(clock.wander_s > 0.5 * wander_s, "{name} {}", clock.wander_s);
            // Straight pieces of a second bend by 0.25 w T²/8 = 3 % of the wander. Middles of 60 stamps add 0.01 ms.
            let (error, others) = error_s(&clock, &stream);
            assert!(error < 0.04 * wander_s + 0.01e-3 && others == 0.0, "{name} {wander_s}: {error}");
        }
    }
}

#[test]
fn stamps_of_arrival_are_told_from_jitter_to_both_sides() {
    for seed in 1..=20 {
        for shop in [ORDINARY, CAMERA, Shop { late_packets: 0.0, ..CAMERA }] {
            let clock = fit(&shop.record(seed).stamps_s, Ticks::Counted).unwrap();
            assert!(clock.lateness.is_of_arrival(), "{seed}");
        }
        let mut chance = Chance(seed);
        let both: Vec<f64> = (0..600).map(|k| f64::from(k) * 0.03 + 0.5e-3 * chance.normal()).collect();
        assert!(!fit(&both, Ticks::Counted).unwrap().lateness.is_of_arrival(), "{seed}");
    }
}

/// The stamps are not known to be late. They are used as recorded unless the fit clearly prefers a regular clock.
fn keeps_its_stamps(stamps_s: &[f64]) -> bool {
    fit(stamps_s, Ticks::Counted).is_none_or(|clock| !clock.lateness.is_of_arrival())
}

/// Irregular sources with correct stamps.
#[test]
fn uneven_sources_keep_their_stamps() {
    for seed in 1..=200 {
        let mut chance = Chance(seed);
        // Triggered at random.
        let mut time_s = 0.0;
        let at_will: Vec<f64> = (0..600)
            .map(|_| {
                time_s += 0.02 + chance.exponential(0.02);
                time_s
            })
            .collect();
        assert!(keeps_its_stamps(&at_will), "{seed}");
        // Triggered along the path, by a robot whose speed changes.
        let along: Vec<f64> =
            (0..600).map(|k| 0.03 * f64::from(k) + 0.4 * (0.02 * f64::from(k)).sin()).collect();
        assert!(keeps_its_stamps(&along));
        // A program that waits 30 ms after each image: errors of the steps add up.
        let mut time_s = 0.0;
        let waiting: Vec<f64> = (0..600)
            .map(|_| {
                time_s += 0.03 + 0.3e-3 * chance.normal();
                time_s
            })
            .collect();
        assert!(keeps_its_stamps(&waiting), "{seed}");
        // The same, late on one side.
        let mut time_s = 0.0;
        let late: Vec<f64> = (0..600)
            .map(|_| {
                time_s += 0.03 + chance.exponential(0.5e-3);
                time_s
            })
            .collect();
        assert!(keeps_its_stamps(&late), "{seed}");
        // Jitter on both sides: regular on average, but the stamps are not known to be late.
        let dithered: Vec<f64> =
            (0..600).map(|k| 0.03 * f64::from(k) + 0.01 * (chance.uniform() - 0.5)).collect();
        assert!(keeps_its_stamps(&dithered), "{seed}");
    }
}
