//! A result of stamps that were shifted before the estimate, told in the stamps as they were recorded.

use super::ResultFile;

impl ResultFile {
    /// The result of a recording from whose image stamps `images_ahead_s` was taken: every time offset then counts from the stamps as
    /// they were recorded. How to use it is left out: it was said of the shifted stamps.
    #[must_use]
    pub fn with_images_ahead(mut self, images_ahead_s: f64) -> Self {
        self.time_offset_s = self.time_offset_s.map(|offset_s| offset_s + images_ahead_s);
        for offset_s in self
            .iterations
            .iter_mut()
            .map(|step| &mut step.time_offset_s)
            .chain(self.rivals.iter_mut().map(|rival| &mut rival.time_offset_s))
            .chain(self.checks.runner_up.iter_mut().map(|other| &mut other.time_offset_s))
        {
            *offset_s += images_ahead_s;
        }
        self.time_offset_use = None;
        self.images_ahead_s = Some(images_ahead_s);
        self
    }
}
