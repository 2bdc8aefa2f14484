//! Line and scatter plots.

use super::axes::{Axis, Frame, round_range};
use super::canvas::{Anchor, Canvas, Font, Pen, Rectangle};
use super::colour::{BLACK, Colour, GREY, LINES, WHITE};
use super::{Picture, PictureError, text};

/// Line of a trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dash {
    /// No line: marks only.
    None,
    /// A whole line.
    #[default]
    Whole,
    /// Dashes.
    Dashed,
    /// Dots.
    Dotted,
}

impl Dash {
    fn pattern(self) -> &'static [f64] {
        match self {
            Self::None | Self::Whole => &[],
            Self::Dashed => &[10.0, 6.0],
            Self::Dotted => &[2.0, 5.0],
        }
    }
}

/// Mark at each point of a trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// No marks.
    #[default]
    None,
    /// Discs.
    Disc,
    /// Rings.
    Ring,
    /// Squares.
    Square,
    /// Triangles.
    Triangle,
    /// Diamonds.
    Diamond,
    /// Small discs, for many points over a line.
    Dot,
}

/// Points that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Name in the legend, empty for none.
    pub label: String,
    /// Points in the units of the axes.
    pub points: Vec<[f64; 2]>,
    /// Half lengths of the error bars in y, empty for none.
    pub errors: Vec<f64>,
    /// Line through the points.
    pub dash: Dash,
    /// Mark at each point.
    pub mark: Mark,
    /// Colour, or the next one of the usual row.
    pub colour: Option<Colour>,
    /// Whether its line is thin.
    pub thin: bool,
}

impl Trace {
    /// Points joined by a line in full, without marks.
    #[must_use]
    pub fn line(label: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        Self { label: label.to_owned(), points: points.into_iter().collect(), ..Self::default() }
    }

    /// Marks without a line.
    #[must_use]
    pub fn marks(label: &str, mark: Mark, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        Self { mark, dash: Dash::None, ..Self::line(label, points) }
    }

    /// The same with another line.
    #[must_use]
    pub fn dashed(self, dash: Dash) -> Self {
        Self { dash, ..self }
    }

    /// The same with marks.
    #[must_use]
    pub fn marked(self, mark: Mark) -> Self {
        Self { mark, ..self }
    }

    /// The same with error bars: half their lengths.
    #[must_use]
    pub fn with_errors(self, errors: impl IntoIterator<Item = f64>) -> Self {
        Self { errors: errors.into_iter().collect(), ..self }
    }

    /// The same in a colour of its own.
    #[must_use]
    pub fn coloured(self, colour: Colour) -> Self {
        Self { colour: Some(colour), ..self }
    }

    /// The same with a thin line.
    #[must_use]
    pub fn thin(self) -> Self {
        Self { thin: true, ..self }
    }

    /// Width of its line \[pixels].
    fn width(&self) -> f64 {
        if self.thin { 1.4 } else { 2.6 }
    }

    fn is_finite(point: &[f64; 2]) -> bool {
        point[0].is_finite() && point[1].is_finite()
    }
}

/// Size of the legend's text, height of its rows, length of its samples of lines \[pixels].
const LEGEND_SIZE: f64 = 17.0;
const LEGEND_ROW: f64 = 26.0;
const LEGEND_SAMPLE: f64 = 42.0;
/// Room beside the frame \[pixels].
const LEFT: f64 = 112.0;
const RIGHT: f64 = 28.0;
const LABEL: Font = Font { size: 17.0, colour: BLACK, across: Anchor::Start, down: Anchor::Middle, upwards: false };

/// A plot of one or several traces.
#[derive(Clone, Debug, PartialEq)]
pub struct LinePlot {
    /// Title above the plot.
    pub title: String,
    /// Label of the horizontal axis with its unit, as in `r [mm]`.
    pub x_label: String,
    /// Label of the vertical axis with its unit.
    pub y_label: String,
    /// Curves; points that are not finite are gaps.
    pub traces: Vec<Trace>,
    /// Range of the horizontal axis, or what the data need.
    pub x_range: Option<[f64; 2]>,
    /// Range of the vertical axis, or what the data need.
    pub y_range: Option<[f64; 2]>,
    /// Logarithmic horizontal axis.
    pub x_log: bool,
    /// Logarithmic vertical axis.
    pub y_log: bool,
    /// Width and height \[pixels].
    pub size: [usize; 2],
}

