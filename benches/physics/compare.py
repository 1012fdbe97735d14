"""Steps of our engine and of MuJoCo, the same scenes, one core each, one after the other, several rounds.

Usage: python3 benches/physics/compare.py [ROUNDS]

Needs the packages mujoco and numpy. Robot and harness are read as in scripts/reference; scenes are those of scene.rs,
written again. MuJoCo steps in its own C loop (mujoco.rollout, one thread), in double precision, which is the only one it
has, 5 ms like ours. It runs with each of SETTINGS, and the fastest one counts:

- "default": Newton, tolerance 1e-8, elliptic cones. It needs one or two iterations, so there is little to save.
- "fast": pyramidal cones, at most four iterations of six line-search steps, tolerance 1e-4, no warnings, no sensors, no
  energy; the kind of setting used where physics is stepped for learning.

Both integrate the servo's damping implicitly. Robots do not touch themselves, only the ground; on stairs that is made of
boxes, which MuJoCo collides faster than a height field. A line is a scene: microseconds a robot-step, median over rounds,
and the median of the rounds' ratios.
"""

import json
import pathlib
import statistics
import subprocess
import sys
import time

import mujoco
import numpy as np
from mujoco import rollout

ROOT = pathlib.Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "scripts" / "reference"), str(ROOT / "benches" / "shared")]
import built  # noqa: E402
from mujoco_robots import HAND, HAND_RADIUS, description  # noqa: E402

CELL, CELLS, STANCE, STEPS, TIME_STEP, DECIMATION = 0.1, 80, 0.5885, 400, 0.005, 4
JOINTS = [f"{leg}_{drive}" for drive in ("HAA", "HFE", "KFE") for leg in ("LF", "LH", "RF", "RH")]
DEFAULT = np.array([0, 0, 0, 0, 0.4, -0.4, 0.4, -0.4, -0.8, 0.8, -0.8, 0.8])
# Scene of ours, robots of ours and of MuJoCo (whose cost of a robot does not depend on their number).
ROBOTS = 1024
MUJOCO_ROBOTS = 32
SCENES = ["free", "flat", "rough_feet", "rough", "stairs", "herd"]
SETTINGS = ["default", "fast"]


def level(column, row):
    return 0.0 * column


def rough(column, row):
    return (column * 7 + row * 3 + column * row * 5) % 11 % 5 * 0.02


def stairs(column, row):
    inward = np.minimum(np.minimum(column, CELLS - 1 - column), np.minimum(row, CELLS - 1 - row))
    return np.minimum(np.where(inward < 10, 0, (inward - 10) // 3 + 1), 7) * 0.14


HEIGHT = {"rough_feet": rough, "rough": rough, "herd": rough, "stairs": stairs}


def model_of(scene, setting):
    spec = description("anymal_d")
    spec.body("base").add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[HAND_RADIUS, 0, 0], pos=HAND)
    for geom in list(spec.geoms):
        if scene == "rough_feet" and abs(geom.size[0] - 0.031455) > 1e-6:
            spec.delete(geom)
        else:
            geom.contype, geom.conaffinity = 1, 0
    add_ground(spec, scene)
    for geom in spec.geoms:
        geom.condim, geom.friction = 3, [1.0, 0.0, 0.0]
    for name in JOINTS:
        servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=80.0, kv=2.0)
        servo.forcelimited, servo.forcerange = True, [-80.0, 80.0]
    option = spec.option
    option.timestep, option.integrator = TIME_STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    if setting == "default":
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    else:
        option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
        option.iterations, option.ls_iterations, option.tolerance = 4, 6, 1e-4
        option.disableflags = mujoco.mjtDisableBit.mjDSBL_SENSOR
    return spec.compile()


def add_ground(spec, scene):
    world = spec.worldbody
    if scene == "stairs":
        for ring in range(8):
            half = 4.0 - (1.0 + 0.3 * (ring - 1) if ring else 0.0)
            thick = 0.07 if ring else 0.5
            geom = world.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[half, half, thick])
            geom.pos = [0, 0, ring * 0.14 - thick]
            geom.contype, geom.conaffinity = 0, 1
        return
    if scene in ("free", "flat"):
        geom = world.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
    else:
        column, row = np.meshgrid(np.arange(CELLS + 1), np.arange(CELLS + 1))
        heights = rough(column, row)
        spec.add_hfield(
            name="rough", nrow=CELLS + 1, ncol=CELLS + 1, size=[4.0, 4.0, heights.max(), 1.0],
            userdata=(heights / heights.max()).ravel(),
        )
        geom = world.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="rough")
    geom.contype, geom.conaffinity = 0, 1


