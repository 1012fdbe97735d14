"""ANYmal D with bar and hand in MuJoCo, walked by exported policies: the other engine's side of the evaluation.

Robots, gains, motor limits, periods and the harness come from the metadata of the two ONNX files; shapes and masses of
the robot from assets/anymal_d.urdf. Nothing of our simulation is used. What both engines must agree on to compare at
all is written in docs/notation.md: observation layouts, frames, the force of the hand constant in the heading frame.

Settings that are MuJoCo's own:

- TIME_STEP 2 ms. The motor law is applied explicitly at the state before each step: kd dt / armature is 0.07, and 0.53 on
  the slope of the motor's speed-torque limit.
- Contacts: SOLREF's time constant is 5 ms, critically damped; elliptic friction cones with impratio 10, Newton solver.
- Gravity, joint limits and armature as in the robot's description; no joint friction and no passive damping.
"""

import dataclasses

import mujoco
import numpy as np
import onnxruntime
from mujoco_robots import HAND_RADIUS, Harness, description

TIME_STEP, TIME_CONSTANT, IMPRATIO = 0.002, 0.005, 10.0
FALL_FORCE, FALLEN_COSINE = 1.0, 0.342  # crates/tasks/src/simulation: base contact above 1 N, or tilted beyond 70 degrees
SCAN_AHEAD, SCAN_LEFT = np.meshgrid(np.arange(17) * 0.1 - 0.8, np.arange(11) * 0.1 - 0.5)  # ahead is the fast index


class Policy:
    """An ONNX file and what it says of itself."""

    def __init__(self, path):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        self.input = self.session.get_inputs()[0].name
        self.metadata = self.session.get_modelmeta().custom_metadata_map

    def __call__(self, observations):
        return self.session.run(None, {self.input: observations.astype(np.float32)})[0]

    def text(self, name):
        return self.metadata[name].split(",")

    def numbers(self, name):
        return np.array([float(part) for part in self.text(name)])

    def number(self, name):
        (value,) = self.numbers(name)
        return value


@dataclasses.dataclass
class Settings:
    """MuJoCo's own choices; defaults are explained above."""

    time_step: float = TIME_STEP
    time_constant: float = TIME_CONSTANT
    impratio: float = IMPRATIO
    friction: float = 1.0


