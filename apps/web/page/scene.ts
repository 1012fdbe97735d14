// The picture: light, ground, robots, handler, force arrows, path traces, cameras.

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
  Mesh,
  MeshStandardMaterial,
  PCFShadowMap,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";

import { Arrow } from "./arrow.ts";
import type { Description, Settings } from "./contract.ts";
import type { Frame } from "./frame.ts";
import { Handler } from "./handler.ts";
import { Robots } from "./robots.ts";

export type View = "follow" | "side" | "top";

/** A picture may take this long [ms] before the next is drawn coarser, and less than this before it is drawn finer. */
const SLOW_MS = 45;
const QUICK_MS = 20;
/** Pixels drawn for one of the page: least, and most. */
const COARSEST = 0.5;
const FINEST = 2;

const SKY = new Color(0xcfdbe6);
const TRACE_COLORS = [0x0057b8, 0xb34700];
const TRACE_POINTS = 3000;

export class Stage {
  readonly camera = new PerspectiveCamera(45, 1, 0.05, 120);
  readonly robots: Robots;
  readonly canvas: HTMLCanvasElement;
  view: View = "follow";
  /** Camera beside what it follows: angle around [rad], height angle [rad], distance [m]; moved by the visitor. */
  readonly orbit = { around: 0, up: 0, distance: 1 };
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly sun = new DirectionalLight(0xffffff, 2.6);
  private readonly ground: Mesh<BufferGeometry, MeshStandardMaterial>;
  private readonly handler = new Handler();
  private readonly arrow = new Arrow(0xd4006a);
  private readonly traces: { line: Line; count: number; last: Vector3 }[];
  private readonly focus = new Vector3();
  private heading = 0;
  private settled = false;
  /** Without a graphics processor every pixel costs: shadows and smooth edges are left out. */
  private readonly inSoftware: boolean;
  private ratio: number;
  private pictureMs = 30;
  /** What was drawn last while time stood still. */
  private drawn = "";

