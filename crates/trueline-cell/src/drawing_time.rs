//! Whether a simulated camera's pictures are drawn in time.

use std::time::Duration;
use trueline_camera::device::DeviceSettings;

/// Share of the time there is that drawing may take on average: single pictures take longer.
const USED: f64 = 0.7;
/// Share of it that drawing takes with the proposed settings.
const PROPOSED: f64 = 0.5;

/// Advice if a picture takes longer to draw than there is time: it must be ready before its first packet is
/// due, and before the next one.
pub(crate) fn late_pictures(takes: Duration, settings: &DeviceSettings) -> Option<String> {
    let takes_ms = takes.as_secs_f64() * 1e3;
    let (allowed_ms, latency_ms) =
        (1e3 * (settings.readout_s + settings.latency_s), 1e3 * settings.latency_s);
    let (period_ms, fps) = (1e3 * settings.period_s, 1.0 / settings.period_s);
    if takes_ms <= USED * allowed_ms && takes_ms <= USED * period_ms {
        return None;
    }
    let longer_ms = (takes_ms / PROPOSED).max(latency_ms).ceil();
    let rarer_hz = rounded_down((1e3 * PROPOSED / takes_ms).min(fps));
    Some(format!(
        "a picture takes {takes_ms:.0} ms to draw on this machine, and has {allowed_ms:.0} ms (--readout-ms and --latency-ms) and \
         {period_ms:.0} ms between pictures (--fps); those that are late are dropped. --latency-ms {longer_ms:.0} and --fps {rarer_hz} \
         leave room; a smaller picture in sensor.toml is drawn faster"
    ))
}

/// To two digits.
fn rounded_down(value: f64) -> f64 {
    let digits = 1 - value.log10().floor() as i32;
    // Powers of ten that are whole numbers: 0.29 is 29 / 100, and no 0.29000000000000004.
    if digits > 0 {
        let scale = 10f64.powi(digits);
        (value * scale).floor() / scale
    } else {
        let step = 10f64.powi(-digits);
        (value / step).floor() * step
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]
mod tests {
    use super::late_pictures;
    use std::net::Ipv4Addr;
    use std::time::Duration;
    use trueline_camera::device::DeviceSettings;

    fn settings(readout_ms: f64, latency_ms: f64, fps: f64) -> DeviceSettings {
        DeviceSettings {
            readout_s: readout_ms * 1e-3,
            latency_s: latency_ms * 1e-3,
            period_s: 1.0 / fps,
            ..DeviceSettings::small(Ipv4Addr::LOCALHOST)
        }
    }

    fn number_after(text: &str, option: &str) -> f64 {
        let rest = text.split_once(&format!("{option} ")).expect(text).1;
        rest.split([' ', ';']).next().unwrap().parse().expect(rest)
    }

    #[test]
    fn nothing_is_said_where_pictures_are_in_time() {
        assert_eq!(late_pictures(Duration::from_millis(50), &settings(10.0, 150.0, 5.0)), None);
    }

    #[test]
    fn a_picture_after_its_first_packet_is_late() {
        assert!(late_pictures(Duration::from_millis(140), &settings(10.0, 150.0, 1.0)).is_some());
    }

    #[test]
    fn a_picture_that_keeps_the_next_one_waiting_is_late() {
        assert!(late_pictures(Duration::from_millis(150), &settings(10.0, 3000.0, 5.0)).is_some());
    }

    /// From a tenth of a millisecond to ten seconds, and whichever of both is short.
    #[test]
    fn what_is_proposed_leaves_room_and_takes_none_away() {
        for takes_us in [130, 997, 4_300, 47_000, 180_000, 2_710_000, 10_300_000] {
            let takes = Duration::from_micros(takes_us);
            for (latency_ms, fps) in [(0.0, 0.01), (150.0, 20.0), (40_000.0, 1e4)] {
                let asked = settings(0.05, latency_ms, fps);
                let Some(text) = late_pictures(takes, &asked) else { continue };
                let (longer_ms, rarer_hz) =
                    (number_after(&text, "--latency-ms"), number_after(&text, "--fps"));
                assert!(longer_ms >= latency_ms && rarer_hz <= fps && rarer_hz > 0.0, "{text}");
                assert_eq!(late_pictures(takes, &settings(0.05, longer_ms, rarer_hz)), None, "{text}");
            }
        }
    }
}
