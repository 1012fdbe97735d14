// Where the links of a robot are, between two frames: the tree of `RobotModel`, joint by joint.

import { Matrix4, Quaternion, Vector3 } from "three";

import type { Description } from "./contract.ts";
import type { Frame } from "./frame.ts";

export class Kinematics {
  /** World pose of each link; the base first. */
  readonly links: Matrix4[];
  private readonly axes: Vector3[];
  private readonly position = new Vector3();
  private readonly attitude = new Quaternion();
  private readonly later = new Quaternion();
  private readonly joint = new Matrix4();
  private readonly one = new Vector3(1, 1, 1);

  constructor(private readonly joints: Description["joints"]) {
    this.links = Array.from({ length: joints.length + 1 }, () => new Matrix4());
    this.axes = joints.map(({ axis }) => new Vector3(...axis));
  }

  /** Places all links at `share` of the way from `a` to `b`. */
  update(a: Frame, b: Frame, robot: number, share: number): void {
    const [p, q] = [a.field(robot, "position", 3), b.field(robot, "position", 3)];
    const mix = (x: number, y: number) => x + share * (y - x);
    this.position.set(mix(p[0]!, q[0]!), mix(p[1]!, q[1]!), mix(p[2]!, q[2]!));
    set(this.attitude, a.field(robot, "orientation", 4));
    this.attitude.slerp(set(this.later, b.field(robot, "orientation", 4)), share);
    this.links[0]!.compose(this.position, this.attitude, this.one);
    const [from, to] = [a.field(robot, "joints", 12), b.field(robot, "joints", 12)];
    this.joints.forEach(({ parent, origin }, j) => {
      this.joint.makeRotationAxis(this.axes[j]!, mix(from[j]!, to[j]!)).setPosition(...origin);
      this.links[j + 1]!.multiplyMatrices(this.links[parent]!, this.joint);
    });
  }
}

function set(quaternion: Quaternion, [w, x, y, z]: Float32Array): Quaternion {
  return quaternion.set(x!, y!, z!, w!);
}
