//! Runs cases, several at a time, and judges them.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use sazanami::error::CommandError;
use sazanami::followers;
use sazanami::progress::{Progress, Silent, duration};
use sazanami_numerics::Real;
use sazanami_parallel::{Processes, with_threads};
use serde::{Deserialize, Serialize};

use crate::catalogue::Case;
use crate::expected::Expected;
use crate::judge::{Row, judge, number, tally};
use crate::measured::Outcome;

/// Interval of the messages of a case that runs long.
const STILL_RUNNING: Duration = Duration::from_secs(30);

/// Choice of cases and manner of running.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Names of cases; empty for all.
    pub names: Vec<String>,
    /// Whether cases that take long are among all.
    pub long: bool,
    /// Only the cases that run with the tests.
    pub subset: bool,
    /// A folder whose `<case>/expected.toml`, `case.toml` and `reference.csv` stand in for those of the program.
    pub expected: Option<PathBuf>,
    /// Cases at a time, each on one thread; 0 for as many as there are processors.
    pub jobs: usize,
}

/// A case that was run and judged.
#[derive(Clone, Debug)]
pub struct Judged {
    /// Name of the case.
    pub name: &'static str,
    /// Expectations.
    pub expected: Expected,
    /// Measurements; empty if it failed.
    pub outcome: Outcome,
    /// The verdicts.
    pub rows: Vec<Row>,
    /// Why it measured nothing.
    pub error: Option<String>,
    /// Wall-clock time \[s].
    pub seconds: Real,
}

struct Job {
    place: usize,
    case: Case,
    expected: Expected,
}

enum News {
    Begun(usize),
    Done(usize, Box<Judged>),
}

/// Expectations of `case`, from the folder of the choice or from the program.
///
/// # Errors
/// If the text is no valid `expected.toml`.
pub fn expected_of(case: &Case, folder: Option<&PathBuf>) -> Result<Expected, CommandError> {
    let path = folder.map(|folder| folder.join(case.name).join("expected.toml")).filter(|path| path.is_file());
    let text = match &path {
        Some(path) => std::fs::read_to_string(path)
            .map_err(|error| CommandError::Undone(format!("{}: {error}", path.display())))?,
        None => case.expected.to_owned(),
    };
    Expected::parse(&text).map_err(|problem| {
        CommandError::input(format!("expected.toml of {}: {problem}", case.name), "see verification/README.md")
    })
}

/// Runs the chosen cases, those that cost most first, each on one thread: results do not depend on the number of
/// threads, and time is not judged. They come back in the order of the catalogue.
///
/// # Errors
/// If a name is not known or an `expected.toml` is wrong.
pub fn verify(cases: &[Case], choice: &Choice, progress: &mut dyn Progress) -> Result<Vec<Judged>, CommandError> {
    let mut queue = chosen(cases, choice)?;
    let count = queue.len();
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let jobs = if choice.jobs == 0 { cores } else { choice.jobs }.min(count).max(1);
    let labels: Vec<(&str, Real)> = queue.iter().map(|job| (job.case.name, job.expected.cost)).collect();
    queue.sort_by(|a, b| b.expected.cost.total_cmp(&a.expected.cost));
    let queue = Mutex::new(VecDeque::from(queue));
    let (send, news) = channel();
    let mut found = std::thread::scope(|scope| {
        for _ in 0..jobs {
            let (send, queue) = (send.clone(), &queue);
            scope.spawn(move || work(queue, &send));
        }
        drop(send);
        follow(&news, &labels, progress)
    });
    found.sort_by_key(|(place, _)| *place);
    Ok(found.into_iter().map(|(_, judged)| judged).collect())
}

