//! Whole productions, from recordings to alarms: what changed is found, named, dated and measured; what did not is not.

use crate::common;

use common::{evidence, exact, part};
use nalgebra::Vector3;
use trueline_sim::production::{Change, Layout, Production, ScheduledChange};
use trueline_watch::detect::inside::CutWeld;
use trueline_watch::detect::{History, Judgement, judge, scatter};
use trueline_watch::innovation::Evidence;
use trueline_watch::{Kind, Part, PieceInformation, Reference, Scatter, WeldStatistic};

/// Good pieces from which the scatter is learnt.
const GOOD: usize = 32;

struct Cell {
    reference: Reference,
    part: Part,
    scatters: [Option<Scatter>; 1],
    pieces: Vec<PieceInformation>,
}

impl Cell {
    fn taught_by(production: &Production) -> Self {
        let reference = exact(production);
        let part = part(production, &reference);
        let statistics: Vec<WeldStatistic> =
            (0..GOOD).map(|n| evidence(production, &reference, &part, n, 5).statistic).collect();
        let scatters = [scatter::learnt(&statistics.iter().collect::<Vec<_>>(), &part)];
        let information = |s| PieceInformation::of(s, 0, &part, scatters[0].as_ref());
        let pieces = statistics.iter().map(information).collect();
        Self { reference, part, scatters, pieces }
    }

    fn judged(&self, pieces: &[PieceInformation], last: &Evidence) -> Judgement {
        let cut = CutWeld {
            chunks: &last.chunks,
            bow_prior: &last.bow_prior,
            part: &self.part,
            dispersion: self.scatters[0].as_ref().map_or([1.0; 4], |s| s.dispersion),
            freedom: last.statistic.freedom(),
        };
        judge(
            &History { pieces, prior: &self.reference.prior, scatters: &self.scatters, regimes: &[] },
            Some(&cut),
        )
    }

    /// Welds on until an alarm, at most so many pieces: the alarm and how many it took.
    fn until_alarm(&self, production: &Production, most: usize) -> Option<(trueline_watch::Alarm, usize)> {
        let mut pieces = self.pieces.clone();
        (0..most).find_map(|k| {
            let last = evidence(production, &self.reference, &self.part, GOOD + k, 5);
            pieces.push(PieceInformation::of(&last.statistic, 0, &self.part, self.scatters[0].as_ref()));
            Some((self.judged(&pieces, &last).alarm?, k + 1))
        })
    }
}

fn with(production: &Production, change: Change, after: f64) -> Production {
    Production { change: Some(ScheduledChange { change, piece: GOOD, after }), ..production.clone() }
}

#[test]
fn each_kind_of_change_is_found_named_dated_and_measured() {
    let production = Layout::CheckScan.production();
    let cell = Cell::taught_by(&production);
    let changes = [
        (Kind::Timing, Change::Timing(-0.3e-3), vec![-0.3e-3], 2),
        (
            Kind::Bracket,
            Change::Bracket { rotation_rad: Vector3::zeros(), translation_m: Vector3::new(0.0, 2e-4, -1e-4) },
            vec![0.0, 0.0, 0.0, 0.0, 2e-4, -1e-4],
            2,
        ),
        (Kind::Sensor, Change::Sensor([0.0, 4e-3, 0.0, 0.0, 0.0]), vec![0.0, 4e-3, 0.0, 0.0, 0.0], 2),
        (
            Kind::Seam,
            Change::Seam { rotation_rad: Vector3::zeros(), translation_m: Vector3::new(0.0, 5e-4, 3e-4) },
            vec![],
            3,
        ),
    ];
    for (kind, change, truth, within) in changes {
        let changed = with(&production, change, 0.0);
        let (alarm, took) = cell.until_alarm(&changed, within).expect("nothing was found");
        assert_eq!(alarm.change.kind, kind, "after {took} pieces");
        assert_eq!((alarm.since.piece, alarm.since.inside_s), (GOOD, None), "{kind:?}");
        for (k, truth) in truth.iter().enumerate() {
            let (value, sigma) = (alarm.change.value[k].unwrap(), alarm.change.sigma[k].unwrap());
            // Twelve numbers: 4 σ is reached by one of them in a thousand runs.
            assert!((value - truth).abs() < 4.0 * sigma, "{kind:?} {k}: {value} ± {sigma}, truth {truth}");
        }
    }
}

#[test]
fn nothing_is_found_where_nothing_changed() {
    let production = Layout::CheckScan.production();
    let cell = Cell::taught_by(&production);
    assert!(cell.until_alarm(&production, 12).is_none());
}

#[test]
fn a_change_inside_a_weld_is_dated_to_a_stretch_of_it() {
    // 21 s of weave over one seam; the offset jumps by 1 ms after 60 % of it.
    let production =
        Production { weave: Layout::BoxWeave.production().weave, ..Layout::OneSeam.production() };
    let cell = Cell::taught_by(&production);
    let changed = with(&production, Change::Timing(1e-3), 0.6);
    let (alarm, took) = cell.until_alarm(&changed, 1).expect("nothing was found");
    let at_s = alarm.since.inside_s.expect("not inside");
    assert_eq!((alarm.change.kind, alarm.since.piece, took), (Kind::Timing, GOOD, 1));
    // The weld is 20 s, a stretch of it 1.25 s; it begins 0.22 s into the recording.
    assert!((at_s - 12.2).abs() < 1.9, "{at_s}");
    let (value, sigma) = (alarm.change.value[0].unwrap(), alarm.change.sigma[0].unwrap());
    assert!((value - 1e-3).abs() < 4.0 * sigma + 0.1e-3, "{value} ± {sigma}");
}

#[test]
fn scatter_is_learnt_as_it_is() {
    let production = Layout::OneSeam.production();
    let cell = Cell::taught_by(&production);
    let scatter = cell.scatters[0].as_ref().unwrap();
    // Across the seam the part's 0.3 mm and the seam's own 0.1 mm; 32 pieces know a standard deviation to 12.5 %.
    let expected = 0.3e-3_f64.hypot(0.1e-3);
    for k in [2, 3] {
        let sigma = scatter.covariance[(k, k)].sqrt();
        assert!((sigma / expected - 1.0).abs() < 4.0 * 0.125, "{k}: {sigma}");
    }
    // About the two axes across it the part's 0.1°.
    for k in [0, 1] {
        let sigma = scatter.covariance[(k, k)].sqrt().to_degrees();
        assert!((sigma / 0.1 - 1.0).abs() < 4.0 * 0.125, "{k}: {sigma}");
    }
}
