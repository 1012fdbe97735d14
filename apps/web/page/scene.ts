// The picture: light, ground, robots, handlers, force arrows, path traces; one camera for each lane.

import {
  ACESFilmicToneMapping,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  Fog,
  HemisphereLight,
  Line,
  LineBasicMaterial,
  PCFShadowMap,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";

import { Arrows } from "./arrows.ts";
import type { Description, Settings, Vector } from "./contract.ts";
import { find } from "./dom.ts";
import type { Frame } from "./frame.ts";
import { Ground } from "./ground.ts";
import { Handler } from "./handler.ts";
import { type Orbit, Rig, type View } from "./rig.ts";
import { Robots } from "./robots.ts";

/** A picture may take this long [ms] before the next is drawn coarser, and less than this before it is drawn finer. */
const SLOW_MS = 45;
const QUICK_MS = 20;
/** Pixels drawn for one of the page: least, and most. */
const COARSEST = 0.5;
const FINEST = 2;

/** The air at the horizon; the sky above is a gradient of the style sheet behind the picture. */
const HAZE = new Color(0xdde7ee);
const PULL_COLOR = 0xd4006a;
const PUSH_COLOR = 0xb35900;
const TRACE_COLORS = [0x0057b8, 0xb34700];
const TRACE_POINTS = 3000;

export interface Drawing {
  traces: boolean;
  /** Time stands still: the picture is drawn finely, once. */
  still: boolean;
  /** Each robot has its own forces, instead of the one pull of the frame. */
  ownForces?: boolean;
}

export class Stage {
  readonly robots: Robots;
  readonly canvas: HTMLCanvasElement;
  readonly orbit: Orbit = { around: 0, up: 0, distance: 1 };
  readonly ground = new Ground();
  view: View = "follow";
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly sun = new DirectionalLight(0xfff4e2, 2.9);
  private readonly handlers = [new Handler(0x2f5d8a), new Handler(0x8a4b2f)];
  private readonly pulls: Arrows;
  private readonly pushes: Arrows;
  private readonly traces: { line: Line; count: number; last: Vector3 }[];
  private rigs = [new Rig()];
  private withHandlers = true;
  /** Without a graphics processor every pixel costs: shadows and smooth edges are left out. */
  private readonly inSoftware: boolean;
  private ratio: number;
  /** The next picture has another size, or other parts. */
  private resized = true;
  private pictureMs = 30;
  /** What was drawn last while time stood still. */
  private drawn = "";

  constructor(private readonly host: HTMLElement, description: Description) {
    this.inSoftware = drawsInSoftware();
    this.ratio = this.inSoftware ? 0.75 : Math.min(window.devicePixelRatio, FINEST);
    this.renderer = new WebGLRenderer({ antialias: !this.inSoftware, alpha: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.renderer.setScissorTest(true);
    this.canvas = this.renderer.domElement;
    host.append(this.canvas);
    this.scene.fog = new Fog(HAZE, 9, 15);
    this.scene.add(new HemisphereLight(0xe9f3ff, 0x8f8a7c, 2.1));
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.setScalar(this.inSoftware ? 512 : 2048);
    this.sun.shadow.normalBias = 0.02;
    this.scene.add(this.sun, this.sun.target);
    this.robots = new Robots(description);
    this.pulls = new Arrows(PULL_COLOR, description.max_herd);
    this.pushes = new Arrows(PUSH_COLOR, description.max_herd);
    this.scene.add(this.ground.mesh, this.robots.group, this.pulls.group, this.pushes.group);
    for (const handler of this.handlers) this.scene.add(handler.group);
    this.traces = TRACE_COLORS.map((color) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * TRACE_POINTS), 3));
      const line = new Line(geometry, new LineBasicMaterial({ color }));
      line.frustumCulled = false;
      this.scene.add(line);
      return { line, count: 0, last: new Vector3(Infinity, 0, 0) };
    });
    this.configure(description.defaults);
    new ResizeObserver(() => (this.resized = true)).observe(host);
  }

  /** From another side, where the visitor has not moved the camera yet. */
  look(view: View): void {
    this.view = view;
    Object.assign(this.orbit, { around: 0, up: 0 });
  }

  /** One dog, two beside each other with a camera each, or a herd. */
  configure(settings: Settings): void {
    this.robots.configure(settings);
    const herd = settings.robots > 1;
    this.withHandlers = !herd;
    this.rigs = settings.minds.map(() => new Rig());
    this.reach(herd ? 14 : 3.5);
    this.orbit.distance = herd ? 2.5 : 1;
    this.clearTraces();
    this.resized = true;
  }

  /** Half the width of what casts shadows, and how far it can be seen [m]. */
  private reach(meters: number): void {
    Object.assign(this.sun.shadow.camera, { left: -meters, right: meters, top: meters, bottom: -meters, near: 1, far: 24 });
    this.sun.shadow.camera.updateProjectionMatrix();
    Object.assign(this.scene.fog!, meters > 10 ? { near: 13, far: 23 } : { near: 8, far: 14 });
  }

  clearTraces(): void {
    for (const rig of this.rigs) rig.jump();
    for (const trace of this.traces) {
      trace.count = 0;
      trace.last.x = Infinity;
      trace.line.geometry.setDrawRange(0, 0);
    }
  }

  /** Draws the moment at `share` of the way from `a` to `b`; `seconds` since the picture before. */
  draw(a: Frame, b: Frame, share: number, seconds: number, options: Drawing): void {
    if (options.still && this.alreadyDrawn(b, options)) return;
    if (!options.still) this.adapt(seconds);
    // A new size empties the canvas, so it is taken only here, where a picture follows.
    const ratio = options.still ? FINEST : this.ratio;
    if (this.resized || this.renderer.getPixelRatio() !== ratio) this.resize(ratio);
    this.robots.update(a, b, share);
    this.drawForces(b, 0, b.robots, options.ownForces ?? false);
    this.trace(b, options.traces);
    const { clientWidth: width, clientHeight: height } = this.host;
    this.rigs.forEach((rig, lane) => {
      if (lane >= b.robots) return;
      // In a lane of two only its own dog is seen: the other walks where this one would be in the way.
      if (this.rigs.length > 1) {
        this.robots.showOnly(lane);
        this.drawForces(b, lane, lane + 1, false);
      }
      this.handlers.forEach((handler, i) => (handler.group.visible = this.withHandlers && i === lane));
      if (this.withHandlers) {
        const standing = b.vector(lane, "position")[2] - 0.55;
        this.handlers[lane]!.update(this.robots.handles[lane]!, b.yaw(lane), standing, seconds);
      }
      rig.place(new Vector3(...b.vector(lane, "position")), b.yaw(lane), seconds, this.view, this.orbit);
      this.sun.position.set(rig.focus.x - 3.5, rig.focus.y + 4.5, rig.focus.z + 8);
      this.sun.target.position.copy(rig.focus);
      const { left, bottom, width: w, height: h } = rig.part;
      const part = [left * width, bottom * height, w * width, h * height] as const;
      this.renderer.setViewport(...part);
      this.renderer.setScissor(...part);
      this.renderer.render(this.scene, rig.camera);
    });
  }

  private drawForces(frame: Frame, from: number, to: number, own: boolean): void {
    this.pulls.clear();
    this.pushes.clear();
    const base = new Vector3();
    for (let robot = from; robot < to; robot++) {
      const yaw = frame.yaw(robot);
      const [sin, cos] = [Math.sin(yaw), Math.cos(yaw)];
      const inWorld = ([x, y, z]: Vector) => new Vector3(cos * x - sin * y, sin * x + cos * y, z);
      const pull = own ? frame.vector(robot, "observed_force") : frame.force;
      this.pulls.add(this.robots.handles[robot]!, inWorld(pull));
      if (own) this.pushes.add(base.set(...frame.vector(robot, "position")), inWorld(frame.vector(robot, "base_force")));
    }
  }

  /** Whether the picture of a moment at which time stands still is the one that is shown, finely. */
  private alreadyDrawn(frame: Frame, { traces }: Drawing): boolean {
    const { around, up, distance } = this.orbit;
    const ground = this.ground.mesh.geometry.id;
    const asked = [frame.time, frame.force, this.view, around, up, distance, traces, ground].join();
    const same = asked === this.drawn && !this.resized && this.renderer.getPixelRatio() === FINEST;
    this.drawn = asked;
    return same;
  }

  /** Draws coarser where pictures come slowly, finer where there is time. */
  private adapt(seconds: number): void {
    this.pictureMs += 0.1 * (1000 * seconds - this.pictureMs);
    const most = this.inSoftware ? 1 : Math.min(window.devicePixelRatio, FINEST);
    const slow = this.pictureMs > SLOW_MS && this.ratio > COARSEST;
    const quick = this.pictureMs < QUICK_MS && this.ratio < most;
    if (!slow && !quick) return;
    this.ratio = Math.min(Math.max(this.ratio * (slow ? 0.8 : 1.25), COARSEST), most);
    this.pictureMs = 0.5 * (SLOW_MS + QUICK_MS);
  }

  /** The lane a point of the page is in. */
  laneAt(clientX: number, clientY: number): number {
    const rect = this.canvas.getBoundingClientRect();
    const [x, y] = [(clientX - rect.left) / rect.width, 1 - (clientY - rect.top) / rect.height];
    const inside = ({ part: { left, bottom, width, height } }: Rig) => x >= left && x < left + width && y >= bottom && y < bottom + height;
    return Math.max(this.rigs.findIndex(inside), 0);
  }

  /** A lane's camera, and the part of the page it fills. */
  lane(index: number): { rig: Rig; rect: DOMRect } {
    const rig = this.rigs[Math.min(index, this.rigs.length - 1)]!;
    const all = this.canvas.getBoundingClientRect();
    const { left, bottom, width, height } = rig.part;
    const top = all.top + (1 - bottom - height) * all.height;
    return { rig, rect: new DOMRect(all.left + left * all.width, top, width * all.width, height * all.height) };
  }

  private trace(frame: Frame, show: boolean): void {
    this.traces.forEach((trace, robot) => {
      trace.line.visible = show && robot < frame.robots && frame.robots <= this.rigs.length;
      if (!trace.line.visible) return;
      const at = new Vector3(...frame.vector(robot, "position"));
      if (trace.last.distanceTo(at) < 0.04) return;
      if (trace.last.distanceTo(at) > 1) trace.count = 0;
      trace.last.copy(at);
      const positions = trace.line.geometry.getAttribute("position") as BufferAttribute;
      if (trace.count === TRACE_POINTS) {
        positions.array.copyWithin(0, 3);
        trace.count -= 1;
      }
      positions.setXYZ(trace.count++, at.x, at.y, at.z - 0.5);
      positions.needsUpdate = true;
      trace.line.geometry.setDrawRange(0, trace.count);
    });
  }

  private resize(ratio: number): void {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (width === 0 || height === 0) return;
    this.resized = false;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height);
    const beside = width >= height;
    this.host.parentElement!.classList.toggle("stacked", !beside);
    const share = 1 / this.rigs.length;
    this.rigs.forEach((rig, lane) => {
      rig.part = beside
        ? { left: lane * share, bottom: 0, width: share, height: 1 }
        : { left: 0, bottom: 1 - (lane + 1) * share, width: 1, height: share };
      rig.resize(width, height);
    });
  }
}

/** The stage in `host`; where there can be none, a sentence instead: whoever needs no picture can do everything else. */
export function stageIn(host: HTMLElement, description: Description): Stage | null {
  try {
    return new Stage(host, description);
  } catch (error) {
    console.warn(error);
    host.textContent = "No picture: this browser has no WebGL 2.";
    host.setAttribute("aria-label", host.textContent);
    host.classList.add("none");
    find("views").hidden = true;
    return null;
  }
}

/** Whether the browser has no graphics processor to draw with. */
function drawsInSoftware(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return true;
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}