/// The same on the processes of a launcher, each case on one of them, on rank 0.
///
/// # Errors
/// As [`verify`].
pub fn verify_on(
    processes: &Processes,
    cases: &[Case],
    choice: &Choice,
    progress: &mut dyn Progress,
) -> Result<Vec<Judged>, CommandError> {
    let all = chosen(cases, choice)?;
    let mut shares: Vec<Share> = vec![Share::default(); processes.size()];
    let mut by_cost: Vec<&Job> = all.iter().collect();
    by_cost.sort_by(|a, b| b.expected.cost.total_cmp(&a.expected.cost));
    for job in by_cost {
        // To the rank that has least to do.
        if let Some(share) = shares.iter_mut().min_by(|a, b| a.cost.total_cmp(&b.cost)) {
            share.cost += job.expected.cost;
            share.names.push(job.case.name.to_owned());
        }
    }
    let order = Order { shares: shares.iter().map(|share| share.names.clone()).collect(), jobs: choice.jobs };
    let text = serde_json::to_string(&order).map_err(|error| CommandError::Undone(error.to_string()))?;
    let own = Choice { names: order.shares[0].clone(), ..choice.clone() };
    let (found, others) =
        followers::share_work::<Vec<Found>, _>(processes, &format!("{ORDER}{text}"), || match own.names[..] {
            [] => Ok(Vec::new()),
            _ => verify(cases, &own, progress),
        });
    let mut found = found?;
    let mut others: Vec<Found> = others.into_iter().flatten().collect();
    for job in all {
        if own.names.iter().any(|name| name == job.case.name) {
            continue;
        }
        let answer = match others.iter().position(|other| other.name == job.case.name) {
            Some(at) => others.swap_remove(at),
            None => Found { name: String::new(), outcome: Err("its rank has not answered".into()), seconds: 0.0 },
        };
        let judged = judged(job, answer.outcome, answer.seconds);
        progress.message(&format!("{}: {} on another rank", judged.name, duration(answer.seconds)));
        found.push(judged);
    }
    found.sort_by_key(|judged| cases.iter().position(|case| case.name == judged.name));
    Ok(found)
}

/// Cases of a rank, and their cost \[s].
#[derive(Clone, Debug, Default)]
struct Share {
    cost: Real,
    names: Vec<String>,
}

/// Begins the order to run cases.
const ORDER: &str = "verify ";

/// Names of the cases of each rank, and how many of them it runs at a time.
#[derive(Debug, Serialize, Deserialize)]
struct Order {
    shares: Vec<Vec<String>>,
    jobs: usize,
}

/// Outcome of a case on another rank, or why there is none, and its duration \[s].
#[derive(Debug, Serialize, Deserialize)]
struct Found {
    name: String,
    outcome: Result<Outcome, String>,
    seconds: Real,
}

/// Runs the cases that rank 0 ordered for this rank, if this is such an order.
///
/// A case that cannot be run here has no answer, and fails on rank 0.
pub fn follow_order(processes: &Processes, cases: &[Case], order: &str) {
    let Some(Ok(order)) = order.strip_prefix(ORDER).map(serde_json::from_str::<Order>) else { return };
    let names = order.shares.into_iter().nth(processes.rank()).unwrap_or_default();
    let choice = Choice { names, jobs: order.jobs, ..Choice::default() };
    let judged = if choice.names.is_empty() { Ok(Vec::new()) } else { verify(cases, &choice, &mut Silent) };
    let found = judged.unwrap_or_default().into_iter().map(|judged| Found {
        name: judged.name.to_owned(),
        outcome: judged.error.map_or(Ok(judged.outcome), Err),
        seconds: judged.seconds,
    });
    followers::answer_work(processes, &found.collect::<Vec<Found>>());
}

/// Runs jobs until none is left.
fn work(queue: &Mutex<VecDeque<Job>>, news: &Sender<News>) {
    loop {
        let Some(job) = queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front() else { return };
        let place = job.place;
        let _ = news.send(News::Begun(place));
        let _ = news.send(News::Done(place, Box::new(run(job))));
    }
}

fn run(job: Job) -> Judged {
    let start = Instant::now();
    let found = with_threads(1, || job.case.measure(&job.expected))
        .map_err(|refused| refused.to_string())
        .and_then(|found| found);
    judged(job, found, start.elapsed().as_secs_f64())
}

fn judged(job: Job, found: Result<Outcome, String>, seconds: Real) -> Judged {
    let Job { case, expected, .. } = job;
    let (outcome, rows, error) = match found {
        Ok(outcome) => {
            let rows = judge(case.name, &expected, &outcome);
            (outcome, rows, None)
        }
        Err(message) => (Outcome::default(), vec![Row::failed(case.name, &message)], Some(message)),
    };
    Judged { name: case.name, expected, outcome, rows, error, seconds }
}

