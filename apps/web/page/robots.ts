// All robots of a frame as one instanced mesh a link, with bar and hand.

import { Color, CylinderGeometry, DynamicDrawUsage, Group, InstancedMesh, Matrix4, MeshStandardMaterial, Quaternion, SphereGeometry, Vector3 } from "three";

import type { Description, Settings } from "./contract.ts";
import type { Frame } from "./frame.ts";
import { Kinematics } from "./kinematics.ts";
import { linkShapes } from "./shapes.ts";

const UP = new Vector3(0, 1, 0);

export class Robots {
  readonly group = new Group();
  private readonly links: InstancedMesh[];
  private readonly bar: InstancedMesh;
  private readonly hand: InstancedMesh;
  private readonly kinematics: Kinematics;
  private readonly onBase = { bar: new Matrix4(), hand: new Matrix4() };
  private readonly pose = new Matrix4();
  /** Places of the robots' hands in the world, as last drawn [m]. */
  readonly handles: Vector3[];

  constructor(private readonly description: Description) {
    this.kinematics = new Kinematics(description.joints);
    const body = new MeshStandardMaterial({ vertexColors: true, roughness: 0.55, metalness: 0.25 });
    const many = (mesh: InstancedMesh, shadow = true) => {
      mesh.instanceMatrix.setUsage(DynamicDrawUsage);
      mesh.frustumCulled = false;
      mesh.castShadow = shadow;
      this.group.add(mesh);
      return mesh;
    };
    const most = description.max_herd;
    this.handles = Array.from({ length: most }, () => new Vector3());
    this.links = linkShapes(description).map((shape) => many(new InstancedMesh(shape, body, most)));
    const steel = new MeshStandardMaterial({ color: new Color(0xe6e9ee), roughness: 0.3, metalness: 0.6 });
    const grip = new MeshStandardMaterial({ color: new Color(0xffb000), roughness: 0.6 });
    this.bar = many(new InstancedMesh(new CylinderGeometry(0.014, 0.014, 1, 10), steel, most));
    this.hand = many(new InstancedMesh(new SphereGeometry(description.harness.hand_radius + 0.015, 16, 12), grip, most));
    this.configure(description.defaults);
  }

  /** Fits the bar to the settings. */
  configure(settings: Settings): void {
    const { bar_start, hand_height } = this.description.harness;
    const rise = hand_height - bar_start[2];
    const back = Math.sqrt(Math.max(settings.bar_length_m ** 2 - rise ** 2, 0));
    const start = new Vector3(...bar_start);
    const hand = new Vector3(bar_start[0] - back, bar_start[1], hand_height);
    const turn = new Quaternion().setFromUnitVectors(UP, hand.clone().sub(start).normalize());
    const length = new Vector3(1, settings.bar_length_m, 1);
    this.onBase.bar.compose(start.add(hand).multiplyScalar(0.5), turn, length);
    this.onBase.hand.makeTranslation(hand.x, hand.y, hand.z);
  }

  /** Draws all robots at `share` of the way from frame `a` to frame `b`. */
  update(a: Frame, b: Frame, share: number): void {
    for (let robot = 0; robot < b.robots; robot++) {
      this.kinematics.update(a, b, robot, share);
      this.links.forEach((mesh, link) => mesh.setMatrixAt(robot, this.kinematics.links[link]!));
      const base = this.kinematics.links[0]!;
      this.bar.setMatrixAt(robot, this.pose.multiplyMatrices(base, this.onBase.bar));
      this.hand.setMatrixAt(robot, this.pose.multiplyMatrices(base, this.onBase.hand));
      this.handles[robot]!.setFromMatrixPosition(this.pose);
    }
    for (const mesh of [...this.links, this.bar, this.hand]) {
      mesh.count = b.robots;
      mesh.instanceMatrix.needsUpdate = true;
    }
  }

  /** Draws one robot alone, until the next update: those before it must have had their turn. */
  showOnly(robot: number): void {
    for (const mesh of [...this.links, this.bar, this.hand]) {
      mesh.instanceMatrix.array.copyWithin(0, 16 * robot, 16 * (robot + 1));
      mesh.count = 1;
      mesh.instanceMatrix.needsUpdate = true;
    }
  }
}
