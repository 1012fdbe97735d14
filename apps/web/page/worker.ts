// The worker: runs the simulation in real time and sends frames.

import type { FromWorker, Settings, ToWorker } from "./contract.ts";
import { Simulation } from "./module.ts";
import { reasonOf } from "./reason.ts";

/** Time between two looks at the clock [ms]. */
const TICK_MS = 8;
/** Most simulated time made up for in one tick [s]; what is beyond is dropped, and shows as a slower pace. */
const MOST_BEHIND_S = 0.1;
/** Time over which the pace is measured [s]. */
const PACE_WINDOW_S = 1;

const send = (message: FromWorker, transfer: Transferable[] = []) => self.postMessage(message, { transfer });

let simulation: Simulation;
let settings: Settings;
let period = 0.02;
let speed = 0;
let owed = 0;
let before = performance.now();
let ticking = 0;
let pace = { simulated: 0, since: before, value: 1 };

async function begin(): Promise<void> {
  const fetchBytes = async (path: string) => {
    const answer = await fetch(path);
    if (!answer.ok) throw new Error(`${path}: ${answer.status} ${answer.statusText}`);
    return new Uint8Array(await answer.arrayBuffer());
  };
  const [module, locomotion, supervisor] = await Promise.all(
    ["simulation.wasm", "policies/locomotion.onnx", "policies/supervisor.onnx"].map(fetchBytes),
  );
  simulation = await Simulation.load(module!);
  const description = simulation.describe();
  simulation.load(locomotion!);
  simulation.load(supervisor!);
  settings = description.defaults;
  simulation.configure(settings);
  period = description.control_period_s;
  send({ kind: "ready", description });
  ticking = setInterval(() => {
    try {
      tick();
    } catch (error) {
      fail(error);
    }
  }, TICK_MS);
}

/** Ends everything: a module that was stopped in the middle of a call answers no other. */
function fail(error: unknown): void {
  clearInterval(ticking);
  self.onmessage = null;
  send({ kind: "failed", reason: reasonOf(error) });
}

function tick(): void {
  const now = performance.now();
  const elapsed = (now - before) / 1000;
  before = now;
  if (speed === 0) return;
  owed = Math.min(owed + elapsed * speed, MOST_BEHIND_S);
  const steps = Math.floor(owed / period);
  if (steps === 0) return;
  owed -= steps * period;
  advance(steps);
  pace.simulated += steps * period;
  const span = (performance.now() - pace.since) / 1000;
  if (span > PACE_WINDOW_S) pace = { simulated: 0, since: performance.now(), value: pace.simulated / span };
}

function advance(steps: number): void {
  const frames = simulation.advance(steps);
  send({ kind: "frames", frames, count: Math.max(steps, 1), pace: pace.value }, [frames.buffer]);
}

/** While time stands still, its moment is shown all the same, with the pull of now. */
function showStanding(): void {
  if (speed === 0) advance(0);
}

function handle(message: ToWorker): void {
  switch (message.kind) {
    case "configure": {
      const anew = simulation.configure(message.settings);
      settings = message.settings;
      send({ kind: "configured", settings, anew });
      return advance(0);
    }
    case "load": {
      const network = simulation.load(new Uint8Array(message.file));
      send({ kind: "loaded", network, name: message.name });
      return;
    }
    case "pull":
      simulation.pull(message.force);
      return showStanding();
    case "tug":
      simulation.tug(message.force, message.duration);
      return showStanding();
    case "run":
      speed = message.speed;
      owed = 0;
      pace = { simulated: 0, since: performance.now(), value: speed };
      return showStanding();
    case "step":
      return advance(1);
    case "reset":
      simulation.reset();
      return advance(0);
    case "ground": {
      const triangles = simulation.ground(message.x, message.y);
      send({ kind: "ground", triangles, x: message.x, y: message.y }, [triangles.buffer]);
    }
  }
}

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  try {
    handle(data);
  } catch (error) {
    if (error instanceof WebAssembly.RuntimeError) return fail(error);
    const what = data.kind === "load" ? data.name : data.kind === "configure" ? "settings" : data.kind;
    send({ kind: "refused", what, reason: reasonOf(error) });
  }
};

begin().catch(fail);
