"""ANYmal D with bar and hand in MuJoCo, walked by exported policies: the other engine's side of the evaluation.

Robots, gains, motor limits, periods and the harness come from the metadata of the two ONNX files; shapes and masses of
the robot from assets/anymal_d.urdf. Nothing of our simulation is used but where robots are randomized: what was drawn
for each comes with the plan. What both engines must agree on to compare at all is written in docs/notation.md:
observation layouts, frames, the force of the hand constant in the heading frame.

Settings that are MuJoCo's own:

- TIME_STEP 2 ms. The motor law is applied explicitly at the state before each step: kd dt / armature is 0.07, and 0.53 on
  the slope of the motor's speed-torque limit.
- Contacts: the time constant (solref) is 5 ms, critically damped; elliptic friction cones with impratio 10, Newton solver.
- Gravity, joint limits and armature as in the robot's description; no joint friction and no passive damping.
- No tree of bounding boxes over a body's shapes: MuJoCo builds it about the inertial frame it compiled, and robots whose
  mass is exchanged afterwards would not feel the ground with all of their trunk.
- A robot whose state is no number any more has fallen; MuJoCo would put it back to the origin.
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


# What differs between robots, and what MuJoCo derives from it.
CONSTANTS = (
    "body_mass",
    "body_subtreemass",
    "body_inertia",
    "body_ipos",
    "body_iquat",
    "body_invweight0",
    "dof_invweight0",
    "geom_pos",
    "geom_friction",
)


class Walker:
    """Robots under velocity commands and hand forces. One model serves all; what differs between robots is exchanged
    before each one's turn."""

    def __init__(self, locomotion, supervisor, ground, robots, settings):
        self.locomotion, self.supervisor, self.ground, self.settings = locomotion, supervisor, ground, settings
        self.model = compiled(locomotion, harness_of(supervisor), ground, settings)
        self.data = [mujoco.MjData(self.model) for _ in range(robots)]
        joints = [self.model.joint(name) for name in locomotion.text("joint_names")]
        self.position_at = np.array([joint.qposadr[0] for joint in joints])
        self.rate_at = np.array([joint.dofadr[0] for joint in joints])
        self.default = locomotion.numbers("default_joint_pos")
        self.hand = np.tile(supervisor.numbers("hand_position"), (robots, 1))
        self.constants = [{}] * robots
        self.motor = Motor(locomotion)
        base = self.model.body("base").id
        self.base_geoms = np.flatnonzero((self.model.geom_bodyid == base) & (self.model.geom_contype == 1))
        self.base_geoms = np.setdiff1d(self.base_geoms, [self.model.geom("hand").id])
        period = locomotion.number("control_period")
        self.substeps = substeps(period, settings.time_step)
        self.decision_steps = round(supervisor.number("control_period") / period)
        self.action = np.zeros((robots, len(joints)))
        self.command = np.zeros((robots, 3))
        self.fallen = np.zeros(robots, bool)
        self.step = 0

    def become(self, friction, base_inertia=None, hand_position=None):
        """Gives every robot its friction and, where robots differ, its own base with harness (mass, first moment, xx yy zz
        xy xz yz about the base origin) and its hand."""
        if base_inertia is not None:
            self.hand = hand_position.astype(float)
        self.constants = []
        for robot, mu in enumerate(friction):
            self.model.geom_friction[:, 0] = mu
            if base_inertia is not None:
                self.load(base_inertia[robot].astype(float), self.hand[robot])
            self.constants.append({name: getattr(self.model, name).copy() for name in CONSTANTS})

    def load(self, inertia, hand):
        model, base = self.model, self.model.body("base").id
        mass, center = inertia[0], inertia[1:4] / inertia[0]
        xx, yy, zz, xy, xz, yz = inertia[4:]
        about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        about_center = about_origin - mass * (center @ center * np.eye(3) - np.outer(center, center))
        moments, axes = np.linalg.eigh(about_center)
        axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
        model.body_mass[base], model.body_ipos[base], model.body_inertia[base] = mass, center, moments
        mujoco.mju_mat2Quat(model.body_iquat[base], axes.ravel())
        model.geom_pos[model.geom("hand").id] = hand
        mujoco.mj_setConst(model, mujoco.MjData(model))

    def turn_of(self, robot):
        for name, values in self.constants[robot].items():
            getattr(self.model, name)[:] = values

    def place(self, start, velocity, joint_position):
        """At x, y, z and heading of the base; linear and angular velocity along its axes; joints in the policy's order."""
        for robot, data in enumerate(self.data):
            (x, y, z, yaw), moving = start[robot], velocity[robot].astype(float)
            data.qpos[:7] = [x, y, z, np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
            data.qpos[self.position_at] = joint_position[robot]
            c, s = np.cos(yaw), np.sin(yaw)
            data.qvel[:3] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ moving[:3]
            data.qvel[3:6] = moving[3:]
            self.turn_of(robot)
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
                self.turn_of(robot)
                self.simulate(data, target[robot], force[robot], self.hand[robot])
                self.fallen[robot] = self.has_fallen(data)
        self.step += 1

    def simulate(self, data, target, force, hand):
        applied, rotation = data.qfrc_applied, np.empty(9)
        r = rotation.reshape(3, 3)
        for _ in range(self.substeps):
            applied[self.rate_at] = self.motor(target, data.qpos[self.position_at], data.qvel[self.rate_at])
            if force.any():
                mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
                c, s = r[:2, 0] / np.hypot(r[0, 0], r[1, 0])
                world = np.array([c * force[0] - s * force[1], s * force[0] + c * force[1], force[2]])
                applied[:3] = world  # along the world's axes,
                applied[3:6] = np.cross(hand, r.T @ world)  # and about the base's
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


def substeps(period, time_step):
    count = round(period / time_step)
    if count < 1 or abs(count * time_step - period) > 1e-9:
        raise ValueError(f"time_step is {time_step:g}, must go into the control period of {period:g} s")
    return count


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
        geom.condim = 3
        geom.solref[:2] = settings.time_constant, 1.0
    option = spec.option
    option.timestep = settings.time_step
    option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, settings.impratio
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE | mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return spec.compile()


class HeightField:
    """Our ground: cells with a height for each of their corners, row by row along x, so that neighbors may differ by a step.

    MuJoCo's height fields are continuous. Each of our cells becomes FINE x FINE of its; the vertices of a border take the
    higher of both sides, so a riser becomes a ramp of a FINE-th of a cell, 25 mm, before the tread it leads to.
    """

    FINE = 4

    def __init__(self, cells, x, y, cell_size):
        self.cells, self.origin, self.size = cells, np.array([x, y]), cell_size

    def height(self, x, y):
        """Both triangles of a cell meet along the diagonal from its first to its last corner."""
        rows, columns = self.cells.shape[:2]
        u, v = (x - self.origin[0]) / self.size, (y - self.origin[1]) / self.size
        column, row = (np.clip(w.astype(int), 0, n - 1) for w, n in ((u, columns), (v, rows)))
        u, v = np.clip(u - column, 0.0, 1.0), np.clip(v - row, 0.0, 1.0)
        return in_cell(self.cells[row, column], u, v)

    def vertices(self):
        rows, columns = self.cells.shape[:2]
        fine = self.FINE
        heights = np.full((rows * fine + 1, columns * fine + 1), -np.inf, np.float32)
        for i in range(fine + 1):
            for k in range(fine + 1):
                place = heights[k : k + (rows - 1) * fine + 1 : fine, i : i + (columns - 1) * fine + 1 : fine]
                np.maximum(place, in_cell(self.cells, np.float32(i / fine), np.float32(k / fine)), out=place)
        return heights

    def add(self, spec):
        heights = self.vertices()
        low, high = float(heights.min()), float(heights.max())
        rows, columns = heights.shape
        half = np.array([columns - 1, rows - 1]) * self.size / self.FINE / 2
        size = [*half, max(high - low, 1e-3), 1.0]
        spec.add_hfield(name="ground", nrow=rows, ncol=columns, size=size, userdata=(heights - low).ravel())
        place = [*(self.origin + half), low]
        spec.worldbody.add_geom(name="ground", type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="ground", pos=place)


def in_cell(cell, u, v):
    corner = np.where(u >= v, cell[..., 1], cell[..., 2])
    return cell[..., 0] + np.maximum(u, v) * (corner - cell[..., 0]) + np.minimum(u, v) * (cell[..., 3] - corner)


class Level:
    """Flat ground."""

    def add(self, spec):
        spec.worldbody.add_geom(name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])

    def height(self, x, y):
        return np.zeros(np.broadcast(x, y).shape)
