// What the dog understands, in figures and in words.

import type { Description, Mind, Vector } from "./contract.ts";
import { MIND_NAMES } from "./choices.ts";
import { find, make, write } from "./dom.ts";
import type { Frame } from "./frame.ts";
import { inWords } from "./pull.ts";

/** Time between two updates of the figures [ms]: faster nobody reads. */
export const FIGURES_MS = 100;
/** A behavior is announced when it has lasted this long [s]. */
const SETTLED_S = 0.4;
export const SPEEDS = [
  { name: "ahead, m/s", most: 1.2 },
  { name: "left, m/s", most: 0.4 },
  { name: "turn, rad/s", most: 1.5 },
];
const DOES: Record<string, string> = { walk: "walks", stop: "stands", turn: "walks and turns", spin: "turns on the spot" };

export interface SpeedRow {
  commanded: HTMLElement;
  actual: HTMLElement;
  bars: SVGElement[];
}

export class Telling {
  private readonly live = find("live");
  private readonly labels = find("labels");
  /** Rows of the table of speeds, for each lane. */
  private rows: SpeedRow[][] = [];
  private shownAt = 0;
  private told = "";
  /** Words that will be told if they last. */
  private coming = { words: "", since: 0 };
  private minds: readonly Mind[] = ["learned"];

  /** `announce` is told the words of each change. */
  constructor(private readonly description: Description, private readonly announce: (words: string, behavior: string) => void) {
    this.configure(["learned"]);
  }

  /** A lane for each mind; two have a table of speeds and a sign in the picture each. */
  configure(minds: readonly Mind[]): void {
    this.minds = minds;
    const table = find("speeds");
    for (const body of table.querySelectorAll("tbody")) body.remove();
    this.rows = minds.map((mind) => {
      const body = make("tbody");
      table.append(body);
      if (minds.length > 1) {
        const head = make("th", MIND_NAMES[mind], "mind");
        Object.assign(head, { scope: "rowgroup", colSpan: 4 });
        const row = make("tr");
        row.append(head);
        body.append(row);
      }
      return SPEEDS.map(({ name }) => speedRow(body, name));
    });
    const lanes = find("lanes");
    lanes.hidden = minds.length < 2;
    lanes.replaceChildren(...minds.map((mind) => {
      const sign = make("div");
      sign.append(make("strong", MIND_NAMES[mind]), make("span"));
      return sign;
    }));
  }

  /** Shows a moment; one at which time stands still has no next that would make up for it. */
  update(frame: Frame, still: boolean): void {
    this.tell(frame);
    const now = performance.now();
    if (!still && now - this.shownAt < FIGURES_MS) return;
    this.shownAt = now;
    this.figures(frame);
  }

  /** What a visitor did, for who does not see it. A new element, so that the same words are told again. */
  say(words: string): void {
    find("said").replaceChildren(make("span", words));
  }

  private name(index: number): string {
    return this.description.behaviors[index]!;
  }

  /** Speaks of a change once it has settled. */
  private tell(frame: Frame): void {
    const { words, behavior } = this.words(frame);
    // Time that goes back is a new beginning.
    if (words !== this.coming.words || frame.time < this.coming.since) this.coming = { words, since: frame.time };
    if (words === this.told || frame.time - this.coming.since < SETTLED_S) return;
    this.told = words;
    this.live.textContent = words;
    this.announce(words, behavior);
  }

  private words(frame: Frame): { words: string; behavior: string } {
    const meant = this.name(frame.meant);
    if (frame.robots > this.minds.length) {
      const obey = Array.from({ length: frame.robots }, (_, i) => frame.value(i, "behavior")).filter((b) => b === frame.meant).length;
      const share = Math.round((10 * obey) / frame.robots) * 10;
      return { words: `About ${share} % of ${frame.robots} dogs ${meant}.`, behavior: meant };
    }
    const does = (robot: number) => {
      if (frame.value(robot, "fallen") > 0) return { behavior: "fallen", text: "has fallen" };
      const behavior = this.name(frame.value(robot, "behavior"));
      const turns = behavior === "turn" || behavior === "spin";
      const side = frame.vector(robot, "velocity")[2] > 0 ? " left" : " right";
      const wanted = frame.force[1] !== 0 ? (frame.force[1] > 0 ? " left" : " right") : side;
      return { behavior, text: DOES[behavior]! + (turns ? (meant === "turn" || meant === "spin" ? wanted : side) : "") };
    };
    const first = does(0);
    if (frame.robots === 1) return { words: `The dog ${first.text}.`, behavior: first.behavior };
    return { words: `${this.minds[0]} ${first.text}, ${this.minds[1]} ${does(1).text}.`, behavior: first.behavior };
  }

