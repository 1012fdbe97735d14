// A camera that goes with a dog and its handler.

import { PerspectiveCamera, Vector3 } from "three";

export type View = "follow" | "side" | "top";

/** Where a visitor moved the camera: angle around [rad], height angle [rad], distance as a factor. */
export interface Orbit {
  around: number;
  up: number;
  distance: number;
}

/** A part of the picture in shares of it, from its lower left corner. */
export interface Part {
  left: number;
  bottom: number;
  width: number;
  height: number;
}

export class Rig {
  readonly camera = new PerspectiveCamera(45, 1, 0.05, 160);
  readonly focus = new Vector3();
  part: Part = { left: 0, bottom: 0, width: 1, height: 1 };
  private heading = 0;
  private settled = false;
  /** Who asks for little motion gets a camera that does not swing around with the dog. */
  private readonly calm = window.matchMedia("(prefers-reduced-motion: reduce)");

  constructor() {
    this.camera.up.set(0, 0, 1);
  }

  /** The next picture jumps to its dog instead of gliding there. */
  jump(): void {
    this.settled = false;
  }

  resize(width: number, height: number): void {
    const [w, h] = [width * this.part.width, height * this.part.height];
    this.camera.aspect = w / h;
    this.camera.fov = w < h ? 58 : 42;
    this.camera.updateProjectionMatrix();
  }

  place(base: Vector3, yaw: number, seconds: number, view: View, { around, up, distance }: Orbit): void {
    const follow = this.settled ? 1 - Math.exp(-4 * seconds) : 1;
    this.settled = true;
    // Looking at the middle of dog and handler.
    const middle = new Vector3(base.x - 0.55 * Math.cos(yaw), base.y - 0.55 * Math.sin(yaw), base.z);
    this.focus.lerp(middle, follow);
    const turn = Math.atan2(Math.sin(yaw - this.heading), Math.cos(yaw - this.heading));
    const swing = this.calm.matches ? 0 : 1 - Math.exp(-1.5 * seconds);
    this.heading += turn * (view !== "follow" ? 0 : follow < 1 ? swing : 1);
    const [azimuth, elevation, far] = {
      follow: [this.heading + Math.PI - 0.95 + around, 0.3 + up, 4.2 * distance] as const,
      side: [-Math.PI / 2 + around, 0.16 + up, 4.6 * distance] as const,
      top: [-Math.PI / 2 + around, Math.PI / 2 - 0.02 + Math.min(up, 0), 6.5 * distance] as const,
    }[view];
    const lift = Math.max(0.04, Math.min(Math.PI / 2 - 0.02, elevation));
    this.camera.position.set(
      this.focus.x + far * Math.cos(lift) * Math.cos(azimuth),
      this.focus.y + far * Math.cos(lift) * Math.sin(azimuth),
      this.focus.z + 0.1 + far * Math.sin(lift),
    );
    this.camera.lookAt(this.focus.x, this.focus.y, this.focus.z + 0.05);
    this.camera.updateMatrixWorld();
  }
}
