// Playing: worker, scene and controls put together.

import { Choices, fromLink, linkTo, refusal } from "./choices.ts";
import type { Description, FromWorker, Network, Settings, ToWorker, Vector } from "./contract.ts";
import { find, make } from "./dom.ts";
import { Frame } from "./frame.ts";
import { bindGrab } from "./grab.ts";
import { Plane } from "./plane.ts";
import { Gamepad, Pull, bindKeys, inWords } from "./pull.ts";
import { reasonOf } from "./reason.ts";
import { Recorder, download } from "./recorder.ts";
import type { View } from "./rig.ts";
import { type Stage, stageIn } from "./scene.ts";
import { Telling } from "./telling.ts";
import { Voice } from "./voice.ts";

/** The ground is drawn anew when the dog is this far from the middle of what is drawn [m]. */
const NEW_GROUND_M = 4;
const TUG_S = 0.4;
/** What a visitor did is said when nothing was done after it for this long [ms]. */
const SAY_MS = 500;
/** Sliders tell their own values, a new beginning is told as such. */
const TOLD_ELSEWHERE = ["fx", "fy", "fz", "reset"];
/** The largest file that is read [MB]: the shipped networks have less than one. */
const MOST_MB = 64;

function notice(text: string, good = false): void {
  const element = find("notice");
  element.hidden = text === "";
  element.textContent = text;
  element.classList.toggle("good", good);
}

class Page {
  /** None where the browser cannot draw. */
  private readonly stage: Stage | null;
  private readonly pull: Pull;
  private readonly plane: Plane;
  private readonly telling: Telling;
  private readonly choices: Choices;
  private readonly recorder: Recorder;
  private readonly voice = new Voice();
  private readonly gamepad: Gamepad;
  private before: Frame | null = null;
  private now: Frame | null = null;
  private arrived = 0;
  private drawnAt = 0;
  private pictures = { count: 0, since: performance.now(), rate: 0 };
  private pace = 1;
  private readonly clock = find("clock");
  private paused = false;
  private saying = 0;
  private groundAt: [number, number] | null = null;
  /** The settings that run. */
  private accepted: Settings;
  private readonly networks: Record<Network, string> = { locomotion: "the shipped one", supervisor: "the shipped one" };

  constructor(
    private readonly description: Description,
    private readonly send: (message: ToWorker, transfer?: Transferable[]) => void,
  ) {
    this.accepted = structuredClone(description.defaults);
    this.stage = stageIn(find("picture"), description);
    this.pull = new Pull(description);
    this.gamepad = new Gamepad(this.pull, description);
    this.recorder = new Recorder(description.behaviors);
    this.telling = new Telling(description, (words, behavior) => this.voice.announce(words, behavior));
    const keeps = () => find<HTMLInputElement>("hold").checked;
    this.plane = new Plane(find("plane"), description, (x, y) => this.pull.set([x, y, this.pull.force[2]], "plane"));
    this.choices = new Choices(description, (settings) => this.send({ kind: "configure", settings }));
    if (this.stage) bindGrab(this.stage, this.pull, (lane) => this.now?.yaw(lane) ?? 0, keeps);
    this.pull.listen((force, source) => {
      this.send({ kind: "pull", force });
      if (TOLD_ELSEWHERE.includes(source)) clearTimeout(this.saying);
      else this.sayLater(() => inWords(force));
    });
    this.bindHandle();
    this.bindTime();
    this.bindTools();
    this.bindFiles();
    const wanted = fromLink(location.search, description.defaults);
    const refused = refusal(wanted);
    if (refused) notice(`settings cannot be used: ${refused}`);
    else if (location.search) this.send({ kind: "configure", settings: wanted });
    this.send({ kind: "ground", x: 0, y: 0 });
    this.run();
    requestAnimationFrame((time) => this.draw(time));
    find("loading").hidden = true;
  }

  receive(message: FromWorker): void {
    switch (message.kind) {
      case "frames":
        return this.take(Frame.all(this.description.frame, message.frames, message.count), message.pace);
      case "ground":
        this.stage?.ground.set(message.triangles);
        return;
      case "configured":
        return this.configured(message.settings, message.anew);
      case "loaded":
        this.networks[message.network] = message.name;
        find("networks").textContent = `locomotion: ${this.networks.locomotion}; supervisor: ${this.networks.supervisor}`;
        this.beginAnew();
        return notice(`${message.name} is now the ${message.network} network; the dog begins again.`, true);
      case "refused":
        notice(`${message.what} cannot be used: ${message.reason}`);
        this.choices.show(this.accepted);
        return;
    }
  }

  private configured(settings: Settings, anew: boolean): void {
    this.accepted = settings;
    this.choices.show(settings);
    this.telling.configure(settings.minds);
    notice("");
    if (!anew) return;
    if (this.now) this.telling.say("begun anew");
    this.beginAnew();
  }