impl LinePlot {
    /// An empty plot with linear axes.
    #[must_use]
    pub fn new(title: &str, x_label: &str, y_label: &str) -> Self {
        Self {
            title: title.to_owned(),
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            traces: Vec::new(),
            x_range: None,
            y_range: None,
            x_log: false,
            y_log: false,
            size: [1000, 700],
        }
    }

    /// The same with one more trace.
    #[must_use]
    pub fn with(mut self, trace: Trace) -> Self {
        self.traces.push(trace);
        self
    }

    /// The same as a picture of `width` with a frame of `height` \[pixels], whatever the labels need.
    pub(super) fn framed(mut self, width: usize, height: usize) -> Self {
        let [above, below] = self.margins();
        self.size = [width, height + (above + below) as usize];
        self
    }

    /// Width of the frame in a picture of `width` without a legend of its own \[pixels].
    pub(super) fn frame_width(width: usize) -> f64 {
        width as f64 - LEFT - RIGHT
    }

    /// Room above and below the frame, for title and labels if there are any \[pixels].
    fn margins(&self) -> [f64; 2] {
        [if self.title.is_empty() { 22.0 } else { 58.0 }, if self.x_label.is_empty() { 40.0 } else { 78.0 }]
    }

    /// Draws the plot.
    ///
    /// # Errors
    /// If a trace has some error bars but not one for each point, or if a logarithmic axis has nothing to show.
    pub fn draw(&self) -> Result<Picture, PictureError> {
        for trace in self.traces.iter().filter(|trace| !trace.errors.is_empty()) {
            super::check_length("an error bar", trace.points.len(), trace.errors.len())?;
        }
        let [width, height] = self.size;
        let mut canvas = Canvas::new(width, height);
        let size = 19.0;
        let y = self.axis(1, &self.y_label, self.y_range, self.y_log)?;
        let [above, below] = self.margins();
        let area = Rectangle { left: LEFT, top: above, right: width as f64 - RIGHT, bottom: height as f64 - below };
        let mut frame = Frame { area, x: self.axis(0, &self.x_label, self.x_range, self.x_log)?, y, size };
        let legend = self.place_legend(&mut frame);
        let area = frame.area;
        frame.draw_grid(&mut canvas);
        if !frame.y.log && frame.y.lower < 0.0 && frame.y.upper > 0.0 {
            let zero = [frame.x.lower, frame.x.upper].map(|x| frame.place([x, 0.0]));
            canvas.line(&zero, Pen::new(1.2, GREY));
        }
        let traces = self.traces.iter().enumerate();
        canvas.clipped(area, |canvas| {
            traces.clone().for_each(|(number, trace)| draw_lines(canvas, &frame, trace, colour_of(trace, number)));
        });
        frame.draw(&mut canvas);
        traces.for_each(|(number, trace)| draw_marks(&mut canvas, &frame, trace, colour_of(trace, number)));
        if let Some(legend) = legend {
            self.draw_legend(&mut canvas, legend);
        }
        let font = Font { size: 22.0, colour: BLACK, across: Anchor::Middle, down: Anchor::Middle, upwards: false };
        canvas.text([0.5 * (area.left + area.right), 30.0], &self.title, font);
        Ok(canvas.finish())
    }

    fn axis(&self, direction: usize, label: &str, range: Option<[f64; 2]>, log: bool) -> Result<Axis, PictureError> {
        let (mut lower, mut upper) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut include = |value: f64| {
            if !log || value > 0.0 {
                (lower, upper) = (lower.min(value), upper.max(value));
            }
        };
        for trace in &self.traces {
            for (n, point) in trace.points.iter().enumerate().filter(|(_, point)| Trace::is_finite(point)) {
                let error = if direction == 1 { trace.errors.get(n).copied().unwrap_or(0.0) } else { 0.0 };
                include(point[direction] - error);
                include(point[direction] + error);
            }
        }
        let found = lower <= upper;
        let [lower, upper] = match range {
            Some(range) => range,
            None if log && !found => return Err(PictureError::NothingPositive { label: label.to_owned() }),
            None if log => [lower / 1.3, upper * 1.3],
            None if !found => [0.0, 1.0],
            // Time runs from edge to edge; heights get room.
            None if direction == 0 && lower < upper && self.traces.iter().all(|trace| trace.dash != Dash::None) => {
                [if lower > 0.0 && lower < 0.1 * upper { 0.0 } else { lower }, upper]
            }
            None => {
                let room = if direction == 1 { 0.03 * (upper - lower) } else { 0.0 };
                let least = if lower >= 0.0 { (lower - room).max(0.0) } else { lower - room };
                round_range(least, upper + room)
            }
        };
        Ok(Axis { label: label.to_owned(), lower, upper, log })
    }

