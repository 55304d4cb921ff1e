//! The pictures of a whole scan.

use super::joint::Joint;
use super::look::Look;
use super::renderer::{Picture, Renderer, Studio};
use crate::motion::Motion;
use crate::noise::Noise;
use crate::scenario::{Scenario, SensorModel};
use crate::shutter::{Exposed, Shutter};
use trueline_geometry::Line;

/// A scan with pictures that can be drawn one by one, in any order and by several threads.
pub struct PictureScan<'a> {
    scenario: &'a Scenario,
    motion: Motion<'a>,
    studio: Studio,
    exposures: Vec<Exposed>,
}

impl<'a> PictureScan<'a> {
    /// The scan of a scenario over a joint. `None` without a line, or for a sensor that takes no pictures.
    #[must_use]
    pub fn new(scenario: &'a Scenario, joint: Joint, look: Look, seed: u64) -> Option<Self> {
        let SensorModel::CameraLaser { camera, laser_plane_in_camera } = &scenario.cell.sensor else {
            return None;
        };
        let seam = *scenario.cell.lines.first()?;
        let scene = (joint, seam, scenario.cell.approach.into_inner());
        let (mut noise, mut chance) = (Noise::new(seed, 12), Noise::new(seed, 13));
        let mut shutter = Shutter::new(scenario);
        let exposures: Vec<Exposed> = (0..shutter.count())
            .map(|_| shutter.expose(&mut noise))
            .filter(|_| !chance.happens(scenario.disturbance.drop_fraction))
            .collect();
        let motion = Motion::new(scenario)?;
        let mut studio = Studio::new((*camera, *laser_plane_in_camera), scene, look, seed);
        if let Some(middle) = exposures.get(exposures.len() / 2) {
            studio.order_lines(&(motion.base_from_tool(middle.exposed_s) * scenario.cell.tool_from_camera));
        }
        Some(Self { scenario, motion, studio, exposures })
    }

    /// The lines that the pictures show, in base.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        self.studio.lines()
    }

    /// When the pictures are taken.
    #[must_use]
    pub fn exposures(&self) -> &[Exposed] {
        &self.exposures
    }

    /// Something that draws; one for each thread.
    #[must_use]
    pub fn renderer(&self) -> Renderer<'_> {
        Renderer::new(&self.studio)
    }

    /// Draws one picture.
    pub fn draw(&self, renderer: &mut Renderer<'_>, exposed: &Exposed) -> Picture {
        let hand_eye = self.scenario.cell.tool_from_camera;
        renderer.draw(exposed.frame, |from_middle_s| {
            self.motion.base_from_tool(exposed.exposed_s + from_middle_s) * hand_eye
        })
    }
}