  /** The module has other dogs now, at the start, and no hand on the bar. */
  private beginAnew(): void {
    this.stage?.configure(this.accepted);
    this.pull.release("reset");
    this.before = this.now = null;
    this.groundAt = null;
  }

  private take(frames: Frame[], pace: number): void {
    this.pace = pace;
    for (const frame of frames) {
      if (frame.time !== this.now?.time) this.recorder.take(frame);
      this.before = this.now ?? frame;
      this.now = frame;
      this.telling.update(frame, this.paused);
    }
    this.arrived = performance.now();
    const frame = this.now!;
    const drawn = this.stage ? `, ${this.pictures.rate.toFixed(0)} pictures/s` : "";
    const told = this.paused ? "paused" : `${this.pace.toFixed(2)} × real time${drawn}`;
    this.clock.textContent = `${frame.time.toFixed(2)} s, ${told}`;
    // A jump is a new beginning: nothing is drawn in between.
    const [a, b] = [this.before!.vector(0, "position"), frame.vector(0, "position")];
    if (this.before!.robots !== frame.robots || Math.hypot(a[0] - b[0], a[1] - b[1]) > 0.5) this.before = frame;
    if (this.groundAt === null || Math.hypot(b[0] - this.groundAt[0], b[1] - this.groundAt[1]) > NEW_GROUND_M) {
      this.groundAt = [b[0], b[1]];
      this.send({ kind: "ground", x: b[0], y: b[1] });
    }
  }

  private draw(time: number): void {
    requestAnimationFrame((next) => this.draw(next));
    this.gamepad.poll();
    if (!this.before || !this.now) return;
    const seconds = Math.min((time - this.drawnAt) / 1000, 1);
    this.drawnAt = time;
    const period = (this.description.control_period_s * 1000) / this.speed;
    const share = this.paused ? 1 : Math.min((performance.now() - this.arrived) / period, 1);
    this.plane.show(this.now.force);
    const options = { traces: find<HTMLInputElement>("traces").checked, still: this.paused };
    this.stage?.draw(this.before, this.now, share, seconds, options);
    this.pictures.count += 1;
    const span = (time - this.pictures.since) / 1000;
    if (span > 2) this.pictures = { count: 0, since: time, rate: this.pictures.count / span };
  }

  private get speed(): number {
    return Number(find<HTMLSelectElement>("speed").value);
  }

  private run(): void {
    this.send({ kind: "run", speed: this.paused ? 0 : this.speed });
    const button = find("pause");
    button.textContent = this.paused ? "Go on" : "Pause";
    button.classList.toggle("on", this.paused);
  }

  private sayLater(words: () => string): void {
    clearTimeout(this.saying);
    this.saying = setTimeout(() => this.telling.say(words()), SAY_MS);
  }

  private togglePause(): void {
    this.paused = !this.paused;
    this.run();
    this.telling.say(this.paused ? "paused" : "goes on");
  }

  private oneStep(): void {
    if (!this.paused) this.togglePause();
    this.send({ kind: "step" });
    this.sayLater(() => `stepped to ${this.now?.time.toFixed(2)} s`);
  }

  private begin(): void {
    this.pull.release("reset");
    this.stage?.clearTraces();
    this.send({ kind: "reset" });
    this.telling.say("begun anew");
  }

  private bindHandle(): void {
    const axes = ["fx", "fy", "fz"].map((id, axis) => {
      const slider = find<HTMLInputElement>(id);
      // A pull to the left is positive, but the thumb belongs on the right for a pull to the right.
      const sign = id === "fy" ? -1 : 1;
      const ends = [sign * this.description.force_low_n[axis]!, sign * this.description.force_high_n[axis]!];
      [slider.min, slider.max] = [String(Math.min(...ends)), String(Math.max(...ends))];
      slider.addEventListener("input", () => {
        const force = [...this.pull.force] as Vector;
        force[axis] = sign * Number(slider.value);
        this.pull.set(force, id);
      });
      return { slider, sign, out: find(`${id}-out`) };
    });
    const presets = find("presets");
    const buttons = this.description.presets.map(([x, y]) => {
      const meant = tableTwo(this.description, x, y);
      const button = make("button", `${x}/${y}`);
      button.append(make("small", meant, `behavior ${meant}`));
      button.type = "button";
      button.dataset["preset"] = `${x}/${y}`;
      button.setAttribute("aria-label", `${inWords([x, y, 0])}: ${meant}`);
      button.addEventListener("click", () => this.pull.set([x, y, 0], "preset"));
      presets.append(button);
      return { button, x, y };
    });
    const show = ([fx, fy, fz]: Vector) => {
      axes.forEach(({ slider, sign, out }, axis) => {
        const value = [fx, fy, fz][axis]!;
        slider.value = String(sign * value);
        const words: Vector = [0, 0, 0];
        words[axis] = value;
        slider.setAttribute("aria-valuetext", inWords(words));
        out.textContent = `${value.toFixed(0)} N`;
      });
      for (const { button, x, y } of buttons) button.setAttribute("aria-pressed", String(x === fx && y === fy && fz === 0));
    };
    this.pull.listen(show);
    show([0, 0, 0]);
    find("release").addEventListener("click", () => this.pull.release("button"));
    for (const button of document.querySelectorAll<HTMLElement>("[data-tug]")) {
      const [x, y] = button.dataset["tug"]!.split(",").map(Number) as [number, number];
      button.addEventListener("click", () => this.send({ kind: "tug", force: [x, y, 0], duration: TUG_S }));
    }
    bindKeys(this.pull, {
      pause: () => this.togglePause(),
      step: () => this.oneStep(),
      reset: () => this.begin(),
      preset: (index) => buttons[index]?.button.click(),
    });
  }

