// Forces as arrows: thick enough to be seen, as long as they are strong; any number of them.

import {
  ConeGeometry,
  CylinderGeometry,
  DynamicDrawUsage,
  Group,
  InstancedMesh,
  Matrix4,
  MeshBasicMaterial,
  Quaternion,
  Vector3,
} from "three";

const UP = new Vector3(0, 1, 0);
const HEAD_M = 0.14;
/** Meters of arrow for a newton. */
const M_PER_N = 0.012;
/** A weaker pull is not drawn [N]. */
const LEAST_N = 1;

export class Arrows {
  readonly group = new Group();
  private readonly shaft: InstancedMesh;
  private readonly head: InstancedMesh;
  private readonly pose = new Matrix4();
  private readonly turn = new Quaternion();
  private readonly size = new Vector3(1, 1, 1);
  private readonly place = new Vector3();

  constructor(color: number, most: number) {
    const material = new MeshBasicMaterial({ color });
    this.shaft = new InstancedMesh(new CylinderGeometry(0.014, 0.014, 1, 10), material, most);
    this.head = new InstancedMesh(new ConeGeometry(0.05, HEAD_M, 14), material, most);
    for (const mesh of [this.shaft, this.head]) {
      mesh.instanceMatrix.setUsage(DynamicDrawUsage);
      mesh.frustumCulled = false;
      mesh.count = 0;
      this.group.add(mesh);
    }
  }

  clear(): void {
    this.shaft.count = this.head.count = 0;
  }

  /** One more arrow: a force [N, world frame] that acts at a point [m]. */
  add(at: Vector3, force: Vector3): void {
    const strength = force.length();
    if (!(strength >= LEAST_N)) return;
    const length = 0.05 + M_PER_N * strength;
    const along = force.clone().divideScalar(strength);
    this.turn.setFromUnitVectors(UP, along);
    const put = (mesh: InstancedMesh, away: number, scale: number) => {
      this.place.copy(at).addScaledVector(along, away);
      mesh.setMatrixAt(mesh.count++, this.pose.compose(this.place, this.turn, this.size.set(1, scale, 1)));
      mesh.instanceMatrix.needsUpdate = true;
    };
    put(this.shaft, length / 2, length);
    put(this.head, length + HEAD_M / 2, 1);
  }
}
