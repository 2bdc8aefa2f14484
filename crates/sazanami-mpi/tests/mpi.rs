//! Ranks as processes: messages and collective operations as within one process, and the end of a rank that panics.
//!
//! This program starts itself under the launcher `SAZANAMI_MPIRUN`, else `mpirun`, and is then a rank.

use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use sazanami_parallel::{Communicator, Processes, Reduction, Sums, run_ranks_with};

/// Environment variable with the task of a rank.
const ROLE: &str = "SAZANAMI_ROLE";

fn main() -> ExitCode {
    match std::env::var(ROLE) {
        Ok(role) => rank(&role),
        Err(_) => tests(),
    }
}

/// Messages of all kinds; a number that hangs on their contents and on the order of sums.
fn exchange(c: &dyn Communicator) -> u64 {
    let (rank, size) = (c.rank(), c.size());
    let mut seen = Vec::new();
    let mut bytes = Vec::new();
    for round in 1..=20_usize {
        for to in 0..size {
            c.send(to, 7, &vec![rank as u8; 3 * round * (to + 1)]);
            c.send(to, 8, &[round as u8]);
        }
        // A message as large as a field of cells, which waits for its receiver.
        if round == 10 {
            c.send((rank + 1) % size, 9, &vec![rank as u8; 3 << 20]);
        }
        for from in (0..size).rev() {
            c.receive(from, 8, &mut bytes);
            seen.extend_from_slice(&bytes);
            c.receive(from, 7, &mut bytes);
            assert_eq!(bytes, vec![from as u8; 3 * round * (rank + 1)]);
            seen.push(bytes[0]);
        }
        let mut sums = [1.0 / (rank as f64 + 0.3), 1e16_f64.powf(rank as f64 / 7.0), f64::from(round as u32)];
        c.all_reduce(&mut sums, Reduction::Sum);
        let mut extremes = [rank as f64, if rank + 1 == size { f64::NAN } else { 1.0 }, -0.0];
        c.all_reduce(&mut extremes, Reduction::Max);
        assert!(extremes[0] == (size - 1) as f64 && extremes[1].is_nan());
        seen.extend_from_slice(bytemuck::bytes_of(&sums));
        let mut all = Vec::new();
        c.all_gather(&vec![rank as u8; rank * round % 5], &mut all);
        all.iter().for_each(|bytes| seen.extend_from_slice(bytes));
        let mut told = vec![rank as u8; if rank == 0 { round } else { 0 }];
        c.broadcast(&mut told);
        assert_eq!(told, vec![0; round]);
    }
    c.receive((rank + size - 1) % size, 9, &mut bytes);
    assert_eq!(bytes.len(), 3 << 20);
    seen.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

fn rank(role: &str) -> ExitCode {
    let world = sazanami_mpi::join().expect("the processes belong together").expect("a launcher started them");
    let processes = world.processes();
    match role {
        "panic" => broken(processes),
        _ => {
            for sums in [Sums::Ordered, Sums::Tree] {
                let hash = processes.run(1, sums, |c| exchange(&*c)).expect("no rank panics");
                let expected = run_ranks_with(sums, processes.size(), 1, |c| exchange(&*c)).expect("no rank panics");
                assert_eq!(hash, expected[processes.rank()], "{sums:?} on {} ranks", processes.size());
            }
            ExitCode::SUCCESS
        }
    }
}

/// Rank 1 panics while the others wait for it.
fn broken(processes: &Processes) -> ExitCode {
    let outcome = processes.run(1, Sums::Ordered, |c| {
        assert_ne!(c.rank(), 1, "the sand ran out");
        c.all_reduce(&mut [1.0], Reduction::Sum);
    });
    let failed = outcome.expect_err("a rank panicked");
    println!("rank {} heard: {failed}", processes.rank());
    processes.abort(17)
}

fn start(ranks: usize, role: &str) -> (Option<i32>, String, Duration) {
    let words = std::env::var("SAZANAMI_MPIRUN").unwrap_or_else(|_| "mpirun".into());
    let mut words = words.split_whitespace();
    let mut command = Command::new(words.next().expect("a launcher is named"));
    for name in ["OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_rmaps_base_oversubscribe"] {
        command.env(name, "1");
    }
    let program = std::env::current_exe().expect("this program has a name");
    command.args(words).args(["-n", &ranks.to_string()]).arg(program).env(ROLE, role);
    let began = Instant::now();
    let output = command.output().expect("the launcher can be started");
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    (output.status.code(), text, began.elapsed())
}

fn tests() -> ExitCode {
    let mut failed = 0;
    let mut judge = |name: &str, good: bool, printed: &str| {
        println!("test {name} ... {}", if good { "ok" } else { "FAILED" });
        if !good {
            println!("{printed}");
            failed += 1;
        }
    };
    for ranks in [1, 2, 3, 4, 6] {
        let (code, printed, _) = start(ranks, "exchange");
        judge(&format!("messages_on_{ranks}_ranks"), code == Some(0), &printed);
    }
    let (code, printed, took) = start(3, "panic");
    let told = printed.contains("rank 0 heard: rank 1 panicked") && printed.contains("the sand ran out");
    let good = code == Some(17) && told && took < Duration::from_secs(5);
    judge("a_panic_on_one_rank_ends_all", good, &format!("exit code {code:?} after {took:?}: {printed}"));
    let state = if failed == 0 { "ok" } else { "FAILED" };
    println!("\ntest result: {state}. {} passed; {failed} failed; 0 ignored; 0 measured; 0 filtered out", 6 - failed);
    ExitCode::from(u8::from(failed > 0))
}
