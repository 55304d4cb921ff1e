//! Observations of a line with the robot's motion at each, four side by side: the input of the inner loop.
//!
//! Gathering them from the recording is half of the work of a sweep, so a problem that is swept repeatedly keeps them ([`crate::problem::packing`]).
//! They hold for every time offset that leaves each stamp in its segment. If a stamp leaves its segment, its group of four is gathered again.

use super::lanes::{Lanes, WIDTH};
use crate::input::observations::{Observation, Observations};
use trueline_geometry::{Segment, Trajectory};

/// Up to four measurements of one line, with the robot's motion at each.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct Samples {
    /// The stamps of the measurements, s.
    stamp_s: [f64; WIDTH],
    /// Start of each segment of the robot's path, s. NaN without a segment.
    start_s: [f64; WIDTH],
    /// End of each segment, s.
    end_s: [f64; WIDTH],
    /// `base_from_tool` at the segment's beginning, w x y z.
    pub rotation: [[f64; WIDTH]; 4],
    /// The same, m.
    pub position: [[f64; WIDTH]; 3],
    /// Body rate, rad/s.
    pub rate: [[f64; WIDTH]; 3],
    /// Velocity in base, m/s.
    pub velocity: [[f64; WIDTH]; 3],
    /// The point in the camera frame, m.
    pub point: [[f64; WIDTH]; 3],
    /// Index of each in the list.
    pub index: [u32; WIDTH],
    /// The line.
    pub line: u32,
    /// Number of measurements. The other lanes repeat the first.
    pub count: u32,
}

impl Samples {
    /// No measurement.
    fn none(line: u32) -> Self {
        let (one, three) = ([0.0; WIDTH], [[0.0; WIDTH]; 3]);
        Self {
            stamp_s: one,
            start_s: one,
            end_s: one,
            rotation: [[0.0; WIDTH]; 4],
            position: three,
            rate: three,
            velocity: three,
            point: three,
            index: [0; WIDTH],
            line,
            count: 0,
        }
    }

    /// Time since the start of each segment, at this time offset, s.
    #[inline(always)]
    pub(super) fn elapsed<const FUSED: bool>(&self, time_offset_s: f64) -> Lanes<FUSED> {
        Lanes(self.stamp_s) - Lanes::splat(time_offset_s) - Lanes(self.start_s)
    }

    /// Whether every stamp is in its segment at this time offset.
    #[inline(always)]
    pub(super) fn hold_with(&self, time_offset_s: f64) -> bool {
        let mut hold = true;
        for lane in 0..WIDTH {
            let time_s = self.stamp_s[lane] - time_offset_s;
            hold &= self.start_s[lane] <= time_s && time_s < self.end_s[lane];
        }
        hold
    }

    /// The same measurements with the motion at this time offset, and the indices of those without motion.
    #[cold]
    #[inline(never)]
    pub(super) fn moved(
        &self,
        observations: &Observations,
        list: &[Observation],
        time_offset_s: f64,
    ) -> (Self, Unplaced) {
        let trajectory = &observations.robot.trajectory;
        let (mut moved, mut unplaced) = (Self::none(self.line), Unplaced::default());
        for &index in &self.index[..self.count as usize] {
            let o = &list[index as usize];
            match trajectory.segment_at(o.stamp_s - time_offset_s) {
                Some(segment) => moved.push(index, o, segment),
                None => unplaced.push(index),
            }
        }
        moved.fill();
        (moved, unplaced)
    }

    #[inline(always)]
    fn push(&mut self, index: u32, o: &Observation, segment: &Segment) {
        let lane = self.count as usize;
        self.set(lane, index, o);
        (self.start_s[lane], self.end_s[lane]) = (segment.start, segment.start + segment.duration);
        let (rotation, position) = (&segment.base_from_tool.rotation, &segment.base_from_tool.translation);
        let [x, y, z, w] = rotation.coords.data.0[0];
        set(&mut self.rotation, lane, [w, x, y, z]);
        set(&mut self.position, lane, position.vector.data.0[0]);
        set(&mut self.rate, lane, segment.body_rate.data.0[0]);
        set(&mut self.velocity, lane, segment.velocity.data.0[0]);
        self.count += 1;
    }

