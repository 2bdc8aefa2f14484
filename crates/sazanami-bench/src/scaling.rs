//! Possible gain of whole steps by more threads: time outside parallel loops, tasks of each loop, and the speed-up
//! these allow.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::panic::Location;
use std::sync::OnceLock;
use std::time::Instant;

use sazanami_numerics::Real;
use sazanami_parallel::{Solo, WorkAndSpan, with_threads, work_and_span};
use serde::Serialize;

use sazanami::error::CommandError;
use sazanami::progress::Progress;

use crate::timing::spread;
use crate::{coupling, particles};

/// Numbers of threads that speed-ups are given for; loops are cut as on the last.
const THREADS: [usize; 6] = [2, 4, 8, 16, 32, 64];
/// Time in which the threads of a loop wake and wait for one another, in the second row of speed-ups \[s]. Waking a
/// thread that sleeps takes 20 to 50 microseconds here; threads that still spin take less.
const MEETING: Real = 20e-6;
/// Steps that are recorded, and steps before them.
const STEPS: usize = 5;
const WARM_UP: usize = 2;
/// Serial sections listed.
const LISTED: usize = 8;
/// Loops of fewer tasks keep threads idle on a machine of that many.
const FEW: usize = 64;

/// Parallelism of a step.
#[derive(Clone, Debug, Serialize)]
pub struct Scaling {
    /// Name of the solver and its case.
    pub name: &'static str,
    /// Time of a step on one thread, recording included and loops cut as on 64 \[s].
    pub step: Real,
    /// Time outside all parallel loops \[s].
    pub serial: Real,
    /// Parallel loops in a step.
    pub loops: Real,
    /// Tasks of the median loop, weighted by time.
    pub tasks: Real,
    /// Part of the step's time in loops of fewer than 64 tasks.
    pub few_tasks: Real,
    /// Most speed-up of any number of threads: the step over its longest chain of tasks that wait for one another.
    pub parallelism: Real,
    /// Speed-ups that a scheduler without idle threads promises, on so many threads.
    pub speed_ups: Vec<SpeedUp>,
    /// Longest serial sections, by the loop that ends them.
    pub sections: Vec<Place>,
    /// Loops that lose most by their longest task, on 64 threads.
    pub narrow: Vec<Place>,
}

/// Time over time on one thread.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SpeedUp {
    /// Number of threads.
    pub threads: usize,
    /// Loops that begin and end at once.
    pub at_once: Real,
    /// With 20 microseconds in each loop for threads to meet.
    pub with_meetings: Real,
}

/// A place in the program.
#[derive(Clone, Debug, Serialize)]
pub struct Place {
    /// File and line of a parallel loop.
    pub at: String,
    /// Time in a step \[s].
    pub time: Real,
}

