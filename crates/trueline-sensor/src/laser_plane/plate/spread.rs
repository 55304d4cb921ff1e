//! Spread of the stops beyond the noise of their pixels: the robot's pose error, and the plate's flatness.

/// One number of a stop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    /// Residual, m.
    pub value_m: f64,
    /// Variance that the noise of the pixels leaves, m².
    pub noise: f64,
    /// d value / d (plate's surface).
    pub gain: f64,
    /// Part of the number absorbed by the fit, 0 to 1.
    pub leverage: f64,
}

impl Measured {
    /// Variance with a spread, m².
    pub(super) fn variance(&self, spread_m: f64) -> f64 {
        self.noise + (self.gain * spread_m).powi(2)
    }

    /// Residual by its own standard deviation, which is smaller than the number's by the absorbed part.
    pub(super) fn z(&self, spread_m: f64) -> f64 {
        self.value_m / (self.variance(spread_m) * (1.0 - self.leverage).max(1e-3)).sqrt()
    }
}

/// Numbers less the part absorbed by the fit.
pub(super) fn freedom(of: &[Measured]) -> f64 {
    of.iter().map(|m| 1.0 - m.leverage).sum()
}

/// The spread with which the weighted squares have their expected value, by halving (\[Paule1982\]); zero if the noise of
/// the pixels explains all.
pub(super) fn spread_m(of: &[Measured]) -> f64 {
    let excess = |spread_m: f64| -> f64 {
        let squares: f64 = of.iter().map(|m| m.value_m * m.value_m / m.variance(spread_m)).sum();
        squares - freedom(of)
    };
    if excess(0.0) <= 0.0 {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 1e-6);
    while excess(high) > 0.0 && high < 1.0 {
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    high
}
