//! Options of `trueline simulate` that the sensor of the scan, or what is written of it, has no use for.

use crate::SimulateArgs;
use trueline_sim::SensorModel;

/// An option that changes nothing: whether it was given, whether it has a use all the same, its name, why it has none, and a hint.
type Idle = (bool, bool, &'static str, &'static str, &'static str);

impl SimulateArgs {
    /// What is wrong with an option of a scan with a sensor, and a hint.
    pub fn wrong_option(&self, sensor: &SensorModel) -> Option<(String, &'static str)> {
        if self.path.tilt_hz.len() == 2 {
            let what = "`--tilt-hz`: expected one frequency or three, found 2";
            return Some((what.to_owned(), "give one for each tilt"));
        }
        let idle =
            self.idle_options(sensor).into_iter().find(|(is_given, has_use, ..)| *is_given && !has_use);
        idle.map(|(_, _, name, why, hint)| (format!("`{name}` would do nothing: {why}"), hint))
    }

    fn idle_options(&self, sensor: &SensorModel) -> [Idle; 9] {
        let is_camera = matches!(sensor, SensorModel::CameraLaser { .. });
        let is_profiler = matches!(sensor, SensorModel::Profiler { .. });
        let (plates, images) = (self.plates.plates, self.images);
        let by_look = "--look says how pictures look";
        let by_preset = "--preset profiler is a scan with a profiler";
        let px =
            |has_use, why, hint| (self.feature_noise_px.is_some(), has_use, "--feature-noise-px", why, hint);
        let outliers = |has_use, why, hint| (self.outliers.is_some(), has_use, "--outliers", why, hint);
        let (mm, columns) = (self.feature_noise_mm.is_some(), self.plates.column_noise_px.is_some());
        let (parquet, look) = (self.plates.parquet, self.plates.look.given());
        let no_profiles = "only a profiler has profiles";
        let px_instead = "say --feature-noise-px, with --plates --column-noise-px";
        [
            px(is_camera, "this sensor reports lengths", "say --feature-noise-mm"),
            px(!plates, "stripes have the noise of their columns", "say --column-noise-px"),
            px(!images, "pictures are written, and no features", by_look),
            (mm, !is_camera, "--feature-noise-mm", "this sensor reports pixels", px_instead),
            (
                columns,
                is_camera,
                "--column-noise-px",
                "this sensor reports lengths",
                "say --feature-noise-mm",
            ),
            (parquet, is_profiler, "--parquet", no_profiles, by_preset),
            (look.is_some(), is_profiler, look.unwrap_or_default(), no_profiles, by_preset),
            outliers(!images, "pictures are written, and no features", by_look),
            outliers(!(plates && is_profiler), "profiles are written, and no features", "say --reflections"),
        ]
    }
}
