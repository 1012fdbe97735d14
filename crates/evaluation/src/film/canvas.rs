//! A small picture in a palette of colors: lines, disks, convex areas; what is drawn later lies on top.

/// Pixels, each an index into a palette.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<u8>,
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize, color: u8) -> Self {
        Self { width, height, pixels: vec![color; width * height] }
    }

    /// Colors the pixels within `reach` of a box that a test takes.
    fn fill(&mut self, low: [f32; 2], high: [f32; 2], color: u8, inside: impl Fn(f32, f32) -> bool) {
        let clip = |value: f32, count: usize| value.max(0.0).min(count as f32) as usize;
        let (left, right) = (clip(low[0].floor(), self.width), clip(high[0].ceil() + 1.0, self.width));
        let (top, bottom) = (clip(low[1].floor(), self.height), clip(high[1].ceil() + 1.0, self.height));
        for y in top..bottom {
            for x in left..right {
                if inside(x as f32, y as f32) {
                    self.pixels[y * self.width + x] = color;
                }
            }
        }
    }

    /// A line with round ends, `radius` at each of them.
    pub(super) fn capsule(&mut self, ends: [[f32; 2]; 2], radius: [f32; 2], color: u8) {
        let [a, b] = ends;
        let reach = radius[0].max(radius[1]);
        let low = [a[0].min(b[0]) - reach, a[1].min(b[1]) - reach];
        let high = [a[0].max(b[0]) + reach, a[1].max(b[1]) + reach];
        let way = [b[0] - a[0], b[1] - a[1]];
        let square = (way[0] * way[0] + way[1] * way[1]).max(1e-6);
        self.fill(low, high, color, |x, y| {
            let t = (((x - a[0]) * way[0] + (y - a[1]) * way[1]) / square).clamp(0.0, 1.0);
            let (dx, dy) = (x - a[0] - t * way[0], y - a[1] - t * way[1]);
            let r = radius[0] + t * (radius[1] - radius[0]);
            dx * dx + dy * dy <= r * r
        });
    }

    /// The convex area around some points.
    pub(super) fn hull(&mut self, points: &[[f32; 2]], color: u8) {
        let corners = convex_hull(points);
        let bound = |pick: fn(f32, f32) -> f32, axis: usize, start: f32| {
            corners.iter().map(|corner| corner[axis]).fold(start, pick)
        };
        let low = [bound(f32::min, 0, f32::MAX), bound(f32::min, 1, f32::MAX)];
        let high = [bound(f32::max, 0, f32::MIN), bound(f32::max, 1, f32::MIN)];
        self.fill(low, high, color, |x, y| {
            (0..corners.len()).all(|i| {
                let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
                (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= 0.0
            })
        });
    }
}

/// Corners in the order in which `hull` tests its sides (Andrew's monotone chain).
fn convex_hull(points: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let chain = |points: &mut dyn Iterator<Item = &[f32; 2]>| {
        let mut chain: Vec<[f32; 2]> = Vec::new();
        for &p in points {
            while let [.., a, b] = chain[..] {
                if (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut corners = chain(&mut sorted.iter());
    corners.extend(chain(&mut sorted.iter().rev()));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(canvas: &Canvas) -> usize {
        canvas.pixels.iter().filter(|pixel| **pixel == 1).count()
    }

    #[test]
    fn areas_are_those_of_the_shapes() {
        let mut canvas = Canvas::new(100, 80, 0);
        canvas.capsule([[50.0, 40.0]; 2], [20.0; 2], 1);
        assert!((count(&canvas) as f32 - std::f32::consts::PI * 400.0).abs() < 30.0);
        let mut canvas = Canvas::new(100, 80, 0);
        // A point inside changes nothing.
        canvas.hull(&[[10.0, 10.0], [40.0, 30.0], [80.0, 10.0], [80.0, 60.0], [10.0, 60.0]], 1);
        assert_eq!(count(&canvas), 71 * 51);
    }

    #[test]
    fn what_lies_outside_is_cut_off() {
        let mut canvas = Canvas::new(10, 10, 0);
        canvas.capsule([[-50.0, 5.0], [60.0, 5.0]], [0.6; 2], 1);
        assert_eq!(count(&canvas), 10);
        canvas.capsule([[f32::NAN, 5.0], [1e9, 1e9]], [3.0; 2], 1);
        canvas.hull(&[], 1);
        assert_eq!(count(&canvas), 10);
    }
}
