"""One PPO update in ours and in PyTorch, the same shapes and threads, one after the other, several rounds.

Usage: python3 benches/learning/compare.py [--threads N] [--samples N] [--rounds N]

Needs the packages torch and rsl-rl-lib. Compared are plain PyTorch in f32 and under autocast to bf16 (pytorch.py), rsl_rl's own PPO,
and ours in both precisions. PyTorch gets a tuned allocator: memory freed in a step stays with the process, so it is not
page-faulted anew in the next one. All learners are started once, then take turns; ratios are medians over rounds of ratios within
a round. "processor" is the time of all threads of a learner on processors, which other programs beside it do not count in; with more
than one thread PyTorch's waiting is in it, so there only the wall time says who is faster.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "benches" / "shared"))
import built  # noqa: E402

GIGABYTE = str(1 << 30)
TUNED = {"MALLOC_TOP_PAD_": GIGABYTE, "MALLOC_MMAP_THRESHOLD_": str(1 << 33), "MALLOC_TRIM_THRESHOLD_": str(1 << 33)}
# Theirs, and ours that it is held against.
PAIRS = [("PyTorch f32", "ours f32"), ("rsl_rl f32", "ours f32"), ("PyTorch bf16", "ours bf16")]


class Learner:
    def __init__(self, command):
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            env=os.environ | TUNED, cwd=ROOT,
        )

    def update(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        return json.loads(line) if line else None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--samples", type=int, default=98304)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    threads, samples = str(options.threads), str(options.samples)
    ours, theirs = built.bench("learning"), [sys.executable, "benches/learning/pytorch.py"]
    learners = {
        "ours f32": Learner([ours, "--follow", "--precision", "f32", "--threads", threads, "--samples", samples]),
        "PyTorch f32": Learner([*theirs, "f32", threads, samples]),
        "rsl_rl f32": Learner([*theirs, "rsl_rl", threads, samples]),
        "ours bf16": Learner([ours, "--follow", "--precision", "bf16", "--threads", threads, "--samples", samples]),
        "PyTorch bf16": Learner([*theirs, "bf16", threads, samples]),
    }
    # The first answers come when all are ready; they are not counted.
    learners = {name: learner for name, learner in learners.items() if learner.update() or print(f"{name}: does not run")}
    rounds = [{name: learner.update() for name, learner in learners.items()} for _ in range(options.rounds)]
    print(f"{samples} samples, {threads} threads, medians of {options.rounds} rounds")
    print(f"{'':<14} {'seconds':>8} {'processor':>10} {'MB':>6}")
    for name in learners:
        seconds, cpu, resident = (statistics.median(r[name][key] for r in rounds) for key in ("s", "cpu_s", "resident_mb"))
        print(f"{name:<14} {seconds:8.2f} {cpu:10.2f} {resident:6.0f}")
    for slow, fast in PAIRS:
        if slow in learners and fast in learners:
            wall, cpu = (statistics.median(r[slow][key] / r[fast][key] for r in rounds) for key in ("s", "cpu_s"))
            print(f"{slow} / {fast}: {wall:.2f} by the clock, {cpu:.2f} by processor time")


if __name__ == "__main__":
    main()
