//! A small chart as SVG, drawn here: no library runs in the browser, and the numbers are in the page's own text.

use crate::serve::html::escape;
use std::fmt::Write;

/// Colours by their class in the style sheet.
pub(crate) const COLOURS: [&str; 4] = ["a", "b", "c", "d"];

const SIZE: [f64; 2] = [400.0, 200.0];
/// Left, top, right and bottom of the plot.
const FRAME: [f64; 4] = [46.0, 22.0, 394.0, 180.0];
/// Ticks upright, about.
const TICKS: f64 = 4.0;

/// One line of a chart.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Its name.
    pub name: &'static str,
    /// Points from left to right; a gap is where the second is not finite.
    pub points: Vec<[f64; 2]>,
    /// Half the width of the band around each point, or nothing.
    pub sigma: Vec<f64>,
    /// Dots instead of a line.
    pub dotted: bool,
}

/// A chart of lines.
#[derive(Clone, Debug, Default)]
pub struct Trend {
    /// The content in words, for those who do not see it.
    pub alternative: String,
    /// Name of the axis along the bottom.
    pub along: &'static str,
    /// The lines.
    pub series: Vec<Series>,
    /// Dashed lines across.
    pub limits: Vec<f64>,
}

/// From numbers to places on the paper.
struct Scale {
    from: [f64; 2],
    per: [f64; 2],
}

impl Scale {
    /// Around all that is finite; `None` if nothing is.
    fn of(trend: &Trend) -> Option<Self> {
        let mut places: Vec<[f64; 2]> = Vec::new();
        for series in &trend.series {
            for (k, [x, y]) in series.points.iter().enumerate() {
                let sigma = series.sigma.get(k).copied().filter(|s| s.is_finite()).unwrap_or(0.0);
                places.extend([[*x, y - sigma], [*x, y + sigma]]);
            }
        }
        places.retain(|place| place.iter().all(|x| x.is_finite()));
        let first = *places.first()?;
        places.extend(trend.limits.iter().map(|limit| [first[0], *limit]));
        let ends = |of: fn(f64, f64) -> f64| {
            places.iter().fold(first, |end, p| [of(end[0], p[0]), of(end[1], p[1])])
        };
        let (mut low, mut high) = (ends(f64::min), ends(f64::max));
        for k in 0..2 {
            let middle = 0.5 * (low[k] + high[k]);
            let half = (0.52 * (high[k] - low[k])).max(1e-9 + 1e-6 * middle.abs());
            (low[k], high[k]) = (middle - half, middle + half);
        }
        let [left, top, right, bottom] = FRAME;
        Some(Self {
            from: low,
            per: [(right - left) / (high[0] - low[0]), (top - bottom) / (high[1] - low[1])],
        })
    }

    fn x(&self, x: f64) -> f64 {
        FRAME[0] + (x - self.from[0]) * self.per[0]
    }

    fn y(&self, y: f64) -> f64 {
        FRAME[3] + (y - self.from[1]) * self.per[1]
    }
}

impl Trend {
    /// As markup.
    #[must_use]
    pub fn svg(&self) -> String {
        let alternative = escape(&self.alternative);
        let [width, height] = SIZE;
        let mut out =
            format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{alternative}\">");
        match Scale::of(self) {
            Some(scale) => self.draw(&scale, &mut out),
            None => out += "<text x=\"200\" y=\"100\" text-anchor=\"middle\">nothing yet</text>",
        }
        out + "</svg>"
    }

    // Writing to a String cannot fail.
    fn draw(&self, scale: &Scale, out: &mut String) {
        let [left, top, right, bottom] = FRAME;
        let high = scale.from[1] + (top - bottom) / scale.per[1];
        for tick in ticks(scale.from[1], high) {
            let y = scale.y(tick);
            let _ = write!(
                out,
                "<path class=\"axis\" d=\"M{left} {y:.1}H{right}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 4.0,
                y + 4.0,
                number(tick, high - scale.from[1])
            );
        }
        let name = escape(self.along);
        let _ = write!(out, "<text x=\"{right}\" y=\"196\" text-anchor=\"end\">{name}</text>");
        let last = scale.from[0] + (right - left) / scale.per[0];
        for tick in ticks(scale.from[0], last) {
            let x = scale.x(tick);
            // The end is the name's.
            if x < right - 9.0 * self.along.chars().count() as f64 {
                let text = number(tick, last - scale.from[0]);
                let text = text.strip_suffix(".0").unwrap_or(&text);
                let _ = write!(out, "<text x=\"{x:.1}\" y=\"196\" text-anchor=\"middle\">{text}</text>");
            }
        }
        let mut key_at = left;
        for (series, colour) in self.series.iter().zip(COLOURS) {
            let _ = write!(
                out,
                "<rect class=\"key {colour}\" x=\"{key_at:.0}\" y=\"5\" width=\"9\" height=\"9\"/><text x=\"{:.0}\" y=\"14\">{}</text>",
                key_at + 13.0,
                escape(series.name)
            );
            key_at += 30.0 + 6.5 * series.name.chars().count() as f64;
            series.draw(scale, colour, out);
        }
        for limit in &self.limits {
            let _ = write!(out, "<path class=\"limit\" d=\"M{left} {:.1}H{right}\"/>", scale.y(*limit));
        }
    }
}

