//! `[[probe]]`: places to watch.

use sazanami_case_derive::Keys;
use sazanami_numerics::{Real, Vector};

use super::grains::numbered;
use super::{Schedule, read_by};
use crate::read::{Context, Places, Table};
use crate::suggest::nearest;

/// Most points of a line that is watched: each has columns of its own in a table.
const MOST_POINTS: usize = 10_000;
/// Longest name of a probe: with its ending it is the name of a file.
const LONGEST_NAME: usize = 100;

/// A line of evenly spaced points.
#[derive(Clone, Copy, Debug, Keys)]
struct Line {
    /// First point.
    #[key(unit = "m")]
    from: Vector,
    /// Last point.
    #[key(unit = "m")]
    to: Vector,
    /// Number of points.
    #[key(least = 2, most = MOST_POINTS, default = 101)]
    points: usize,
}

/// A plane, by one of its coordinates.
#[derive(Clone, Copy, Debug, Keys)]
struct Plane {
    /// Plane normal to x1, its coordinate.
    #[key(unit = "m")]
    x1: Option<Real>,
    /// Plane normal to x2, its coordinate.
    #[key(unit = "m")]
    x2: Option<Real>,
    /// Plane normal to x3, its coordinate.
    #[key(unit = "m")]
    x3: Option<Real>,
}

/// A grain.
#[derive(Clone, Debug, Keys)]
struct BodyKeys {
    /// Name of its population.
    #[key(says = "the first")]
    population: Option<String>,
    /// Number within it, from 0.
    #[key(default = 0)]
    index: usize,
}

/// A place to watch: one of `point`, `line`, `plane`, `gauge` and `body`; written to `probes/NAME.csv`.
#[derive(Clone, Debug, Default, Keys)]
#[keys(check = Self::check)]
struct ProbeKeys {
    /// Name, unlike that of any other probe; it has to be the name of a file, of 100 characters at most.
    #[key(default = numbered(table), says = "`probe N`")]
    name: String,
    /// When; all three absent: as `output.series`.
    #[key(flatten)]
    schedule: Schedule,
    /// A point: liquid fraction (on a grid), pressure and velocity there.
    #[key(unit = "m")]
    point: Option<Vector>,
    /// The same at the points of a line.
    #[key(table, inline)]
    line: Option<Line>,
    /// A plane, on a grid: volume flux, liquid flux, mean pressure; between faces of cells linear between them.
    #[key(table, inline)]
    plane: Option<Plane>,
    /// A place in x1 and x2: level of the water; of moving particles those within 3 spacings across, all of a tank narrower than 6.
    #[key(unit = "m")]
    gauge: Option<[Real; 2]>,
    /// A grain: its motion and the forces on it, on a grid the torques too.
    #[key(table, inline)]
    body: Option<BodyKeys>,
    #[key(skip = None)]
    place: Option<ProbePlace>,
}

/// A place to watch.
#[derive(Clone, Debug, PartialEq)]
pub enum ProbePlace {
    /// A point \[m].
    Point(Vector),
    /// Points equally spaced on a line.
    Line {
        /// First point \[m].
        from: Vector,
        /// Last point \[m].
        to: Vector,
        /// Number of points.
        points: usize,
    },
    /// A plane normal to a direction of the box.
    Plane {
        /// Direction 0, 1, 2.
        direction: usize,
        /// Coordinate along it \[m].
        position: Real,
    },
    /// A wave gauge at this place in x1 and x2 \[m].
    Gauge([Real; 2]),
    /// A grain.
    Body {
        /// Name of its population.
        population: String,
        /// Number within it, from 0.
        index: usize,
    },
}

/// A place to watch and when.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Name of its table of results.
    pub name: String,
    /// Point, line, plane or other place that is watched.
    pub place: ProbePlace,
    /// Times at which it is read.
    pub schedule: Schedule,
}

read_by!(Probe, ProbeKeys);