    fn named(&self) -> impl Iterator<Item = (usize, &Trace)> {
        self.traces.iter().enumerate().filter(|(_, trace)| !trace.label.is_empty())
    }

    /// Place of the legend, if there is one: inside the frame where it hides nothing, or else to the right of the
    /// frame, which then shrinks.
    fn place_legend(&self, frame: &mut Frame) -> Option<Rectangle> {
        let longest = self.named().map(|(_, trace)| text::length(&trace.label, LEGEND_SIZE)).reduce(f64::max)?;
        let (width, height) = (longest + LEGEND_SAMPLE + 34.0, LEGEND_ROW * self.named().count() as f64 + 14.0);
        let Rectangle { left, top, right, bottom } = frame.area;
        let gap = 16.0;
        let columns = [right - gap - width, left + gap, 0.5 * (left + right - width)];
        let rows = [top + gap, bottom - gap - height, 0.5 * (top + bottom - height)];
        let at = |x: f64, y: f64| Rectangle { left: x, top: y, right: x + width, bottom: y + height };
        let places = rows.iter().flat_map(|&y| columns.map(|x| at(x, y)));
        let free = places.into_iter().find(|area| self.hidden_by(area, frame) == 0);
        free.or_else(|| {
            frame.area.right -= width + gap;
            Some(at(right - width, top))
        })
    }

    /// The legend alone, in rows as long as `width` \[pixels] lets them be: for several plots that share it.
    pub(super) fn legend_strip(&self, width: usize) -> Picture {
        let length = |label: &str| LEGEND_SAMPLE + 40.0 + text::length(label, LEGEND_SIZE);
        let mut rows: Vec<(f64, Vec<(usize, &Trace)>)> = Vec::new();
        for (number, trace) in self.named() {
            let needed = length(&trace.label);
            match rows.last_mut().filter(|row| row.0 + needed <= width as f64) {
                Some(row) => {
                    row.0 += needed;
                    row.1.push((number, trace));
                }
                None => rows.push((needed, vec![(number, trace)])),
            }
        }
        let mut canvas = Canvas::new(width, (LEGEND_ROW * rows.len() as f64) as usize + 6);
        for (row, (needed, traces)) in rows.into_iter().enumerate() {
            let mut left = (0.5 * (width as f64 - needed)).max(0.0);
            for (number, trace) in traces {
                self.draw_sample(&mut canvas, [left, LEGEND_ROW * (row as f64 + 0.5) + 3.0], number, trace);
                left += length(&trace.label);
            }
        }
        canvas.finish()
    }

    /// A line of the legend from the point `[x, y]` on.
    fn draw_sample(&self, canvas: &mut Canvas, [x, y]: [f64; 2], number: usize, trace: &Trace) {
        let ends = [[x + 12.0, y], [x + 12.0 + LEGEND_SAMPLE, y]];
        let colour = colour_of(trace, number);
        if trace.dash != Dash::None {
            canvas.line(&ends, Pen { width: trace.width(), colour, dashes: trace.dash.pattern() });
        }
        draw_mark(canvas, [x + 12.0 + LEGEND_SAMPLE / 2.0, y], trace.mark, colour);
        let font = Font { size: LEGEND_SIZE, ..LABEL };
        canvas.text([x + LEGEND_SAMPLE + 24.0, y], &trace.label, font);
    }