  private figures(frame: Frame): void {
    const meant = this.name(frame.meant);
    const rows: [string, string, string][] = [
      ["The pull", inWords(frame.force), ""],
      ["Table II says", meant, meant],
    ];
    if (frame.robots <= this.minds.length) {
      for (let robot = 0; robot < frame.robots; robot++) {
        const fallen = frame.value(robot, "fallen") > 0;
        const behavior = this.name(frame.value(robot, "behavior"));
        const who = frame.robots === 1 ? "The dog" : `The dog (${this.minds[robot]})`;
        rows.push([`${who} does`, fallen ? "fallen" : behavior, fallen ? "stop" : behavior]);
        const drift = (frame.value(robot, "heading_drift") * 180) / Math.PI;
        rows.push(["Heading drift in 10 s", `${drift.toFixed(1)}°`, ""]);
      }
    } else {
      const counts = this.description.behaviors.map(() => 0);
      for (let robot = 0; robot < frame.robots; robot++) counts[frame.value(robot, "behavior")]! += 1;
      rows.push(["The herd", this.description.behaviors.map((name, i) => `${name} ${counts[i]}`).join(", "), ""]);
    }
    showLabels(this.labels, rows);
    this.rows.slice(0, frame.robots).forEach((rows, robot) => showSpeeds(rows, frame.vector(robot, "command"), frame.vector(robot, "velocity")));
    if (this.minds.length > 1) {
      [...find("lanes").querySelectorAll("span")].slice(0, frame.robots).forEach((sign, robot) => {
        const fallen = frame.value(robot, "fallen") > 0;
        const behavior = this.name(frame.value(robot, "behavior"));
        write(sign, fallen ? "fallen" : behavior);
        sign.className = `behavior ${fallen ? "stop" : behavior}`;
      });
    }
  }
}

/** Rows of a term, a text and the behavior it names or none; elements are made only where their number changes. */
export function showLabels(list: HTMLElement, rows: [string, string, string][]): void {
  if (list.children.length !== 2 * rows.length) list.replaceChildren(...rows.flatMap(() => [make("dt"), make("dd")]));
  rows.forEach(([term, text, behavior], i) => {
    const value = list.children[2 * i + 1]!;
    write(list.children[2 * i]!, term);
    write(value, text);
    value.className = behavior ? `behavior ${behavior}` : "";
  });
}

export function speedRow(body: HTMLElement, name: string): SpeedRow {
  const row = make("tr");
  const head = make("th", name);
  head.scope = "row";
  const [commanded, actual, picture] = [make("td", "", "number"), make("td", "", "number"), make("td")];
  picture.innerHTML = `<svg viewBox="-50 0 100 14" aria-hidden="true"><line x1="0" x2="0" y1="0" y2="14" stroke="#5b6874" stroke-width="0.5"/><rect y="2" height="4" fill="#6b7a88"/><rect y="8" height="4" fill="#0050a8"/></svg>`;
  row.append(head, commanded, actual, picture);
  body.append(row);
  return { commanded, actual, bars: [...picture.querySelectorAll("rect")] };
}

export function showSpeeds(rows: SpeedRow[], command: Vector, velocity: Vector): void {
  rows.forEach(({ commanded, actual, bars }, i) => {
    // Adding zero takes the sign from what rounds to it.
    const figure = (value: number) => (Math.round(100 * value) / 100 + 0).toFixed(2);
    write(commanded, figure(command[i]!));
    write(actual, figure(velocity[i]!));
    // Left on the page is left of the dog.
    const sign = i === 0 ? 1 : -1;
    [command[i]!, velocity[i]!].forEach((value, bar) => {
      const end = Math.max(-50, Math.min(50, (50 * sign * value) / SPEEDS[i]!.most));
      bars[bar]!.setAttribute("x", String(Math.min(0, end)));
      bars[bar]!.setAttribute("width", String(Math.abs(end)));
    });
  });
}