impl Series {
    fn draw(&self, scale: &Scale, colour: &str, out: &mut String) {
        let known = |[_, y]: &[f64; 2]| y.is_finite();
        if self.dotted {
            for [x, y] in self.points.iter().copied().filter(known) {
                let _ = write!(
                    out,
                    "<circle class=\"dot {colour}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"2\"/>",
                    scale.x(x),
                    scale.y(y)
                );
            }
            return;
        }
        let pairs: Vec<([f64; 2], f64)> = self
            .points
            .iter()
            .enumerate()
            .map(|(k, p)| (*p, self.sigma.get(k).copied().unwrap_or(f64::NAN)))
            .collect();
        for stretch in pairs.split(|(point, _)| !known(point)).filter(|stretch| !stretch.is_empty()) {
            if stretch.iter().all(|(_, sigma)| sigma.is_finite()) {
                let upper = stretch.iter().map(|([x, y], s)| [*x, y + s]);
                let lower = stretch.iter().rev().map(|([x, y], s)| [*x, y - s]);
                let _ =
                    write!(out, "<path class=\"band {colour}\" d=\"{}Z\"/>", path(upper.chain(lower), scale));
            }
            let _ = write!(
                out,
                "<path class=\"line {colour}\" d=\"{}\"/>",
                path(stretch.iter().map(|(p, _)| *p), scale)
            );
        }
    }
}

fn path(points: impl Iterator<Item = [f64; 2]>, scale: &Scale) -> String {
    let step = |(k, [x, y]): (usize, [f64; 2])| {
        format!("{}{:.1} {:.1}", if k == 0 { 'M' } else { 'L' }, scale.x(x), scale.y(y))
    };
    points.enumerate().map(step).collect()
}

/// Round numbers between two: steps of 1, 2 or 5 times a power of ten.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let rough = (high - low) / TICKS;
    let power = 10f64.powf(rough.log10().floor());
    // The largest round step up to that: at least TICKS of them.
    let step = power * [5.0, 2.0, 1.0].into_iter().find(|m| m * power <= rough).unwrap_or(1.0);
    let first = (low / step).ceil();
    (0..20).map(|k| (first + f64::from(k)) * step).take_while(|tick| *tick <= high).collect()
}

/// With as many digits as a range needs.
fn number(value: f64, range: f64) -> String {
    let digits = (1.0 - range.log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    // No minus before nothing.
    if text.trim_start_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(-0.3, 6.5), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(ticks(-0.5, 9.0), [0.0, 2.0, 4.0, 6.0, 8.0]);
        let fine = ticks(1.234, 1.241);
        assert!(fine.len() >= 2 && fine.iter().all(|t| (1.234..=1.241).contains(t)), "{fine:?}");
        assert_eq!((number(0.05, 0.2), number(-0.0, 5.0)), ("0.05".to_owned(), "0.0".to_owned()));
    }

    #[test]
    fn gaps_part_a_line_and_nothing_is_no_number() {
        let points = vec![[0.0, 1.0], [1.0, 2.0], [2.0, f64::NAN], [3.0, 1.5]];
        let series = Series { name: "a < b", points, ..Series::default() };
        let svg = Trend { series: vec![series], limits: vec![6.25], ..Trend::default() }.svg();
        assert_eq!(svg.matches("class=\"line a\"").count(), 2, "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf") && svg.contains("a &lt; b"), "{svg}");
        assert!(Trend::default().svg().contains("nothing yet"));
        let one = Trend {
            series: vec![Series { points: vec![[7.0, 3.0]], ..Series::default() }],
            ..Trend::default()
        };
        assert!(!one.svg().contains("NaN"), "a single point has no range");
    }
}
