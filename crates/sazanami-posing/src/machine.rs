//! The machine: processor, memory and what limits it, disk.

use std::fs;
use std::path::Path;

use serde::Serialize;

/// Processors and memory of the machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Machine {
    /// Name of the processor.
    pub cpu: String,
    /// Processors the system lets this program use.
    pub cores: usize,
    /// Memory that this program can still take \[bytes]: the least of what is free and of the limits set to it.
    pub memory_available: Option<u64>,
    /// Bound of that memory.
    pub memory_limit: MemoryLimit,
}

/// Bound of the memory of this program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MemoryLimit {
    /// Memory of the machine that is free or can be freed.
    #[default]
    Machine,
    /// Limit on the address space of a process, `ulimit -v`.
    AddressSpace,
    /// Limit of the control group, set by a container or a batch system.
    ControlGroup,
}

impl std::fmt::Display for MemoryLimit {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Machine => "free memory of this machine",
            Self::AddressSpace => "limit on address space, `ulimit -v`",
            Self::ControlGroup => "memory limit of the control group (container or batch system)",
        })
    }
}

impl Machine {
    /// Asks the operating system.
    #[must_use]
    pub fn this() -> Self {
        let processors = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let least = memory_bounds().into_iter().min_by_key(|&(_, bytes)| bytes);
        Self {
            cpu: processor_name(&processors).unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            cores: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            memory_available: least.map(|(_, bytes)| bytes),
            memory_limit: least.map_or_else(MemoryLimit::default, |(limit, _)| limit),
        }
    }
}

/// Memory that this program can still take under each bound \[bytes].
#[must_use]
pub fn memory_bounds() -> Vec<(MemoryLimit, u64)> {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let machine = available_memory(&read("/proc/meminfo"));
    let address_space = address_space_limit(&read("/proc/self/limits"))
        .map(|limit| limit.saturating_sub(status_bytes(&read("/proc/self/status"), "VmSize:").unwrap_or_default()));
    let group = control_group_room(&read("/proc/self/cgroup"), Path::new("/sys/fs/cgroup"));
    let bounds = [
        (MemoryLimit::Machine, machine),
        (MemoryLimit::AddressSpace, address_space),
        (MemoryLimit::ControlGroup, group),
    ];
    bounds.into_iter().filter_map(|(limit, bytes)| Some((limit, bytes?))).collect()
}

/// The processors that the system lets this program use, by their numbers; empty where it does not tell them.
#[must_use]
pub fn processors_allowed() -> String {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    line.unwrap_or_default().trim().to_owned()
}

/// Most memory that this program has held so far \[bytes], if the system reports it.
#[must_use]
pub fn peak_memory() -> Option<u64> {
    status_bytes(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

fn processor_name(text: &str) -> Option<String> {
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn available_memory(text: &str) -> Option<u64> {
    status_bytes(text, "MemAvailable:")
}

/// A line `name value kB` of a table of the system \[bytes].
fn status_bytes(text: &str, name: &str) -> Option<u64> {
    let kibibytes: u64 =
        text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024)
}

/// The soft limit of `Max address space` in `/proc/self/limits` \[bytes]; `None` if there is none.
fn address_space_limit(text: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix("Max address space"))?.split_whitespace().next()?.parse().ok()
}

/// Room under the tightest memory limit of the control groups that `memberships` (`/proc/self/cgroup`) names \[bytes];
/// both versions of control groups, with the limits of the groups above.
fn control_group_room(memberships: &str, root: &Path) -> Option<u64> {
    memberships.lines().filter_map(|line| group_room(line, root)).min()
}

/// The room of one membership `number:controllers:/path`.
fn group_room(membership: &str, root: &Path) -> Option<u64> {
    let mut parts = membership.splitn(3, ':');
    let (_, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
    let (root, limit, usage, cache) = match controllers {
        "" => (root.to_owned(), "memory.max", "memory.current", "inactive_file"),
        named if named.split(',').any(|name| name == "memory") => {
            (root.join("memory"), "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
        }
        _ => return None,
    };
    let group = root.join(path.trim_start_matches('/'));
    let room = |group: &Path| -> Option<u64> {
        let number = |name: &str| fs::read_to_string(group.join(name)).ok()?.trim().parse::<u64>().ok();
        let statistics = fs::read_to_string(group.join("memory.stat")).unwrap_or_default();
        // Cached pages of files are given back when memory is needed.
        let cached = statistics.lines().find_map(|line| line.strip_prefix(cache)?.trim().parse().ok());
        let used = number(usage)?.saturating_sub(cached.unwrap_or(0));
        // Version 1 writes the largest number of whole pages where there is no limit.
        Some(number(limit).filter(|&bytes| bytes < 1 << 60)?.saturating_sub(used))
    };
    group.ancestors().take_while(|above| above.starts_with(&root)).filter_map(room).min()
}

/// Free space where `path` lies or will lie \[bytes], if the system tells.
#[must_use]
pub fn free_disk(path: &Path) -> Option<u64> {
    let absolute = std::path::absolute(path).ok()?;
    let existing = absolute.ancestors().find(|ancestor| ancestor.exists())?;
    let volume = rustix::fs::statvfs(existing).ok()?;
    volume.f_bavail.checked_mul(volume.f_frsize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_systems_tables_are_understood() {
        assert_eq!(available_memory("MemTotal: 9 kB\nMemAvailable:   2048 kB\n"), Some(2 << 20));
        assert_eq!(processor_name("vendor: x\nmodel name\t: Some CPU @ 2 GHz\n").as_deref(), Some("Some CPU @ 2 GHz"));
        assert_eq!(available_memory(""), None);
        assert!(Machine::this().cores > 0);
        let limits =
            |soft: &str| format!("Max stack size 8 8 bytes\nMax address space         {soft}   unlimited  bytes\n");
        assert_eq!(address_space_limit(&limits("409600")), Some(409_600));
        assert_eq!(address_space_limit(&limits("unlimited")), None);
    }

    #[test]
    fn the_tightest_control_group_counts() {
        let root = tempfile::tempdir().unwrap();
        let write = |group: &str, files: [(&str, &str); 3]| {
            let group = root.path().join(group);
            fs::create_dir_all(&group).unwrap();
            files.iter().for_each(|(name, text)| fs::write(group.join(name), text).unwrap());
        };
        let [limit, usage] = ["memory.max", "memory.current"];
        write("a", [(limit, "1000\n"), (usage, "900\n"), ("memory.stat", "anon 7\ninactive_file 300\n")]);
        write("a/b", [(limit, "max\n"), (usage, "10\n"), ("memory.stat", "")]);
        assert_eq!(control_group_room("0::/a/b\n", root.path()), Some(400));
        // The first version has one tree per controller.
        let [limit, usage] = ["memory.limit_in_bytes", "memory.usage_in_bytes"];
        write("memory/c", [(limit, "500\n"), (usage, "200\n"), ("memory.stat", "total_inactive_file 50\n")]);
        assert_eq!(control_group_room("4:cpu:/c\n3:memory:/c\n0::/a/b\n", root.path()), Some(350));
        assert_eq!(control_group_room("4:cpu:/c\n0::/none\n", root.path()), None);
        write("memory/d", [(limit, "9223372036854771712\n"), (usage, "200\n"), ("memory.stat", "")]);
        assert_eq!(control_group_room("3:memory:/d\n", root.path()), None);
    }
}
