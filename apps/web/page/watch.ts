// Watching a training: robots and curves as its server sends them over a WebSocket. The page only listens.

import type { Description, Layout } from "./contract.ts";
import { Curves, type CurvesMessage, plain, short } from "./curves.ts";
import { find, make, write } from "./dom.ts";
import { Frame } from "./frame.ts";
import { bindGrab } from "./grab.ts";
import { Simulation } from "./module.ts";
import { inWords } from "./pull.ts";
import { reasonOf } from "./reason.ts";
import type { View } from "./rig.ts";
import { type Stage, stageIn } from "./scene.ts";
import { FIGURES_MS, SPEEDS, type SpeedRow, showLabels, showSpeeds, speedRow } from "./telling.ts";

/** Frames come in bursts, one an iteration: they are shown so that this much time [s] is left to show. */
const BUFFER_S = 1.2;
/** Slowest and fastest showing, as a factor of simulated time. */
const PACES = [0.1, 2.5] as const;
/** More frames than this are not kept for later. */
const MOST_FRAMES = 300;
/** Time between two attempts to hear of the training again [ms]. */
const RETRY_MS = 2000;
/** A screen reader is told how it goes this often [ms]. */
const TELL_MS = 20_000;
/** Charts of the most important curves. */
const FIRST_CURVES = ["episode_return"];
const MORE_CURVES = ["kl", "steps_per_s"];
const MOST_CHARTS = 6;

/** The server's first message. */
interface Hello {
  kind: "hello";
  run: string;
  task: string;
  robots: number;
  iterations: number;
  shown: string[];
  frame: Layout;
}
type Told = Hello | ({ kind: "curves" } & CurvesMessage) | { kind: "ended"; how: string };

export async function watch(): Promise<void> {
  document.body.classList.add("watching");
  document.title = "guidedog: watching a training";
  try {
    const answer = await fetch("simulation.wasm");
    if (!answer.ok) throw new Error(`simulation.wasm: ${answer.status} ${answer.statusText}`);
    // Nothing is simulated here: the module knows what the robot looks like.
    const module = await Simulation.load(await answer.arrayBuffer());
    new Watching(module.describe());
  } catch (error) {
    find("loading").textContent = `The training cannot be shown: ${reasonOf(error)}`;
  }
}

class Watching {
  /** None where the browser cannot draw. */
  private readonly stage: Stage | null;
  private readonly status = find("training-status");
  private readonly speeds: SpeedRow[];
  /** The picture stands still; the ground of robots that came meanwhile is kept. */
  private held = false;
  private missed: Float32Array | null = null;
  private hello: Hello | null = null;
  private curves: Curves | null = null;
  private queue: Frame[] = [];
  private before: Frame | null = null;
  private now: Frame | null = null;
  /** Simulated time that is shown [s]. */
  private shownTime = 0;
  private drawnAt = 0;
  private figuresAt = 0;
  private toldAt = -Infinity;
  private readonly pace = { iterations: [] as [number, number][] };
  private ended = false;

  constructor(private readonly description: Description) {
    find("picture").setAttribute("aria-label", "Robots in training on their ground. How the training goes is told below.");
    const stage = stageIn(find("picture"), description);
    this.stage = stage;
    if (stage) {
      stage.configure({ ...description.defaults, robots: 2 });
      stage.orbit.distance = 1.7;
      bindGrab(stage, null, () => 0, () => false);
      find("views").addEventListener("change", (event) => stage.look((event.target as HTMLInputElement).value as View));
    }
    const body = make("tbody");
    find("one-speeds").append(body);
    this.speeds = SPEEDS.map(({ name }) => speedRow(body, name));
    const hold = find("hold-picture");
    hold.addEventListener("click", () => {
      this.held = !this.held;
      hold.textContent = this.held ? "Go on" : "Hold the picture";
      hold.classList.toggle("on", this.held);
      if (this.held) return;
      this.queue = [];
      if (this.missed) this.shown(this.missed);
      this.missed = null;
    });
    find("loading").textContent = "Waiting for the training…";
    this.listen();
    requestAnimationFrame((time) => this.draw(time));
  }

