// The choices: their controls, and the link that restores them.

import { type Description, GROUNDS, type Ground, MINDS, type Mind, type Settings } from "./contract.ts";
import { find, make } from "./dom.ts";

/** Names of the supervisors to people. */
export const MIND_NAMES: Record<Mind, string> = {
  learned: "learned network",
  rules: "rules: Table II",
  dominance: "dominance rule",
  oracle: "oracle: true force",
};

interface NumberChoice {
  key: "level" | "added_mass_kg" | "friction" | "bar_length_m" | "hand_mass_kg" | "force_noise_n" | "sensor_noise";
  label: string;
  min: number;
  max: number;
  step: number;
}

const NUMBERS: NumberChoice[] = [
  { key: "level", label: "Difficulty, 0 to 9", min: 0, max: 9, step: 1 },
  { key: "added_mass_kg", label: "Added mass, kg", min: -10, max: 20, step: 1 },
  { key: "friction", label: "Friction", min: 0.1, max: 2, step: 0.1 },
  { key: "bar_length_m", label: "Bar, m", min: 0.5, max: 1.2, step: 0.1 },
  { key: "hand_mass_kg", label: "Hand, kg", min: 0.1, max: 5, step: 0.1 },
  { key: "force_noise_n", label: "Force noise, ± N", min: 0, max: 20, step: 1 },
  { key: "sensor_noise", label: "Sensor noise", min: 0, max: 2, step: 0.1 },
];
const HERDS = [1, 64, 128, 256];

export class Choices {
  settings: Settings;
  private readonly controls = new Map<string, HTMLInputElement | HTMLSelectElement>();

  /** `changed` is told of every change a visitor makes. */
  constructor(description: Description, private readonly changed: (settings: Settings) => void) {
    this.settings = structuredClone(description.defaults);
    const list = find("choice-list");
    const add = (key: string, label: string, control: HTMLInputElement | HTMLSelectElement) => {
      const wrap = make("label", label);
      control.id = `choice-${key}`;
      control.addEventListener("change", () => this.read());
      wrap.append(control);
      list.append(wrap);
      this.controls.set(key, control);
    };
    const select = (options: [string, string][]) => {
      const control = make("select");
      for (const [value, text] of options) {
        const option = make("option", text);
        option.value = value;
        control.append(option);
      }
      return control;
    };
    const minds = MINDS.map((mind): [string, string] => [mind, MIND_NAMES[mind]]);
    add("mind", "Supervisor", select(minds));
    add("beside", "Beside it", select([["", "nobody"], ...minds]));
    add("robots", "Dogs", select(HERDS.map((n) => [String(n), n === 1 ? "one" : `a herd of ${n}`])));
    add("ground", "Ground", select(GROUNDS.map((ground) => [ground, ground])));
    for (const { key, label, min, max, step } of NUMBERS) {
      const control = make("input");
      Object.assign(control, { type: "number", min: String(min), max: String(max), step: String(step) });
      add(key, label, control);
    }
    this.show(this.settings);
  }

  /** Shows settings that came from elsewhere. */
  show(settings: Settings): void {
    this.settings = structuredClone(settings);
    const set = (key: string, value: string) => {
      this.controls.get(key)!.value = value;
    };
    set("mind", settings.minds[0]!);
    set("beside", settings.minds[1] ?? "");
    set("robots", String(settings.robots));
    set("ground", settings.ground);
    for (const { key } of NUMBERS) set(key, String(Number(settings[key].toFixed(3))));
    this.disable();
  }

  private read(): void {
    const value = (key: string) => this.controls.get(key)!.value;
    const beside = value("beside");
    const settings = { ...this.settings, ground: value("ground") as Ground, robots: Number(value("robots")) };
    settings.minds = [value("mind") as Mind];
    if (beside && settings.robots === 1) settings.minds.push(beside as Mind);
    for (const { key } of NUMBERS) settings[key] = value(key) === "" ? this.settings[key] : Number(value(key));
    this.settings = settings;
    this.disable();
    this.changed(settings);
  }

  private disable(): void {
    // A herd's robots are drawn, all but the friction.
    for (const key of ["beside", "added_mass_kg", "bar_length_m", "hand_mass_kg"])
      this.controls.get(key)!.disabled = this.settings.robots > 1;
    this.controls.get("level")!.disabled = this.settings.ground === "flat";
  }
}

/** The address of this page with these settings: only what differs from the defaults. */
export function linkTo(settings: Settings, defaults: Settings): string {
  const query = new URLSearchParams();
  for (const [key, value] of Object.entries(settings)) {
    if (String(value) !== String(defaults[key as keyof Settings])) query.set(key, String(value));
  }
  const text = query.toString();
  return `${location.origin}${location.pathname}${text ? `?${text}` : ""}`;
}

/** Why settings cannot be chosen here, or nothing; whether their numbers can be is for the module to say. */
export function refusal({ robots }: Settings): string {
  return HERDS.includes(robots) ? "" : `robots is ${robots}, must be one of ${HERDS.join(", ")}`;
}

/** The settings an address asks for, whether they can be or not. */
export function fromLink(search: string, defaults: Settings): Settings {
  const settings: Record<string, unknown> = structuredClone(defaults) as unknown as Record<string, unknown>;
  for (const [key, value] of new URLSearchParams(search)) {
    const usual = settings[key];
    if (Array.isArray(usual)) settings[key] = value.split(",");
    else if (typeof usual === "number") settings[key] = Number(value);
    else if (typeof usual === "string") settings[key] = value;
  }
  return settings as unknown as Settings;
}
