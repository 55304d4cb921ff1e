//! All observations, four of a line at a time, in a fixed order.

use super::lanes::WIDTH;
use super::view::{InSheet, Mounting, Residual, Samples, Seen, ToLine, see};
use crate::config::ResidualKind;
use crate::observations::{Observation, Observations};
use crate::parameters::Parameters;
use trueline_geometry::Segment;

/// What is swept: a list of observations, seen with some parameters.
#[derive(Clone, Copy)]
pub struct Scan<'a> {
    /// Trajectory and sheet.
    pub observations: &'a Observations,
    /// The observations, by rising stamp.
    pub list: &'a [Observation],
    /// The parameters.
    pub at: &'a Parameters,
    /// Which residual.
    pub residual: ResidualKind,
}

/// What is done with each four.
pub trait Visit {
    /// Up to four samples of one line.
    fn samples<const FUSED: bool>(&mut self, line: usize, samples: &Samples, seen: &Seen<FUSED>);

    /// An observation outside the robot's recording, or in one of its gaps.
    fn unplaced(&mut self, index: usize);
}

/// Sweeps with the widest instructions that the processor has.
pub fn sweep(scan: &Scan<'_>, visit: &mut impl Visit) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        // SAFETY: the function asks for AVX2 and FMA, and the processor has just said that it has both.
        #[expect(unsafe_code, reason = "the only way to call a function for a processor found at run time")]
        unsafe {
            sweep_avx2(scan, visit);
        }
        return;
    }
    sweep_with::<false>(scan, visit);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn sweep_avx2(scan: &Scan<'_>, visit: &mut impl Visit) {
    sweep_with::<true>(scan, visit);
}

#[inline(always)]
fn sweep_with<const FUSED: bool>(scan: &Scan<'_>, visit: &mut impl Visit) {
    match scan.residual {
        ResidualKind::Sheet => sweep_residual::<FUSED, InSheet>(scan, visit),
        ResidualKind::PointToLine => sweep_residual::<FUSED, ToLine>(scan, visit),
    }
}

#[inline(always)]
fn sweep_residual<const FUSED: bool, R: Residual>(scan: &Scan<'_>, visit: &mut impl Visit) {
    let mounting = Mounting::new(&scan.observations.sheet, scan.at);
    let trajectory = &scan.observations.robot.trajectory;
    // Each line gathers its own four: their sums go to the same unknowns.
    let mut waiting = vec![Samples::default(); scan.at.lines.len()];
    let mut hint = 0;
    for (index, o) in scan.list.iter().enumerate() {
        let exposure = o.stamp_s - scan.at.time_offset_s;
        let Some(segment) = trajectory.bracket(exposure, hint).and_then(|found| {
            hint = found;
            trajectory.segment(found)
        }) else {
            visit.unplaced(index);
            continue;
        };
        let line = o.line as usize;
        let samples = &mut waiting[line];
        samples.push(index, exposure, segment, o);
        if samples.count == WIDTH {
            visit.samples(line, samples, &see::<FUSED, R>(&mounting, &scan.at.lines[line], samples));
            samples.count = 0;
        }
    }
    for (line, samples) in waiting.iter_mut().enumerate().filter(|(_, samples)| samples.count > 0) {
        samples.repeat_first();
        visit.samples(line, samples, &see::<FUSED, R>(&mounting, &scan.at.lines[line], samples));
    }
}

impl Samples {
    #[inline(always)]
    fn push(&mut self, index: usize, exposure: f64, segment: &Segment, o: &Observation) {
        let lane = self.count;
        let rotation = segment.base_from_tool.rotation;
        let position = segment.base_from_tool.translation.vector;
        self.index[lane] = index as u32;
        self.elapsed[lane] = exposure - segment.start;
        self.rotation[0][lane] = rotation.w;
        self.rotation[1][lane] = rotation.i;
        self.rotation[2][lane] = rotation.j;
        self.rotation[3][lane] = rotation.k;
        for axis in 0..3 {
            self.position[axis][lane] = position[axis];
            self.rate[axis][lane] = segment.body_rate[axis];
            self.velocity[axis][lane] = segment.velocity[axis];
            self.point[axis][lane] = o.point_in_camera[axis];
        }
        self.count += 1;
    }

    /// Fills the lanes that have no sample with the first, so that they hold numbers.
    fn repeat_first(&mut self) {
        let fill = |lanes: &mut [f64; WIDTH], count: usize| lanes.copy_within(0..1, count.min(WIDTH - 1));
        for lane in self.count..WIDTH {
            self.index[lane] = self.index[0];
            fill(&mut self.elapsed, lane);
            self.rotation.iter_mut().for_each(|lanes| fill(lanes, lane));
            for lanes in [&mut self.position, &mut self.rate, &mut self.velocity, &mut self.point] {
                lanes.iter_mut().for_each(|lanes| fill(lanes, lane));
            }
        }
    }
}
