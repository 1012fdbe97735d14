// What the page, its worker and the module say to each other.

export type Vector = [number, number, number];
export type Mind = "learned" | "rules" | "dominance" | "oracle";
export const MINDS: readonly Mind[] = ["learned", "rules", "dominance", "oracle"];
export type Ground = "flat" | "rough" | "slopes" | "stairs" | "mixed";
export const GROUNDS: readonly Ground[] = ["flat", "rough", "slopes", "stairs", "mixed"];

/** The choices of a session, named as in the module. */
export interface Settings {
  ground: Ground;
  level: number;
  seed: number;
  minds: Mind[];
  robots: number;
  added_mass_kg: number;
  friction: number;
  bar_length_m: number;
  hand_mass_kg: number;
  force_noise_n: number;
  sensor_noise: number;
}

export type Network = "locomotion" | "supervisor";
export type Part = "foot" | "shank" | "knee" | "thigh" | "base" | "hand";
export type Field =
  | "position"
  | "orientation"
  | "joints"
  | "command"
  | "velocity"
  | "observed_force"
  | "behavior"
  | "heading_drift"
  | "fallen"
  | "base_force";

/** Where the numbers of a frame are; a training's frames have other fields than the module's. */
export interface Layout {
  header: number;
  row: number;
  fields: Partial<Record<Field, number>>;
}

/** What the module says of itself: see `description.rs`. */
export interface Description {
  frame: Layout;
  control_period_s: number;
  physics_rate_hz: number;
  joints: { name: string; parent: number; origin: Vector; axis: Vector }[];
  spheres: { part: Part; link: number; center: Vector; radius: number }[];
  harness: { bar_start: Vector; hand_height: number; hand_radius: number };
  behaviors: string[];
  thresholds_n: [number, number];
  force_low_n: Vector;
  force_high_n: Vector;
  presets: [number, number][];
  max_herd: number;
  defaults: Settings;
}

export type ToWorker =
  | { kind: "configure"; settings: Settings }
  | { kind: "load"; name: string; file: ArrayBuffer }
  | { kind: "pull"; force: Vector }
  | { kind: "tug"; force: Vector; duration: number }
  | { kind: "run"; speed: number }
  | { kind: "step" }
  | { kind: "reset" }
  | { kind: "ground"; x: number; y: number };

export type FromWorker =
  | { kind: "ready"; description: Description }
  | { kind: "configured"; settings: Settings; anew: boolean }
  | { kind: "frames"; frames: Float32Array; count: number; pace: number }
  | { kind: "ground"; triangles: Float32Array; x: number; y: number }
  | { kind: "loaded"; network: Network; name: string }
  | { kind: "refused"; what: string; reason: string }
  | { kind: "failed"; reason: string };
