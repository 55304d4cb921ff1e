//! The simulated controller's side of one RTDE connection: bytes in, bytes out.

use super::variables::{Kind, output};
use super::wire::{self, BadSize, CONTROLLER, DATA, INPUTS, OUTPUTS, PAUSE, START, VERSION, package};
use trueline_geometry::{Pose, so3};

/// Its reported software: PolyScope 5.11.
const SOFTWARE: [u32; 4] = [5, 11, 0, 108];
/// A controller's cycles in a second, Hz.
pub(crate) const CYCLES_HZ: f64 = 500.0;

/// Knowledge of a controller at a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Time since it was started, s.
    pub stamp_s: f64,
    /// `base_from_tool`.
    pub base_from_tool: Pose,
    /// `robot_mode`; 7 runs.
    pub robot_mode: i32,
    /// Digital inputs, the first in the lowest bit.
    pub inputs: u64,
}

/// One client.
#[derive(Clone, Debug)]
pub struct Connection {
    waiting: Vec<u8>,
    version: u16,
    /// Fields of the outputs, by name.
    fields: Vec<(String, Kind)>,
    recipes: u8,
    divisor: u64,
    streams: bool,
    highest_version: u16,
}

impl Connection {
    /// Of a controller that speaks up to a version of RTDE (1 or 2).
    #[must_use]
    pub fn new(highest_version: u16) -> Self {
        Self {
            waiting: Vec::new(),
            version: 1,
            fields: Vec::new(),
            recipes: 0,
            divisor: 1,
            streams: false,
            highest_version,
        }
    }

    /// Reads the client's bytes; appends the answers.
    ///
    /// # Errors
    /// [`BadSize`]: the connection is to be closed.
    pub fn take(&mut self, bytes: &[u8], send: &mut Vec<u8>) -> Result<(), BadSize> {
        let mut waiting = std::mem::take(&mut self.waiting);
        waiting.extend(bytes);
        let mut used = 0;
        while let Some(asked) = wire::first(&waiting[used..])? {
            used += asked.whole.len();
            self.answer(asked.kind, asked.payload, send);
        }
        waiting.drain(..used);
        self.waiting = waiting;
        Ok(())
    }

    fn answer(&mut self, kind: u8, payload: &[u8], send: &mut Vec<u8>) {
        match kind {
            VERSION => {
                let asked = payload.try_into().map_or(0, u16::from_be_bytes);
                let known = (1..=self.highest_version).contains(&asked);
                if known {
                    self.version = asked;
                }
                send.extend(package(VERSION, &[known.into()]));
            }
            CONTROLLER => {
                let software: Vec<u8> = SOFTWARE.iter().flat_map(|part| part.to_be_bytes()).collect();
                send.extend(package(CONTROLLER, &software));
            }
            OUTPUTS => self.agree_on_outputs(payload, send),
            INPUTS => self.agree_on_inputs(payload, send),
            START => {
                self.streams = !self.fields.is_empty();
                send.extend(package(START, &[self.streams.into()]));
            }
            PAUSE => {
                self.streams = false;
                send.extend(package(PAUSE, &[1]));
            }
            // Written inputs and words move nothing here.
            _ => {}
        }
    }

    fn agree_on_outputs(&mut self, payload: &[u8], send: &mut Vec<u8>) {
        let (rate_hz, names) = match self.version {
            1 => (CYCLES_HZ, payload),
            _ => payload.split_at_checked(8).map_or((CYCLES_HZ, &[][..]), |(rate, names)| {
                (rate.try_into().map_or(CYCLES_HZ, f64::from_be_bytes), names)
            }),
        };
        self.divisor = if rate_hz >= 1.0 { (CYCLES_HZ / rate_hz) as u64 } else { 1 }.max(1);
        let names = names_in(names);
        let kinds: Vec<Option<Kind>> = names.iter().map(|name| output(name)).collect();
        let known: Option<Vec<Kind>> = kinds.iter().copied().collect();
        self.fields = known.map_or_else(Vec::new, |kinds| names.into_iter().zip(kinds).collect());
        self.recipes = if self.fields.is_empty() { 0 } else { self.recipes.wrapping_add(1).max(1) };
        let types: Vec<&str> = kinds.iter().map(|kind| kind.map_or("NOT_FOUND", Kind::name)).collect();
        self.reply_types(OUTPUTS, self.recipes, &types, send);
    }

    fn agree_on_inputs(&mut self, payload: &[u8], send: &mut Vec<u8>) {
        let types: Vec<&str> = names_in(payload)
            .iter()
            .map(|name| match name.as_str() {
                "speed_slider_fraction" => "DOUBLE",
                "speed_slider_mask" => "UINT32",
                name => output(name).map_or("NOT_FOUND", Kind::name),
            })
            .collect();
        self.reply_types(INPUTS, 1, &types, send);
    }

    fn reply_types(&self, kind: u8, recipe: u8, types: &[&str], send: &mut Vec<u8>) {
        let mut payload = if self.version > 1 { vec![recipe] } else { Vec::new() };
        payload.extend(types.join(",").as_bytes());
        send.extend(package(kind, &payload));
    }

    /// Data sent at a cycle, if it is the client's turn.
    #[must_use]
    pub fn data(&self, cycle: u64, moment: &Moment) -> Option<Vec<u8>> {
        if !self.streams || !cycle.is_multiple_of(self.divisor) {
            return None;
        }
        let mut payload = if self.version > 1 { vec![self.recipes] } else { Vec::new() };
        for (name, kind) in &self.fields {
            payload.extend(value(name, *kind, moment));
        }
        Some(package(DATA, &payload))
    }
}

/// A comma at the end is not a name.
fn names_in(bytes: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(bytes);
    text.split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

fn value(name: &str, kind: Kind, moment: &Moment) -> Vec<u8> {
    let doubles = |figures: &[f64]| figures.iter().flat_map(|figure| figure.to_be_bytes()).collect();
    let pose = || {
        let (p, r) = (moment.base_from_tool.translation.vector, so3::log(&moment.base_from_tool.rotation));
        doubles(&[p.x, p.y, p.z, r.x, r.y, r.z])
    };
    match name {
        "timestamp" => doubles(&[moment.stamp_s]),
        "actual_TCP_pose" | "target_TCP_pose" => pose(),
        "actual_digital_input_bits" => moment.inputs.to_be_bytes().to_vec(),
        "robot_mode" => moment.robot_mode.to_be_bytes().to_vec(),
        "safety_mode" | "safety_status" => 1_i32.to_be_bytes().to_vec(),
        "runtime_state" => 2_u32.to_be_bytes().to_vec(),
        "robot_status_bits" => 3_u32.to_be_bytes().to_vec(),
        "safety_status_bits" => 1_u32.to_be_bytes().to_vec(),
        "speed_scaling" | "target_speed_fraction" => doubles(&[1.0]),
        _ => vec![0; kind.bytes()],
    }
}
