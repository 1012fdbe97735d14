// Dragging: near a handle it pulls, elsewhere it turns the camera; the wheel goes nearer. Keys move the camera, too.

import { Plane as GeometryPlane, Raycaster, Vector2, Vector3 } from "three";

import { type Pull, isForPage } from "./pull.ts";
import type { Stage } from "./scene.ts";

/** How near the handle a pointer takes it [px]; fingers are wider. */
const REACH_PX = { mouse: 26, touch: 44 };
/** Pull for a meter the pointer is away from where it took the handle [N/m]. */
const NEWTONS_PER_METER = 130;
/** What a key does to the camera: angle around and up [rad], distance as a factor. */
const CAMERA_KEYS: Record<string, [number, number, number]> = {
  a: [-0.1, 0, 1],
  d: [0.1, 0, 1],
  w: [0, 0.07, 1],
  s: [0, -0.07, 1],
  "+": [0, 0, 0.9],
  "-": [0, 0, 1 / 0.9],
};

export function bindGrab(stage: Stage, pull: Pull | null, heading: (lane: number) => number, keeps: () => boolean): void {
  const { canvas, orbit } = stage;
  const raycaster = new Raycaster();
  const level = new GeometryPlane();
  /** The pointer that is down: a second finger changes nothing. */
  let pointer: number | null = null;
  let taken = false;
  let turning: { x: number; y: number } | null = null;
  let held: Vector3 | null = null;
  /** The lane whose handle is taken. */
  let lane = 0;

  const near = (event: PointerEvent) => {
    if (!pull) return false;
    const { rig, rect } = stage.lane(stage.laneAt(event.clientX, event.clientY));
    const p = stage.robots.handles[stage.laneAt(event.clientX, event.clientY)]!.clone().project(rig.camera);
    const [x, y] = [rect.left + ((p.x + 1) / 2) * rect.width, rect.top + ((1 - p.y) / 2) * rect.height];
    return Math.hypot(event.clientX - x, event.clientY - y) < (event.pointerType === "touch" ? REACH_PX.touch : REACH_PX.mouse);
  };
  /** The point under the pointer on a level plane through the handle. */
  const under = (event: PointerEvent): Vector3 | null => {
    const { rig, rect } = stage.lane(lane);
    const spot = new Vector2(((event.clientX - rect.left) / rect.width) * 2 - 1, 1 - ((event.clientY - rect.top) / rect.height) * 2);
    raycaster.setFromCamera(spot, rig.camera);
    level.setFromNormalAndCoplanarPoint(new Vector3(0, 0, 1), stage.robots.handles[lane]!);
    return raycaster.ray.intersectPlane(level, new Vector3());
  };
  const move = (around: number, up: number, farther: number) => {
    orbit.around += around;
    orbit.up += up;
    orbit.distance = Math.min(Math.max(orbit.distance * farther, 0.4), 5);
  };

  canvas.addEventListener("pointerdown", (event) => {
    if (pointer !== null || event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    pointer = event.pointerId;
    taken = near(event);
    if (taken) {
      lane = stage.laneAt(event.clientX, event.clientY);
      const point = under(event);
      held = point?.sub(stage.robots.handles[lane]!) ?? null;
    } else {
      turning = { x: event.clientX, y: event.clientY };
    }
    canvas.classList.toggle("pulling", taken);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (pointer !== null && event.pointerId !== pointer) return;
    if (taken && held && pull) {
      const point = under(event);
      if (!point) return;
      const away = point.sub(stage.robots.handles[lane]!).sub(held).multiplyScalar(NEWTONS_PER_METER);
      const [sin, cos] = [Math.sin(heading(lane)), Math.cos(heading(lane))];
      pull.set([cos * away.x + sin * away.y, cos * away.y - sin * away.x, pull.force[2]], "handle");
    } else if (turning) {
      move((turning.x - event.clientX) * 0.007, (event.clientY - turning.y) * 0.005, 1);
      turning = { x: event.clientX, y: event.clientY };
    } else {
      canvas.classList.toggle("over", near(event));
    }
  });
  // Comes after the pointer went up, was cancelled or taken away.
  canvas.addEventListener("lostpointercapture", (event) => {
    if (event.pointerId !== pointer) return;
    if (taken && !keeps()) pull?.release("handle");
    pointer = null;
    taken = false;
    turning = null;
    canvas.classList.remove("pulling");
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      // The browser's own: it makes the page larger.
      if (event.ctrlKey) return;
      event.preventDefault();
      move(0, 0, Math.exp(event.deltaY * 0.001));
    },
    { passive: false },
  );
  document.addEventListener("keydown", (event) => {
    const keys = CAMERA_KEYS[event.key];
    if (!keys || !isForPage(event)) return;
    move(...keys);
    event.preventDefault();
  });
}
