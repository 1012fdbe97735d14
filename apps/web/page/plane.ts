// The force plane: Table II's four fields, the pull with its tail; a pull can be set in it by pointer or arrow keys.

import type { Description, Vector } from "./contract.ts";

const TAIL = 60;
const SVG = "http://www.w3.org/2000/svg";

function element<K extends keyof SVGElementTagNameMap>(name: K, attributes: Record<string, string | number>): SVGElementTagNameMap[K] {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  return made;
}

export class Plane {
  private readonly point = element("circle", { r: 4, fill: "#d4006a", stroke: "#fff", "stroke-width": 1.2 });
  private readonly tail = element("polyline", { fill: "none", stroke: "#d4006a", "stroke-width": 1.2, "stroke-opacity": 0.55 });
  private readonly trail: [number, number][] = [];
  private readonly svg: SVGSVGElement;
  private readonly low: Vector;
  private readonly high: Vector;

  /** The pull forward is up, the pull to the left is on the left. `pull` is told what a visitor sets. */
  constructor(host: HTMLElement, description: Description, pull: (x: number, y: number) => void) {
    const { force_low_n: low, force_high_n: high, thresholds_n: [tx, ty] } = description;
    [this.low, this.high] = [low, high];
    const [width, height] = [high[1] - low[1], high[0] - low[0]];
    this.svg = element("svg", { viewBox: `${-high[1]} ${-high[0]} ${width} ${height}`, "aria-hidden": "true" });
    const field = (x: number, y: number, w: number, h: number, color: string, name: string) => {
      this.svg.append(element("rect", { x, y, width: w, height: h, fill: color }));
      const text = element("text", { x: x + w / 2, y: y + h / 2, "font-size": 8, "text-anchor": "middle", fill: "#16202b" });
      text.textContent = name;
      this.svg.append(text);
    };
    const columns: [number, number, boolean][] = [[-high[1], -ty, true], [-ty, ty, false], [ty, -low[1], true]];
    for (const [left, right, aside] of columns) {
      field(left, -high[0], right - left, high[0] + tx, aside ? "#d8e8fb" : "#dcf1e1", aside ? "turn" : "walk");
      field(left, tx, right - left, -low[0] - tx, aside ? "#eddcf6" : "#fadfe1", aside ? "spin" : "stop");
    }
    for (const [x1, y1, x2, y2] of [[-high[1], 0, -low[1], 0], [0, -high[0], 0, -low[0]]] as const)
      this.svg.append(element("line", { x1, y1, x2, y2, stroke: "#5b6874", "stroke-width": 0.4, "stroke-dasharray": "2 2" }));
    this.svg.append(this.tail, this.point);
    host.append(this.svg);
    host.tabIndex = 0;
    host.setAttribute("role", "group");
    host.setAttribute("aria-label", "Force plane. Arrow keys pull the handle; the sliders beside do the same.");
    const set = (event: PointerEvent) => {
      const rect = this.svg.getBoundingClientRect();
      const x = high[0] - ((event.clientY - rect.top) / rect.height) * height;
      const y = high[1] - ((event.clientX - rect.left) / rect.width) * width;
      pull(Math.round(x), Math.round(y));
    };
    host.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      host.setPointerCapture(event.pointerId);
      set(event);
    });
    for (const kind of ["pointermove", "pointerup"] as const)
      host.addEventListener(kind, (event) => {
        if (host.hasPointerCapture(event.pointerId)) set(event);
      });
  }

  show([x, y]: Vector): void {
    const clamp = (value: number, axis: 0 | 1) => Math.min(Math.max(value, this.low[axis] + 2), this.high[axis] - 2);
    const at: [number, number] = [-clamp(y, 1), -clamp(x, 0)];
    this.trail.push(at);
    if (this.trail.length > TAIL) this.trail.shift();
    this.point.setAttribute("cx", String(at[0]));
    this.point.setAttribute("cy", String(at[1]));
    this.tail.setAttribute("points", this.trail.map((p) => p.join(",")).join(" "));
  }
}
