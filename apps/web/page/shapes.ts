// The robot's shapes, our own: what the contact spheres and joints say, dressed as boxes, capsules and drums.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  Color,
  CylinderGeometry,
  Matrix4,
  Quaternion,
  SphereGeometry,
  Vector3,
} from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";

import type { Description } from "./contract.ts";

const SHELL = new Color(0xc8321e);
const DARK = new Color(0x23272e);
const METAL = new Color(0x8b939e);
const RUBBER = new Color(0x14161a);
const GLASS = new Color(0x4aa8ff);

const UP = new Vector3(0, 1, 0);

function painted(geometry: BufferGeometry, color: Color): BufferGeometry {
  const plain = geometry.index ? geometry.toNonIndexed() : geometry;
  plain.deleteAttribute("uv");
  const count = plain.getAttribute("position").count;
  const colors = new Float32Array(count * 3);
  for (let i = 0; i < count; i++) color.toArray(colors, 3 * i);
  plain.setAttribute("color", new BufferAttribute(colors, 3));
  return plain;
}

function box(size: [number, number, number], at: [number, number, number], color: Color): BufferGeometry {
  return painted(new BoxGeometry(...size), color).translate(...at);
}

/** A capsule from one point to another. */
export function rod(from: Vector3, to: Vector3, radius: number, color: Color): BufferGeometry {
  const along = to.clone().sub(from);
  const turn = new Quaternion().setFromUnitVectors(UP, along.clone().normalize());
  const pose = new Matrix4().compose(from.clone().add(to).multiplyScalar(0.5), turn, new Vector3(1, 1, 1));
  return painted(new CapsuleGeometry(radius, along.length(), 4, 10), color).applyMatrix4(pose);
}

function ball(at: Vector3, radius: number, color: Color): BufferGeometry {
  return painted(new SphereGeometry(radius, 14, 10), color).translate(at.x, at.y, at.z);
}

function drum(at: Vector3, axis: "x" | "y", radius: number, length: number, color: Color): BufferGeometry {
  const geometry = painted(new CylinderGeometry(radius, radius, length, 18), color);
  if (axis === "x") geometry.rotateZ(Math.PI / 2);
  return geometry.translate(at.x, at.y, at.z);
}

/** One geometry for each link, in the link's frame; the base first. */
export function linkShapes({ joints, spheres }: Description): BufferGeometry[] {
  const vector = (numbers: readonly number[]) => new Vector3(...(numbers as [number, number, number]));
  const parts: BufferGeometry[][] = Array.from({ length: joints.length + 1 }, () => []);
  const on = (link: number, part: string) => spheres.filter((s) => s.link === link && s.part === part);

  // The trunk: as long and wide as its corner and drive spheres say, with a face in front.
  parts[0]!.push(
    box([0.86, 0.2, 0.16], [0, 0, -0.02], SHELL),
    box([0.6, 0.24, 0.1], [0, 0, 0.01], DARK),
    box([0.5, 0.18, 0.05], [-0.02, 0, 0.085], SHELL),
    box([0.06, 0.16, 0.12], [0.45, 0, -0.02], DARK),
    box([0.02, 0.11, 0.04], [0.482, 0, 0.0], GLASS),
    box([0.06, 0.16, 0.12], [-0.45, 0, -0.02], DARK),
    drum(new Vector3(0.32, 0, 0.14), "y", 0.03, 0.09, METAL),
  );
  joints.forEach((joint, j) => {
    const link = j + 1;
    const children = joints.filter((other) => other.parent === link);
    const kind = joint.name.split("_")[1];
    if (kind === "HAA") {
      parts[0]!.push(drum(vector(joint.origin), "x", 0.07, 0.16, DARK));
      for (const child of children) {
        const [x, y] = child.origin;
        parts[link]!.push(
          rod(new Vector3(0, 0, 0), new Vector3(x, y, 0), 0.05, METAL),
          drum(new Vector3(x, y + Math.sign(joint.origin[1]) * 0.035, 0), "y", 0.078, 0.09, DARK),
        );
      }
    } else if (kind === "HFE") {
      for (const child of children) {
        const knee = vector(child.origin);
        const hip = new Vector3(0, 0.55 * knee.y, 0);
        const above = new Vector3(knee.x, 0.6 * knee.y, 0.97 * knee.z);
        parts[link]!.push(rod(hip, above, 0.052, SHELL), drum(new Vector3(knee.x, 0.78 * knee.y, knee.z), "y", 0.058, 0.1, DARK));
      }
    } else {
      const foot = on(link, "foot")[0]!;
      const shank = on(link, "shank")[0]!;
      const [end, middle] = [vector(foot.center), vector(shank.center)];
      const bend = new Vector3(end.x, end.y, 0.28 * end.z);
      parts[link]!.push(
        rod(new Vector3(0, 0.1 * end.y, 0), bend, 0.034, METAL),
        rod(bend, end, shank.radius + 0.004, DARK),
        ball(middle, shank.radius + 0.006, METAL),
        ball(end, foot.radius, RUBBER),
      );
    }
  });
  return parts.map((list) => mergeGeometries(list));
}
