"""Writes our description of ANYmal D from the figures of the official one.

Usage: python3 mint_anymal_d.py OFFICIAL_URDF > assets/anymal_d.urdf

The official description (ANYbotics, anymal_d_simple_description, BSD-3) has 97 links, most of them fixed to each
other, and an inspection payload. Ours has the 13 bodies that move, without the payload, and spheres where the body may touch
the ground. Only figures carry over: each body's mass, center of mass and inertia are those of its links together.
"""

import sys
import xml.etree.ElementTree as ElementTree

import numpy as np

LEGS = [("LF", 1, 1), ("LH", -1, 1), ("RF", 1, -1), ("RH", -1, -1)]
PARTS = [("HAA", "HIP"), ("HFE", "THIGH"), ("KFE", "SHANK")]
ARMATURE = 0.06  # kg m², reflected rotor inertia; our choice: the official file has none, and light shanks under stiff servos want it


def vector(text):
    return np.array([float(x) for x in (text or "0 0 0").split()])


def pose(element):
    """Rotation and translation of an <origin>."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    roll, pitch, yaw = vector(origin.get("rpy"))

    def turn(axis, angle):
        c, s = np.cos(angle), np.sin(angle)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        r = np.eye(3)
        r[i, i] = r[j, j] = c
        r[j, i], r[i, j] = s, -s
        return r

    return turn(2, yaw) @ turn(1, pitch) @ turn(0, roll), vector(origin.get("xyz"))


def main():
    root = ElementTree.parse(sys.argv[1]).getroot()
    links = {link.get("name"): link for link in root.findall("link")}
    children = {}
    for joint in root.findall("joint"):
        children.setdefault(joint.find("parent").get("link"), []).append(joint)

    # Pose of each link in the base at zero joint positions, and the body it belongs to.
    placed = {"base": (np.eye(3), np.zeros(3))}
    body_of = {"base": "base"}
    joints = {}
    stack = ["base"]
    while stack:
        parent = stack.pop()
        r, p = placed[parent]
        for joint in children.get(parent, []):
            child = joint.find("child").get("link")
            if "inspection_payload" in child:
                continue
            rj, pj = pose(joint)
            placed[child] = (r @ rj, r @ pj + p)
            if joint.get("type") == "fixed":
                body_of[child] = body_of[parent]
            else:
                body_of[child] = joint.get("name")
                axis = r @ rj @ vector(joint.find("axis").get("xyz"))
                joints[joint.get("name")] = (body_of[parent], placed[child][1], axis, joint.find("limit"))
            stack.append(child)

    bodies = {name: [] for name in ["base", *joints]}
    for name, body in body_of.items():
        inertial = links[name].find("inertial")
        if inertial is None:
            continue
        r, p = placed[name]
        ri, pi = pose(inertial)
        i = inertial.find("inertia")
        entry = {k: float(i.get(k)) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
        tensor = np.array(
            [
                [entry["ixx"], entry["ixy"], entry["ixz"]],
                [entry["ixy"], entry["iyy"], entry["iyz"]],
                [entry["ixz"], entry["iyz"], entry["izz"]],
            ]
        )
        turned = r @ ri
        bodies[body].append((float(inertial.find("mass").get("value")), r @ pi + p, turned @ tensor @ turned.T))

    def merged(body, origin):
        parts = bodies[body]
        mass = sum(m for m, _, _ in parts)
        center = sum(m * c for m, c, _ in parts) / mass
        tensor = np.zeros((3, 3))
        for m, c, t in parts:
            d = c - center
            tensor += t + m * (d @ d * np.eye(3) - np.outer(d, d))
        return mass, center - origin, tensor

    def numbers(values):
        return " ".join(f"{0.0 if abs(v) < 1e-12 else v:.10g}" for v in values)

    def inertial(body, origin):
        mass, center, t = merged(body, origin)
        print(f'    <inertial>\n      <origin xyz="{numbers(center)}"/>\n      <mass value="{mass:.10g}"/>')
        entries = [("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2)]
        text = " ".join(f'{k}="{numbers([t[i, j]])}"' for k, i, j in entries)
        print(f"      <inertia {text}/>\n    </inertial>")

    def sphere(name, center, radius):
        print(
            f'    <collision name="{name}">\n      <origin xyz="{numbers(center)}"/>\n'
            f'      <geometry><sphere radius="{radius:.10g}"/></geometry>\n    </collision>'
        )

    total = sum(m for parts in bodies.values() for m, _, _ in parts)
    print('<?xml version="1.0"?>')
    print("<!-- ANYmal D without inspection payload: 13 bodies, contact spheres. Figures computed from the official")
    print("     description (ANYbotics, BSD-3) by scripts/reference/mint_anymal_d.py; all frames are parallel to the base's")
    print(f"     at zero joint positions. Total mass {total:.5f} kg. -->")
    print('<robot name="anymal_d">\n  <link name="base">')
    inertial("base", np.zeros(3))
    for leg, x, y in LEGS:
        # Lower corners of the trunk's box (0.894 x 0.1615 x 0.256 m at z = 0.016 m), rounded by 0.03 m.
        sphere(f"BASE_{leg}", (x * 0.417, y * 0.05075, -0.082), 0.03)
    for leg, x, y in LEGS:
        # The hip drives stand out sideways: cylinders of 0.089 m around (0.2353, 0.08075, 0) m.
        sphere(f"BASE_{leg}_DRIVE", (x * 0.27, y * 0.08075, 0.0), 0.089)
    print("  </link>")
    for drive, part in PARTS:
        for leg, x, y in LEGS:
            joint = f"{leg}_{drive}"
            parent, origin, axis, limit = joints[joint]
            parent_origin = joints[parent][1] if parent != "base" else np.zeros(3)
            parent_link = "base" if parent == "base" else f"{leg}_{dict(PARTS)[parent[3:]]}"
            print(f'  <link name="{leg}_{part}">')
            inertial(joint, origin)
            knee = joints[f"{leg}_KFE"][1] - joints[f"{leg}_HFE"][1]
            foot_r, foot_p = placed[f"{leg}_FOOT"]
            foot = foot_p - joints[f"{leg}_KFE"][1]
            ball = next(c for c in links[f"{leg}_FOOT"].findall("collision") if c.find("geometry/sphere") is not None)
            radius = float(ball.find("geometry/sphere").get("radius"))
            tube = next(c for c in links[f"{leg}_FOOT"].findall("collision") if c.find("geometry/cylinder") is not None)
            if part == "THIGH":
                sphere(f"{leg}_THIGH", 0.5 * knee, 0.07)
                sphere(f"{leg}_KNEE", knee, 0.06)
            if part == "SHANK":
                sphere(f"{leg}_FOOT", foot + foot_r @ pose(ball)[1], radius)
                sphere(f"{leg}_SHANK", foot + foot_r @ pose(tube)[1], float(tube.find("geometry/cylinder").get("radius")))
            print("  </link>")
            print(f'  <joint name="{joint}" type="revolute">')
            print(f'    <parent link="{parent_link}"/>\n    <child link="{leg}_{part}"/>')
            print(f'    <origin xyz="{numbers(origin - parent_origin)}"/>\n    <axis xyz="{numbers(axis)}"/>')
            bounds = {k: float(limit.get(k)) for k in ("lower", "upper", "effort", "velocity")}
            # A joint whose axis the official file turns around keeps its limits along its own axis.
            print("    <limit " + " ".join(f'{k}="{v:.10g}"' for k, v in bounds.items()) + "/>")
            print(f'    <dynamics damping="0" friction="0" armature="{ARMATURE}"/>\n  </joint>')
    print("</robot>")


main()