  private listen(): void {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (typeof data === "string") this.told(JSON.parse(data));
      else this.shown(new Float32Array(data));
    };
    let opened = false;
    socket.onopen = () => (opened = true);
    socket.onclose = async () => {
      if (this.ended) return;
      // No page is told why a socket was refused: a server that answers all else has hardly another reason.
      const full = !opened && (await fetch(location.href, { method: "HEAD" }).then(({ ok }) => ok, () => false));
      const how = full ? "This page is not let in, perhaps because too many watch already" : "The training is no longer heard of";
      write(this.status, `${how}; trying again.`);
      setTimeout(() => this.listen(), RETRY_MS);
    };
  }

  private told(message: Told): void {
    switch (message.kind) {
      case "hello": {
        this.hello = message;
        this.queue = [];
        find("training-title").textContent = `${message.run}: ${message.task === "supervisor" ? "learning what a pull means" : "learning to walk"}`;
        const names = [...FIRST_CURVES, ...message.shown, ...MORE_CURVES];
        find("curves").replaceChildren();
        this.curves = new Curves(names.slice(0, MOST_CHARTS));
        this.status.textContent = "Watching; the first iteration is under way.";
        return;
      }
      case "curves":
        this.curves?.take(message);
        return this.progress();
      case "ended":
        this.ended = true;
        find("training-left").textContent = "";
        this.status.textContent = `The training has ${message.how === "finished" ? "finished" : message.how === "stopped" ? "been stopped; it can be resumed" : "failed; its terminal says why"}.`;
    }
  }

  /** A binary message: 0 and a frame, or 1, the sample's number, its place and the triangles of its ground. */
  private shown(numbers: Float32Array): void {
    if (this.held) {
      if (numbers[0] === 1) this.missed = numbers;
    } else if (numbers[0] === 1) {
      this.stage?.ground.set(numbers.slice(4));
      this.queue = [];
      this.before = this.now = null;
      this.stage?.clearTraces();
    } else if (this.hello) {
      if (this.queue.length < MOST_FRAMES) this.queue.push(new Frame(this.hello.frame, numbers.subarray(1)));
      find("loading").hidden = true;
    }
  }

  private progress(): void {
    const { curves, hello } = this;
    if (!curves || !hello) return;
    const { iteration, value } = curves.last;
    const bar = find<HTMLProgressElement>("training-progress");
    [bar.max, bar.value] = [hello.iterations, iteration];
    const times = this.pace.iterations;
    times.push([performance.now(), iteration]);
    if (times.length > 30) times.shift();
    const [began, first] = times[0]!;
    const each = (performance.now() - began) / Math.max(iteration - first, 1);
    const left = iteration > first ? `, ${duration((each * (hello.iterations - iteration)) / 1000)} left` : "";
    const rate = value("steps_per_s");
    find("training-left").textContent =
      `Iteration ${iteration} of ${hello.iterations}${left}` + (rate === null ? "" : ` · ${short(rate)} steps/s`) + ` · ${hello.robots} robots`;
    if (performance.now() - this.toldAt < TELL_MS) return;
    this.toldAt = performance.now();
    const score = [...hello.shown, "episode_return"].find((name) => value(name) !== null);
    this.status.textContent = `Iteration ${iteration} of ${hello.iterations}${score ? `, ${plain(score)} ${short(value(score)!)}` : ""}.`;
  }

  private draw(time: number): void {
    requestAnimationFrame((next) => this.draw(next));
    const seconds = Math.min((time - this.drawnAt) / 1000, 0.5);
    this.drawnAt = time;
    if (!this.held) this.advance(seconds);
    if (!this.before || !this.now) return;
    const span = this.now.time - this.before.time;
    const share = span > 0 ? Math.min(Math.max((this.shownTime - this.before.time) / span, 0), 1) : 1;
    this.stage?.draw(this.before, this.now, share, seconds, { traces: false, still: this.held, ownForces: true });
    if (time - this.figuresAt < FIGURES_MS) return;
    this.figuresAt = time;
    this.figures(this.now);
  }

  /** Goes on in simulated time, faster the more of it waits. */
  private advance(seconds: number): void {
    if (!this.now) {
      const first = this.queue.shift();
      if (!first) return;
      this.before = this.now = first;
      this.shownTime = first.time;
    }
    const waiting = (this.queue.at(-1) ?? this.now).time - this.shownTime;
    const pace = Math.min(Math.max(waiting / BUFFER_S, PACES[0]), PACES[1]);
    this.shownTime = Math.min(this.shownTime + pace * seconds, this.now.time + Math.max(waiting, 0));
    while (this.shownTime > this.now!.time && this.queue.length > 0) {
      this.before = this.now;
      this.now = this.queue.shift()!;
    }
    // Robots that begin a new episode jump to their start: nothing is drawn in between.
    if (this.before && this.now && this.before !== this.now) this.before = withoutJumps(this.before, this.now);
    write(find("clock"), `${this.now!.robots} of ${this.hello?.robots ?? 0} robots, ${this.ended ? "ended" : "live"}`);
  }

  private figures(frame: Frame): void {
    const meant = this.description.behaviors[frame.meant]!;
    const rows: [string, string, string][] = [
      ["Hand pulls", inWords(frame.force), ""],
    ];
    if (this.hello?.task === "supervisor") rows.push(["Table II says", meant, meant]);
    else rows.push(["Base is pushed", inWords(frame.vector(0, "base_force")).replace("no pull", "no push"), ""]);
    showSpeeds(this.speeds, frame.vector(0, "command"), frame.vector(0, "velocity"));
    showLabels(find("one"), rows);
  }
}

/** The frame before, with the robots that jumped already where they are after. */
function withoutJumps(before: Frame, now: Frame): Frame {
  let mended = before;
  for (let robot = 0; robot < Math.min(before.robots, now.robots); robot++) {
    const [p, q] = [before.vector(robot, "position"), now.vector(robot, "position")];
    if (Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) > 0.4) mended = mended.withRobotOf(robot, now);
  }
  return mended;
}

function duration(seconds: number): string {
  const minutes = seconds / 60;
  if (minutes < 1.5) return `${seconds.toFixed(0)} s`;
  return minutes < 90 ? `${minutes.toFixed(0)} min` : `${(minutes / 60).toFixed(1)} h`;
}
