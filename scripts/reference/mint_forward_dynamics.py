"""Writes accelerations of ANYmal D with the nominal harness, computed by MuJoCo in double precision.

Usage: python3 mint_forward_dynamics.py > crates/physics/tests/golden/forward_dynamics.txt

Needs the packages mujoco and numpy; the output names the MuJoCo version that made it. MuJoCo reads our own
assets/anymal_d.urdf, gets a free joint, our armature and the harness as bodies of stated inertia, and merges what is
fixed to the base itself. No contacts, no joint limits, no damping: M qacc + bias = forces, and nothing else.

What differs from MuJoCo, and is turned here into our conventions (docs/notation.md):

- Order: base angular, base linear, joints LF LH RF RH for HAA, HFE, KFE. MuJoCo: linear, angular, joints depth-first.
- Axes of base quantities: the base's. MuJoCo's free joint has its linear velocity along the world's, its angular
  velocity along the base's.
- Base linear acceleration: that of the base origin in the inertial world, its components along the base's axes. It is
  R' d(v_world)/dt, not the derivative of the base-frame components, which is less by omega x v.

With T the constant-in-this-instant map from our velocities to MuJoCo's, qvel = T v and qacc = T a, so that
M = T' M_mujoco T and bias = T' bias_mujoco.
"""

import pathlib
import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np

URDF = pathlib.Path(__file__).parents[2] / "assets" / "anymal_d.urdf"
JOINTS = [f"{leg}_{drive}" for drive in ("HAA", "HFE", "KFE") for leg in ("LF", "LH", "RF", "RH")]
DEFAULT = np.array([0, 0, 0, 0, 0.4, -0.4, 0.4, -0.4, -0.8, 0.8, -0.8, 0.8])
STATES = 256
WITH_MATRIX = 8  # of these states the mass matrix and the bias force, too
SEED = 20

# The nominal harness: crates/robot/src/harness.rs, Harness::default.
BAR_START = np.array([-0.45, 0.0, 0.10])
BAR_LENGTH, BAR_MASS = 0.8, 0.5
HAND_HEIGHT, HAND_MASS, HAND_RADIUS = 0.315, 1.5, 0.04
RISE = HAND_HEIGHT - BAR_START[2]
HAND = BAR_START + np.array([-np.sqrt(BAR_LENGTH**2 - RISE**2), 0.0, RISE])


def description():
    """ANYmal D with the harness as an editable specification; other scripts put it on a ground."""
    spec = mujoco.MjSpec.from_string(URDF.read_text())
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.compiler.fusestatic = True
    base = spec.body("base")
    base.add_freejoint()
    # A thin rod's moment about its own axis is zero; its z axis is turned onto the bar.
    rod = BAR_MASS * BAR_LENGTH**2 / 12
    angle = np.arctan2(HAND[0] - BAR_START[0], RISE)
    along = [np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]
    add_inertia(base, "bar", (BAR_START + HAND) / 2, along, BAR_MASS, [rod, rod, 0.0])
    ball = 0.4 * HAND_MASS * HAND_RADIUS**2
    add_inertia(base, "hand", HAND, [1.0, 0.0, 0.0, 0.0], HAND_MASS, [ball] * 3)
    # The attribute is ours: MuJoCo's URDF reader passes over it.
    for joint in ElementTree.parse(URDF).getroot().findall("joint"):
        spec.joint(joint.get("name")).armature = float(joint.find("dynamics").get("armature"))
    return spec


def robot():
    """The model, compiled by MuJoCo: nothing but the equation of motion."""
    spec = description()
    flags = mujoco.mjtDisableBit
    spec.option.disableflags = flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_CONSTRAINT
    return spec.compile()


def add_inertia(base, name, position, quaternion, mass, inertia):
    body = base.add_body(name=name, pos=position, quat=quaternion)
    body.mass, body.inertia, body.ipos, body.explicitinertial = mass, inertia, np.zeros(3), True


def base_inertia(model):
    """Mass, first moment and rotational inertia (xx, yy, zz, xy, xz, yz) of the base about its origin."""
    body = model.body("base")
    mass, center = body.mass[0], body.ipos
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, body.iquat)
    turn = turn.reshape(3, 3)
    about_center = turn @ np.diag(body.inertia) @ turn.T
    tensor = about_center + mass * (center @ center * np.eye(3) - np.outer(center, center))
    return [mass, *(mass * center), *(tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))]