    /// Adds a measurement without motion.
    fn push_unplaced(&mut self, index: u32, o: &Observation) {
        let lane = self.count as usize;
        self.set(lane, index, o);
        (self.start_s[lane], self.end_s[lane]) = (f64::NAN, f64::NAN);
        self.count += 1;
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, index: u32, o: &Observation) {
        self.index[lane] = index;
        self.stamp_s[lane] = o.stamp_s;
        set(&mut self.point, lane, o.point_in_camera.data.0[0]);
    }

    /// Unused lanes repeat the first sample, so that they hold finite numbers.
    fn fill(&mut self) {
        for lane in (self.count as usize).max(1)..WIDTH {
            self.index[lane] = self.index[0];
            for lanes in [&mut self.stamp_s, &mut self.start_s, &mut self.end_s] {
                lanes[lane] = lanes[0];
            }
            let vectors = [&mut self.position, &mut self.rate, &mut self.velocity, &mut self.point];
            for lanes in vectors.into_iter().flatten().chain(&mut self.rotation) {
                lanes[lane] = lanes[0];
            }
        }
    }
}

#[inline(always)]
fn set<const N: usize>(lanes: &mut [[f64; WIDTH]; N], lane: usize, values: [f64; N]) {
    for (lanes, value) in lanes.iter_mut().zip(values) {
        lanes[lane] = value;
    }
}

/// Indices of measurements outside the robot's recording, or in one of its gaps.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Unplaced {
    index: [u32; WIDTH],
    count: usize,
}

impl Unplaced {
    fn push(&mut self, index: u32) {
        self.index[self.count] = index;
        self.count += 1;
    }

    pub(super) fn indices(&self) -> impl Iterator<Item = usize> + '_ {
        self.index[..self.count].iter().map(|index| *index as usize)
    }
}

/// Gathers samples of a list in groups of four of one line, because their sums go to the same unknowns.
pub(crate) struct Gathering<'a> {
    trajectory: &'a Trajectory,
    list: &'a [Observation],
    time_offset_s: f64,
    next: usize,
    samples: Vec<Samples>,
    /// For each line, the index of its incomplete group.
    open: Vec<Option<usize>>,
    /// The incomplete groups when the last samples were handed out.
    waiting: Vec<Samples>,
}

impl<'a> Gathering<'a> {
    /// For a list at a time offset.
    #[must_use]
    pub(crate) fn new(
        observations: &'a Observations,
        list: &'a [Observation],
        lines: usize,
        time_offset_s: f64,
    ) -> Self {
        let trajectory = &observations.robot.trajectory;
        let (open, samples, waiting) = (vec![None; lines], Vec::new(), Vec::new());
        Self { trajectory, list, time_offset_s, next: 0, samples, open, waiting }
    }

    /// All samples of the list.
    #[must_use]
    pub(crate) fn all(mut self) -> Vec<Samples> {
        self.next_samples(usize::MAX);
        self.samples
    }

    /// The next samples, some of them empty. None at the end.
    pub(crate) fn next_samples(&mut self, most: usize) -> &[Samples] {
        self.samples.clear();
        // Each line may have one incomplete group, before and after.
        self.samples.reserve(most.min(self.list.len().div_ceil(WIDTH)) + 2 * self.open.len());
        for waiting in self.waiting.drain(..) {
            self.open[waiting.line as usize] = Some(self.samples.len());
            self.samples.push(waiting);
        }
        while self.samples.len() < most.saturating_add(self.open.len())
            && let Some(o) = self.list.get(self.next)
        {
            self.take(o);
            self.next += 1;
        }
        let is_end = self.next == self.list.len();
        for slot in self.open.iter_mut().filter_map(Option::take) {
            let samples = &mut self.samples[slot];
            if is_end {
                samples.fill();
            } else {
                self.waiting.push(*samples);
                samples.count = 0;
            }
        }
        &self.samples
    }

    #[inline(always)]
    fn take(&mut self, o: &Observation) {
        let open = &mut self.open[o.line as usize];
        let slot = *open.get_or_insert(self.samples.len());
        if slot == self.samples.len() {
            self.samples.push(Samples::none(o.line));
        }
        let samples = &mut self.samples[slot];
        match self.trajectory.segment_at(o.stamp_s - self.time_offset_s) {
            Some(segment) => samples.push(self.next as u32, o, segment),
            None => samples.push_unplaced(self.next as u32, o),
        }
        if samples.count as usize == WIDTH {
            *open = None;
        }
    }
}
