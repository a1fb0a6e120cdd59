//! Error against time: what each rung of a ladder of settings costs and brings.

use serde::Serialize;

use super::{
    difference::Difference,
    style::{Style, table},
    svg::{Axis, Plot, hue},
};

/// One setting of one knob, rendered.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rung {
    /// The knob: `samples` or `max_depth`.
    pub knob: &'static str,
    /// Its setting.
    pub value: u64,
    /// Seconds that rendering took.
    pub seconds: f64,
    /// From the best rung of the same knob.
    #[serde(flatten)]
    pub difference: Difference,
}

/// What was found for a job.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tradeoff {
    /// Name of the job.
    pub job: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Rendering threads.
    pub threads: usize,
    /// Knob by knob, each from its cheapest rung to its best.
    pub rungs: Vec<Rung>,
}

/// A picture on the screen within this of another is hardly told apart from it: 40 dB of signal over noise.
pub const HARDLY_SEEN: f64 = 0.01;

/// Settings from 1 up to `best`, each `factor` times the one before, and `best` itself.
pub fn ladder(best: u64, factor: u64) -> Vec<u64> {
    let mut rungs: Vec<_> = std::iter::successors(Some(1_u64), |rung| rung.checked_mul(factor)).take_while(|rung| *rung < best).collect();
    rungs.push(best.max(1));
    rungs
}

impl Tradeoff {
    /// The knobs, in order of their rungs.
    pub fn knobs(&self) -> Vec<&'static str> {
        let mut knobs: Vec<_> = self.rungs.iter().map(|rung| rung.knob).collect();
        knobs.dedup();
        knobs
    }

    /// The cheapest setting of a knob whose picture is hardly told apart from that of the best.
    pub fn reasonable(&self, knob: &str) -> Option<&Rung> {
        let good = self.of(knob).filter(|rung| rung.difference.on_screen <= HARDLY_SEEN);
        good.min_by_key(|rung| rung.value)
    }

    /// The table, and which rung is reasonable. Ends in a line break.
    pub fn text(&self, style: Style) -> String {
        let Self { job, width, height, threads, .. } = self;
        let mut text = format!("{}  {width} x {height}, {threads} threads\n", style.bold(job));
        for knob in self.knobs() {
            let mut rows = vec![[knob, "seconds", "rmse", "relmse", "on screen"].map(str::to_owned).to_vec()];
            rows.extend(self.of(knob).map(row));
            text.push('\n');
            table(&rows).iter().for_each(|line| text.push_str(&format!("  {line}\n")));
            text.push_str(&format!("{}\n", self.advice(knob)));
        }
        text.push_str(&style.dim("\nErrors are differences from the best rung of the same knob, not from the truth.\n"));
        text
    }

    /// The rungs as comma-separated values with a line of names.
    pub fn csv(&self) -> String {
        let mut csv = "knob,value,seconds,rmse,relative_mse,on_screen\n".to_owned();
        for Rung { knob, value, seconds, difference: Difference { rmse, relative_mse, on_screen } } in &self.rungs {
            csv.push_str(&format!("{knob},{value},{seconds},{rmse},{relative_mse},{on_screen}\n"));
        }
        csv
    }

    /// Error against seconds, both logarithmic; the best rungs have no error and are left out.
    pub fn svg(&self) -> String {
        let shown = || self.rungs.iter().filter(|rung| rung.difference.rmse > 0.0);
        let x = Axis::logarithmic("seconds", shown().map(|rung| rung.seconds));
        let mut plot = Plot::new(x, Axis::logarithmic("RMSE against the best rung", shown().map(|rung| rung.difference.rmse)));
        for (i, knob) in self.knobs().into_iter().enumerate() {
            let rungs: Vec<_> = shown().filter(|rung| rung.knob == knob).collect();
            let points: Vec<_> = rungs.iter().map(|rung| (rung.seconds, rung.difference.rmse)).collect();
            plot.line(&points, &hue(i), false);
            for rung in rungs {
                let said = format!("{knob} {}: {:.3} s, RMSE {:.2e}", rung.value, rung.seconds, rung.difference.rmse);
                plot.point(rung.seconds, rung.difference.rmse, &hue(i), &said);
                plot.label(rung.seconds, rung.difference.rmse, &format!("{knob} {}", rung.value));
            }
        }
        plot.finish_alone()
    }

    fn of(&self, knob: &str) -> impl Iterator<Item = &Rung> {
        self.rungs.iter().filter(move |rung| rung.knob == knob)
    }

    fn advice(&self, knob: &str) -> String {
        let best = self.of(knob).map(|rung| rung.value).max().unwrap_or(1);
        match self.reasonable(knob) {
            Some(rung) if rung.value < best => format!(
                "{knob} = {} is reasonable: on the screen it lies within {HARDLY_SEEN} of {knob} = {best}, which is hardly seen",
                rung.value
            ),
            _ if best == 1 => format!("{knob} = 1 is all there is to choose from"),
            _ => format!("no rung below {knob} = {best} comes close to it: if that shows noise or lacks light, go higher"),
        }
    }
}

fn row(rung: &Rung) -> Vec<String> {
    let Difference { rmse, relative_mse, on_screen } = rung.difference;
    let error = |error: f64| if error > 0.0 { format!("{error:.2e}") } else { "best".to_owned() };
    vec![rung.value.to_string(), format!("{:.3}", rung.seconds), error(rmse), error(relative_mse), error(on_screen)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tradeoff() -> Tradeoff {
        let rung = |knob, value, error: f64| Rung {
            knob,
            value,
            seconds: value as f64 * 0.5,
            difference: Difference { rmse: error, relative_mse: error * error, on_screen: error / 2.0 },
        };
        let samples = [(1, 0.08), (4, 0.04), (16, 0.02), (64, 0.0)].map(|(value, error)| rung("samples", value, error));
        let depths = [(1, 0.4), (2, 0.2), (4, 0.0)].map(|(value, error)| rung("max_depth", value, error));
        Tradeoff { job: "demo".into(), width: 64, height: 48, threads: 2, rungs: [&samples[..], &depths].concat() }
    }

    #[test]
    fn ladders_end_at_the_best_rung() {
        assert_eq!(ladder(64, 4), [1, 4, 16, 64]);
        assert_eq!(ladder(50, 4), [1, 4, 16, 50]);
        assert_eq!(ladder(1, 4), [1]);
        assert_eq!(ladder(8, 2), [1, 2, 4, 8]);
        assert_eq!(*ladder(u64::MAX, 4).last().unwrap(), u64::MAX);
    }

    #[test]
    fn the_reasonable_rung_is_the_cheapest_that_is_hardly_told_apart() {
        assert_eq!(tradeoff().reasonable("samples").unwrap().value, 16);
        assert_eq!(tradeoff().reasonable("max_depth").unwrap().value, 4);
    }

    #[test]
    fn the_table_says_what_its_errors_are_measured_against() {
        insta::assert_snapshot!(tradeoff().text(Style::PLAIN) + "\n" + &tradeoff().csv());
    }

    #[test]
    fn the_plot_shows_all_rungs_but_the_best() {
        let svg = tradeoff().svg();
        assert_eq!(svg.matches("<circle").count(), 5);
        assert!(!svg.contains("NaN") && !svg.contains("inf\""));
    }
}
