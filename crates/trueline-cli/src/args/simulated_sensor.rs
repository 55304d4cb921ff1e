//! Options of `trueline simulate` without effect on the sensor of the scan, its joint, or the written files.

use crate::args::SimulateArgs;
use trueline_sim::{Joint, PlatePair, SensorModel};

/// An option that changes nothing: whether it was given, whether it has a use all the same, its name, why it has none, and a hint.
type Idle = (bool, bool, &'static str, &'static str, &'static str);

impl SimulateArgs {
    /// Fault of an option of a scan with a sensor, and a hint.
    pub(crate) fn wrong_option(&self, sensor: &SensorModel) -> Option<(String, &'static str)> {
        if self.path.tilt_hz.len() == 2 {
            let what = "`--tilt-hz`: expected one frequency or three, found 2";
            return Some((what.to_owned(), "give one for each tilt"));
        }
        let mut options = self
            .idle_by_sensor(sensor)
            .into_iter()
            .chain(self.idle_by_joint())
            .chain(self.idle_without_pictures());
        let idle = options.find(|(is_given, has_use, ..)| *is_given && !has_use);
        idle.map(|(_, _, name, why, hint)| (format!("`{name}` has no effect: {why}"), hint))
    }

    fn idle_by_sensor(&self, sensor: &SensorModel) -> [Idle; 9] {
        let is_camera = matches!(sensor, SensorModel::CameraLaser { .. });
        let is_profiler = matches!(sensor, SensorModel::Profiler { .. });
        let (plates, images) = (self.plates.plates, self.images);
        let by_look = "--look sets the look of pictures";
        let by_preset = "--preset profiler is a scan with a profiler";
        let px =
            |has_use, why, hint| (self.feature_noise_px.is_some(), has_use, "--feature-noise-px", why, hint);
        let outliers = |has_use, why, hint| (self.outliers.is_some(), has_use, "--outliers", why, hint);
        let (mm, columns) = (self.feature_noise_mm.is_some(), self.plates.column_noise_px.is_some());
        let (parquet, look) = (self.plates.parquet, self.plates.look.given());
        let no_profiles = "only a profiler has profiles";
        let px_instead = "use --feature-noise-px, with --plates --column-noise-px";
        [
            px(is_camera, "this sensor reports lengths", "use --feature-noise-mm"),
            px(!plates, "stripes have the noise of their columns", "use --column-noise-px"),
            px(!images, "pictures are written, and no features", by_look),
            (mm, !is_camera, "--feature-noise-mm", "this sensor reports pixels", px_instead),
            (
                columns,
                is_camera,
                "--column-noise-px",
                "this sensor reports lengths",
                "use --feature-noise-mm",
            ),
            (parquet, is_profiler, "--parquet", no_profiles, by_preset),
            (look.is_some(), is_profiler, look.unwrap_or_default(), no_profiles, by_preset),
            outliers(!images, "pictures are written, and no features", by_look),
            outliers(
                !(plates && is_profiler),
                "profiles are written, and no features",
                "give --profile-look reflections=PART",
            ),
        ]
    }

    /// Options of pictures that are not written: with --plates clap does not ask for --images, which it would refuse.
    fn idle_without_pictures(&self) -> [Idle; 7] {
        let of = |is_given, name| (is_given, self.images, name, "no pictures are written", "give --images");
        [
            of(self.joint.is_some(), "--joint"),
            of(self.look.is_some(), "--look"),
            of(self.bits.is_some(), "--bits"),
            of(self.exposure_ms.is_some(), "--exposure-ms"),
            of(self.opening_deg.is_some(), "--opening-deg"),
            of(self.roll_deg.is_some(), "--roll-deg"),
            of(self.corner_gap_mm.is_some(), "--corner-gap-mm"),
        ]
    }

    /// Options of joints that the scan does not have; a plan says its joint itself.
    fn idle_by_joint(&self) -> [Idle; 6] {
        let (pair, by_plan) = (self.plates.pair(), self.plan.is_some());
        let is_gap = by_plan || matches!(pair, Some(PlatePair::Butt { .. }));
        let has_edge = is_gap || matches!(pair, Some(PlatePair::Edge));
        let is_fillet =
            matches!(self.joint.map_or_else(Joint::fillet, |joint| joint()), Joint::Fillet { .. });
        let look = &self.plates.look;
        let by_gap = "use --gap-mm";
        let by_edge = "use --one-plate or --gap-mm";
        let of_edge = |is_given, name| (is_given, has_edge, name, "no plate ends over nothing", by_edge);
        let of_fillet =
            |is_given, name| (is_given, is_fillet, name, "only a fillet has it", "use --joint fillet");
        [
            of_edge(look.says("edge-drop-outs"), "--edge-drop-outs"),
            of_edge(look.says("rounded-mm"), "--rounded-mm"),
            (look.says("gap-filled"), is_gap, "--gap-filled", "there is no gap between the plates", by_gap),
            of_fillet(self.opening_deg.is_some(), "--opening-deg"),
            of_fillet(self.roll_deg.is_some(), "--roll-deg"),
            of_fillet(self.corner_gap_mm.is_some(), "--corner-gap-mm"),
        ]
    }
}