def starts(scene, count):
    robot = np.arange(count)
    x, y = (-2.5 + 5.0 * (robot * step % 1.0) for step in (0.618034, 0.414214))
    if scene not in HEIGHT:
        return x, y, np.full(count, STANCE + (1000.0 if scene == "free" else 0.0))
    top = np.zeros(count)
    for i in robot:
        cells = [np.arange(int((at[i] - 0.5 + 4) / CELL), int((at[i] + 0.5 + 4) / CELL) + 1) for at in (x, y)]
        top[i] = HEIGHT[scene](*np.meshgrid(*cells)).max()
    return x, y, top + STANCE


def trot(time):
    phase = 2 * np.pi * (1.5 * time + 0.5 * np.array([0, 1, 1, 0]))
    lift = np.array([1, -1, 1, -1]) * 0.35 * np.maximum(np.sin(phase), 0.0)
    return DEFAULT + np.concatenate([np.zeros(4), lift, -2.0 * lift])


class Mujoco:
    """A pass of MuJoCo, ready to run."""

    def __init__(self, scene, setting):
        self.model = model_of(scene, setting)
        self.data = mujoco.MjData(self.model)
        x, y, z = starts(scene, MUJOCO_ROBOTS)
        states = []
        for i in range(MUJOCO_ROBOTS):
            data = mujoco.MjData(self.model)
            data.qpos[:7] = [x[i], y[i], z[i], 1, 0, 0, 0]
            for name, q in zip(JOINTS, DEFAULT):
                data.qpos[self.model.joint(name).qposadr[0]] = q
            state = np.zeros(mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
            mujoco.mj_getState(self.model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
            states.append(state)
        self.states = np.array(states)
        targets = [trot(step // DECIMATION * DECIMATION * TIME_STEP) for step in range(STEPS)]
        self.control = np.tile(np.array(targets), (MUJOCO_ROBOTS, 1, 1))
        shape = (MUJOCO_ROBOTS, STEPS)
        self.out = np.empty((*shape, self.states.shape[1]))
        self.sensors = np.empty((*shape, self.model.nsensordata))

    def run(self, rollouts):
        start = time.perf_counter()
        rollouts.rollout(
            self.model, self.data, self.states, control=self.control, nstep=STEPS,
            state=self.out, sensordata=self.sensors, skip_checks=False,
        )
        return (time.perf_counter() - start) * 1e6 / (MUJOCO_ROBOTS * STEPS)

    def upright(self):
        """Share of robots whose base is less than 60 degrees from level at the end, and its mean height."""
        w, x, y, z = self.out[:, -1, 4:8].T
        return np.mean(1 - 2 * (x * x + y * y) > 0.5), self.out[:, -1, 3].mean()


def ours(binary, scene):
    name, robots = ("rough", 4096) if scene == "herd" else (scene, ROBOTS)
    command = [binary, "--scene", name, "--robots", str(robots), "--seconds", "1", "--json"]
    return json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)["us_median"]


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    binary = built.bench("physics")
    print(f"MuJoCo {mujoco.__version__}, one core; {rounds} rounds")
    print(f"{'scene':<12} {'ours':>8} {'MuJoCo':>8} {'setting':>8} {'ratio':>7}   upright, height at the end (MuJoCo)")
    with rollout.Rollout(nthread=0) as rollouts:
        for scene in SCENES:
            theirs = {setting: Mujoco(scene, setting) for setting in SETTINGS}
            us, them = [], {setting: [] for setting in SETTINGS}
            for _ in range(rounds):
                us.append(ours(binary, scene))
                for setting in SETTINGS:
                    them[setting].append(theirs[setting].run(rollouts))
            best = min(SETTINGS, key=lambda setting: statistics.median(them[setting]))
            ratio = statistics.median(b / a for a, b in zip(us, them[best]))
            upright, height = theirs[best].upright()
            print(
                f"{scene:<12} {statistics.median(us):8.3f} {statistics.median(them[best]):8.2f} {best:>8} {ratio:7.1f}"
                f"   {upright:.2f} {height:.2f}", flush=True,
            )


if __name__ == "__main__":
    main()
