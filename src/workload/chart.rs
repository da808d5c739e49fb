//! Bar charts as SVG: what a measurement looks like to people.

use std::fmt::Write;

/// One bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// What stands beside it.
    pub name: String,
    /// Its length.
    pub value: f64,
    /// The smallest value that was seen; a whisker shows it.
    pub low: f64,
    /// The largest value that was seen.
    pub high: f64,
}

/// Horizontal bars in groups, from zero, with the value at the end of each.
#[derive(Clone, Debug, Default)]
pub struct BarChart {
    title: String,
    groups: Vec<(String, Vec<Bar>)>,
    line: Option<(f64, String)>,
}

const WIDTH: f64 = 760.0;
const LEFT: f64 = 190.0;
const RIGHT: f64 = 70.0;
const BAR_HEIGHT: f64 = 16.0;
const BAR_STEP: f64 = 20.0;
const GROUP_STEP: f64 = 30.0;
const TOP: f64 = 64.0;

impl BarChart {
    /// A chart without bars.
    pub fn new(title: &str) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Draws a line across all bars at this value, with a label above it. Bars that don't reach it
    /// are drawn in another colour.
    pub fn line_at(&mut self, value: f64, label: &str) {
        self.line = Some((value, label.into()));
    }

    /// Appends a bar to a group; a new name opens a group.
    pub fn push(&mut self, group: &str, bar: Bar) {
        match self.groups.iter_mut().find(|(name, _)| name == group) {
            Some((_, bars)) => bars.push(bar),
            None => self.groups.push((group.into(), vec![bar])),
        }
    }

    /// The chart as an SVG document, dark on white.
    pub fn to_svg(&self) -> String {
        let bars = self.groups.iter().flat_map(|(_, bars)| bars);
        let line = self.line.as_ref().map_or(0.0, |(value, _)| *value);
        let longest = bars.map(|bar| bar.value.max(bar.high)).fold(line, f64::max);
        let scale = if longest > 0.0 { (WIDTH - LEFT - RIGHT) / longest } else { 0.0 };
        let rows: usize = self.groups.iter().map(|(_, bars)| bars.len()).sum();
        let height = TOP + GROUP_STEP * self.groups.len() as f64 + BAR_STEP * rows as f64 + 16.0;

        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" \
             font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n\
             <text x=\"16\" y=\"26\" font-size=\"16\" font-weight=\"bold\">{}</text>\n",
            escaped(&self.title)
        );
        let mut y = TOP;
        for (group, bars) in &self.groups {
            y += GROUP_STEP;
            draw(
                &mut svg,
                format_args!(
                    "<text x=\"16\" y=\"{}\" font-weight=\"bold\">{}</text>\n",
                    y - 8.0,
                    escaped(group)
                ),
            );
            for bar in bars {
                self.draw_bar(&mut svg, bar, y, scale);
                y += BAR_STEP;
            }
        }
        if let Some((value, label)) = &self.line {
            let x = LEFT + value * scale;
            draw(
                &mut svg,
                format_args!(
                    "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{}\" y2=\"{y}\" stroke=\"#444\" \
                 stroke-dasharray=\"4 3\"/>\n\
                 <text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\" fill=\"#444\">{}</text>\n",
                    TOP - 4.0,
                    TOP - 10.0,
                    escaped(label)
                ),
            );
        }
        svg.push_str("</svg>\n");
        svg
    }

    fn draw_bar(&self, svg: &mut String, bar: &Bar, y: f64, scale: f64) {
        let short = self.line.as_ref().is_some_and(|(line, _)| bar.value < *line);
        let color = if short { "#d98c5f" } else { "#4a7fb0" };
        let (middle, text_y) = (y + 0.5 * BAR_HEIGHT, y + 0.5 * BAR_HEIGHT + 4.0);
        let at = |value: f64| LEFT + value * scale;
        draw(
            svg,
            format_args!(
                "<text x=\"{}\" y=\"{text_y}\" text-anchor=\"end\">{}</text>\n\
             <rect x=\"{LEFT}\" y=\"{y}\" width=\"{:.1}\" height=\"{BAR_HEIGHT}\" \
             fill=\"{color}\"/>\n\
             <line x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{middle}\" y2=\"{middle}\" stroke=\"#222\"/>\n\
             <text x=\"{:.1}\" y=\"{text_y}\">{}</text>\n",
                LEFT - 8.0,
                escaped(&bar.name),
                bar.value * scale,
                at(bar.low),
                at(bar.high),
                at(bar.value.max(bar.high)) + 6.0,
                three_digits(bar.value)
            ),
        );
    }
}

/// Appends to a string, which can't fail.
fn draw(svg: &mut String, element: std::fmt::Arguments<'_>) {
    let _ = svg.write_fmt(element);
}

fn three_digits(value: f64) -> String {
    let digits = if value.abs() < 10.0 { 2 } else { usize::from(value.abs() < 100.0) };
    format!("{value:.digits$}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_has_every_bar_and_escapes_names() {
        let mut chart = BarChart::new("a < b & c");
        chart.line_at(1.0, "even");
        for (group, name, value) in [("one", "x", 2.0), ("two", "y", 0.5), ("one", "z", 31.25)] {
            chart.push(group, Bar { name: name.into(), value, low: value, high: value });
        }
        let svg = chart.to_svg();
        assert!(svg.contains("a &lt; b &amp; c"));
        assert_eq!(svg.matches("fill=\"#4a7fb0\"").count(), 2);
        assert_eq!(svg.matches("fill=\"#d98c5f\"").count(), 1);
        assert!(svg.contains(">31.2<") && svg.contains(">0.50<"));
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
    }

    #[test]
    fn an_empty_chart_is_a_picture_too() {
        assert!(!BarChart::new("nothing").to_svg().contains("NaN"));
    }
}