  constructor(private readonly host: HTMLElement, description: Description) {
    this.inSoftware = drawsInSoftware();
    this.ratio = this.inSoftware ? 0.75 : Math.min(window.devicePixelRatio, FINEST);
    this.renderer = new WebGLRenderer({ antialias: !this.inSoftware });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.canvas = this.renderer.domElement;
    host.append(this.canvas);
    this.camera.up.set(0, 0, 1);
    this.scene.background = SKY;
    this.scene.fog = new Fog(SKY, 14, 30);
    this.scene.add(new HemisphereLight(0xf2f7ff, 0x8d8d80, 2.3));
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.setScalar(this.inSoftware ? 512 : 1024);
    const reach = 4;
    Object.assign(this.sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: 1, far: 20 });
    this.sun.shadow.normalBias = 0.02;
    this.scene.add(this.sun, this.sun.target);
    this.ground = new Mesh(new BufferGeometry(), groundMaterial());
    this.ground.receiveShadow = true;
    this.ground.frustumCulled = false;
    this.robots = new Robots(description);
    this.scene.add(this.ground, this.robots.group, this.handler.group, this.arrow.group);
    this.traces = TRACE_COLORS.map((color) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * TRACE_POINTS), 3));
      const line = new Line(geometry, new LineBasicMaterial({ color }));
      line.frustumCulled = false;
      this.scene.add(line);
      return { line, count: 0, last: new Vector3(Infinity, 0, 0) };
    });
    new ResizeObserver(() => this.resize()).observe(host);
    this.resize();
  }

  configure(settings: Settings): void {
    this.robots.configure(settings);
    this.handler.group.visible = settings.robots === 1;
    const reach = settings.robots > 1 ? 14 : 4;
    Object.assign(this.sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach });
    this.sun.shadow.camera.updateProjectionMatrix();
    this.orbit.distance = settings.robots > 1 ? 2.5 : 1;
    this.clearTraces();
  }

  clearTraces(): void {
    this.settled = false;
    for (const trace of this.traces) {
      trace.count = 0;
      trace.last.x = Infinity;
      trace.line.geometry.setDrawRange(0, 0);
    }
  }

  setGround(triangles: Float32Array): void {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(triangles, 3));
    geometry.computeVertexNormals();
    this.ground.geometry.dispose();
    this.ground.geometry = geometry;
  }

  /** Draws the moment at `share` of the way from `a` to `b`; `seconds` since the picture before, while time stands `still` finely. */
  draw(a: Frame, b: Frame, share: number, seconds: number, options: { traces: boolean; still: boolean }): void {
    if (options.still && this.alreadyDrawn(b)) return;
    if (options.still) this.sharpen();
    this.robots.update(a, b, share);
    const base = new Vector3(...b.vector(0, "position"));
    const yaw = b.yaw(0);
    this.trace(b, options.traces);
    const standing = base.z - 0.55;
    if (this.handler.group.visible) this.handler.update(this.robots.handle, yaw, standing, seconds);
    const [x, y, z] = b.force;
    const [sin, cos] = [Math.sin(yaw), Math.cos(yaw)];
    this.arrow.update(this.robots.handle, new Vector3(cos * x - sin * y, sin * x + cos * y, z));
    this.placeCamera(base, yaw, seconds);
    this.renderer.render(this.scene, this.camera);
    if (!options.still) this.adapt(seconds);
  }

  /** Whether the picture of a moment at which time stands still is the one that is shown, finely. */
  private alreadyDrawn(frame: Frame): boolean {
    const { around, up, distance } = this.orbit;
    const { clientWidth, clientHeight } = this.host;
    const asked = [frame.time, frame.force, this.view, around, up, distance, clientWidth, clientHeight].join();
    const same = asked === this.drawn && this.renderer.getPixelRatio() === FINEST;
    this.drawn = asked;
    return same;
  }

  private sharpen(): void {
    if (this.renderer.getPixelRatio() === FINEST) return;
    this.resize(FINEST);
    this.drawn = "";
  }

  /** Draws coarser where pictures come slowly, finer where there is time. */
  private adapt(seconds: number): void {
    this.pictureMs += 0.1 * (1000 * seconds - this.pictureMs);
    const most = this.inSoftware ? 1 : Math.min(window.devicePixelRatio, FINEST);
    const slow = this.pictureMs > SLOW_MS && this.ratio > COARSEST;
    const quick = this.pictureMs < QUICK_MS && this.ratio < most;
    if (!slow && !quick && this.renderer.getPixelRatio() === this.ratio) return;
    if (slow || quick) this.ratio = Math.min(Math.max(this.ratio * (slow ? 0.8 : 1.25), COARSEST), most);
    this.pictureMs = 0.5 * (SLOW_MS + QUICK_MS);
    this.resize();
  }

  /** Where a point of the world is on the canvas, in pixels of the page. */
  project(point: Vector3): [number, number] {
    const p = point.clone().project(this.camera);
    const rect = this.canvas.getBoundingClientRect();
    return [rect.left + ((p.x + 1) / 2) * rect.width, rect.top + ((1 - p.y) / 2) * rect.height];
  }

  private placeCamera(base: Vector3, yaw: number, seconds: number): void {
    const follow = this.settled ? 1 - Math.exp(-4 * seconds) : 1;
    this.settled = true;
    // Looking at the middle of dog and handler.
    const middle = new Vector3(base.x - 0.55 * Math.cos(yaw), base.y - 0.55 * Math.sin(yaw), base.z);
    this.focus.lerp(middle, follow);
    const turn = Math.atan2(Math.sin(yaw - this.heading), Math.cos(yaw - this.heading));
    this.heading += turn * (this.view !== "follow" ? 0 : follow < 1 ? 1 - Math.exp(-1.5 * seconds) : 1);
    const { around, up, distance } = this.orbit;
    const place = {
      follow: [this.heading + Math.PI - 0.95 + around, 0.3 + up, 4.2 * distance],
      side: [-Math.PI / 2 + around, 0.16 + up, 4.6 * distance],
      top: [-Math.PI / 2 + around, Math.PI / 2 - 0.02 + Math.min(up, 0), 6.5 * distance],
    }[this.view] as [number, number, number];
    const [azimuth, elevation, far] = place;
    const lift = Math.max(0.04, Math.min(Math.PI / 2 - 0.02, elevation));
    this.camera.position.set(
      this.focus.x + far * Math.cos(lift) * Math.cos(azimuth),
      this.focus.y + far * Math.cos(lift) * Math.sin(azimuth),
      this.focus.z + 0.1 + far * Math.sin(lift),
    );
    this.camera.lookAt(this.focus.x, this.focus.y, this.focus.z + 0.05);
    this.sun.position.set(this.focus.x - 3, this.focus.y + 4, this.focus.z + 8);
    this.sun.target.position.copy(this.focus);
  }

  private trace(frame: Frame, show: boolean): void {
    this.traces.forEach((trace, robot) => {
      trace.line.visible = show && robot < frame.robots && frame.robots <= 2;
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

  private resize(ratio = this.ratio): void {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.fov = width < height ? 58 : 42;
    this.camera.updateProjectionMatrix();
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

/** Concrete with a line every meter, drawn from the place in the world: no picture has to be loaded. */
function groundMaterial(): MeshStandardMaterial {
  const material = new MeshStandardMaterial({ color: 0xa9b0a4, roughness: 0.95 });
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vPlace;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvPlace = position;");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vPlace;")
      .replace(
        "#include <color_fragment>",
        `#include <color_fragment>
         vec2 off = abs(fract(vPlace.xy - 0.5) - 0.5) / max(fwidth(vPlace.xy), vec2(0.012));
         diffuseColor.rgb *= mix(0.8, 1.0, smoothstep(0.5, 1.5, min(off.x, off.y)));
         diffuseColor.rgb *= 1.0 + 0.35 * clamp(vPlace.z, -0.5, 0.5);`,
      );
  };
  return material;
}
