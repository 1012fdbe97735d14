"""Writes trajectories with contact of ANYmal D with the nominal harness (and of a sliding brick), simulated by MuJoCo.

Usage: python3 mint_trajectories.py [TIME_CONSTANT] > crates/physics/tests/golden/trajectories.txt

Needs the packages mujoco and numpy; the output names the MuJoCo version that made it. The scenes are those of
crates/physics/tests/scenes/mod.rs, where ground, targets and forces are written again; the first sample of a scene is
its initial state. Robot and harness are those of mujoco_robots.py, spheres and joint limits those of our URDF,
and the robot's own parts do not touch each other, as in ours.

Settings, and why:

- TIME_STEP 0.05 ms, a hundredth of ours, so that what time does to the differences is ours to explain.
- TIME_CONSTANT (solref) 2 ms, forty steps, critically damped. A standing foot sinks in by micrometers and a landing
  lasts a few milliseconds; ours is over within a step. Forty, because MuJoCo's convex friction lifts what slides: at two
  steps to the time constant a brick at 2 m/s is thrown 36 mm high, at forty 0.4 mm. Another value shows how far
  MuJoCo's own answer depends on it (docs/physics.md).
- Elliptic friction cones with impratio 100: friction a hundred times stiffer than the normal direction. MuJoCo's
  default lets a standing robot creep.
- Torques from the actuator law of crates/physics/src/actuator.rs at the state before each step. The damping is thus
  explicit, where ours is implicit; at this step kd dt / I is 0.002.

A sample, every 0.02 s: base position, orientation (w x y z), linear velocity (world axes), angular velocity (base
axes), vertical force of the ground on the whole robot, mean since the last sample, joint positions (our order).
"""

import sys

import mujoco
import numpy as np
from mujoco_robots import HAND, HAND_RADIUS, description

JOINTS = [f"{leg}_{drive}" for drive in ("HAA", "HFE", "KFE") for leg in ("LF", "LH", "RF", "RH")]
DEFAULT = np.array([0, 0, 0, 0, 0.4, -0.4, 0.4, -0.4, -0.8, 0.8, -0.8, 0.8])
TIME_STEP = 0.00005
TIME_CONSTANT = float(sys.argv[1]) if len(sys.argv) > 1 else 0.002
CONTROL_PERIOD = 0.02
STANCE = 0.58852  # base height at which the feet of the default pose touch level ground, and 10 µm more
CELL = 0.1
ROUGH_LEVEL, RIDGE_LEVEL = 0.005, 0.01
STEP_HEIGHT, STEP_START = 0.06, 0.7


def level(spec):
    spec.worldbody.add_geom(name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])


def rough(spec):
    """Vertices 0.1 m apart at 0, 5, 10 or 15 mm."""
    height_field(spec, ROUGH_LEVEL)


def ridges(spec):
    """Twice as steep: up to 23 degrees, so that feet stand on ridges and in valleys."""
    height_field(spec, RIDGE_LEVEL)


def height_field(spec, level_height):
    """Both engines split a cell from (x0, y0) to (x1, y1)."""
    columns, rows = 80, 40
    column, row = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    levels = rough_level(column, row)
    assert levels.min() == 0
    size = [columns * CELL / 2, rows * CELL / 2, levels.max() * level_height, 1.0]
    spec.add_hfield(name="rough", nrow=rows + 1, ncol=columns + 1, size=size, userdata=levels.ravel().astype(float))
    # From (-2, -2) to (6, 2).
    spec.worldbody.add_geom(name="ground", type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="rough", pos=[2.0, 0.0, 0.0])


def rough_level(column, row):
    return (column * 7 + row * 3 + column * row * 5) % 11 % 4


def step(spec):
    level(spec)
    half = [2.5, 2.0, STEP_HEIGHT / 2]
    center = [STEP_START + half[0], 0.0, half[2]]
    spec.worldbody.add_geom(name="step", type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=center)


def hold(time):
    return DEFAULT


def trot(time):
    """Diagonal legs together, 1.5 times a second; the foot is swung forward while the leg is drawn up."""
    phase = 2.0 * np.pi * 1.5 * time + np.pi * np.array([0, 1, 1, 0])  # LF LH RF RH
    ramp = min(time / 0.5, 1.0)
    fold = np.array([1, -1, 1, -1])  # hind legs are bent the other way
    lift = ramp * 0.35 * np.maximum(np.sin(phase), 0.0)
    swing = ramp * 0.10 * np.cos(phase)
    return DEFAULT + np.concatenate([np.zeros(4), fold * lift + swing, -2.0 * fold * lift])


def no_force(time):
    return np.zeros(3)


def push(time):
    return np.array([0.0, 60.0, 0.0]) if 1.0 <= time < 1.5 else np.zeros(3)


