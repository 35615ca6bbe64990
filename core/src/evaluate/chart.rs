//! Line charts as SVG, for figures of accuracy: drawn the same from the same numbers, readable on paper and on screen.

use std::fmt::Write as _;

/// Size of a chart.
const SIZE: [f64; 2] = [760.0, 460.0];
/// Where its curves are: left, top, right, bottom.
const FIELD: [f64; 4] = [76.0, 56.0, 556.0, 396.0];
/// Colours that are told apart by most eyes (Okabe & Ito, 2008).
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const INK: &str = "#22262c";
const SOFT: &str = "#5b626d";
const LINE: &str = "#d9dbd6";

/// A chart of curves over one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// One line above it.
    pub title: String,
    /// What the horizontal axis is, with its unit.
    pub x_label: String,
    /// What the vertical axis is, with its unit.
    pub y_label: String,
    /// The curves; the key names them in this order.
    pub series: Vec<Series>,
    /// The least span of the vertical axis.
    pub y_span: [f64; 2],
}

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name in the key.
    pub name: String,
    /// Horizontal and vertical value of each point; one that is not finite leaves a gap.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub mark: Mark,
}

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line with a dot at each point: what was measured.
    Measured,
    /// A dashed line in grey: what it is held against.
    Oracle,
}

impl Chart {
    /// The chart as one SVG document.
    pub fn svg(&self) -> String {
        let scale = self.scale();
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"system-ui, sans-serif\" \
             font-size=\"14\" fill=\"{INK}\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            SIZE[0], SIZE[1]
        );
        let [left, top, right, bottom] = FIELD;
        text(&mut svg, [left, 32.0], "font-size=\"17\" font-weight=\"600\"", &self.title);
        self.draw_axes(&mut svg, &scale);
        // Oracles last: where a curve lies on its oracle both are seen.
        for mark in [Mark::Measured, Mark::Oracle] {
            for (index, series) in self.series.iter().enumerate().filter(|(_, series)| series.mark == mark) {
                draw_series(&mut svg, &scale, series, (self.colour(index), self.extra(index)));
            }
        }
        for (index, series) in self.series.iter().enumerate() {
            let y = top + 12.0 + 24.0 * index as f64;
            draw_sample(&mut svg, [right + 20.0, y], series.mark, self.colour(index));
            text(&mut svg, [right + 54.0, y + 5.0], "", &series.name);
        }
        let middle = (left + right) / 2.0;
        text(&mut svg, [middle, bottom + 46.0], "text-anchor=\"middle\"", &self.x_label);
        let turned = format!("text-anchor=\"middle\" transform=\"rotate(-90 22 {})\"", (top + bottom) / 2.0);
        text(&mut svg, [22.0, (top + bottom) / 2.0], &turned, &self.y_label);
        svg + "</svg>\n"
    }

    /// Measured curves have colours in their order, oracles grey.
    fn colour(&self, index: usize) -> &'static str {
        match self.series[index].mark {
            Mark::Oracle => SOFT,
            Mark::Measured => {
                let before = self.series[..index].iter().filter(|series| series.mark == Mark::Measured).count();
                COLOURS[before % COLOURS.len()]
            }
        }
    }

    /// By how much a curve is wider than the last one: curves that lie on each other all show.
    fn extra(&self, index: usize) -> f64 {
        match self.series[index].mark {
            Mark::Oracle => 0.0,
            Mark::Measured => {
                self.series[index + 1..].iter().filter(|series| series.mark == Mark::Measured).count() as f64
            }
        }
    }

    fn scale(&self) -> Scale {
        let points = || self.series.iter().flat_map(|series| &series.points).filter(|point| is_drawn(point));
        let least = |axis: usize, start: f64| points().map(|point| point[axis]).fold(start, f64::min);
        let most = |axis: usize, start: f64| points().map(|point| point[axis]).fold(start, f64::max);
        let x = Ticks::over(least(0, f64::INFINITY), most(0, f64::NEG_INFINITY), 10.0, Fit::Tight);
        let y = Ticks::over(least(1, self.y_span[0]), most(1, self.y_span[1]), 6.0, Fit::Round);
        Scale { x, y }
    }

    fn draw_axes(&self, svg: &mut String, scale: &Scale) {
        let [left, top, right, bottom] = FIELD;
        for value in scale.y.values() {
            let [_, y] = scale.at([scale.x.low, value]);
            line(svg, [left, y], [right, y], LINE);
            text(svg, [left - 10.0, y + 5.0], "text-anchor=\"end\" font-size=\"13\"", &scale.y.words(value));
        }
        for value in scale.x.values() {
            let [x, _] = scale.at([value, scale.y.low]);
            line(svg, [x, bottom], [x, bottom + 6.0], SOFT);
            text(svg, [x, bottom + 22.0], "text-anchor=\"middle\" font-size=\"13\"", &scale.x.words(value));
        }
        line(svg, [left, bottom], [right, bottom], SOFT);
        line(svg, [left, top], [left, bottom], SOFT);
    }
}

fn is_drawn(point: &[f64; 2]) -> bool {
    point.iter().all(|value| value.is_finite())
}

/// Values to places of the picture.
struct Scale {
    x: Ticks,
    y: Ticks,
}

