// The WebAssembly module as an object with methods: bytes in, texts and numbers out, refusals as errors.

import type { Description, Network, Settings } from "./contract.ts";

interface Exports {
  memory: WebAssembly.Memory;
  input(length: number): number;
  output(): number;
  output_length(): number;
  describe(): void;
  load(): number;
  configure(): number;
  reset(): number;
  pull(x: number, y: number, z: number): number;
  tug(x: number, y: number, z: number, duration: number): number;
  advance(steps: number): number;
  ground(x: number, y: number): number;
}

export class Simulation {
  private readonly exports: Exports;

  private constructor(instance: WebAssembly.Instance) {
    this.exports = instance.exports as unknown as Exports;
  }

  static async load(bytes: BufferSource): Promise<Simulation> {
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new Simulation(instance);
  }

  describe(): Description {
    this.exports.describe();
    return JSON.parse(this.text());
  }

  /** Takes an ONNX file; which network it is. */
  load(file: Uint8Array): Network {
    this.give(file);
    return this.check(this.exports.load()) === 2 ? "locomotion" : "supervisor";
  }

  /** True if everything began anew. */
  configure(settings: Settings): boolean {
    this.give(new TextEncoder().encode(JSON.stringify(settings)));
    return this.check(this.exports.configure()) === 2;
  }

  reset(): void {
    this.check(this.exports.reset());
  }

  pull([x, y, z]: readonly number[]): void {
    this.check(this.exports.pull(x!, y!, z!));
  }

  tug([x, y, z]: readonly number[], duration: number): void {
    this.check(this.exports.tug(x!, y!, z!, duration));
  }

  /** The frames after each of a number of control steps; with 0 the frame of now. */
  advance(steps: number): Float32Array {
    this.check(this.exports.advance(steps));
    return this.numbers();
  }

  ground(x: number, y: number): Float32Array {
    this.check(this.exports.ground(x, y));
    return this.numbers();
  }

  private give(bytes: Uint8Array): void {
    const at = this.exports.input(bytes.length);
    new Uint8Array(this.exports.memory.buffer, at, bytes.length).set(bytes);
  }

  private check(code: number): number {
    if (code === 1) throw new Error(this.text());
    return code;
  }

  private text(): string {
    const bytes = new Uint8Array(this.exports.memory.buffer, this.exports.output(), this.exports.output_length());
    return new TextDecoder().decode(bytes);
  }

  private numbers(): Float32Array {
    return new Float32Array(this.exports.memory.buffer, this.exports.output(), this.exports.output_length() / 4).slice();
  }
}