  private bindTime(): void {
    find("pause").addEventListener("click", () => this.togglePause());
    find("step").addEventListener("click", () => this.oneStep());
    find("reset").addEventListener("click", () => this.begin());
    find("speed").addEventListener("change", () => this.run());
  }

  private bindTools(): void {
    const record = find("record");
    record.addEventListener("click", () => {
      if (this.recorder.recording) this.recorder.recording = false;
      else this.recorder.start();
      record.classList.toggle("on", this.recorder.recording);
      record.textContent = this.recorder.recording ? "Stop recording" : "Record";
      find<HTMLButtonElement>("download").disabled = this.recorder.recording;
    });
    find("download").addEventListener("click", () => download("guidedog.csv", this.recorder.csv()));
    find("link").addEventListener("click", () => {
      const link = linkTo(this.accepted, this.description.defaults);
      history.replaceState(null, "", link);
      const copied = navigator.clipboard?.writeText(link) ?? Promise.reject(new Error("no clipboard"));
      copied.then(
        () => notice("The link is copied.", true),
        () => notice("The link is in the address bar.", true),
      );
    });
    for (const name of ["sounds", "speech"] as const) {
      find<HTMLInputElement>(name).addEventListener("change", (event) => {
        this.voice[name] = (event.target as HTMLInputElement).checked;
      });
    }
    find("views").addEventListener("change", (event) => this.stage?.look((event.target as HTMLInputElement).value as View));
  }

  /** Files dropped on the page or opened: the width of the input tells which network it is. */
  private bindFiles(): void {
    const drop = find("drop");
    document.addEventListener("dragover", (event) => {
      event.preventDefault();
      drop.hidden = false;
    });
    document.addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null) drop.hidden = true;
    });
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      drop.hidden = true;
      const file = event.dataTransfer?.files[0];
      if (file) void this.load(file);
    });
    const input = find<HTMLInputElement>("file");
    find("open").addEventListener("click", () => input.click());
    input.addEventListener("change", () => {
      const file = input.files?.[0];
      if (file) void this.load(file);
      input.value = "";
    });
  }

  private async load(file: File): Promise<void> {
    const size = file.size / 1e6;
    if (size > MOST_MB) return notice(`${file.name} cannot be used: it has ${size.toFixed(1)} MB, must have at most ${MOST_MB}`);
    try {
      const bytes = await file.arrayBuffer();
      this.send({ kind: "load", name: file.name, file: bytes }, [bytes]);
    } catch (error) {
      notice(`${file.name} cannot be read; is it a folder? ${reasonOf(error)}`);
    }
  }
}

function tableTwo({ thresholds_n: [tx, ty] }: Description, x: number, y: number): string {
  const [back, aside] = [x < -tx, Math.abs(y) > ty];
  return back ? (aside ? "spin" : "stop") : aside ? "turn" : "walk";
}

/** Begins as soon as the worker is ready. */
export function play(): void {
  const worker = new Worker("worker.js", { type: "module" });
  let page: Page | null = null;
  const failed = (reason: string) => {
    if (page) notice(`The simulation stopped: ${reason}. Load the page again to go on.`);
    else find("loading").textContent = `The dog cannot come: ${reason}`;
  };
  worker.onmessage = ({ data }: MessageEvent<FromWorker>) => {
    if (data.kind === "failed") failed(data.reason);
    else if (data.kind === "ready") page = new Page(data.description, (message, transfer = []) => worker.postMessage(message, transfer));
    else page?.receive(data);
  };
  // A script that does not come has no message.
  worker.onerror = (event) => failed(event.message || "its script cannot be loaded");
}