/// Work and span of steps of the paper's case and of moving particles with and without grains.
///
/// # Errors
/// If a case cannot be built or a step fails.
pub fn scaling(progress: &mut dyn Progress) -> Result<Vec<Scaling>, CommandError> {
    type Steps = fn() -> Result<Vec<WorkAndSpan>, String>;
    let cases: [(&'static str, Steps); 3] = [("case_step", raindrop), ("mps_step", tank), ("mps_dam_break", dam)];
    let record = |(name, steps): (&'static str, Steps)| {
        progress.message(&format!("{name}: steps on one thread, loops cut as on {}", THREADS[THREADS.len() - 1]));
        let steps = with_threads(1, steps).map_err(|refused| CommandError::Undone(refused.to_string()))?;
        steps.map(|steps| of_steps(name, &steps)).map_err(|why| CommandError::Undone(format!("{name}: {why}")))
    };
    cases.into_iter().map(record).collect()
}

/// Time since the first call \[s].
fn clock() -> Real {
    static FIRST: OnceLock<Instant> = OnceLock::new();
    FIRST.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// Steps, the first ones not recorded.
fn recorded(mut step: impl FnMut() -> Result<(), String>) -> Result<Vec<WorkAndSpan>, String> {
    (0..WARM_UP).try_for_each(|_| step())?;
    let one = |_| {
        let (outcome, found) = work_and_span(THREADS[THREADS.len() - 1], clock, &mut step);
        outcome.map(|()| found)
    };
    (0..STEPS).map(one).collect()
}

fn raindrop() -> Result<Vec<WorkAndSpan>, String> {
    let (_, mut solver) = coupling::whole_case(Box::<Solo>::default())?;
    recorded(|| {
        let step = solver.stable_step();
        solver.step(step, step.dt, |_| ()).map(drop).map_err(|error| error.to_string())
    })
}

fn tank() -> Result<Vec<WorkAndSpan>, String> {
    let (mut solver, _) = particles::tank()?;
    recorded(|| particles::step(&mut solver, particles::TANK_STEP, particles::SHAKEN, |_| ()).map(drop))
}

fn dam() -> Result<Vec<WorkAndSpan>, String> {
    let mut solver = particles::dam()?;
    recorded(|| particles::step(&mut solver, particles::DAM_STEP, particles::GRAVITY, |_| ()).map(drop))
}

/// The figures of a step, by the medians over the steps of what each place takes: what other programs interrupted
/// shows in none of them.
fn of_steps(name: &'static str, steps: &[WorkAndSpan]) -> Scaling {
    let median = |of: &dyn Fn(&WorkAndSpan) -> Real| median(&steps.iter().map(of).collect::<Vec<_>>());
    let serial = median(&WorkAndSpan::serial_time);
    let loops = median(&|step| step.loops.len() as Real);
    let work = places(steps, |step| step.loops.iter().map(|l| (l.at, l.work)).collect());
    let spans = places(steps, |step| step.loops.iter().map(|l| (l.at, l.span)).collect());
    let sum = |places: &[Place]| places.iter().map(|place| place.time).sum::<Real>();
    let (in_loops, span) = (sum(&work), sum(&spans));
    let step = serial + in_loops;
    let most = THREADS[THREADS.len() - 1] as Real;
    // A scheduler which lets no thread idle promises this of loops that begin once the one before has ended (Graham 1969).
    let speed_up = |threads: Real, meeting: Real| {
        step / (serial + span + (in_loops - span) / threads + if threads > 1.0 { loops * meeting } else { 0.0 })
    };
    let of = |at: &str| work.iter().find(|place| place.at == at).map_or(0.0, |place| place.time);
    let narrow = spans.iter().map(|place| Place { at: place.at.clone(), time: place.time - of(&place.at) / most });
    Scaling {
        name,
        step,
        serial,
        loops,
        tasks: median(&middle_tasks),
        few_tasks: median(&|step| {
            step.loops.iter().filter(|l| l.tasks < FEW).map(|l| l.work).sum::<Real>() / step.work
        }),
        parallelism: speed_up(Real::INFINITY, 0.0),
        speed_ups: THREADS
            .map(|threads| SpeedUp {
                threads,
                at_once: speed_up(threads as Real, 0.0),
                with_meetings: speed_up(threads as Real, MEETING),
            })
            .to_vec(),
        sections: longest(places(steps, |step| step.serial.iter().map(|s| (s.before, s.time)).collect())),
        narrow: longest(narrow.collect()),
    }
}

fn median(values: &[Real]) -> Real {
    spread(values).map_or(0.0, |[_, median, _]| median)
}

/// Number of tasks of the loop in which half of the time in loops is reached, in order of tasks.
fn middle_tasks(step: &WorkAndSpan) -> Real {
    let mut loops: Vec<_> = step.loops.iter().collect();
    loops.sort_by_key(|l| l.tasks);
    let half = 0.5 * (step.work - step.serial_time());
    let mut reached = 0.0;
    let middle = loops.iter().find(|l| {
        reached += l.work;
        reached >= half
    });
    middle.map_or(0.0, |l| l.tasks as Real)
}

/// Median over the steps of the time that each place takes in one.
fn places(
    steps: &[WorkAndSpan],
    times: impl Fn(&WorkAndSpan) -> Vec<(&'static Location<'static>, Real)>,
) -> Vec<Place> {
    let mut sums: BTreeMap<(&str, u32), Vec<Real>> = BTreeMap::new();
    for (n, step) in steps.iter().enumerate() {
        for (at, time) in times(step) {
            sums.entry((at.file(), at.line())).or_insert_with(|| vec![0.0; steps.len()])[n] += time;
        }
    }
    let place =
        |((file, line), times): ((&str, u32), Vec<Real>)| Place { at: format!("{file}:{line}"), time: median(&times) };
    sums.into_iter().map(place).collect()
}

/// The largest of them.
fn longest(mut places: Vec<Place>) -> Vec<Place> {
    places.sort_by(|a, b| b.time.total_cmp(&a.time));
    places.truncate(LISTED);
    places
}

/// The steps as a table for people.
#[must_use]
pub fn table(all: &[Scaling]) -> String {
    let mut text = String::new();
    for s in all {
        let ms = |seconds: Real| 1e3 * seconds;
        let _ = writeln!(
            text,
            "{}: {:.1} ms a step on one thread, {:.2} ms or {:.2} % of it serial; {:.0} loops, {} tasks in the median, \
             {:.1} % of the time in loops of fewer than {FEW}; {:.0} times as fast at most",
            s.name,
            ms(s.step),
            ms(s.serial),
            1e2 * s.serial / s.step,
            s.loops,
            s.tasks,
            1e2 * s.few_tasks,
            s.parallelism
        );
        let row = |words: &str, of: &dyn Fn(&SpeedUp) -> String| {
            s.speed_ups.iter().fold(format!("  {words:<28}"), |line, one| line + &format!("{:>7}", of(one))) + "\n"
        };
        text.push_str(&row("threads", &|one| one.threads.to_string()));
        text.push_str(&row("speed-up", &|one| format!("{:.1}", one.at_once)));
        text.push_str(&row("with 20 us a loop to meet", &|one| format!("{:.1}", one.with_meetings)));
        for (words, places) in [("serial before", &s.sections), ("longest tasks at", &s.narrow)] {
            for place in places {
                let _ = writeln!(text, "  {:>8.3} ms {words} {}", ms(place.time), place.at);
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami_parallel::{ParallelLoop, SerialSection};

    #[test]
    fn speed_ups_are_those_of_work_and_span() {
        let at = Location::caller();
        let loop_of = |work: Real, span: Real, tasks: usize| ParallelLoop { at, work, span, tasks };
        let step = WorkAndSpan {
            work: 10.0,
            loops: vec![loop_of(8.0, 0.0, 1000), loop_of(1.0, 1.0, 1)],
            serial: vec![SerialSection { before: at, time: 0.75 }, SerialSection { before: at, time: 0.25 }],
        };
        let found = of_steps("x", &[step.clone(), step]);
        assert_eq!((found.step, found.serial, found.loops, found.tasks), (10.0, 1.0, 2.0, 1000.0));
        assert_eq!((found.few_tasks, found.parallelism), (0.1, 5.0));
        let of = |n: usize| found.speed_ups[n];
        assert_eq!((of(1).threads, of(1).at_once), (4, 10.0 / 4.0));
        assert_eq!(of(1).with_meetings, 10.0 / (4.0 + 2.0 * MEETING));
        assert_eq!((found.sections.len(), found.sections[0].time), (1, 1.0));
        // The loop of one task loses all but a 64th; that of many gains what it has to.
        assert_eq!(found.narrow[0].time, 1.0 - 9.0 / 64.0);
        assert!(table(&[found]).contains("10.00 % of it serial"));
    }
}
