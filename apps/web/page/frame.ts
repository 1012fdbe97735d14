// One moment of all robots, read from the numbers of the module without copying them.

import type { Field, Layout, Vector } from "./contract.ts";

export class Frame {
  constructor(
    private readonly layout: Layout,
    private readonly numbers: Float32Array,
  ) {}

  /** The frames of a message, in order. */
  static all(layout: Layout, numbers: Float32Array, count: number): Frame[] {
    const length = numbers.length / count;
    return Array.from({ length: count }, (_, i) => new Frame(layout, numbers.subarray(i * length, (i + 1) * length)));
  }

  get time(): number {
    return this.numbers[0]!;
  }

  get robots(): number {
    return this.numbers[1]!;
  }

  get force(): Vector {
    return [this.numbers[2]!, this.numbers[3]!, this.numbers[4]!];
  }

  /** Table II's label of the force, an index into `behaviors`. */
  get meant(): number {
    return this.numbers[5]!;
  }

  /** `width` numbers of a field of a robot. */
  field(robot: number, name: Field, width: number): Float32Array {
    const start = this.layout.header + robot * this.layout.row + this.layout.fields[name]!;
    return this.numbers.subarray(start, start + width);
  }

  value(robot: number, name: Field): number {
    return this.field(robot, name, 1)[0]!;
  }

  vector(robot: number, name: "position" | "command" | "velocity" | "observed_force" | "base_force"): Vector {
    const [x, y, z] = this.field(robot, name, 3);
    return [x!, y!, z!];
  }

  /** The same moment, but one robot as it is in another frame. */
  withRobotOf(robot: number, other: Frame): Frame {
    const numbers = this.numbers.slice();
    const start = this.layout.header + robot * this.layout.row;
    numbers.set(other.numbers.subarray(start, start + this.layout.row), start);
    return new Frame(this.layout, numbers);
  }

  /** Heading: yaw of the base's x axis [rad]. */
  yaw(robot: number): number {
    const [w, x, y, z] = this.field(robot, "orientation", 4) as unknown as [number, number, number, number];
    return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  }
}
