//! What this process has taken of the machine, and how many threads it may.

use crate::error::{BadInput, OrBadInput as _};

/// Uses so many threads; one a core if it is not said.
///
/// # Errors
/// The system does not give as many, or they were started before.
pub fn use_threads(threads: Option<usize>) -> Result<(), BadInput> {
    let Some(threads) = threads else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    pool.or_bad_input(|| format!("--threads {threads}"))
}

/// Threads in use.
pub fn threads() -> usize {
    rayon::current_num_threads()
}

/// Processor time of all threads so far \[s\]; what other programs take is not in it. 0 where the system does not say.
pub fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    // utime and stime, in hundredths of a second.
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Most memory this process ever had \[MB\]; 0 where the system does not say.
pub fn resident_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).map_or(0.0, |kb: f64| kb / 1024.0)
}

/// The processor's name; empty where the system does not say.
pub fn processor_name() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = info.lines().find_map(|line| line.strip_prefix("model name"));
    line.map_or_else(String::new, |line| line.trim_start_matches([' ', '\t', ':']).trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_says_what_was_taken() {
        let before = processor_s();
        let started = std::time::Instant::now();
        let mut sum = 0_u64;
        while processor_s() - before < 0.03 && started.elapsed().as_secs() < 20 {
            sum = std::hint::black_box(sum.wrapping_add(1));
        }
        assert!(processor_s() - before >= 0.03);
        assert!(resident_mb() > 1.0 && threads() > 0);
    }
}
