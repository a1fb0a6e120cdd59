//! Drawing for pages that need nothing else: colours, escaping, and plots with axes, as inline SVG.

use std::fmt::Write as _;

/// Text as it may stand in HTML and SVG, also within attributes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            _ => escaped.push(c),
        }
    }
    escaped
}

/// A colour of a scale from dark blue (0) to yellow (1) whose lightness rises steadily.
pub fn heat(value: f64) -> String {
    const STOPS: [[f64; 3]; 5] = [[68.0, 1.0, 84.0], [59.0, 82.0, 139.0], [33.0, 145.0, 140.0], [94.0, 201.0, 98.0], [253.0, 231.0, 37.0]];
    let at = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (at as usize).min(STOPS.len() - 2);
    let [r, g, b] = std::array::from_fn(|i| STOPS[below][i] + (at - below as f64) * (STOPS[below + 1][i] - STOPS[below][i]));
    format!("rgb({r:.0},{g:.0},{b:.0})")
}

/// The colour of the i-th thing: hues a golden angle apart stay apart for any number.
pub fn hue(i: usize) -> String {
    format!("hsl({:.0} 55% 50%)", i as f64 * 137.508 % 360.0)
}

/// One axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    label: String,
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Axis {
    /// An axis from 0 to the largest of `values`.
    pub fn linear(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let high = values.fold(0.0, f64::max);
        Self { label: label.to_owned(), low: 0.0, high: if high > 0.0 { high } else { 1.0 }, logarithmic: false }
    }

    /// A logarithmic axis around all positive `values`.
    pub fn logarithmic(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values.filter(|v| *v > 0.0).fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)));
        let (low, high) = if low <= high { (low / 1.25, high * 1.25) } else { (0.1, 10.0) };
        Self { label: label.to_owned(), low, high, logarithmic: true }
    }

    /// An axis with the same label and both ranges.
    pub fn joined(mut self, other: &Self) -> Self {
        (self.low, self.high) = (self.low.min(other.low), self.high.max(other.high));
        self
    }

    /// Place on the axis, in [0, 1].
    fn place(&self, value: f64) -> f64 {
        match self.logarithmic {
            true => (value.max(self.low) / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        }
    }

    /// Values that get a mark: steps of 1, 2 or 5 times a power of ten; on logarithmic axes these themselves.
    fn ticks(&self) -> Vec<f64> {
        if self.logarithmic {
            let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
            let few = (self.high / self.low).log10() < 2.0;
            let steps: &[f64] = if few { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let all = decades.flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)));
            return all.filter(|tick| (self.low..=self.high).contains(tick)).collect();
        }
        let rough = (self.high - self.low) / 6.0;
        let unit = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|s| s * unit).into_iter().find(|step| *step >= rough).unwrap_or(unit);
        (0..=(self.high / step) as u32).map(|i| f64::from(i) * step).collect()
    }
}

/// A plot: two axes and what is drawn between them.
pub struct Plot {
    x: Axis,
    y: Axis,
    body: String,
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 420.0;
const LEFT: f64 = 70.0;
const BOTTOM: f64 = 48.0;
const MARGIN: f64 = 14.0;

impl Plot {
    /// An empty plot.
    pub fn new(x: Axis, y: Axis) -> Self {
        let mut plot = Self { x, y, body: String::new() };
        plot.draw_axes();
        plot
    }

    /// A dot, with what is said when it is pointed at.
    pub fn point(&mut self, x: f64, y: f64, color: &str, said: &str) {
        let (x, y) = self.at(x, y);
        let said = escape(said);
        self.draw(format_args!(
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.5" fill="{color}" fill-opacity="0.75"><title>{said}</title></circle>"#
        ));
    }

