// The handler: a simple figure that walks beside the hand it holds the bar with. Nobody simulates it; it shows whose hand pulls.

import { BoxGeometry, CapsuleGeometry, Color, Group, Mesh, MeshStandardMaterial, SphereGeometry, Vector3 } from "three";

const LEG = 0.86;
const HIP_HEIGHT = 0.92;
const SHOULDER = new Vector3(0.02, 0.2, 1.42);
/** Place of the figure from the hand, in the heading frame: the dog walks ahead on its left. */
const BESIDE = new Vector3(-0.28, -0.3, 0);
const STRIDE_M = 0.75;
const SWING_RAD = 0.45;

export class Handler {
  readonly group = new Group();
  private readonly legs: Group[] = [];
  private readonly arm: Mesh;
  private readonly otherArm: Group;
  private readonly last = new Vector3(NaN, 0, 0);
  private walked = 0;
  private pace = 0;

  constructor(shirt: number) {
    const cloth = new MeshStandardMaterial({ color: new Color(shirt), roughness: 0.9 });
    const trousers = new MeshStandardMaterial({ color: new Color(0x39424e), roughness: 0.9 });
    const skin = new MeshStandardMaterial({ color: new Color(0xc99372), roughness: 0.8 });
    const capsule = (radius: number, length: number, material: MeshStandardMaterial) => {
      const mesh = new Mesh(new CapsuleGeometry(radius, length, 4, 10), material);
      mesh.rotation.x = Math.PI / 2;
      mesh.castShadow = true;
      return mesh;
    };
    const shoes = new MeshStandardMaterial({ color: new Color(0x1d2126), roughness: 0.7 });
    const torso = capsule(0.17, 0.36, cloth);
    torso.position.z = 1.2;
    const head = new Mesh(new SphereGeometry(0.115, 18, 14), skin);
    head.position.z = 1.66;
    head.castShadow = true;
    const hair = new Mesh(new SphereGeometry(0.122, 18, 10, 0, 2 * Math.PI, 0, 0.55 * Math.PI), shoes);
    hair.rotation.set(Math.PI / 2, 0, 0);
    hair.position.set(-0.014, 0, 1.672);
    this.group.add(torso, head, hair);
    for (const side of [1, -1]) {
      const leg = new Group();
      const limb = capsule(0.075, LEG - 0.15, trousers);
      limb.position.z = -LEG / 2;
      const shoe = new Mesh(new BoxGeometry(0.26, 0.1, 0.08), shoes);
      shoe.position.set(0.05, 0, -LEG + 0.02);
      shoe.castShadow = true;
      leg.add(limb, shoe);
      leg.position.set(0, 0.1 * side, HIP_HEIGHT);
      this.legs.push(leg);
      this.group.add(leg);
    }
    this.otherArm = new Group();
    const resting = capsule(0.05, 0.5, cloth);
    resting.position.z = -0.28;
    this.otherArm.add(resting);
    this.otherArm.position.set(0, -0.24, 1.42);
    this.group.add(this.otherArm);
    this.arm = new Mesh(new CapsuleGeometry(0.045, 1, 4, 8), cloth);
    this.arm.castShadow = true;
    this.group.add(this.arm);
  }

  /** Stands beside the hand at `hand`, looking along `yaw`, on ground of height `ground`. */
  update(hand: Vector3, yaw: number, ground: number, seconds: number): void {
    const [sin, cos] = [Math.sin(yaw), Math.cos(yaw)];
    this.group.position.set(hand.x + cos * BESIDE.x - sin * BESIDE.y, hand.y + sin * BESIDE.x + cos * BESIDE.y, ground);
    this.group.rotation.z = yaw;
    const moved = Number.isNaN(this.last.x) ? 0 : this.last.distanceTo(this.group.position);
    this.last.copy(this.group.position);
    if (moved < 0.5) this.walked += moved;
    const speed = seconds > 0 ? moved / seconds : 0;
    this.pace += Math.min(seconds * 4, 1) * (Math.min(speed / 0.6, 1) - this.pace);
    const phase = (Math.PI * this.walked) / STRIDE_M;
    const swing = SWING_RAD * this.pace * Math.sin(phase);
    this.legs[0]!.rotation.y = swing;
    this.legs[1]!.rotation.y = -swing;
    this.otherArm.rotation.y = 0.8 * swing;
    // The arm reaches from the shoulder to the hand, in the figure's own frame.
    const reach = new Vector3(-BESIDE.x, -BESIDE.y, hand.z - ground).sub(SHOULDER);
    this.arm.position.copy(SHOULDER).addScaledVector(reach, 0.5);
    this.arm.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), reach.clone().normalize());
    this.arm.scale.set(1, reach.length(), 1);
  }
}
