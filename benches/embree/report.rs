//! Tables for a terminal, JSON for scripts, a chart for people.

use std::time::Duration;

use octray::workload::{Bar, BarChart, Model};
use serde::Serialize;

use crate::calls::Call;
use crate::engine::{Device, EmbreeScene};
use crate::options::Options;
use crate::turns::{Qualified, Row};

/// Prints what is measured as it comes, and keeps it for JSON and the chart.
pub(crate) struct Report<'a> {
    options: &'a Options,
    document: Document,
}

#[derive(Serialize)]
struct Document {
    embree: Option<String>,
    size: [usize; 2],
    turns: usize,
    seed: u64,
    rows: Vec<Row>,
}

impl<'a> Report<'a> {
    pub(crate) fn new(options: &'a Options, device: Option<&Device>) -> Self {
        let document = Document {
            embree: device.map(Device::version),
            size: options.size.into(),
            turns: options.turns,
            seed: options.seed,
            rows: Vec::new(),
        };
        Self { options, document }
    }

    /// Opens the table of a scene.
    pub(crate) fn model(&mut self, model: &Model, build: Duration, embree: &[EmbreeScene<'_>]) {
        if self.options.json {
            return;
        }
        let count = model.primitive_count();
        let speed = |time: Duration| count as f64 / time.as_secs_f64() / 1e6;
        print!(
            "\n{}: {count} primitives; million a second built: octray {:.2}",
            model.name,
            speed(build)
        );
        for scene in embree {
            print!(", {} {:.2}", scene.mode.name(), speed(scene.build_time));
        }
        println!(" (all threads)");
        println!(
            "{:<17} {:>2} {:>8} {:>4} {:>8} {:>8} {:>8}  {:<24} {:>6} {:>13} {:>10} {:>6}  \
             octray only/embree only/other, dt/t",
            "workload",
            "th",
            "rays",
            "hit%",
            "octray",
            "embree",
            "copied",
            "best call",
            "ratio",
            "range",
            "visibility",
            "ratio"
        );
    }

    /// Prints one row.
    pub(crate) fn row(&mut self, row: Row, calls: &[Qualified]) {
        if !self.options.json {
            self.print(&row);
            if self.options.calls {
                print_calls(calls);
            }
        }
        self.document.rows.push(row);
    }

    fn print(&self, row: &Row) {
        print!(
            "{:<17} {:>2} {:>8} {:>4.0} ",
            row.workload,
            row.threads,
            row.rays,
            100.0 * row.hit_share
        );
        if let Some(failure) = &row.failure {
            println!("NOT MEASURED: {failure}");
            return;
        }
        let number = |value: Option<f64>, digits: usize| {
            value.map_or("-".into(), |value| format!("{value:.digits$}"))
        };
        let range = row.ratio_range.map(|[low, high]| format!("{low:.2}..{high:.2}"));
        let agreement = row.agreement.map(|agreement| agreement.to_string());
        println!(
            "{:>8} {:>8} {:>8}  {:<24} {:>6} {:>13} {:>10} {:>6}  {}",
            number(row.octray, 2),
            number(row.embree, 2),
            number(row.embree_copied, 2),
            row.embree_call.as_deref().unwrap_or("-"),
            number(row.ratio, 2),
            range.unwrap_or_default(),
            number(row.visibility, 2),
            number(row.visibility_ratio, 2),
            agreement.unwrap_or_default()
        );
    }

    /// Writes what was asked for beside the tables. An error if a row could not be measured.
    pub(crate) fn finish(self) -> Result<(), String> {
        let document = &self.document;
        if self.options.json {
            let json = serde_json::to_string_pretty(document).map_err(|error| error.to_string())?;
            println!("{json}");
        }
        if let Some(path) = &self.options.svg {
            let svg = chart(document).to_svg();
            std::fs::write(path, svg).map_err(|error| format!("{}: {error}", path.display()))?;
        }
        match document.rows.iter().filter(|row| row.failure.is_some()).count() {
            0 => Ok(()),
            failed => Err(format!("{failed} rows have no figures: see above")),
        }
    }
}

/// The ratios, a group of bars for each scene.
fn chart(document: &Document) -> BarChart {
    let version = document.embree.as_deref().unwrap_or("");
    let mut chart =
        BarChart::new(&format!("octray against Embree {version}: times as many rays a second"));
    chart.line_at(1.0, "Embree's best call");
    let most = document.rows.iter().map(|row| row.threads).max().unwrap_or(1);
    for row in &document.rows {
        if let Some(value) = row.ratio.or(row.octray) {
            let threads =
                if most > 1 { format!(", {} threads", row.threads) } else { String::new() };
            let [low, high] = row.ratio_range.unwrap_or([value; 2]);
            chart.push(
                &format!("{}{threads}", row.scene),
                Bar { name: row.workload.clone(), value, low, high },
            );
        }
    }
    chart
}

/// A line for each build, a column for each call; the qualifying run of those that agree.
fn print_calls(calls: &[Qualified]) {
    let mut modes = Vec::new();
    for qualified in calls {
        if !modes.contains(&qualified.call.mode) {
            modes.push(qualified.call.mode);
        }
    }
    for mode in modes {
        print!("    {:<14}", mode.name());
        for call in Call::all(mode) {
            let qualified = calls.iter().find(|qualified| qualified.call == call);
            let rate = match qualified {
                Some(qualified) if qualified.agreement.holds() => format!("{:.1}", qualified.rate),
                _ => "-".into(),
            };
            print!(" {}{} {rate:>5}", call.short(), if call.packed { "p" } else { " " });
        }
        println!();
    }
}
