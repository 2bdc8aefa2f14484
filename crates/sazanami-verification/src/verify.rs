//! Runs cases, several at a time, and judges them.

use std::any::Any;
use std::borrow::Cow;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use sazanami::error::CommandError;
use sazanami::followers;
use sazanami::progress::{Progress, Silent, duration};
use sazanami::stop::Stop;
use sazanami_numerics::Real;
use sazanami_parallel::{Processes, with_threads};
use serde::{Deserialize, Serialize};

use crate::catalogue::{Case, Manner};
use crate::expected::Expected;
use crate::judge::{Row, judge, number, tally};
use crate::measured::Outcome;
use crate::posed::{CASE, REFERENCE};

/// File of the expectations of a case.
const EXPECTED: &str = "expected.toml";
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
    /// A folder in which the runs are kept, as [`Manner::keep`].
    pub keep: Option<PathBuf>,
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
    /// Text of the expectations.
    text: Cow<'static, str>,
    expected: Expected,
}

enum News {
    Begun(usize),
    Done(usize, Box<Judged>),
    /// It was stopped before it had measured.
    Stopped(usize),
}

/// Expectations of `case`, from the folder of the choice or from the program.
///
/// # Errors
/// If there is no such folder, or the text is no valid `expected.toml`.
pub fn expected_of(case: &Case, folder: Option<&PathBuf>) -> Result<Expected, CommandError> {
    Ok(text_and_expected(case, folder)?.1)
}

fn text_and_expected(case: &Case, folder: Option<&PathBuf>) -> Result<(Cow<'static, str>, Expected), CommandError> {
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        return Err(CommandError::input(format!("there is no folder `{}`", folder.display()), OF_FOLDERS));
    }
    let path = folder.map(|folder| folder.join(case.name).join(EXPECTED)).filter(|path| path.is_file());
    let text = match &path {
        Some(path) => std::fs::read_to_string(path)
            .map_err(|error| CommandError::Undone(format!("{}: {error}", path.display())))?
            .into(),
        None => Cow::Borrowed(case.expected),
    };
    let expected = Expected::parse(&text).map_err(|problem| {
        CommandError::input(format!("{EXPECTED} of {}: {problem}", case.name), "see verification/README.md")
    })?;
    Ok((text, expected))
}

/// Help where the folder of the choice is of no use.
const OF_FOLDERS: &str =
    "name the folder that holds folders of cases, with `expected.toml`, `case.toml` or `reference.csv` in them";

/// Whether `folder` holds a file of a case.
fn holds(folder: &Path, case: &Case) -> bool {
    [EXPECTED, CASE, REFERENCE].iter().any(|name| folder.join(case.name).join(name).is_file())
}

/// Runs the chosen cases, those that cost most first, each on one thread: results do not depend on the number of
/// threads, and time is not judged. They come back in the order of the catalogue. Once `stop` is set no case begins, the
/// runs of cases end, and only what had been judged comes back.
///
/// # Errors
/// If a name is not known or not among those of the subset, nothing is chosen, the folder of the choice is not there or holds
/// none of the chosen cases, or an `expected.toml` is wrong.
pub fn verify(
    cases: &[Case],
    choice: &Choice,
    progress: &mut dyn Progress,
    stop: &Stop,
) -> Result<Vec<Judged>, CommandError> {
    Ok(all_of(chosen(cases, choice)?, choice.jobs, progress, Manner { stop, keep: choice.keep.as_deref() }))
}

