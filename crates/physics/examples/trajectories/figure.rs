//! Line figures as SVG: two panels, each with the curve of either engine over time.

use std::fmt::Write;

/// One curve each of the two engines.
pub(crate) struct Panel {
    pub(crate) label: &'static str,
    pub(crate) ours: Vec<f64>,
    pub(crate) mujoco: Vec<f64>,
}

const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 200.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 30.0;
const MUJOCO: &str = r##"stroke="#e08a1e" stroke-width="3.5" stroke-opacity="0.55""##;
const OURS: &str = r##"stroke="#1f4e8c" stroke-width="1.2""##;

/// A figure of panels side by side; values are `period` \[s\] apart.
pub(crate) fn figure(panels: &[Panel], period: f64) -> String {
    let width = WIDTH * panels.len() as f64;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {HEIGHT}\" font-family=\"sans-serif\" \
         font-size=\"11\">\n<rect width=\"{width}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\n"
    );
    for (i, panel) in panels.iter().enumerate() {
        writeln!(svg, "<g transform=\"translate({} 0)\">", WIDTH * i as f64).expect("strings grow");
        svg.push_str(&draw(panel, period));
        svg.push_str("</g>\n");
    }
    svg.push_str("</svg>\n");
    svg
}

fn draw(panel: &Panel, period: f64) -> String {
    let end = period * (panel.ours.len() - 1) as f64;
    let both = || panel.ours.iter().chain(&panel.mujoco).copied();
    let (low, high, tick) = axis(both().fold(f64::MAX, f64::min), both().fold(f64::MIN, f64::max));
    let x = |t: f64| LEFT + (WIDTH - LEFT - RIGHT) * t / end;
    let y = |v: f64| HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (v - low) / (high - low);
    let mut out = String::new();
    for i in 0..=((high - low) / tick).round() as usize {
        let value = low + tick * i as f64;
        let decimals = (-tick.log10()).ceil().max(0.0) as usize;
        out += &line(LEFT, y(value), WIDTH - RIGHT, y(value));
        out += &text(LEFT - 5.0, y(value) + 4.0, "end", &format!("{value:.decimals$}"));
    }
    let every = if end > 5.0 { 2.0 } else { 0.5 };
    for i in 0..=(end / every + 1e-9) as usize {
        let t = every * i as f64;
        out += &line(x(t), HEIGHT - BOTTOM, x(t), HEIGHT - BOTTOM + 4.0);
        out += &text(x(t), HEIGHT - BOTTOM + 16.0, "middle", &format!("{t}"));
    }
    out += &text(WIDTH - RIGHT, HEIGHT - 3.0, "end", "t [s]");
    out += &text(LEFT, 16.0, "start", panel.label);
    for (values, style, name, right) in
        [(&panel.mujoco, MUJOCO, "MuJoCo", 130.0), (&panel.ours, OURS, "guidedog", 58.0)]
    {
        let points: Vec<String> = values
            .iter()
            .enumerate()
            .map(|(i, &v)| format!("{:.1},{:.1}", x(period * i as f64), y(v)))
            .collect();
        out += &format!("<polyline fill=\"none\" {style} points=\"{}\"/>\n", points.join(" "));
        let key = WIDTH - RIGHT - right;
        out += &format!("<path d=\"M{} 12h14\" {style}/>\n", key - 18.0);
        out += &text(key, 16.0, "start", name);
    }
    out
}

/// Round borders around the values and a round distance of ticks, about five of them.
fn axis(low: f64, high: f64) -> (f64, f64, f64) {
    let rough = ((high - low) / 4.0).max(1e-6);
    let decade = 10.0_f64.powf(rough.log10().floor());
    let tick = [1.0, 2.0, 5.0, 10.0].map(|step| step * decade).into_iter().find(|&step| step >= rough);
    let tick = tick.expect("a decade is ten times the one before");
    ((low / tick).floor() * tick, (high / tick).ceil() * tick, tick)
}

fn line(x1: f64, y1: f64, x2: f64, y2: f64) -> String {
    format!("<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"#ccc\"/>\n")
}

fn text(x: f64, y: f64, anchor: &str, text: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>\n")
}
