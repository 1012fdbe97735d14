// The curves of a training: small pictures of numbers over iterations, drawn anew when rows come.

import { find, make } from "./dom.ts";

const SVG = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT] = [220, 84];
/** Most points of a line; where there are more, means of neighbors are drawn. */
const MOST_POINTS = 220;

/** What the server tells: rows from the `from`th on; the first number of each is the iteration. */
export interface CurvesMessage {
  names: string[];
  from: number;
  rows: (number | null)[][];
}

interface Chart {
  select: HTMLSelectElement;
  value: HTMLElement;
  line: SVGPolylineElement;
  high: HTMLElement;
  low: HTMLElement;
  first: HTMLElement;
  last: HTMLElement;
}

export class Curves {
  private names: string[] = [];
  private rows: (number | null)[][] = [];
  private readonly charts: Chart[];

  /** A chart for each of the names that come first. */
  constructor(private readonly wanted: string[]) {
    this.charts = wanted.map((name) => chart(name, () => this.draw()));
  }

  get last(): { iteration: number; value(name: string): number | null } {
    const row = this.rows.at(-1);
    return { iteration: row?.[0] ?? 0, value: (name) => row?.[this.names.indexOf(name) + 1] ?? null };
  }

  take({ names, from, rows }: CurvesMessage): void {
    this.names = names;
    this.rows.length = Math.min(this.rows.length, from);
    this.rows.push(...rows);
    this.charts.forEach(({ select }, i) => {
      if (select.options.length === names.length) return;
      const chosen = select.value || this.wanted[i]!;
      select.replaceChildren(...names.map((name) => new Option(plain(name), name)));
      select.value = names.includes(chosen) ? chosen : names[0]!;
    });
    this.draw();
  }

  private draw(): void {
    for (const { select, value, line, high, low, first, last } of this.charts) {
      const column = this.names.indexOf(select.value) + 1;
      const points = this.rows.flatMap((row) => (column > 0 && row[column] != null ? [[row[0]!, row[column]!] as const] : []));
      if (points.length === 0) continue;
      const drawn = means(points, Math.ceil(points.length / MOST_POINTS));
      const values = drawn.map(([, y]) => y);
      const [least, most] = [Math.min(...values), Math.max(...values)];
      const [begin, end] = [drawn[0]![0], drawn.at(-1)![0]];
      const x = (at: number) => (end > begin ? ((at - begin) / (end - begin)) * WIDTH : WIDTH / 2);
      const y = (at: number) => (most > least ? HEIGHT - 4 - ((at - least) / (most - least)) * (HEIGHT - 8) : HEIGHT / 2);
      line.setAttribute("points", drawn.map(([a, b]) => `${x(a).toFixed(1)},${y(b).toFixed(1)}`).join(" "));
      value.textContent = short(points.at(-1)![1]);
      [high.textContent, low.textContent] = [short(most), short(least)];
      [first.textContent, last.textContent] = [String(points[0]![0]), String(end)];
    }
  }
}

function chart(name: string, changed: () => void): Chart {
  const figure = make("figure");
  const head = make("figcaption");
  const select = make("select");
  select.setAttribute("aria-label", "Curve");
  select.append(new Option(plain(name), name));
  select.addEventListener("change", changed);
  const value = make("span", "–", "value");
  head.append(select, value);
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
  svg.setAttribute("preserveAspectRatio", "none");
  svg.setAttribute("aria-hidden", "true");
  const line = document.createElementNS(SVG, "polyline");
  svg.append(line);
  const [high, low, first, last] = ["high", "low", "first", "last"].map((place) => make("small", "", place));
  const picture = make("div", "", "curve");
  picture.append(svg, high!, low!);
  const foot = make("div", "", "ends");
  foot.append(first!, make("small", "iteration"), last!);
  figure.append(head, picture, foot);
  find("curves").append(figure);
  return { select, value, line, high: high!, low: low!, first: first!, last: last! };
}

function means(points: (readonly [number, number])[], width: number): (readonly [number, number])[] {
  if (width === 1) return points;
  const made: (readonly [number, number])[] = [];
  for (let i = 0; i < points.length; i += width) {
    const part = points.slice(i, i + width);
    const sum = part.reduce(([a, b], [x, y]) => [a + x, b + y], [0, 0]);
    made.push([Math.round(sum[0] / part.length), sum[1] / part.length]);
  }
  return made;
}

/** A metric's name to people. */
export function plain(name: string): string {
  return name.replaceAll("_", " ").replace("/", ": ");
}

export function short(value: number): string {
  const size = Math.abs(value);
  if (size >= 10_000) return `${(value / 1000).toFixed(0)} k`;
  if (size >= 100) return value.toFixed(0);
  if (size >= 0.01 || size === 0) return value.toFixed(size >= 10 ? 1 : 3);
  return value.toExponential(1);
}