/// Runs a `queue` of cases, so many at a time; they come back in its order.
fn all_of(mut queue: Vec<Job>, jobs: usize, progress: &mut dyn Progress, manner: Manner<'_>) -> Vec<Judged> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let jobs = if jobs == 0 { cores } else { jobs }.min(queue.len()).max(1);
    queue.iter_mut().enumerate().for_each(|(place, job)| job.place = place);
    let labels: Vec<(&str, Real)> = queue.iter().map(|job| (job.case.name, job.expected.cost)).collect();
    queue.sort_by(|a, b| b.expected.cost.total_cmp(&a.expected.cost));
    let queue = Mutex::new(VecDeque::from(queue));
    let (send, news) = channel();
    let mut found = std::thread::scope(|scope| {
        for _ in 0..jobs {
            let (send, queue) = (send.clone(), &queue);
            scope.spawn(move || work(queue, &send, manner));
        }
        drop(send);
        follow(&news, &labels, progress)
    });
    found.sort_by_key(|(place, _)| *place);
    found.into_iter().map(|(_, judged)| judged).collect()
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
    stop: &Stop,
) -> Result<Vec<Judged>, CommandError> {
    let mut all = chosen(cases, choice)?;
    let mut shares: Vec<Share> = (0..processes.size()).map(|_| Share::default()).collect();
    all.sort_by(|a, b| b.expected.cost.total_cmp(&a.expected.cost));
    for job in all {
        // To the rank that has least to do.
        if let Some(share) = shares.iter_mut().min_by(|a, b| a.cost.total_cmp(&b.cost)) {
            share.cost += job.expected.cost;
            share.jobs.push(job);
        }
    }
    let sent = |share: &Share| share.jobs.iter().map(Sent::of).collect();
    let order = Order { shares: shares.iter().map(sent).collect(), jobs: choice.jobs, keep: choice.keep.clone() };
    let text = serde_json::to_string(&order).map_err(|error| CommandError::Undone(error.to_string()))?;
    let mut shares = shares.into_iter().map(|share| share.jobs);
    let own = shares.next().unwrap_or_default();
    let (mut found, others) = followers::share_work::<Vec<Found>, _>(processes, &format!("{ORDER}{text}"), || {
        all_of(own, choice.jobs, progress, Manner { stop, keep: choice.keep.as_deref() })
    });
    let mut others: Vec<Found> = others.into_iter().flatten().collect();
    for job in shares.flatten() {
        let answer = match others.iter().position(|other| other.name == job.case.name) {
            Some(at) => others.swap_remove(at),
            None if stop.is_set() => continue,
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
#[derive(Default)]
struct Share {
    cost: Real,
    jobs: Vec<Job>,
}

/// Begins the order to run cases.
const ORDER: &str = "verify ";

/// Cases of each rank, how many of them it runs at a time, and where their runs are kept.
#[derive(Debug, Serialize, Deserialize)]
struct Order {
    shares: Vec<Vec<Sent>>,
    jobs: usize,
    keep: Option<PathBuf>,
}

/// A case with the texts that judge and pose it: they may be of a folder that rank 0 alone was told of or sees.
#[derive(Debug, Serialize, Deserialize)]
struct Sent {
    name: String,
    expected: String,
    /// Texts of case and reference.
    posed: Option<[String; 2]>,
}

impl Sent {
    fn of(job: &Job) -> Self {
        let posed = job.case.posed.as_ref();
        let posed = posed.map(|posed| [&posed.case, &posed.reference].map(|text| text.clone().into_owned()));
        Self { name: job.case.name.to_owned(), expected: job.text.clone().into_owned(), posed }
    }

    /// The same case here, if it is one of `cases`.
    fn job(self, cases: &[Case]) -> Option<Job> {
        let mut case = cases.iter().find(|case| case.name == self.name)?.clone();
        if let (Some(posed), Some([text, reference])) = (&mut case.posed, self.posed) {
            (posed.case, posed.reference) = (text.into(), reference.into());
        }
        let expected = Expected::parse(&self.expected).ok()?;
        Some(Job { place: 0, case, text: self.expected.into(), expected })
    }
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
/// A case that cannot be run here, or that `stop` ends, has no answer, and fails on rank 0.
pub fn follow_order(processes: &Processes, cases: &[Case], order: &str, stop: &Stop) {
    let Some(Ok(order)) = order.strip_prefix(ORDER).map(serde_json::from_str::<Order>) else { return };
    let share = order.shares.into_iter().nth(processes.rank()).unwrap_or_default();
    let queue = share.into_iter().filter_map(|sent| sent.job(cases)).collect();
    let manner = Manner { stop, keep: order.keep.as_deref() };
    let found = all_of(queue, order.jobs, &mut Silent, manner).into_iter().map(|judged| Found {
        name: judged.name.to_owned(),
        outcome: judged.error.map_or(Ok(judged.outcome), Err),
        seconds: judged.seconds,
    });
    followers::answer_work(processes, &found.collect::<Vec<Found>>());
}

/// Runs jobs until none is left or `stop` is set.
fn work(queue: &Mutex<VecDeque<Job>>, news: &Sender<News>, manner: Manner<'_>) {
    while !manner.stop.is_set() {
        let Some(job) = queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front() else { return };
        let place = job.place;
        let _ = news.send(News::Begun(place));
        let judged = run(job, manner);
        let is_cut = judged.error.is_some() && manner.stop.is_set();
        let _ = news.send(if is_cut { News::Stopped(place) } else { News::Done(place, Box::new(judged)) });
    }
}

fn run(job: Job, manner: Manner<'_>) -> Judged {
    let start = Instant::now();
    // A case that breaks off takes no other with it.
    let measured = catch_unwind(AssertUnwindSafe(|| with_threads(1, || job.case.measure(&job.expected, manner))));
    let found = match measured {
        Ok(Ok(found)) => found,
        Ok(Err(refused)) => Err(refused.to_string()),
        Err(panic) => Err(format!("it broke off, which is a fault of the program: {}", cause(&*panic))),
    };
    judged(job, found, start.elapsed().as_secs_f64())
}

/// What a panic says.
fn cause(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
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
            Ok(News::Stopped(place)) => {
                running.retain(|(other, _)| *other != place);
                progress.message(&format!("{}: stopped", labels[place].0));
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

/// Number of the cases of a choice.
///
/// # Errors
/// If the choice is none, or names what is not there.
pub fn count(cases: &[Case], choice: &Choice) -> Result<usize, CommandError> {
    Ok(chosen(cases, choice)?.len())
}

fn chosen(cases: &[Case], choice: &Choice) -> Result<Vec<Job>, CommandError> {
    let known: Vec<&str> = cases.iter().map(|case| case.name).collect();
    if let Some(name) = choice.names.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(CommandError::unknown("verification case", name, &known));
    }
    let named = |case: &Case| choice.names.iter().any(|name| name == case.name);
    let (mut jobs, mut are_held) = (Vec::new(), false);
    for case in cases.iter().filter(|case| choice.names.is_empty() || named(case)) {
        let (text, expected) = text_and_expected(case, choice.expected.as_ref())?;
        let wanted = !choice.names.is_empty() || choice.long || !expected.long;
        if named(case) && choice.subset && !expected.subset {
            return Err(CommandError::input(
                format!("`{}` is not among the cases that run with the tests", case.name),
                "leave out `--subset`, or the name",
            ));
        }
        if wanted && (!choice.subset || expected.subset) {
            are_held |= choice.expected.as_ref().is_some_and(|folder| holds(folder, case));
            let mut case = case.clone();
            if let Some(folder) = choice.expected.as_ref().map(|folder| folder.join(case.name)) {
                let posed = case.posed.map(|posed| posed.of_folder(&folder)).transpose();
                case.posed = posed.map_err(|error| CommandError::Undone(format!("{}: {error}", folder.display())))?;
            }
            jobs.push(Job { place: jobs.len(), case, text, expected });
        }
    }
    if jobs.is_empty() {
        return Err(CommandError::input("no case is chosen", "name one: `sazanami verify --list` has them all"));
    }
    if let Some(folder) = choice.expected.as_ref().filter(|_| !are_held) {
        return Err(CommandError::input(format!("`{}` holds none of the chosen cases", folder.display()), OF_FOLDERS));
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
    use crate::posed::Posed;

    const WANTED: &str =
        "about = \"a test\"\ncost = 1\n[[quantity]]\nname = \"x\"\nband = [0.9, 1.1]\nsource = \"by hand\"\n";
    const LONG: &str = "about = \"a test\"\ncost = 9\nlong = true\nquantity = []\n";

    const fn case(name: &'static str, expected: &'static str, program: Program) -> Case {
        Case { name, expected, posed: None, program: Some(program) }
    }

    fn cases() -> [Case; 3] {
        [
            case("near", WANTED, || Ok(vec![Measured::new("x", 1.01)])),
            case("far", WANTED, || Ok(vec![Measured::new("x", 1.2)])),
            case("slow", LONG, || Err("broke".into())),
        ]
    }

    fn verify(cases: &[Case], choice: &Choice) -> Result<Vec<Judged>, CommandError> {
        super::verify(cases, choice, &mut Silent, &Stop::new())
    }

    fn named(name: &str) -> Choice {
        Choice { names: vec![name.into()], ..Choice::default() }
    }

    /// A folder that goes when it is no longer needed, with a file `name` of a `case` in it.
    struct Folder(PathBuf);

    impl Folder {
        fn with(of: &str, case: &str, name: &str, text: &str) -> Self {
            let folder = Self(std::env::temp_dir().join(format!("sazanami-{of}-{}", std::process::id())));
            std::fs::create_dir_all(folder.0.join(case)).unwrap();
            std::fs::write(folder.0.join(case).join(name), text).unwrap();
            folder
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            std::fs::remove_dir_all(&self.0).unwrap();
        }
    }

    #[test]
    fn cases_are_chosen_run_and_judged_in_their_order() {
        let verdicts = |names: &[&str], long| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            let found = verify(&cases(), &Choice { names, long, jobs: 2, ..Choice::default() }).unwrap();
            found.iter().flat_map(|judged| &judged.rows).map(|row| row.verdict).collect::<Vec<_>>()
        };
        assert_eq!(verdicts(&[], false), [Verdict::Pass, Verdict::Miss]);
        assert_eq!(verdicts(&[], true), [Verdict::Pass, Verdict::Miss, Verdict::Failed]);
        assert_eq!(verdicts(&["slow"], false), [Verdict::Failed]);
    }

    #[test]
    fn unknown_names_are_wrong_input() {
        let error = verify(&cases(), &named("neer")).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("did you mean `near`?"));
    }

    #[test]
    fn a_choice_that_judges_nothing_or_by_no_file_of_its_folder_is_wrong_input() {
        let refused = |choice: Choice| {
            let error = verify(&cases(), &choice).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{error}");
            error.to_string()
        };
        let subset = Choice { subset: true, ..Choice::default() };
        assert!(refused(subset.clone()).contains("no case is chosen"));
        assert!(refused(Choice { subset: true, ..named("near") }).contains("`near` is not among"));
        let folder = Folder::with("chosen", "near", EXPECTED, &WANTED.replace("cost", "subset = true\ncost"));
        let from = |folder: &Path, choice: Choice| Choice { expected: Some(folder.to_owned()), ..choice };
        assert!(refused(from(&folder.0.join("absent"), named("near"))).contains("there is no folder"));
        assert!(refused(from(&folder.0, named("far"))).contains("holds none of the chosen cases"));
        // The controls: what the folder holds is judged by it, and is in the subset by it; of several one is enough.
        assert_eq!(verify(&cases(), &from(&folder.0, subset)).unwrap().len(), 1);
        assert_eq!(verify(&cases(), &from(&folder.0, Choice::default())).unwrap().len(), 2);
    }

    #[test]
    fn a_case_that_panics_fails_and_the_others_are_judged() {
        let mut cases = cases();
        cases[0].program = Some(|| panic!("out of range"));
        let found = verify(&cases, &Choice { jobs: 1, ..Choice::default() }).unwrap();
        let verdicts: Vec<Verdict> = found.iter().map(|judged| judged.rows[0].verdict).collect();
        assert_eq!(verdicts, [Verdict::Failed, Verdict::Miss]);
        assert!(found[0].rows[0].remark.ends_with("out of range"), "{}", found[0].rows[0].remark);
    }

    #[test]
    fn once_stopped_no_case_begins_and_none_has_failed() {
        let stop = Stop::new();
        let judged = || super::verify(&cases(), &Choice::default(), &mut Silent, &stop).unwrap().len();
        assert_eq!(judged(), 2);
        stop.set(sazanami::stop::StopCause::Caller);
        assert_eq!(judged(), 0);
    }

    #[test]
    fn another_rank_runs_what_rank_0_was_told_to_judge_by() {
        let posed = Posed { case: "own".into(), others: &[], reference: "own".into() };
        let cases = [Case { posed: Some(posed), ..cases()[0].clone() }];
        let folder = Folder::with("sent", "near", CASE, "of the folder");
        let here = |expected: Option<&str>| {
            if let Some(text) = expected {
                std::fs::write(folder.0.join("near").join(EXPECTED), text).unwrap();
            }
            let choice = Choice { expected: Some(folder.0.clone()), ..Choice::default() };
            let order = serde_json::to_string(&Sent::of(&chosen(&cases, &choice).unwrap()[0])).unwrap();
            let job = serde_json::from_str::<Sent>(&order).unwrap().job(&cases).unwrap();
            let posed = job.case.posed.unwrap();
            (posed.case.into_owned(), posed.reference.into_owned(), job.expected.cost)
        };
        assert_eq!(here(None), ("of the folder".into(), "own".into(), 1.0));
        let other = here(Some(&WANTED.replace("cost = 1", "cost = 7")));
        assert_eq!(other, ("of the folder".into(), "own".into(), 7.0));
    }
}