impl Scale {
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [left, top, right, bottom] = FIELD;
        [left + self.x.share(x) * (right - left), bottom - self.y.share(y) * (bottom - top)]
    }
}

/// Whether an axis ends at its last value or at the next tick.
#[derive(Clone, Copy, PartialEq)]
enum Fit {
    Tight,
    Round,
}

/// Round values along an axis.
struct Ticks {
    low: f64,
    high: f64,
    step: f64,
}

impl Ticks {
    fn over(low: f64, high: f64, most: f64, fit: Fit) -> Self {
        let (low, high) = if low < high {
            (low, high)
        } else if low.is_finite() {
            (low, low + 1.0)
        } else {
            (0.0, 1.0)
        };
        let rough = (high - low) / most;
        let power = 10_f64.powf(rough.log10().floor());
        let round = [1.0, 2.0, 5.0, 10.0].into_iter().map(|digit| digit * power).find(|step| *step >= rough * 0.999);
        let step = round.unwrap_or(rough);
        match fit {
            Fit::Tight => Self { low, high, step },
            Fit::Round => Self { low: (low / step).floor() * step, high: (high / step).ceil() * step, step },
        }
    }

    fn values(&self) -> impl Iterator<Item = f64> {
        let (first, last) =
            ((self.low / self.step - 1e-6).ceil() as i64, (self.high / self.step + 1e-6).floor() as i64);
        let step = self.step;
        (first..=last).map(move |index| index as f64 * step)
    }

    fn share(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    fn words(&self, value: f64) -> String {
        let decimals = (-self.step.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.decimals$}").replace('-', "−")
    }
}

fn draw_series(svg: &mut String, scale: &Scale, series: &Series, (colour, extra): (&str, f64)) {
    let (width, radius) = (2.2 + 1.2 * extra, 4.0 + 1.2 * extra);
    let runs = series.points.split(|point| !is_drawn(point)).filter(|run| !run.is_empty());
    let dash = if series.mark == Mark::Oracle { " stroke-dasharray=\"7 5\"" } else { "" };
    for run in runs {
        let places: Vec<[f64; 2]> = run.iter().map(|point| scale.at(*point)).collect();
        let path: Vec<String> = places.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
        let _ = writeln!(
            svg,
            "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width:.1}\"{dash}/>",
            path.join("L")
        );
        if series.mark == Mark::Measured {
            for [x, y] in places {
                let _ = writeln!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{colour}\" stroke=\"#fff\"/>"
                );
            }
        }
    }
}

fn draw_sample(svg: &mut String, [x, y]: [f64; 2], mark: Mark, colour: &str) {
    let dash = if mark == Mark::Oracle { " stroke-dasharray=\"7 5\"" } else { "" };
    let _ =
        writeln!(svg, "<path d=\"M{x:.1} {y:.1}h26\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.2\"{dash}/>");
    if mark == Mark::Measured {
        let _ =
            writeln!(svg, "<circle cx=\"{:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\" stroke=\"#fff\"/>", x + 13.0);
    }
}

fn line(svg: &mut String, from: [f64; 2], to: [f64; 2], colour: &str) {
    let _ = writeln!(
        svg,
        "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"{colour}\" fill=\"none\"/>",
        from[0], from[1], to[0], to[1]
    );
}

fn text(svg: &mut String, [x, y]: [f64; 2], attributes: &str, words: &str) {
    let words = words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" {attributes}>{words}</text>");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<[f64; 2]>) -> Chart {
        let series = Series { name: "a < b & c".to_owned(), points, mark: Mark::Measured };
        Chart {
            title: "t".to_owned(),
            x_label: "x".to_owned(),
            y_label: "y".to_owned(),
            series: vec![series],
            y_span: [0.0, 1.0],
        }
    }

    #[test]
    fn a_gap_ends_a_line_and_names_are_escaped() {
        let svg = chart(vec![[0.0, 1.0], [1.0, 2.0], [2.0, f64::NAN], [3.0, 1.0]]).svg();
        assert_eq!(svg.matches("<path d=\"M").count() - svg.matches("h26").count() - lines(&svg), 2, "two runs");
        assert!(svg.contains("a &lt; b &amp; c") && !svg.contains("NaN"));
    }

    /// Lines of axes and grid, which have no width of their own.
    fn lines(svg: &str) -> usize {
        svg.lines().filter(|line| line.starts_with("<path") && !line.contains("stroke-width")).count()
    }

    #[test]
    fn no_point_and_one_point_are_still_a_chart() {
        for points in [Vec::new(), vec![[2.0, 5.0]], vec![[f64::INFINITY, 1.0]]] {
            let svg = chart(points).svg();
            assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn ticks_are_round() {
        let words = |low, high, most| {
            let ticks = Ticks::over(low, high, most, Fit::Round);
            ticks.values().map(|value| ticks.words(value)).collect::<Vec<_>>()
        };
        assert_eq!(words(0.0, 5.0, 6.0), ["0", "1", "2", "3", "4", "5"]);
        assert_eq!(words(0.0, 0.56, 6.0), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6"]);
        assert_eq!(words(-8.0, 40.0, 6.0), ["−10", "0", "10", "20", "30", "40"]);
    }
}
