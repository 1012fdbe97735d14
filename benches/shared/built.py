"""Our side of a comparison."""

import json
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).parents[2]


def bench(name):
    """Builds a bench; returns its program."""
    command = ["cargo", "bench", "--bench", name, "--no-run", "--message-format", "json"]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, check=True, text=True).stdout
    messages = [json.loads(line) for line in built.splitlines()]
    return next(m["executable"] for m in messages if m.get("target", {}).get("name") == name and m.get("executable"))
