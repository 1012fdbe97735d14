//! Runs that find no room for what they write.

use super::*;

#[test]
fn a_folder_that_cannot_be_written_is_refused_by_name() {
    let folder = Folder::new();
    // A file where the run's folder should be refuses everyone, root included.
    fs::write(folder.0.path().join("runs"), "").unwrap();
    let output = folder.train(1, &[]);
    assert_eq!(output.status.code(), Some(1));
    let said = message(&output);
    assert!(said.contains("cannot create the run folder runs/small"), "{said}");
}

#[test]
fn a_full_disk_is_an_error_and_the_checkpoint_before_stays() {
    let folder = Folder::new();
    assert!(folder.train(2, &[]).status.success());
    let (path, bytes) = newest(&folder);
    // No file may grow beyond a few kilobytes, as if the disk were full.
    let limited = "trap '' XFSZ; ulimit -f 16; exec \"$0\" \"$@\"";
    let mut command = Command::new("sh");
    command.current_dir(&folder.0).args(["-c", limited, env!("CARGO_BIN_EXE_guidedog")]);
    let output = command.args(small(9)).arg("--resume").output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", message(&output));
    assert!(message(&output).contains("cannot save"), "{}", message(&output));
    assert!((path, bytes) == newest(&folder), "the checkpoint before is not as it was");
    assert_eq!(half_written(&folder), Vec::<PathBuf>::new());
    assert!(folder.train(3, &["--resume"]).status.success());
}

/// A small file system of its own, which goes with the last process in it: `script` runs there, in `/mnt`, with the program as `$0`.
/// `None`, saying why, where this user cannot mount one.
fn in_small_disk(script: &str) -> Option<Output> {
    let unshare = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-c", script, env!("CARGO_BIN_EXE_guidedog")]);
        command.output()
    };
    let mount = "mount -t tmpfs -o size=1m tmpfs /mnt && cd /mnt";
    if !unshare(mount).is_ok_and(|output| output.status.success()) {
        println!("skipped: `unshare --map-root-user --mount` cannot mount a tmpfs here");
        return None;
    }
    Some(unshare(&format!("{mount} || exit 9\n{script}")).unwrap())
}

#[test]
fn a_disk_that_runs_full_or_is_only_for_reading_is_named_with_the_last_good_checkpoint() {
    let many = small_quoted(1_000_000);
    let script = format!(
        "said=$(\"$0\" {many} 2>&1); echo \"full: $?\"; echo \"$said\"
         ls runs/small/checkpoints runs/small
         said=$(\"$0\" {many} --resume 2>&1); echo \"still full: $?\"; echo \"$said\"
         mount -o remount,ro /mnt
         \"$0\" {many} --resume; echo \"read-only: $?\"
         mount -o remount,rw,size=8m /mnt
         \"$0\" {} --resume; echo \"again: $?\"",
        small_quoted(4)
    );
    let Some(output) = in_small_disk(&script) else { return };
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let all = format!("{printed}\n{}", message(&output));
    let (_, named) = all.split_once("the last good checkpoint is runs/small/checkpoints/").expect(&all);
    let named = &named[.."00000000.safetensors".len()];
    assert!(printed.lines().any(|line| line == named), "{named} is not there: {all}");
    assert!(all.contains("No space left on device") && all.contains("Read-only file system"), "{all}");
    for outcome in ["\nstill full: 1\n", "\nread-only: 1\n", "\nagain: 0\n"] {
        assert!(printed.contains(outcome), "{outcome:?}: {all}");
    }
    assert!(printed.starts_with("full: 1\n") && !printed.contains(".tmp"), "{all}");
}
