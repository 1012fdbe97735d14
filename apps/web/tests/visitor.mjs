// A visitor in a browser: what the tests of the page look at, and what they wait for.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtemp, readFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";

export const [address, folder] = process.argv.slice(2);
export const browser = await chromium.launch({
  executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium",
  args: [
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic",
  ],
});
export const complaints = [];

/** A page whose complaints are kept; `prepare` is given it before it is loaded. */
export async function visit(url, viewport = { width: 980, height: 700 }, prepare = async () => {}) {
  const host = new URL(url).host;
  const context = await browser.newContext({ viewport, acceptDownloads: true, reducedMotion: folder ? "no-preference" : "reduce" });
  const page = await context.newPage();
  page.on("console", (message) => {
    if (message.type() === "error") complaints.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => complaints.push(`page: ${error.message}`));
  page.on("request", (request) => {
    const url = new URL(request.url());
    if (!["data:", "blob:"].includes(url.protocol) && url.host !== host) complaints.push(`left the host: ${url}`);
  });
  page.on("websocket", (socket) => {
    if (new URL(socket.url()).host !== host) complaints.push(`left the host: ${socket.url()}`);
  });
  await prepare(page);
  await page.goto(url);
  return page;
}

/** The page, loaded and running. */
export async function open(query = "", viewport, prepare) {
  const page = await visit(address + query, viewport, prepare);
  await page.waitForSelector("#loading", { state: "hidden", timeout: 60_000 });
  await page.waitForFunction(() => document.querySelector("#clock").textContent !== "");
  return page;
}

export const folders = [];

/** A training in a folder of its own: its address if it is watched, and how to wait for the policy it ends with. */
export async function train(settings, more = []) {
  const cwd = await mkdtemp(join(tmpdir(), "guidedog-watched-"));
  folders.push(cwd);
  const sets = settings.flatMap((setting) => ["--set", setting]);
  const child = spawn(process.env["GUIDEDOG"], ["train", "locomotion", "--name", "walk", ...sets, ...more], { cwd, stdio: ["ignore", "pipe", "pipe"] });
  let complaint = "";
  child.stderr.on("data", (text) => (complaint = String(text).trim() || complaint));
  const over = new Promise((done) => child.on("exit", done));
  over.then((code) => {
    if (!code) return;
    // Its pages would wait for a picture that never comes.
    complaints.push(`the training ended with ${code}: ${complaint}`);
    for (const context of browser.contexts()) void context.close();
  });
  const watched = more.includes("--watch");
  const url = watched ? await new Promise((found) => child.stdout.once("data", (text) => found(String(text).trim()))) : "";
  const policy = async () => {
    assert.equal(await over, 0);
    return readFile(join(cwd, "runs/walk/policy.onnx"));
  };
  return { url, policy, end: () => child.kill("SIGTERM") && over };
}

export const time = async (page) => Number.parseFloat(await page.textContent("#clock"));
export const told = (page) => page.textContent("#live");
export const figure = async (page, row, column) =>
  Number(await page.locator(`#speeds tbody tr:nth-child(${row}) td:nth-of-type(${column})`).textContent());

/** Waits for simulated, not for wall time. */
export async function simulate(page, seconds) {
  const until = (await time(page)) + seconds;
  await page.waitForFunction((t) => Number.parseFloat(document.querySelector("#clock").textContent) >= t, until, { timeout: 120_000 });
}

/** Waits until the clock says that it is paused, and no more comes; the time that stands. */
export async function standing(page) {
  await page.waitForFunction(() => document.querySelector("#clock").textContent.includes("paused"));
  for (let i = 0; i < 20; i++) {
    const before = await time(page);
    await page.waitForTimeout(500);
    if ((await time(page)) === before) return before;
  }
  throw new Error("time goes on while paused");
}

/** Waits until the page tells that a visitor's doing is done. */
export async function untilSaid(page, words) {
  await page.waitForFunction((w) => document.querySelector("#said").textContent === w, words, { timeout: 60_000 });
}

/** Waits until the live region says `words`; the simulated time it took. */
export async function untilTold(page, words, most) {
  const begun = await time(page);
  await page.waitForFunction((w) => document.querySelector("#live").textContent.includes(w), words, { timeout: 60_000 });
  const took = (await time(page)) - begun;
  assert.ok(took <= most, `"${words}" after ${took.toFixed(1)} s of simulated time, at most ${most} allowed`);
  return took;
}

/** Downloads what was recorded: rows by column name. */
export async function recorded(page) {
  const [file] = await Promise.all([page.waitForEvent("download"), page.click("#download")]);
  let text = "";
  for await (const chunk of await file.createReadStream()) text += chunk;
  const [head, ...lines] = text.trim().split("\n").map((line) => line.split(","));
  return lines.map((line) => Object.fromEntries(head.map((name, i) => [name, line[i]])));
}
