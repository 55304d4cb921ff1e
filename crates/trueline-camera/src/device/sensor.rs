//! Exposures one after the other, and the pictures of them.

use super::packets::Packer;
use super::registers::Wanted;
use super::sender::Outgoing;
use super::shared::Shared;
use super::words::locked;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Duration;
use trueline_dataset::{GrayImage, Pixels};

/// What the camera looks at.
pub trait Pictures: Send {
    /// The picture of the whole sensor of an exposure that has just ended: its start in ns of the steady clock and its
    /// length in s. `None` drops it. A profiler exposes its rows one after the other, and each is a picture of one row.
    fn picture(&mut self, exposure_start_steady_ns: i64, exposure_s: f64) -> Option<GrayImage>;

    /// Told of every exposure, usually before it begins and some more than once: whoever is wired to the camera's output.
    fn exposes(&mut self, _start_steady_ns: i64, _exposure_s: f64) {}
}

/// The counter of the stream goes from here back to 1.
const LAST_BLOCK: u16 = u16::MAX;
/// Pictures that can wait for those before them: the memory of a camera.
const PICTURES_WAITING: f64 = 4.0;
/// How often an idle camera looks whether it is to start.
const IDLE: Duration = Duration::from_millis(1);

/// Where the camera is in its sequence of exposures.
#[derive(Clone, Copy)]
struct Sequence {
    /// Steady time of the exposure from which the present period counts, ns.
    from_ns: i64,
    period_ns: f64,
    /// Exposures since.
    number: u64,
    block_id: u16,
}

impl Sequence {
    fn exposure_start_ns(&self) -> i64 {
        self.from_ns + (self.number as f64 * self.period_ns).round() as i64
    }

    /// The next one, by a period that may be new.
    fn next(self, period_ns: f64) -> Self {
        let block_id = if self.block_id == LAST_BLOCK { 1 } else { self.block_id + 1 };
        let next = Self { number: self.number + 1, block_id, ..self };
        if period_ns == self.period_ns {
            return next;
        }
        let from_ns = self.exposure_start_ns() + period_ns.round() as i64;
        Self { from_ns, period_ns, number: 0, block_id }
    }
}

/// The thread that exposes.
pub(super) struct Sensor {
    shared: Arc<Shared>,
    pictures: Box<dyn Pictures>,
    packer: Packer,
    rng: ChaCha8Rng,
    out: Sender<Outgoing>,
}

impl Sensor {
    pub(super) fn new(shared: Arc<Shared>, pictures: Box<dyn Pictures>, out: Sender<Outgoing>) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(shared.settings.seed.wrapping_add(1));
        Self { shared, pictures, packer: Packer::new(), rng, out }
    }

    /// Exposes whenever pictures are wanted, until the device is stopped.
    pub(super) fn run(mut self) {
        let mut sequence: Option<Sequence> = None;
        while !self.shared.is_stopped() {
            let wanted = locked(&self.shared.registers).wanted();
            let Some(wanted) = wanted else {
                sequence = None;
                std::thread::sleep(IDLE);
                continue;
            };
            let period_ns = self.shared.clock.steady_length_ns(wanted.period_s * 1e9);
            let now = match sequence {
                None => Sequence { from_ns: self.shared.now_ns(), period_ns, number: 0, block_id: 1 },
                Some(last) => last.next(period_ns),
            };
            sequence = Some(now);
            self.expose(now, &wanted);
        }
    }

    fn expose(&mut self, sequence: Sequence, wanted: &Wanted) {
        let start_ns = sequence.exposure_start_ns();
        let rows = if wanted.line_period_s > 0.0 { wanted.size[1] } else { 1 };
        let line_ns = self.shared.clock.steady_length_ns(wanted.line_period_s * 1e9);
        let starts_ns = (0..rows).map(|row| start_ns + (f64::from(row) * line_ns).round() as i64);
        let end_ns = starts_ns.clone().next_back().unwrap_or(start_ns) + (wanted.exposure_s * 1e9) as i64;
        let settings = &self.shared.settings;
        let due_ns = end_ns + ((settings.readout_s + settings.latency_s) * 1e9) as i64;
        // The next one too: this thread may still be at this one's picture when it begins.
        for begins_ns in [0, sequence.period_ns.round() as i64] {
            starts_ns.clone().for_each(|at_ns| self.pictures.exposes(at_ns + begins_ns, wanted.exposure_s));
        }
        if !self.shared.sleep_until(end_ns) {
            return;
        }
        self.shared.count(|counts| counts.exposed += 1);
        if self.rng.random_bool(self.shared.settings.frame_drop) {
            return self.shared.count(|counts| counts.dropped += 1);
        }
        // Behind by more than a picture may take: not even tried, so that the next one is in time.
        if self.shared.now_ns() > due_ns {
            return self.shared.count(|counts| counts.late += 1);
        }
        let seen = starts_ns.map(|start_ns| self.pictures.picture(start_ns, wanted.exposure_s));
        let Some(image) = seen.collect::<Option<Vec<_>>>().and_then(stacked) else {
            return self.shared.count(|counts| counts.dropped += 1);
        };
        self.hand_over(sequence, wanted, &image, due_ns);
        if wanted.single {
            locked(&self.shared.registers).end_acquisition();
        }
    }

    fn hand_over(&mut self, sequence: Sequence, wanted: &Wanted, image: &GrayImage, due_ns: i64) {
        let exposure_start_ns = sequence.exposure_start_ns();
        let device_ns = self.shared.clock.device_ns(exposure_start_ns);
        let block_id = sequence.block_id;
        let packets = self.packer.packets(wanted, block_id, device_ns, (image, self.shared.settings.chunks));
        let picture = Outgoing {
            block_id,
            packets: Arc::new(packets),
            to: wanted.to,
            due_ns,
            device_ns,
            exposure_start_ns,
            patience_ns: (PICTURES_WAITING * sequence.period_ns) as i64,
        };
        if self.shared.now_ns() > due_ns {
            return self.shared.count(|counts| counts.late += 1);
        }
        // Nobody receives any more when the device is being stopped.
        let _ = self.out.send(picture);
    }
}

/// Pictures of one row as one picture; the only one as it is.
fn stacked(mut rows: Vec<GrayImage>) -> Option<GrayImage> {
    if rows.len() == 1 {
        return rows.pop();
    }
    let (width, height) = (rows.first()?.width, rows.len());
    let mut counts = Vec::with_capacity(width * height);
    for row in rows {
        let Pixels::Sixteen(row) = row.pixels else { return None };
        counts.extend(row);
    }
    (counts.len() == width * height).then_some(GrayImage { width, height, pixels: Pixels::Sixteen(counts) })
}
