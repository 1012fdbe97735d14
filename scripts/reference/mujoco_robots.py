"""Our robots in MuJoCo, and MuJoCo's quantities in our conventions.

MuJoCo reads the very URDF files our own reader does; it gets a free joint, our armature and, for ANYmal D, the harness
as bodies of stated inertia, and merges what is fixed itself. No contacts, no joint limits, no damping:
M qacc + bias = forces, and nothing else.

What differs from MuJoCo, and is turned here into our conventions (docs/notation.md):

- Order: base angular, base linear, joints breadth-first with siblings by name. MuJoCo: linear, angular, joints
  depth-first.
- Axes of base quantities: the base's. MuJoCo's free joint has its linear velocity along the world's, its angular
  velocity along the base's.
- Base linear acceleration: that of the base origin in the inertial world, its components along the base's axes. It is
  R' d(v_world)/dt, not the derivative of the base-frame components, which is less by omega x v.

With T the constant-in-this-instant map from our velocities to MuJoCo's, qvel = T v and qacc = T a, so that
M = T' M_mujoco T and bias = T' bias_mujoco.
"""

import dataclasses
import pathlib
import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).parents[2]
OWN = ROOT / "crates" / "robot" / "tests" / "robots"
# Name and description of every robot.
ROBOTS = {"anymal_d": ROOT / "assets" / "anymal_d.urdf"} | {
    name: OWN / f"{name}.urdf" for name in ("small_quadruped", "large_quadruped", "biped", "chain")
}
BASE = 1  # index of the base among MuJoCo's bodies; the world is 0



@dataclasses.dataclass
class Harness:
    """A bar on the base and the hand at its end; the nominal one is crates/robot/src/harness.rs, Harness::default."""

    bar_start: np.ndarray = dataclasses.field(default_factory=lambda: np.array([-0.45, 0.0, 0.10]))
    bar_length: float = 0.8
    bar_mass: float = 0.5
    # Straight back and up to 0.315 m.
    hand: np.ndarray = dataclasses.field(
        default_factory=lambda: np.array([-0.45 - np.sqrt(0.8**2 - 0.215**2), 0.0, 0.315])
    )
    hand_mass: float = 1.5


HAND = Harness().hand
HAND_RADIUS = 0.04


class Robot:
    """A robot compiled by MuJoCo, with its joints in our order."""

    def __init__(self, name):
        elements = ElementTree.parse(ROBOTS[name]).getroot().findall("joint")
        self.elements = {joint.get("name"): joint for joint in elements if joint.get("type") != "fixed"}
        self.model = compiled(name)
        self.data = mujoco.MjData(self.model)
        self.joints = breadth_first(self.model)
        assert self.model.nv == 6 + len(self.elements), "one degree of freedom a joint, and six"
        assert self.model.nbody == 2 + len(self.elements), "what is fixed must have been merged"
        # Where a force from outside acts, base frame: the hand of a harness, else the base origin.
        self.force_point = HAND if name == "anymal_d" else np.zeros(3)

    def set_state(self, quaternion, linear, angular, position, velocity):
        """Takes velocities of the base along its axes, joints in our order; fills what depends on positions."""
        model, data = self.model, self.data
        data.qpos[:3], data.qpos[3:7] = 0.0, quaternion
        data.qvel[:3], data.qvel[3:6] = rotation(quaternion) @ linear, angular
        for name, q, qd in zip(self.joints, position, velocity):
            joint = model.joint(name)
            data.qpos[joint.qposadr[0]], data.qvel[joint.dofadr[0]] = q, qd
        mujoco.mj_fwdPosition(model, data)

    def apply(self, torque, force):
        """Joint torques, and a force at `force_point` that is given in the heading frame."""
        model, data = self.model, self.data
        r = rotation(data.qpos[3:7])
        c, s = r[:2, 0] / np.linalg.norm(r[:2, 0])
        world = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ force
        data.qfrc_applied[:] = 0.0
        point = data.qpos[:3] + r @ self.force_point
        mujoco.mj_applyFT(model, data, world, np.zeros(3), point, BASE, data.qfrc_applied)
        for name, value in zip(self.joints, torque):
            data.qfrc_applied[model.joint(name).dofadr[0]] += value

    def to_mujoco(self):
        """The map from our velocities to MuJoCo's, in the state at hand."""
        turn = np.zeros((self.model.nv, self.model.nv))
        turn[3:6, 0:3], turn[0:3, 3:6] = np.eye(3), rotation(self.data.qpos[3:7])
        for j, name in enumerate(self.joints):
            turn[self.model.joint(name).dofadr[0], 6 + j] = 1.0
        return turn

    def base_inertia(self):
        """Mass, first moment and rotational inertia (xx, yy, zz, xy, xz, yz) of the base about its origin."""
        body = self.model.body(BASE)
        mass, center = body.mass[0], body.ipos
        turn = rotation(body.iquat)
        about_center = turn @ np.diag(body.inertia) @ turn.T
        tensor = about_center + mass * (center @ center * np.eye(3) - np.outer(center, center))
        entries = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        return np.array([mass, *(mass * center), *(tensor[i, j] for i, j in entries)])


def description(name, harness=Harness()):
    """The robot as an editable specification; mint_trajectories.py and mujoco_walker.py put it on a ground."""
    spec = mujoco.MjSpec.from_string(ROBOTS[name].read_text())
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.compiler.fusestatic = True
    base = spec.worldbody.first_body()
    base.add_freejoint()
    if name == "anymal_d":
        add_harness(base, harness)
    # The attribute is ours: MuJoCo's URDF reader passes over it.
    for joint in ElementTree.parse(ROBOTS[name]).getroot().findall("joint"):
        dynamics = joint.find("dynamics")
        if joint.get("type") != "fixed" and dynamics is not None:
            spec.joint(joint.get("name")).armature = float(dynamics.get("armature"))
    return spec


def compiled(name):
    """The model: nothing but the equation of motion."""
    spec = description(name)
    flags = mujoco.mjtDisableBit
    spec.option.disableflags = flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_CONSTRAINT
    return spec.compile()


def add_harness(base, harness):
    # A thin rod's moment about its own axis is zero; its z axis is turned onto the bar.
    rod = harness.bar_mass * harness.bar_length**2 / 12
    back, _, rise = harness.hand - harness.bar_start
    angle = np.arctan2(back, rise)
    along = [np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]
    add_inertia(base, "bar", (harness.bar_start + harness.hand) / 2, along, harness.bar_mass, [rod, rod, 0.0])
    ball = 0.4 * harness.hand_mass * HAND_RADIUS**2
    add_inertia(base, "hand", harness.hand, [1.0, 0.0, 0.0, 0.0], harness.hand_mass, [ball] * 3)


def add_inertia(base, name, position, quaternion, mass, inertia):
    body = base.add_body(name=name, pos=position, quat=quaternion)
    body.mass, body.inertia, body.ipos, body.explicitinertial = mass, inertia, np.zeros(3), True


def breadth_first(model):
    """Names of the joints in our order; every body but the world and the base has one."""
    order, parents = [], [BASE]
    while parents:
        parent = parents.pop(0)
        bodies = [b for b in range(1, model.nbody) if model.body_parentid[b] == parent]
        siblings = sorted((model.joint(model.body_jntadr[b]).name, b) for b in bodies)
        order += [name for name, _ in siblings]
        parents += [body for _, body in siblings]
    return order


def rotation(quaternion):
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