def draw(random, low, high, grid):
    """Numbers on a binary grid: short in decimal, and the same in single as in double precision."""
    return np.round(random.uniform(low, high) / grid) * grid


def forces(model, data, rotation, torque, hand_force):
    """Joint torques and the force at the hand, which is given in the heading frame."""
    forward = np.array([rotation[0, 0], rotation[1, 0], 0.0])
    forward /= np.linalg.norm(forward)
    left = np.array([-forward[1], forward[0], 0.0])
    world = hand_force[0] * forward + hand_force[1] * left + hand_force[2] * np.array([0.0, 0.0, 1.0])
    data.qfrc_applied[:] = 0.0
    point = data.qpos[:3] + rotation @ HAND
    mujoco.mj_applyFT(model, data, world, np.zeros(3), point, model.body("base").id, data.qfrc_applied)
    for name, value in zip(JOINTS, torque):
        data.qfrc_applied[model.joint(name).dofadr[0]] += value


def line(key, values):
    print(key, *(f"{int(v)}" if v == int(v) else repr(float(v)) for v in np.ravel(values)))


def main():
    model = robot()
    assert model.nv == 18 and model.nbody == 14, "bar and hand must have been merged into the base"
    data = mujoco.MjData(model)
    random = np.random.default_rng(SEED)
    print(f"# ANYmal D with the nominal harness: accelerations by MuJoCo {mujoco.__version__}, double precision.")
    print("# Made by scripts/reference/mint_forward_dynamics.py, which explains frames and orders.")
    line("total_mass", model.body_mass.sum())
    line("base_inertia", base_inertia(model))
    for index in range(STATES):
        print("state", index)
        state(model, data, random, index < WITH_MATRIX)


def state(model, data, random, with_matrix):
    quaternion = random.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    linear = draw(random, [-2.0] * 3, [2.0] * 3, 1 / 256)
    angular = draw(random, [-4.0] * 3, [4.0] * 3, 1 / 256)
    position = draw(random, DEFAULT - 1.0, DEFAULT + 1.0, 1 / 1024)
    velocity = draw(random, [-8.0] * 12, [8.0] * 12, 1 / 128)
    torque = draw(random, [-80.0] * 12, [80.0] * 12, 1 / 16)
    hand_force = draw(random, [-100.0] * 3, [100.0] * 3, 1 / 16)

    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, quaternion)
    rotation = rotation.reshape(3, 3)
    data.qpos[:3], data.qpos[3:7] = random.uniform(-5.0, 5.0, 3), quaternion
    data.qvel[:3], data.qvel[3:6] = rotation @ linear, angular
    for name, q, qd in zip(JOINTS, position, velocity):
        joint = model.joint(name)
        data.qpos[joint.qposadr[0]], data.qvel[joint.dofadr[0]] = q, qd
    # Forces at a point need positions; accelerations need forces.
    mujoco.mj_fwdPosition(model, data)
    forces(model, data, rotation, torque, hand_force)
    mujoco.mj_forward(model, data)

    # Our velocities to MuJoCo's.
    to_mujoco = np.zeros((18, 18))
    to_mujoco[3:6, 0:3], to_mujoco[0:3, 3:6] = np.eye(3), rotation
    for j, name in enumerate(JOINTS):
        to_mujoco[model.joint(name).dofadr[0], 6 + j] = 1.0
    line("base_orientation", quaternion)
    line("base_linear_velocity", linear)
    line("base_angular_velocity", angular)
    line("joint_position", position)
    line("joint_velocity", velocity)
    line("joint_torque", torque)
    line("hand_force", hand_force)
    line("acceleration", to_mujoco.T @ data.qacc)
    if with_matrix:
        mass = np.zeros((18, 18))
        for column, unit in zip(mass, np.eye(18)):  # symmetric: rows are columns
            mujoco.mj_mulM(model, data, column, unit)
        line("mass_matrix", (to_mujoco.T @ mass @ to_mujoco)[np.tril_indices(18)])
        line("bias_force", to_mujoco.T @ data.qfrc_bias)


if __name__ == "__main__":
    main()
