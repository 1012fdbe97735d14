"""Writes mass matrices, bias forces and accelerations of five robots, computed by MuJoCo in double precision.

Usage: python3 mint_forward_dynamics.py FOLDER

Writes FOLDER/ROBOT.safetensors for each robot of mujoco_robots.py, which says how MuJoCo gets them and how its numbers
become ours; README.md describes the tensors. Needs the packages mujoco and numpy; the files name the MuJoCo version that
made them. All that is drawn is single precision, so that single and double precision compute from the same numbers.
"""

import json
import pathlib
import sys

import mujoco
import numpy as np

from mujoco_robots import ROBOTS, Robot

STATES = 1024
SEED = 20
TURN = 2 * np.pi  # how far either way a joint without limits is drawn


def limits(element):
    """Lowest and highest position, highest speed and torque of a joint."""
    limit = element.find("limit")
    lower, upper = (float(limit.get(key, default)) for key, default in (("lower", -TURN), ("upper", TURN)))
    return [lower, upper, float(limit.get("velocity")), float(limit.get("effort"))]


def draw(robot, random):
    """The inputs of all states by name, one row a state, in single precision."""
    lower, upper, speed, effort = np.array([limits(robot.elements[name]) for name in robot.joints]).T
    uniform = lambda low, high: random.uniform(low, high, (STATES, len(low))).astype(np.float32)
    orientation = random.normal(size=(STATES, 4))
    return {
        "base_orientation": (orientation / np.linalg.norm(orientation, axis=1)[:, None]).astype(np.float32),
        "base_linear_velocity": uniform([-2.0] * 3, [2.0] * 3),
        "base_angular_velocity": uniform([-4.0] * 3, [4.0] * 3),
        "joint_position": uniform(lower, upper),
        "joint_velocity": uniform(-speed, speed),
        "joint_torque": uniform(-effort, effort),
        "force": uniform([-100.0] * 3, [100.0] * 3),
        "vector": uniform([-1.0] * robot.model.nv, [1.0] * robot.model.nv),
    }


def solve(robot, inputs):
    """What MuJoCo makes of one state: mass matrix times vector, bias force, acceleration."""
    state = {name: values.astype(np.float64) for name, values in inputs.items()}
    quaternion = state["base_orientation"] / np.linalg.norm(state["base_orientation"])
    linear, angular = state["base_linear_velocity"], state["base_angular_velocity"]
    robot.set_state(quaternion, linear, angular, state["joint_position"], state["joint_velocity"])
    robot.apply(state["joint_torque"], state["force"])
    mujoco.mj_forward(robot.model, robot.data)
    turn, product = robot.to_mujoco(), np.zeros(robot.model.nv)
    mujoco.mj_mulM(robot.model, robot.data, product, turn @ state["vector"])
    return turn.T @ product, turn.T @ robot.data.qfrc_bias, turn.T @ robot.data.qacc


def write_safetensors(path, tensors, about):
    """The format: length of the header (8 bytes, little-endian), the header (JSON), the tensors one after the other."""
    kinds, header, start = {"float32": "F32", "float64": "F64"}, {"__metadata__": about}, 0
    for name, values in tensors.items():
        span = [start, start + values.nbytes]
        header[name] = {"dtype": kinds[values.dtype.name], "shape": values.shape, "data_offsets": span}
        start = span[1]
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    data = b"".join(values.astype(values.dtype.newbyteorder("<")).tobytes() for values in tensors.values())
    path.write_bytes(len(text).to_bytes(8, "little") + text + data)


def main(folder):
    for name in ROBOTS:
        robot = Robot(name)
        inputs = draw(robot, np.random.default_rng(SEED))
        rows = [solve(robot, {key: values[i] for key, values in inputs.items()}) for i in range(STATES)]
        outputs = zip(("mass_times_vector", "bias_force", "acceleration"), map(np.array, zip(*rows)))
        whole = {
            "total_mass": robot.model.body_mass.sum().reshape(1),
            "base_inertia": robot.base_inertia(),
            "force_point": robot.force_point,
        }
        about = {
            "engine": f"MuJoCo {mujoco.__version__}, double precision",
            "script": "scripts/reference/mint_forward_dynamics.py",
            "joints": " ".join(robot.joints),
        }
        # Double precision first: its tensors begin at multiples of eight.
        write_safetensors(folder / f"{name}.safetensors", whole | dict(outputs) | inputs, about)


main(pathlib.Path(sys.argv[1]))
