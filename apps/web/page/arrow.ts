// The pull as an arrow at the hand: thick enough to be seen, as long as it is strong.

import { ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Vector3 } from "three";

const UP = new Vector3(0, 1, 0);
const HEAD_M = 0.14;
/** Meters of arrow for a newton. */
const M_PER_N = 0.012;
/** A weaker pull is not drawn [N]. */
const LEAST_N = 1;

export class Arrow {
  readonly group = new Group();
  private readonly shaft: Mesh;
  private readonly head: Mesh;

  constructor(color: number) {
    const material = new MeshBasicMaterial({ color });
    this.shaft = new Mesh(new CylinderGeometry(0.014, 0.014, 1, 10), material);
    this.head = new Mesh(new ConeGeometry(0.05, HEAD_M, 14), material);
    this.group.add(this.shaft, this.head);
  }

  /** Shows a force [N, world frame] that acts at a point [m]. */
  update(at: Vector3, force: Vector3): void {
    const strength = force.length();
    this.group.visible = strength >= LEAST_N;
    if (!this.group.visible) return;
    const length = 0.05 + M_PER_N * strength;
    this.group.position.copy(at);
    this.group.quaternion.setFromUnitVectors(UP, force.clone().divideScalar(strength));
    this.shaft.scale.y = length;
    this.shaft.position.y = length / 2;
    this.head.position.y = length + HEAD_M / 2;
  }
}
