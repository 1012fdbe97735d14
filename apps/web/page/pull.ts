// The visitor's pull: set by sliders, plane, keys, presets, gamepad or the handle itself, all the same.

import type { Description, Vector } from "./contract.ts";
import { find } from "./dom.ts";

const GAMEPAD_STEP_N = 5;

type Listener = (force: Vector, source: string) => void;

export class Pull {
  force: Vector = [0, 0, 0];
  private readonly listeners: Listener[] = [];

  constructor(private readonly description: Description) {}

  listen(listener: Listener): void {
    this.listeners.push(listener);
  }

  /** Sets the pull [N], within limits. */
  set(force: Vector, source: string): void {
    const { force_low_n: low, force_high_n: high } = this.description;
    this.force = force.map((f, axis) => Math.min(Math.max(f, low[axis]!), high[axis]!)) as Vector;
    for (const listener of this.listeners) listener(this.force, source);
  }

  add(x: number, y: number, source: string): void {
    this.set([this.force[0] + x, this.force[1] + y, this.force[2]], source);
  }

  release(source: string): void {
    this.set([0, 0, 0], source);
  }
}

/** "60 N back, 30 N left". */
export function inWords([x, y, z]: Vector): string {
  const part = (value: number, more: string, less: string) =>
    Math.abs(value) < 0.5 ? [] : [`${Math.abs(value).toFixed(0)} N ${value > 0 ? more : less}`];
  const parts = [...part(x, "forward", "back"), ...part(y, "left", "right"), ...part(z, "up", "down")];
  return parts.length > 0 ? parts.join(", ") : "no pull";
}

const ARROWS = ["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"];
/** Keys that controls use themselves, by their type; those that are not here, fields and lists, use all. */
const OWN_KEYS: Record<string, string[]> = { button: [" "], checkbox: [" "], radio: [" ", ...ARROWS], range: ARROWS };

/** Whether a key is meant for the page: keys are not switched off, as who speaks to the browser does, and no control uses it itself. */
export function isForPage(event: KeyboardEvent): boolean {
  if (event.ctrlKey || event.altKey || event.metaKey || !find<HTMLInputElement>("keys").checked) return false;
  const { type } = event.target as HTMLInputElement;
  return !type || OWN_KEYS[type]?.includes(event.key) === false;
}

/** Keys for the handle and the clock; Esc lets go wherever it is pressed. */
export function bindKeys(pull: Pull, actions: { pause(): void; step(): void; reset(): void; preset(index: number): void }): void {
  document.addEventListener("keydown", (event) => {
    const amount = event.shiftKey ? 1 : 5;
    const arrows: Record<string, [number, number]> = {
      ArrowUp: [amount, 0],
      ArrowDown: [-amount, 0],
      ArrowLeft: [0, amount],
      ArrowRight: [0, -amount],
    };
    const arrow = arrows[event.key];
    if (event.key === "Escape") pull.release("keys");
    else if (!isForPage(event)) return;
    else if (arrow) pull.add(...arrow, "keys");
    else if (event.key === ".") actions.step();
    else if (/^[1-9]$/.test(event.key)) actions.preset(Number(event.key) - 1);
    else if (event.key === " " || event.key === "r") {
      // A key that is held down comes again and again: good for a pull or a step, not for these two.
      if (!event.repeat) actions[event.key === " " ? "pause" : "reset"]();
    } else return;
    event.preventDefault();
  });
}

/** A gamepad's left stick pulls while it is out of its middle. */
export class Gamepad {
  private pulling = false;

  constructor(private readonly pull: Pull, private readonly description: Description) {}

  poll(): void {
    const pad = navigator.getGamepads?.().find((found) => found !== null);
    // A gamepad that went away has let go.
    const [right = 0, down = 0] = pad?.axes ?? [];
    const away = Math.hypot(right, down) > 0.15;
    const { force_low_n: low, force_high_n: high } = this.description;
    // A thumb is never quite still: a pull that changed all the time would never be told.
    const rounded = (force: number) => GAMEPAD_STEP_N * Math.round(force / GAMEPAD_STEP_N);
    const force: Vector = [rounded(down > 0 ? down * low[0] : -down * high[0]), rounded(-right * high[1]), 0];
    if (away && String(force) !== String(this.pull.force)) this.pull.set(force, "gamepad");
    else if (!away && this.pulling) this.pull.release("gamepad");
    this.pulling = away;
  }
}
