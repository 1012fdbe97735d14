"""Plays the episodes of a plan in MuJoCo and writes the record that `guidedog evaluate --recorded` judges.

Usage: python3 play_in_mujoco.py PLAN RECORD [--locomotion FILE] [--supervisor FILE] [--jobs N] [--set NAME=VALUE ...]

  guidedog evaluate --suite paper17 --episodes 50 --plan target/flat.plan
  python3 scripts/reference/play_in_mujoco.py target/flat.plan target/flat.record
  guidedog evaluate --recorded target/flat.record --json flat-mujoco.json

A plan says where robots stand, on what ground, which robots they are and how they are pulled; docs/engines.md lists its
tensors. Everything the robots do comes from the ONNX files and their metadata (mujoco_walker.py). --set changes one of
MuJoCo's own settings: time_step, time_constant, impratio. Needs the packages mujoco, numpy and onnxruntime.
"""

import argparse
import dataclasses
import json
import multiprocessing
import pathlib
import sys
import time

import mujoco
import numpy as np
from mujoco_walker import HeightField, Level, Policy, Settings, Walker, substeps

ROOT = pathlib.Path(__file__).parents[2]
CHUNK = 16  # robots of a piece of work
RECORDED = 10


def read(path):
    """Tensors and header of a file in the layout of our checkpoints."""
    raw = pathlib.Path(path).read_bytes()
    length = int.from_bytes(raw[:8], "little")
    header = json.loads(raw[8 : 8 + length])
    text = header.pop("__metadata__")
    assert text.pop("guidedog_checkpoint", None) == "1", f"{path}: not a plan of this version"
    data = np.frombuffer(raw, np.uint8, offset=8 + length)
    tensors = {}
    for name, entry in header.items():
        begin, end = entry["data_offsets"]
        tensors[name.removeprefix("tensor/")] = data[begin:end].view("<f4").reshape(entry["shape"])
    return tensors, text


def write(path, tensors, text):
    header, offset = {"__metadata__": {**text, "guidedog_checkpoint": "1"}}, 0
    for name, values in tensors.items():
        end = offset + 4 * values.size
        header[f"tensor/{name}"] = {"dtype": "F32", "shape": values.shape, "data_offsets": [offset, end]}
        offset = end
    head = json.dumps(header).encode()
    head += b" " * (-len(head) % 8)
    temporary = pathlib.Path(f"{path}.new")
    with open(temporary, "wb") as file:
        file.write(len(head).to_bytes(8, "little") + head)
        for values in tensors.values():
            file.write(np.ascontiguousarray(values, "<f4").tobytes())
    temporary.rename(path)


def prepare(arguments):
    """What every worker holds once."""
    global plan, text, policies, ground, settings
    plan, text = read(arguments.plan)
    policies = [Policy(arguments.locomotion), Policy(arguments.supervisor)]
    cells = plan["ground"]
    ground = HeightField(cells, *plan["ground_frame"]) if cells.size > 4 else Level()
    settings = arguments.settings


def play(first):
    """Plays a chunk of robots; gives their samples."""
    chosen = slice(first, first + CHUNK)
    start, force, steps = plan["start"][chosen], plan["force"][chosen].astype(float), plan["steps"][chosen]
    walker = Walker(*policies, ground, len(start), settings)
    # Nominal robots are what the metadata and the description say; only a drawn one cannot be known from there.
    drawn = ("base_inertia", "hand_position") if text["randomize"] == "true" else ()
    walker.become(plan["friction"][chosen], **{name: plan[name][chosen] for name in drawn})
    walker.place(start, plan["start_velocity"][chosen], plan["joint_position"][chosen])
    samples = np.zeros((len(start), force.shape[1], RECORDED), np.float32)
    for step in range(int(steps.max())):
        walker.control_step(force[:, step])
        motion = walker.motion()
        samples[:, step, 0:2] = motion["linear"][:, :2]
        samples[:, step, 2] = motion["angular"][:, 2]
        samples[:, step, 3:5] = motion["position"][:, :2]
        samples[:, step, 5] = motion["yaw"]
        samples[:, step, 6:9] = np.nan_to_num(walker.command)
        samples[:, step, 9] = walker.fallen
        samples[walker.fallen, step, 0:6] = 0.0
    return samples


def settings_of(entries):
    known = {field.name: field.default for field in dataclasses.fields(Settings)}
    chosen = {}
    for entry in entries:
        name, _, value = entry.partition("=")
        if name not in known:
            raise ValueError(f"--set {entry}: must be one of {', '.join(known)}, as in time_step=0.002")
        try:
            chosen[name] = float(value)
        except ValueError:
            raise ValueError(f"--set {entry}: {value!r} is no number") from None
    return Settings(**chosen), {name: value for name, value in chosen.items() if value != known[name]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plan")
    parser.add_argument("record")
    parser.add_argument("--locomotion", default=ROOT / "policies" / "locomotion.onnx")
    parser.add_argument("--supervisor", default=ROOT / "policies" / "supervisor.onnx")
    parser.add_argument("--jobs", type=int, default=multiprocessing.cpu_count())
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    arguments = parser.parse_args()
    # Once before the workers: a pool starts those that fail anew, for ever.
    try:
        arguments.settings, changed = settings_of(arguments.set)
        locomotion, _ = Policy(arguments.locomotion), Policy(arguments.supervisor)
        substeps(locomotion.number("control_period"), arguments.settings.time_step)
        tensors, text = read(arguments.plan)
    except Exception as error:
        sys.exit(f"play_in_mujoco.py: {error}")
    firsts = range(0, len(tensors["start"]), CHUNK)
    parts, began = [], time.monotonic()
    with multiprocessing.Pool(arguments.jobs, prepare, [arguments]) as pool:
        for part in pool.imap(play, firsts):
            parts.append(part)
            left = (time.monotonic() - began) / len(parts) * (len(firsts) - len(parts))
            print(f"\rrobots {CHUNK * len(parts)}/{len(tensors['start'])}, {left:.0f} s left ", end="", file=sys.stderr)
    print(file=sys.stderr)
    text["engine"] = f"MuJoCo {mujoco.__version__}" + "".join(f", {k} {v:g}" for k, v in changed.items())
    text["locomotion"] = pathlib.Path(arguments.locomotion).name
    text["supervisor"] = pathlib.Path(arguments.supervisor).name
    samples = np.concatenate(parts)
    write(arguments.record, {"samples": samples, "force": tensors["force"], "steps": tensors["steps"]}, text)


if __name__ == "__main__":
    main()