    /// A line through points.
    pub fn line(&mut self, points: &[(f64, f64)], color: &str, dashed: bool) {
        let places: Vec<_> = points.iter().map(|&(x, y)| self.at(x, y)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let dash = if dashed { r#" stroke-dasharray="4 4""# } else { "" };
        self.draw(format_args!(r#"<polyline points="{}" fill="none" stroke="{color}" stroke-width="1.5"{dash}/>"#, places.join(" ")));
    }

    /// Words beside a point.
    pub fn label(&mut self, x: f64, y: f64, text: &str) {
        let (x, y) = self.at(x, y);
        let (x, anchor) = if x < LEFT + 0.8 * (WIDTH - LEFT - MARGIN) { (x + 7.0, "start") } else { (x - 7.0, "end") }; // within the plot
        let text = escape(text);
        self.draw(format_args!(r#"<text x="{x:.1}" y="{:.1}" text-anchor="{anchor}" fill="currentColor">{text}</text>"#, y - 6.0));
    }

    /// The plot as an `<svg>` element; it takes text colour and font from the page around it.
    pub fn finish(self) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" font-size=\"12\" font-family=\"system-ui, \
             sans-serif\">\n{}</svg>\n",
            self.body
        )
    }

    /// The plot as a file of its own: dark on white.
    pub fn finish_alone(self) -> String {
        self.finish().replacen("<svg ", "<svg style=\"background: white; color: #222\" ", 1)
    }

    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let (width, height) = (WIDTH - LEFT - MARGIN, HEIGHT - BOTTOM - MARGIN);
        (LEFT + self.x.place(x) * width, MARGIN + (1.0 - self.y.place(y)) * height)
    }

    fn draw_axes(&mut self) {
        let (right, bottom) = (WIDTH - MARGIN, HEIGHT - BOTTOM);
        for tick in self.x.ticks() {
            let (x, _) = self.at(tick, self.y.low);
            self.draw(format_args!(r#"<path d="M{x:.1} {MARGIN}V{bottom}" stroke="currentColor" stroke-opacity="0.15"/>"#));
            self.draw(format_args!(
                r#"<text x="{x:.1}" y="{}" text-anchor="middle" fill="currentColor">{}</text>"#,
                bottom + 17.0,
                number(tick)
            ));
        }
        for tick in self.y.ticks() {
            let (_, y) = self.at(self.x.low, tick);
            self.draw(format_args!(r#"<path d="M{LEFT} {y:.1}H{right}" stroke="currentColor" stroke-opacity="0.15"/>"#));
            self.draw(format_args!(
                r#"<text x="{}" y="{:.1}" text-anchor="end" fill="currentColor">{}</text>"#,
                LEFT - 7.0,
                y + 4.0,
                number(tick)
            ));
        }
        self.draw(format_args!(r#"<path d="M{LEFT} {MARGIN}V{bottom}H{right}" fill="none" stroke="currentColor" stroke-opacity="0.6"/>"#));
        let (x, y) = (escape(&self.x.label), escape(&self.y.label));
        let (middle, half) = ((LEFT + right) / 2.0, (MARGIN + bottom) / 2.0);
        self.draw(format_args!(r#"<text x="{middle}" y="{}" text-anchor="middle" fill="currentColor">{x}</text>"#, HEIGHT - 8.0));
        self.draw(format_args!(
            r#"<text transform="translate(16 {half}) rotate(-90)" text-anchor="middle" fill="currentColor">{y}</text>"#
        ));
    }

    fn draw(&mut self, element: std::fmt::Arguments<'_>) {
        let _ = writeln!(self.body, "{element}"); // writing to a String cannot fail
    }
}

/// A number at a mark: no digits that do not count.
fn number(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e5).contains(&value.abs()) { format!("{value:.0e}") } else { format!("{}", (value * 1e6).round() / 1e6) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_numbers_that_cover_the_axis() {
        assert_eq!(Axis::linear("", [13.0].into_iter()).ticks(), [0.0, 5.0, 10.0]);
        assert_eq!(Axis::linear("", [0.06].into_iter()).ticks().len(), 7);
        let ticks = Axis::logarithmic("", [0.02, 30.0].into_iter()).ticks();
        assert_eq!(ticks.iter().map(|t| number(*t)).collect::<Vec<_>>(), ["0.1", "1", "10"]);
        assert_eq!(Axis::logarithmic("", [3.0, 30.0].into_iter()).ticks(), [5.0, 10.0, 20.0]);
    }

    #[test]
    fn names_cannot_leave_their_place() {
        assert_eq!(escape(r#"<script>"&'"#), "&lt;script&gt;&quot;&amp;&#39;");
    }

    #[test]
    fn axes_without_values_still_stand() {
        let svg = Plot::new(Axis::linear("x", std::iter::empty()), Axis::logarithmic("y", [0.0].into_iter())).finish();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}
