//! A sweep as an array job of Slurm.

use std::fmt::Write as _;
use std::path::Path;

use crate::sweep::Sweep;

/// Part by which time and memory asked for exceed what `check` foretells.
const TIME: f64 = 2.0;
const MEMORY: f64 = 1.5;
/// Least memory asked for \[bytes].
const LEAST_MEMORY: f64 = 512e6;
/// Seconds before the end of its time that a run is told to write a checkpoint.
const NOTICE: u32 = 120;

/// The script of the array job; each of its tasks is a run. A task that is begun again goes on from its checkpoint.
pub fn script(sweep: &Sweep, program: &Path, side_by_side: Option<usize>, threads: usize) -> String {
    let runs = sweep.runs();
    let most = |of: fn(&crate::posed::Run) -> f64| runs.iter().map(of).fold(0.0, f64::max);
    let minutes = (TIME * most(|run| run.needs.wall[1]) / 60.0).ceil().max(10.0);
    let megabytes = ((MEMORY * most(|run| run.needs.memory)).max(LEAST_MEMORY) / 1e6).ceil();
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string();
    let folder = absolute(sweep.folder());
    let at_a_time = side_by_side.map_or_else(String::new, |runs| format!("%{runs}"));
    let mut text = format!(
        "#!/bin/bash\n\
         # The {} runs of {}: `sbatch` this file; `sazanami sweep` with the same plan and folder then makes the table.\n\
         #SBATCH --job-name={}\n\
         #SBATCH --array=1-{}{at_a_time}\n\
         #SBATCH --ntasks=1\n\
         #SBATCH --cpus-per-task={threads}\n\
         #SBATCH --mem={megabytes:.0}M\n\
         #SBATCH --time={minutes:.0}\n\
         #SBATCH --output={}\n\
         # A checkpoint before the time is up; the task then begins again and goes on from there.\n\
         #SBATCH --signal=B:USR1@{NOTICE}\n\
         #SBATCH --requeue\n\n\
         cd {} || exit 1\n\
         names=(\n",
        runs.len(),
        sweep.plan().path.display(),
        word(&sweep.plan().name()),
        runs.len(),
        quoted(&format!("{folder}/logs/slurm-%A-%a.txt")),
        quoted(&folder),
    );
    for run in runs {
        let _ = writeln!(text, "    {}", quoted(&run.name));
    }
    let program = quoted(&absolute(program));
    let _ = write!(
        text,
        ")\n\
         name=${{names[$((SLURM_ARRAY_TASK_ID - 1))]}}\n\
         if [ -f \"$name/case.toml\" ]; then\n    work=(resume \"$name\")\nelse\n    \
         work=(run \"cases/$name.toml\" --out \"$name\" --force)\nfi\n\
         {program} \"${{work[@]}}\" --threads \"$SLURM_CPUS_PER_TASK\" &\n\
         run=$!\n\
         trap 'kill -USR1 $run' USR1\n\
         wait $run\n\
         code=$?\n\
         # A signal ends `wait` before the run.\n\
         while kill -0 $run 2>/dev/null; do wait $run; code=$?; done\n\
         if [ $code -eq 130 ]; then scontrol requeue \"$SLURM_JOB_ID\"; fi\n\
         exit $code\n",
    );
    text
}

/// A text as one word of a shell.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}

/// A name without what would end it.
fn word(text: &str) -> String {
    text.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect()
}
