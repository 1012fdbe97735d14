// Records the first dog, a row a control step, as CSV with units in the names.

import type { Frame } from "./frame.ts";

const COLUMNS = [
  "time_s",
  "force_x_n", "force_y_n", "force_z_n",
  "observed_force_x_n", "observed_force_y_n", "observed_force_z_n",
  "table_two", "behavior",
  "command_x_mps", "command_y_mps", "command_yaw_radps",
  "velocity_x_mps", "velocity_y_mps", "velocity_yaw_radps",
  "position_x_m", "position_y_m", "position_z_m", "yaw_rad", "heading_drift_rad", "fallen",
];
/** An hour at 50 rows a second. */
const MOST_ROWS = 180_000;

export class Recorder {
  recording = false;
  private rows: string[] = [];

  constructor(private readonly behaviors: readonly string[]) {}

  start(): void {
    this.rows = [];
    this.recording = true;
  }

  take(frame: Frame): void {
    if (!this.recording || this.rows.length >= MOST_ROWS) return;
    const number = (value: number) => Number(value.toFixed(5)).toString();
    this.rows.push(
      [
        frame.time.toFixed(2),
        ...frame.force.map(number),
        ...frame.vector(0, "observed_force").map(number),
        this.behaviors[frame.meant],
        this.behaviors[frame.value(0, "behavior")],
        ...frame.vector(0, "command").map(number),
        ...frame.vector(0, "velocity").map(number),
        ...frame.vector(0, "position").map(number),
        number(frame.yaw(0)),
        number(frame.value(0, "heading_drift")),
        frame.value(0, "fallen"),
      ].join(","),
    );
  }

  csv(): string {
    return `${[COLUMNS.join(","), ...this.rows].join("\n")}\n`;
  }
}

/** Gives a text to the visitor as a file. */
export function download(name: string, text: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