impl ProbeKeys {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        self.check_name(table, cx);
        if !Schedule::is_in(table) {
            self.schedule = cx.known.output.series.clone();
        }
        let alternatives = ["point", "line", "plane", "gauge", "body"].iter().filter(|key| table.has(key)).count();
        if alternatives != 1 {
            cx.report
                .error(table.span(), "a probe watches one place")
                .label(format!("this one has {alternatives}"))
                .help("give one of `point`, `line`, `plane`, `gauge` and `body`");
            return;
        }
        self.place = self.place(table, cx);
        let (domain, points) = (cx.known.domain, self.points(cx));
        if points.iter().any(|point| domain.excludes(*point)) {
            let key = ["point", "gauge", "line", "plane"].into_iter().find(|key| table.has(key)).unwrap_or_default();
            cx.report
                .error(table.place(key), format!("`{}` lies outside the box", self.name))
                .label(domain.reaches())
                .help("move it into the box; where the box begins is `lower` under `[domain]`");
        }
    }

    fn check_name(&self, table: &Table<'_>, cx: &mut Context<'_>) {
        let (name, span) = (&self.name, table.place("name"));
        if name.trim().is_empty() || name.contains(|c: char| c == '/' || c == '\\' || c.is_control()) {
            cx.report
                .error(span, "`name` cannot be the name of a file")
                .label("the probe is written to `probes/NAME.csv`")
                .help("take a name without `/` and `\\`, such as \"behind the step\"");
        } else if name.len() > LONGEST_NAME {
            cx.report
                .error(span, "`name` is too long for the name of a file")
                .label(format!("{} bytes: the probe is written to `probes/NAME.csv`", name.len()))
                .help(format!("take a name of {LONGEST_NAME} bytes at most"));
        } else if let Some(other) = cx.known.probe_names.iter().position(|other| other == name) {
            cx.report
                .error(span, format!("two probes have the name `{name}`"))
                .label(format!("that of probe {other}, counted from 0: both would be written to `probes/{name}.csv`"))
                .help("give each probe a name of its own");
        }
        cx.known.probe_names.push(name.clone());
    }

    fn place(&self, table: &Table<'_>, cx: &mut Context<'_>) -> Option<ProbePlace> {
        if let Some(point) = self.point {
            return Some(ProbePlace::Point(point));
        }
        if let Some(Line { from, to, points }) = self.line {
            return Some(ProbePlace::Line { from, to, points });
        }
        if let Some(Plane { x1, x2, x3 }) = self.plane {
            let mut given = [x1, x2, x3].into_iter().enumerate().filter_map(|(d, x)| Some((d, x?)));
            if let (Some((direction, position)), None) = (given.next(), given.next()) {
                return Some(ProbePlace::Plane { direction, position });
            }
            cx.report
                .error(table.place("plane"), "a plane is given by one coordinate")
                .label("expected one of x1, x2, x3")
                .help("for example `plane = { x2 = \"16.9 mm\" }`");
            return None;
        }
        if let Some(gauge) = self.gauge {
            return Some(ProbePlace::Gauge(gauge));
        }
        self.body.as_ref().and_then(|body| body.place(&table.get("body").path, cx))
    }

    /// Points that have to lie in the box.
    fn points(&self, cx: &Context<'_>) -> Vec<Vector> {
        let domain = cx.known.domain;
        match &self.place {
            Some(ProbePlace::Point(point)) => vec![*point],
            Some(ProbePlace::Line { from, to, .. }) => vec![*from, *to],
            Some(ProbePlace::Plane { direction, position }) => {
                let mut point = 0.5 * (domain.lower + domain.upper);
                point[*direction] = *position;
                vec![point]
            }
            Some(ProbePlace::Gauge([x, y])) => vec![Vector::new(*x, *y, domain.lower.z)],
            Some(ProbePlace::Body { .. }) | None => Vec::new(),
        }
    }

    fn meaning(self, _: &mut Context<'_>) -> Option<Probe> {
        Some(Probe { name: self.name, place: self.place?, schedule: self.schedule })
    }

    fn of(probe: &Probe) -> Self {
        let nothing = Self { name: probe.name.clone(), schedule: probe.schedule.clone(), ..Self::default() };
        match probe.place.clone() {
            ProbePlace::Point(point) => Self { point: Some(point), ..nothing },
            ProbePlace::Line { from, to, points } => Self { line: Some(Line { from, to, points }), ..nothing },
            ProbePlace::Plane { direction, position } => {
                let x = |d: usize| (d == direction).then_some(position);
                Self { plane: Some(Plane { x1: x(0), x2: x(1), x3: x(2) }), ..nothing }
            }
            ProbePlace::Gauge(gauge) => Self { gauge: Some(gauge), ..nothing },
            ProbePlace::Body { population, index } => {
                Self { body: Some(BodyKeys { population: Some(population), index }), ..nothing }
            }
        }
    }
}

impl BodyKeys {
    /// The grain, if there is one.
    fn place(&self, path: &str, cx: &mut Context<'_>) -> Option<ProbePlace> {
        let place = |places: &Places, key: &str| places.near(&format!("{path}.{key}")).unwrap_or(0..0);
        let name = self.population.as_deref();
        let grains = &cx.known.grains;
        let found = match name {
            Some(name) => grains.iter().find(|population| population.name == name),
            None => grains.first(),
        };
        let Some(found) = found else {
            if cx.known.is_damaged {
                return None;
            }
            let meant = name.and_then(|name| nearest(name, grains.iter().map(|p| p.name.as_str())));
            let known: Vec<String> = grains.iter().map(|p| format!("`{}`", p.name)).collect();
            let help = match known[..] {
                [] => "leave out the probe: the case has no grains".to_owned(),
                _ => format!("known here: {}", known.join(", ")),
            };
            cx.report
                .error(place(&cx.places, "population"), "there is no such population of grains")
                .label(meant.map_or("not a population of this case".into(), |m| format!("did you mean `{m}`?")))
                .help(help);
            return None;
        };
        // That there are none is said with their list.
        if let Some(count) = found.grains().filter(|count| *count > 0 && self.index >= *count) {
            cx.report
                .error(place(&cx.places, "index"), format!("`{}` has no grain {}", found.name, self.index))
                .label(format!("its grains are numbered from 0 to {}", count - 1))
                .help("take one of these numbers");
        }
        Some(ProbePlace::Body { population: found.name.clone(), index: self.index })
    }
}
