//! Cells as numbers, in the OpenMetrics text format.

use super::view::CellView;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::{Registry, Unit};
use std::fmt;
use std::sync::atomic::AtomicU64;
use trueline_watch::detect::blindness::names;
use trueline_watch::parameters::TIME_OFFSET;
use trueline_watch::{Kind, State};

type Labels = Vec<(&'static str, String)>;
type Gauges = Family<Labels, Gauge<f64, AtomicU64>>;

/// All gauges.
struct Numbers {
    registry: Registry,
    welds: Gauges,
    last_weld_s: Gauges,
    alarm: Gauges,
    within: Gauges,
    seam_error_m: Gauges,
    seam_error_sigma_m: Gauges,
    tolerance_m: Gauges,
    evidence: Gauges,
    time_offset_s: Gauges,
    time_offset_sigma_s: Gauges,
    noise: Gauges,
    waiting: Gauges,
    blind: Gauges,
}

impl Numbers {
    fn new() -> Self {
        let mut registry = Registry::with_prefix("trueline_watch");
        let mut plain = |name: &str, help: &str| {
            let gauges = Gauges::default();
            registry.register(name, help, gauges.clone());
            gauges
        };
        let welds = plain("welds", "Welds stored for the current calibration");
        let alarm = plain("alarm", "1 while an alarm of this kind is active");
        let within =
            plain("changed_within_tolerance", "1 while a change of this kind within the tolerance is active");
        let evidence =
            plain("evidence", "Minus log10 of the probability without a change; the alarm limit is 6.25");
        let noise = plain("noise_factor", "Residuals of the last weld, divided by the expected noise");
        let waiting = plain("messages_waiting", "Alarm messages waiting for a receiver");
        let blind = plain("blind", "1 while welds like the last ones cannot detect such a change");
        let mut lengths = |name: &str, help: &str| {
            let gauges = Gauges::default();
            registry.register_with_unit(name, help, Unit::Meters, gauges.clone());
            gauges
        };
        let seam_error_m =
            lengths("seam_error", "Displacement of seam points by the active change; 0 without one");
        let seam_error_sigma_m = lengths("seam_error_sigma", "One standard deviation of it");
        let tolerance_m = lengths("tolerance", "Tolerated displacement of seam points, if set");
        let mut seconds = |name: &str, help: &str| {
            let gauges = Gauges::default();
            registry.register_with_unit(name, help, Unit::Seconds, gauges.clone());
            gauges
        };
        let last_weld_s = seconds("last_weld_timestamp", "Time of the last weld, since 1970 UTC");
        let time_offset_s =
            seconds("time_offset_change", "Change of the time offset from the last weld alone");
        let time_offset_sigma_s = seconds("time_offset_change_sigma", "One standard deviation of it");
        Self {
            registry,
            welds,
            last_weld_s,
            alarm,
            within,
            seam_error_m,
            seam_error_sigma_m,
            tolerance_m,
            evidence,
            time_offset_s,
            time_offset_sigma_s,
            noise,
            waiting,
            blind,
        }
    }

    fn take(&self, cell: &CellView) {
        let labels = |more: Option<(&'static str, &str)>| -> Labels {
            let more = more.map(|(name, value)| (name, value.to_owned()));
            [("cell", cell.name.clone())].into_iter().chain(more).collect()
        };
        let set = |gauges: &Gauges, value: f64| gauges.get_or_create(&labels(None)).set(value);
        for receiver in &cell.receivers {
            let own = labels(Some(("receiver", &receiver.name)));
            self.waiting.get_or_create(&own).set(receiver.waiting as f64);
        }
        let (Some(calibration), Some(last)) = (&cell.calibration, cell.history.last()) else { return };
        set(&self.welds, calibration.welds as f64);
        set(&self.last_weld_s, last.watched_s as f64);
        set(&self.noise, last.noise_factor);
        for (k, kind) in Kind::ALL.into_iter().enumerate() {
            let own = labels(Some(("kind", kind.name())));
            let stands = |state: State| {
                let is_own = last.alarm.as_ref().is_some_and(|alarm| alarm.kind == kind.name());
                f64::from(u8::from(is_own && cell.state() == state))
            };
            self.alarm.get_or_create(&own).set(stands(State::Alarm));
            self.within.get_or_create(&own).set(stands(State::WithinTolerance));
            let evidence = last.p_log10.get(k).map_or(0.0, |p| -p);
            self.evidence.get_or_create(&own).set(evidence);
        }
        let change = cell.change();
        let mm = |key: &str| change.map_or(Some(0.0), |change| change[key].as_f64());
        let lengths = [
            (&self.seam_error_m, mm("seam_error_mm")),
            (&self.seam_error_sigma_m, mm("seam_error_sigma_mm")),
            (&self.tolerance_m, change.and_then(|change| change["tolerance_mm"].as_f64())),
        ];
        for (gauges, value_mm) in lengths {
            if let Some(value_mm) = value_mm {
                set(gauges, value_mm * 1e-3);
            }
        }
        for (kind, what) in names() {
            let word =
                if what.is_empty() { kind.name().to_owned() } else { format!("{} {what}", kind.name()) };
            let is_blind = last.blind_to.iter().any(|hidden| *hidden == word || hidden == kind.name());
            self.blind.get_or_create(&labels(Some(("change", &word)))).set(f64::from(u8::from(is_blind)));
        }
        if let Some([change_s, sigma_s]) = last.estimates.get(TIME_OFFSET).copied().flatten() {
            set(&self.time_offset_s, change_s);
            set(&self.time_offset_sigma_s, sigma_s);
        }
    }
}

/// All cells as text.
///
/// # Errors
/// Text that cannot be made.
pub(super) fn text(cells: &[CellView]) -> Result<String, fmt::Error> {
    let numbers = Numbers::new();
    cells.iter().for_each(|cell| numbers.take(cell));
    let mut out = String::new();
    encode(&mut out, &numbers.registry)?;
    Ok(out)
}