def brick(spec):
    """10 kg, 0.4 x 0.2 x 0.1 m, with a sphere in each lower corner."""
    body = spec.worldbody.add_body(name="base", mass=10.0, explicitinertial=True)
    body.inertia = 10.0 / 12.0 * np.array([0.05, 0.17, 0.2])
    body.add_freejoint()
    for x in (0.2, -0.2):
        for y in (0.1, -0.1):
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0], pos=[x, y, -0.04])
    return spec


def anymal():
    spec = description("anymal_d")
    spec.body("base").add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[HAND_RADIUS, 0, 0], pos=HAND)
    return spec


# Name, ground, duration, friction, initial height, initial linear and angular velocity, targets, force at the base.
ROBOT_SCENES = [
    ("drop", level, 2.0, STANCE + 0.1, hold, no_force),
    ("stand", level, 10.0, STANCE, hold, no_force),
    ("push", level, 3.0, STANCE, hold, push),
    ("trot", level, 3.0, STANCE, trot, no_force),
    ("rough", rough, 3.0, STANCE + 0.015, trot, no_force),
    ("step", step, 4.0, STANCE, trot, no_force),
    ("ridges", ridges, 3.0, STANCE + 0.03, trot, no_force),
]


def compiled(spec, ground, friction):
    ground(spec)
    for geom in spec.geoms:
        on_ground = geom.name in ("ground", "step")
        geom.contype, geom.conaffinity = (0, 1) if on_ground else (1, 0)
        geom.condim, geom.friction = 3, [friction, 0.0, 0.0]
        geom.solref[:2] = TIME_CONSTANT, 1.0
    option = spec.option
    option.timestep = TIME_STEP
    option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 100.0
    option.solver, option.tolerance, option.iterations = mujoco.mjtSolver.mjSOL_NEWTON, 1e-12, 100
    return spec.compile()


def motor_torque(target, q, qd):
    """crates/physics/src/actuator.rs: PD behind a DC motor's speed-torque limit."""
    servo = 80.0 * (target - q) - 2.0 * qd
    upper = np.clip(120.0 * (1.0 - qd / 7.5), 0.0, 80.0)
    lower = np.clip(120.0 * (-1.0 - qd / 7.5), -80.0, 0.0)
    return np.clip(servo, lower, upper)


def heading_to_world(rotation, force):
    forward = np.array([rotation[0, 0], rotation[1, 0], 0.0]) / np.hypot(rotation[0, 0], rotation[1, 0])
    return force[0] * forward + force[1] * np.array([-forward[1], forward[0], 0.0])


def run(name, model, data, seconds, targets, force):
    """Steps and prints; the state has been set."""
    joints = [model.joint(joint) for joint in JOINTS] if model.njnt > 1 else []
    position = np.array([joint.qposadr[0] for joint in joints], dtype=int)
    rate = np.array([joint.dofadr[0] for joint in joints], dtype=int)
    substeps = round(CONTROL_PERIOD / TIME_STEP)
    base = model.body("base").id
    print("scene", name)
    sample(data, position, 0.0)
    for tick in range(round(seconds / CONTROL_PERIOD)):
        target, vertical = targets(tick * CONTROL_PERIOD), 0.0
        for _ in range(substeps):
            data.qfrc_applied[rate] = motor_torque(target[: len(rate)], data.qpos[position], data.qvel[rate])
            rotation = np.zeros(9)
            mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
            data.qfrc_applied[:3] = heading_to_world(rotation.reshape(3, 3), force(tick * CONTROL_PERIOD))
            mujoco.mj_step(model, data)
            # Along the free joint's z only contacts push.
            vertical += data.qfrc_constraint[2] / substeps
        sample(data, position, vertical)


def sample(data, position, vertical):
    q = data.qpos
    numbers = [*q[:3], *q[3:7], *data.qvel[:6], vertical, *q[position]]
    print(*(f"{round(value, 5) + 0.0:.5f}".rstrip("0").rstrip(".") for value in numbers))


def main():
    print(f"# Trajectories with contact by MuJoCo {mujoco.__version__}, time step {TIME_STEP} s, elliptic cones,")
    print(f"# impratio 100, contact time constant {TIME_CONSTANT} s. Made by scripts/reference/mint_trajectories.py, which explains")
    print("# scenes, settings and the numbers of a line.")
    for name, ground, seconds, height, targets, force in ROBOT_SCENES:
        model = compiled(anymal(), ground, 1.0)
        data = mujoco.MjData(model)
        data.qpos[:7] = [0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0]
        for joint, q in zip(JOINTS, DEFAULT):
            data.qpos[model.joint(joint).qposadr[0]] = q
        run(name, model, data, seconds, targets, force)
    model = compiled(brick(mujoco.MjSpec()), level, 0.5)
    data = mujoco.MjData(model)
    data.qpos[:7] = [0.0, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0]
    data.qvel[:6] = [2.0, 0.0, 0.0, 0.0, 0.0, 3.0]
    run("slide", model, data, 1.0, hold, no_force)


if __name__ == "__main__":
    main()