/// Passes on what happens until all workers are gone.
fn follow(news: &Receiver<News>, labels: &[(&str, Real)], progress: &mut dyn Progress) -> Vec<(usize, Judged)> {
    let mut found = Vec::new();
    let mut running: Vec<(usize, Instant)> = Vec::new();
    loop {
        match news.recv_timeout(STILL_RUNNING) {
            Ok(News::Begun(place)) => {
                let (name, cost) = labels[place];
                progress.message(&format!("{name}: about {}", duration(cost)));
                running.push((place, Instant::now()));
            }
            Ok(News::Done(place, judged)) => {
                running.retain(|(other, _)| *other != place);
                let bad = judged.rows.iter().filter(|row| row.verdict.is_bad()).count();
                let state = if bad == 0 { "done".to_owned() } else { format!("{bad} BAD") };
                let (done, seconds) = (found.len() + 1, duration(judged.seconds));
                progress.message(&format!("[{done}/{}] {}: {state}, {seconds}", labels.len(), labels[place].0));
                found.push((place, *judged));
            }
            Err(RecvTimeoutError::Timeout) => {
                for (place, since) in &running {
                    let (name, cost) = labels[*place];
                    let so_far = duration(since.elapsed().as_secs_f64());
                    progress.message(&format!("{name}: {so_far} of about {}", duration(cost)));
                }
            }
            Err(RecvTimeoutError::Disconnected) => return found,
        }
    }
}

fn chosen(cases: &[Case], choice: &Choice) -> Result<Vec<Job>, CommandError> {
    let known: Vec<&str> = cases.iter().map(|case| case.name).collect();
    if let Some(name) = choice.names.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(CommandError::unknown("verification case", name, &known));
    }
    let named = |case: &Case| choice.names.iter().any(|name| name == case.name);
    let mut jobs = Vec::new();
    for case in cases.iter().filter(|case| choice.names.is_empty() || named(case)) {
        let expected = expected_of(case, choice.expected.as_ref())?;
        let wanted = !choice.names.is_empty() || choice.long || !expected.long;
        if wanted && (!choice.subset || expected.subset) {
            let mut case = case.clone();
            if let Some(folder) = choice.expected.as_ref().map(|folder| folder.join(case.name)) {
                let posed = case.posed.map(|posed| posed.of_folder(&folder)).transpose();
                case.posed = posed.map_err(|error| CommandError::Undone(format!("{}: {error}", folder.display())))?;
            }
            jobs.push(Job { place: jobs.len(), case, expected });
        }
    }
    Ok(jobs)
}

/// The rows as a table for people, and a line that counts the verdicts.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut text =
        format!("{:<26} {:<52} {:>11} {:>11} {:>23}  verdict\n", "case", "quantity", "measured", "reference", "band");
    for row in rows {
        let (quantity, band) = (row.name(), row.band());
        let (measured, reference) = (number(row.measured), number(row.reference));
        let verdict = row.verdict.word();
        text.push_str(&format!(
            "{:<26} {quantity:<52} {measured:>11} {reference:>11} {band:>23}  {verdict}\n",
            row.case
        ));
        if row.verdict.is_bad() && !row.remark.is_empty() {
            text.push_str(&format!("{:<26} {}\n", "", row.remark));
        }
    }
    text.push_str(&format!("{} quantities: {}\n", rows.len(), tally(rows)));
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::Program;
    use crate::judge::Verdict;
    use crate::measured::Measured;
    use sazanami::progress::Silent;

    const EXPECTED: &str =
        "about = \"a test\"\ncost = 1\n[[quantity]]\nname = \"x\"\nband = [0.9, 1.1]\nsource = \"by hand\"\n";
    const LONG: &str = "about = \"a test\"\ncost = 9\nlong = true\nquantity = []\n";

    const fn case(name: &'static str, expected: &'static str, program: Program) -> Case {
        Case { name, expected, posed: None, program: Some(program) }
    }

    fn cases() -> [Case; 3] {
        [
            case("near", EXPECTED, || Ok(vec![Measured::new("x", 1.01)])),
            case("far", EXPECTED, || Ok(vec![Measured::new("x", 1.2)])),
            case("slow", LONG, || Err("broke".into())),
        ]
    }

    #[test]
    fn cases_are_chosen_run_and_judged_in_their_order() {
        let verdicts = |names: &[&str], long| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            let found = verify(&cases(), &Choice { names, long, jobs: 2, ..Choice::default() }, &mut Silent).unwrap();
            found.iter().flat_map(|judged| &judged.rows).map(|row| row.verdict).collect::<Vec<_>>()
        };
        assert_eq!(verdicts(&[], false), [Verdict::Pass, Verdict::Miss]);
        assert_eq!(verdicts(&[], true), [Verdict::Pass, Verdict::Miss, Verdict::Failed]);
        assert_eq!(verdicts(&["slow"], false), [Verdict::Failed]);
    }

    #[test]
    fn unknown_names_are_wrong_input() {
        let choice = Choice { names: vec!["neer".into()], ..Choice::default() };
        let error = verify(&cases(), &choice, &mut Silent).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("did you mean `near`?"));
    }
}