    fn draw_legend(&self, canvas: &mut Canvas, area: Rectangle) {
        canvas.rectangle(area, WHITE, 0.88);
        let Rectangle { left, top, right, bottom } = area;
        let outline = [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]];
        canvas.line(&outline, Pen::new(1.0, [190, 192, 196]));
        for (place, (number, trace)) in self.named().enumerate() {
            self.draw_sample(canvas, [left, top + 7.0 + LEGEND_ROW * (place as f64 + 0.5)], number, trace);
        }
    }

    /// Number of points, along lines too, that a rectangle hides.
    fn hidden_by(&self, area: &Rectangle, frame: &Frame) -> usize {
        let hidden = |[x, y]: [f64; 2]| {
            x > area.left - 8.0 && x < area.right + 8.0 && y > area.top - 8.0 && y < area.bottom + 8.0
        };
        let mut count = 0;
        for trace in &self.traces {
            let places: Vec<_> = trace.points.iter().filter(|p| Trace::is_finite(p)).map(|&p| frame.place(p)).collect();
            count += places.iter().filter(|&&place| hidden(place)).count();
            for ends in places.windows(2).filter(|_| trace.dash != Dash::None) {
                let length = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
                let samples = (length / 12.0).min(200.0) as usize;
                let at = |n: usize, c: usize| ends[0][c] + (ends[1][c] - ends[0][c]) * n as f64 / (samples + 1) as f64;
                count += (1..=samples).filter(|&n| hidden([at(n, 0), at(n, 1)])).count();
            }
        }
        count
    }
}

fn colour_of(trace: &Trace, number: usize) -> Colour {
    trace.colour.unwrap_or(LINES[number % LINES.len()])
}

/// Whether a point has a place in the frame's scales.
fn is_drawable(frame: &Frame, point: &[f64; 2]) -> bool {
    Trace::is_finite(point) && (!frame.x.log || point[0] > 0.0) && (!frame.y.log || point[1] > 0.0)
}

/// Draws line and error bars of a trace.
fn draw_lines(canvas: &mut Canvas, frame: &Frame, trace: &Trace, colour: Colour) {
    if trace.dash != Dash::None {
        for part in trace.points.split(|point| !is_drawable(frame, point)) {
            let places: Vec<_> = part.iter().map(|&point| frame.place(point)).collect();
            canvas.line(&places, Pen { width: trace.width(), colour, dashes: trace.dash.pattern() });
        }
    }
    for (&[x, y], &error) in trace.points.iter().zip(&trace.errors).filter(|(point, _)| is_drawable(frame, point)) {
        let ends = [frame.place([x, y - error]), frame.place([x, y + error])];
        canvas.line(&ends, Pen::new(1.8, colour));
        for [x, y] in ends {
            canvas.line(&[[x - 6.0, y], [x + 6.0, y]], Pen::new(1.8, colour));
        }
    }
}

/// Draws the marks of the points inside the frame, whole even at its edge.
fn draw_marks(canvas: &mut Canvas, frame: &Frame, trace: &Trace, colour: Colour) {
    let Rectangle { left, top, right, bottom } = frame.area;
    for &point in trace.points.iter().filter(|point| is_drawable(frame, point)) {
        let [x, y] = frame.place(point);
        if x > left - 0.5 && x < right + 0.5 && y > top - 0.5 && y < bottom + 0.5 {
            draw_mark(canvas, [x, y], trace.mark, colour);
        }
    }
}

fn draw_mark(canvas: &mut Canvas, [x, y]: [f64; 2], mark: Mark, colour: Colour) {
    match mark {
        Mark::None => {}
        Mark::Disc => canvas.disc([x, y], 6.5, colour),
        Mark::Dot => canvas.disc([x, y], 3.4, colour),
        Mark::Ring => {
            canvas.disc([x, y], 6.5, colour);
            canvas.disc([x, y], 4.2, WHITE);
        }
        Mark::Square => canvas.polygon(
            &[[-6.0, -6.0], [6.0, -6.0], [6.0, 6.0], [-6.0, 6.0]].map(|[a, b]| [x + a, y + b]),
            colour,
            1.0,
        ),
        Mark::Triangle => {
            canvas.polygon(&[[0.0, -8.0], [7.5, 5.5], [-7.5, 5.5]].map(|[a, b]| [x + a, y + b]), colour, 1.0)
        }
        Mark::Diamond => canvas.polygon(
            &[[0.0, -8.5], [7.0, 0.0], [0.0, 8.5], [-7.0, 0.0]].map(|[a, b]| [x + a, y + b]),
            colour,
            1.0,
        ),
    }
}
