//! An episode over time: the force of the hand, and what was told and done.

use super::chart::{Axes, Scale, figure_file, label, line};
use super::legend::{Entry, legend};
use super::markup::Element;
use crate::recording::{Recording, STEP_S};

const WIDTH: f64 = 760.0;
const ACROSS: [f64; 2] = [58.0, 740.0];
/// Height of a panel, and from one to the next \[px\].
const PANEL: f64 = 120.0;
const PITCH: f64 = 158.0;
/// Of the first panel.
const TOP: f64 = 58.0;

/// One line of a panel: class and values.
type Line<'a> = (&'a str, Vec<f64>);

/// Force, speeds and yaw rate of one episode as an SVG file, the pull's beginning at time 0. What was commanded is dashed, what
/// was done is not.
pub fn series_svg(name: &str, recording: &Recording) -> String {
    let of = |value: fn(&crate::recording::Sample) -> f32| -> Vec<f64> {
        recording.samples.iter().map(|sample| f64::from(value(sample))).collect()
    };
    let panels: [(&str, Vec<Line<'_>>); 3] = [
        (
            "force of the hand [N]",
            vec![("trace trained", of(|s| s.force[0])), ("trace outside", of(|s| s.force[1]))],
        ),
        (
            "speed [m/s]",
            vec![
                ("trace trained dash-1", of(|s| s.command[0])),
                ("trace outside dash-1", of(|s| s.command[1])),
                ("trace trained", of(|s| s.velocity[0])),
                ("trace outside", of(|s| s.velocity[1])),
            ],
        ),
        (
            "yaw rate [rad/s]",
            vec![("trace edge dash-1", of(|s| s.command[2])), ("trace edge", of(|s| s.velocity[2]))],
        ),
    ];
    let time = |step: usize| (step as f64 - recording.onset as f64) * STEP_S;
    let span = [time(0), time(recording.samples.len())];
    let sign = |class: &str| line(class, [-11.0, 0.0], [11.0, 0.0]);
    let entries = vec![
        Entry::new(sign("trace trained"), "along"),
        Entry::new(sign("trace outside"), "sideways"),
        Entry::new(sign("trace edge"), "around"),
        Entry::new(sign("trace dash-1"), "as commanded"),
    ];
    let (legend, _) = legend(entries, [ACROSS[0], WIDTH], 24.0, 1.0);
    let drawn = panels.iter().enumerate().map(|(index, (title, lines))| {
        let top = TOP + PITCH * index as f64;
        panel(title, lines, span, [top + PANEL, top], &time)
    });
    let height = TOP + PITCH * panels.len() as f64 + 8.0;
    figure_file(WIDTH, height, &format!("Force and velocity over time under {name}"))
        .child(label(ACROSS[0], 18.0, "strong", name))
        .child(legend)
        .children(drawn)
        .child(label(ACROSS[1], height - 8.0, "soft end", "seconds since the pull"))
        .to_string()
}

fn panel(
    title: &str,
    lines: &[Line<'_>],
    span: [f64; 2],
    down: [f64; 2],
    time: &dyn Fn(usize) -> f64,
) -> Element {
    let values = lines.iter().flat_map(|(_, values)| values.iter().copied()).chain([0.0]);
    let [low, high] = super::chart::extent(values).unwrap_or_default();
    let margin = (0.08 * (high - low)).max(0.05);
    let axes = Axes { x: Scale::new(span, ACROSS), y: Scale::new([low - margin, high + margin], down) };
    let draw = |(class, values): &Line<'_>| {
        let points = values.iter().enumerate().map(|(step, value)| [time(step), *value]);
        axes.draw_line(class, points)
    };
    let onset = axes.x.at(0.0);
    Element::classed("g", "panel")
        .child(label(ACROSS[0], down[1] - 6.0, "soft", title))
        .children([axes.draw_y(4), axes.draw_x(8)])
        .child(line("reference", [onset, down[0]], [onset, down[1]]))
        .children(lines.iter().map(draw))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::by_hand::drive;

    #[test]
    fn every_number_of_an_episode_has_its_line_and_time_begins_with_the_pull() {
        let recording = Recording { samples: drive(150, |t| [t, 0.0, -t]), onset: 100, fell_at: None };
        let figure = series_svg("a <tug>", &recording);
        assert_eq!(figure.matches("class=\"panel\"").count(), 3);
        assert_eq!(figure.matches("<path class=\"trace").count(), 8);
        // Two of three seconds lie before the pull.
        let x = 58.0 + 682.0 * 2.0 / 3.0;
        assert!(figure.contains(&format!("<line class=\"reference\" x1=\"{x:.2}\"")), "{figure}");
        assert!(figure.contains("a &lt;tug&gt;"));
    }
}