class Walker:
    """Robots under velocity commands and hand forces; all alike, each with a state of its own."""

    def __init__(self, locomotion, supervisor, ground, robots, settings):
        self.locomotion, self.supervisor, self.ground, self.settings = locomotion, supervisor, ground, settings
        self.model = compiled(locomotion, harness_of(supervisor), ground, settings)
        self.data = [mujoco.MjData(self.model) for _ in range(robots)]
        joints = [self.model.joint(name) for name in locomotion.text("joint_names")]
        self.position_at = np.array([joint.qposadr[0] for joint in joints])
        self.rate_at = np.array([joint.dofadr[0] for joint in joints])
        self.default = locomotion.numbers("default_joint_pos")
        self.hand = supervisor.numbers("hand_position")
        self.motor = Motor(locomotion)
        base = self.model.body("base").id
        self.base_geoms = np.flatnonzero((self.model.geom_bodyid == base) & (self.model.geom_contype == 1))
        self.base_geoms = np.setdiff1d(self.base_geoms, [self.model.geom("hand").id])
        period = locomotion.number("control_period")
        self.substeps = round(period / settings.time_step)
        self.decision_steps = round(supervisor.number("control_period") / period)
        self.action = np.zeros((robots, len(joints)))
        self.command = np.zeros((robots, 3))
        self.fallen = np.zeros(robots, bool)
        self.step = 0

    def place(self, start):
        """Standing in the default pose at x, y, height of the base, heading, one row a robot."""
        for data, (x, y, z, yaw) in zip(self.data, start):
            data.qpos[:7] = [x, y, z, np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
            data.qpos[self.position_at] = self.default
            mujoco.mj_forward(self.model, data)

    def motion(self):
        """Base velocities along the base's axes, gravity's direction in them, position, heading."""
        rotation = np.empty((len(self.data), 3, 3))
        for data, r in zip(self.data, rotation):
            mujoco.mju_quat2Mat(r.reshape(9), data.qpos[3:7])
        linear = np.array([data.qvel[:3] for data in self.data])
        return {
            "linear": np.einsum("nji,nj->ni", rotation, linear),
            "angular": np.array([data.qvel[3:6] for data in self.data]),
            "gravity": -rotation[:, 2, :],
            "position": np.array([data.qpos[:3] for data in self.data]),
            "yaw": np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]),
        }

    def observe(self, motion, middle, previous):
        """Both layouts: what differs are the force or command in the middle and the network's own last output."""
        joint = np.array([data.qpos[self.position_at] for data in self.data]) - self.default
        rate = np.array([data.qvel[self.rate_at] for data in self.data])
        cos, sin = np.cos(motion["yaw"])[:, None], np.sin(motion["yaw"])[:, None]
        ahead, left = SCAN_AHEAD.ravel(), SCAN_LEFT.ravel()
        x, y, z = motion["position"].T[:, :, None]
        height = self.ground.height(x + cos * ahead - sin * left, y + sin * ahead + cos * left)
        scan = np.clip(z - height - 0.5, -1.0, 1.0)
        parts = [motion["linear"], motion["angular"], motion["gravity"], middle, joint, rate, previous, scan]
        return np.concatenate(parts, axis=1)

    def control_step(self, force):
        """One control step under forces of the hand, heading frame, one row a robot."""
        motion = self.motion()
        if self.step % self.decision_steps == 0:
            self.command = self.supervisor(self.observe(motion, force, self.command)).astype(float)
        self.action = self.locomotion(self.observe(motion, self.command, self.action)).astype(float)
        target = self.default + self.locomotion.number("action_scale") * self.action
        for robot, data in enumerate(self.data):
            if not self.fallen[robot]:
                self.simulate(data, target[robot], force[robot])
                self.fallen[robot] = self.has_fallen(data)
        self.step += 1

    def simulate(self, data, target, force):
        applied, rotation = data.qfrc_applied, np.empty(9)
        r = rotation.reshape(3, 3)
        for _ in range(self.substeps):
            applied[self.rate_at] = self.motor(target, data.qpos[self.position_at], data.qvel[self.rate_at])
            if force.any():
                mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
                c, s = r[:2, 0] / np.hypot(r[0, 0], r[1, 0])
                world = np.array([c * force[0] - s * force[1], s * force[0] + c * force[1], force[2]])
                applied[:3] = world  # along the world's axes,
                applied[3:6] = np.cross(self.hand, r.T @ world)  # and about the base's
            else:
                applied[:6] = 0.0
            mujoco.mj_step(self.model, data)

    def has_fallen(self, data):
        upright = 1.0 - 2.0 * (data.qpos[4] ** 2 + data.qpos[5] ** 2)
        if not np.isfinite(data.qpos).all() or upright < FALLEN_COSINE:
            return True
        force = np.empty(6)
        for i in np.flatnonzero(np.isin(data.contact.geom, self.base_geoms).any(axis=1)):
            mujoco.mj_contactForce(self.model, data, i, force)
            if force[0] > FALL_FORCE:
                return True
        return False


class Motor:
    """PD servos behind a DC motor's speed-torque limit, as the metadata's `actuator` says."""

    def __init__(self, locomotion):
        (kind,) = locomotion.text("actuator")
        assert kind == "dc_motor", f"actuator is {kind}, must be dc_motor"
        names = ("joint_stiffness", "joint_damping", "joint_effort_limit", "saturation_torque", "velocity_limit")
        self.stiffness, self.damping, self.effort, self.saturation, self.speed = map(locomotion.numbers, names)

    def __call__(self, target, q, qd):
        servo = self.stiffness * (target - q) - self.damping * qd
        slowed = self.saturation / self.speed * qd
        upper = np.minimum(np.maximum(self.saturation - slowed, 0.0), self.effort)
        lower = np.maximum(np.minimum(-self.saturation - slowed, 0.0), -self.effort)
        return np.minimum(np.maximum(servo, lower), upper)


def harness_of(supervisor):
    return Harness(
        bar_start=supervisor.numbers("bar_start"),
        bar_length=supervisor.number("bar_length"),
        bar_mass=supervisor.number("bar_mass"),
        hand=supervisor.numbers("hand_position"),
        hand_mass=supervisor.number("hand_mass"),
    )


def compiled(locomotion, harness, ground, settings):
    spec = description("anymal_d", harness)
    for name, armature in zip(locomotion.text("joint_names"), locomotion.numbers("joint_armature")):
        spec.joint(name).armature = armature
    spec.body("base").add_geom(name="hand", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[HAND_RADIUS, 0, 0], pos=harness.hand)
    ground.add(spec)
    for geom in spec.geoms:
        # Robots touch the ground and not themselves, as in ours.
        geom.contype, geom.conaffinity = (0, 1) if geom.name == "ground" else (1, 0)
        geom.condim, geom.friction = 3, [settings.friction, 0.0, 0.0]
        geom.solref[:2] = settings.time_constant, 1.0
    option = spec.option
    option.timestep = settings.time_step
    option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, settings.impratio
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    return spec.compile()


class Level:
    """Flat ground."""

    def add(self, spec):
        spec.worldbody.add_geom(name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])

    def height(self, x, y):
        return np.zeros(np.broadcast(x, y).shape)
