//! Exposures one after the other, and the pictures of them.

use super::packets::{Packer, Shot};
use super::pictures::Pictures;
use super::registers::Wanted;
use super::sender::Outgoing;
use super::sequence::{Sequence, Turn};
use super::shared::Shared;
use super::words::locked;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Duration;
use trueline_dataset::{FrameSignals, GrayImage, Pixels};

/// Pictures that can wait for those before them: the memory of a camera.
const PICTURES_WAITING: f64 = 4.0;
/// The output that is on while it exposes, `Line2`, among the lines.
const EXPOSES: u64 = 0b10;
/// Interval at which an idle camera checks for a start, and a triggered one for the signal.
const IDLE: Duration = Duration::from_millis(1);

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
            let sequence = sequence.get_or_insert_with(|| Sequence::start(&self.shared, &wanted));
            match sequence.next(&self.shared, &wanted, self.pictures.as_mut()) {
                Some(turn) => self.expose(&turn, &wanted),
                None => std::thread::sleep(IDLE),
            }
        }
    }

    fn expose(&mut self, turn: &Turn, wanted: &Wanted) {
        let last_ns = turn.starts_ns.last().copied().unwrap_or_default();
        let end_ns = last_ns + (wanted.exposure_s * 1e9) as i64;
        let settings = &self.shared.settings;
        let due_ns = end_ns + ((settings.readout_s + settings.latency_s) * 1e9) as i64;
        // The next one too, if known: this thread may still be at this one's picture when it begins.
        let next = turn.period_ns.map(|period_ns| period_ns.round() as i64);
        for begins_ns in [Some(0), next].into_iter().flatten() {
            for at_ns in &turn.starts_ns {
                self.pictures.exposes(at_ns + begins_ns, wanted.exposure_s);
            }
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
        let seen = turn.starts_ns.iter().map(|start_ns| self.pictures.picture(*start_ns, wanted.exposure_s));
        let Some(image) = seen.collect::<Option<Vec<_>>>().and_then(stacked) else {
            return self.shared.count(|counts| counts.dropped += 1);
        };
        self.hand_over(turn, wanted, &image, due_ns);
        if wanted.single {
            locked(&self.shared.registers).end_acquisition();
        }
    }

    fn hand_over(&mut self, turn: &Turn, wanted: &Wanted, image: &GrayImage, due_ns: i64) {
        let exposure_start_ns = turn.starts_ns.first().copied().unwrap_or_default();
        let device_ns = self.shared.clock.device_ns(exposure_start_ns);
        let block_id = turn.block_id;
        let shot = Shot {
            block_id,
            device_ns,
            image,
            chunks: self.shared.settings.chunks,
            signals: FrameSignals {
                encoder: self.pictures.encoder(exposure_start_ns),
                lines: Some(EXPOSES | u64::from(self.pictures.line(exposure_start_ns))),
                counter: Some(turn.signals as i64),
                camera_frame: Some(u64::from(block_id)),
            },
        };
        let packets = self.packer.packets(wanted, &shot);
        let picture = Outgoing {
            block_id,
            packets: Arc::new(packets),
            to: wanted.to,
            due_ns,
            device_ns,
            exposure_start_ns,
            patience_ns: (PICTURES_WAITING * wanted.period_s * 1e9) as i64,
        };
        if self.shared.now_ns() > due_ns {
            return self.shared.count(|counts| counts.late += 1);
        }
        // There is no receiver any more when the device is being stopped.
        let _ = self.out.send(picture);
    }
}

/// Pictures of one row as one picture; a single one unchanged.
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
