// The real page in a real browser: `apps/web/tests/browser.sh` starts the program and this.
//
// usage: node browser.mjs ADDRESS [FOLDER]   with a folder, pictures for README and docs are left there.
// GUIDEDOG is the program, for the trainings that are watched; ONLY runs the tests whose names contain it.

import assert from "node:assert/strict";
import { rm } from "node:fs/promises";
import { resolve } from "node:path";
import { access } from "./access.mjs";
import { browser, complaints, figure, folder, folders, open, recorded, simulate, told, train, untilTold, visit } from "./visitor.mjs";

const tests = {
  async "loads, walks, and tells its pace"() {
    const page = await open();
    await untilTold(page, "walks", 4);
    await simulate(page, 3);
    const clock = await page.textContent("#clock");
    assert.match(clock, /^\d+\.\d\d s, \d+\.\d\d × real time, \d+ pictures\/s$/);
    console.log(`  ${clock}`);
  },

  async "obeys the four pulls"() {
    const page = await open("", folder ? { width: 1020, height: 640 } : undefined);
    await untilTold(page, "walks", 4);
    const pulls = [
      ["-60/0", "stands", "stop"], ["0/30", "turns left", "turn"], ["-20/-30", "turns right", "turn"],
      ["-60/30", "turns on the spot left", "spin"], ["0/0", "The dog walks.", "walk"],
    ];
    for (const [preset, words, behavior] of pulls) {
      await page.click("#record");
      await page.click(`[data-preset="${preset}"]`);
      await untilTold(page, words, 60);
      await page.click("#record");
      // The recording tells the delay in simulated time, however slowly this machine draws.
      const rows = await recorded(page);
      const pulled = rows.find((row) => `${Number(row.force_x_n)}/${Number(row.force_y_n)}` === preset);
      const rightWay = (row) => Number(row.force_y_n) === 0 || Number(row.force_y_n) * row.velocity_yaw_radps > 0;
      const obeyed = rows.find((row) => Number(row.time_s) >= Number(pulled.time_s) && row.behavior === behavior && row.table_two === behavior && rightWay(row));
      const took = obeyed.time_s - pulled.time_s;
      console.log(`  ${preset}: "${await told(page)}" after ${took.toFixed(2)} s`);
      assert.ok(took <= 2, `${preset} obeyed after ${took} s`);
      if (preset === "-60/0") {
        await simulate(page, 1);
        assert.ok(Math.abs(await figure(page, 1, 2)) < 0.15, "it stands still");
      }
      if (preset === "0/30" || preset === "-20/-30") {
        await simulate(page, 1);
        assert.equal(Math.sign(await figure(page, 3, 2)), preset === "0/30" ? 1 : -1, "it turns the right way");
      }
      if (folder) {
        await simulate(page, 1);
        // Time stands still for the picture: it is drawn finely then.
        await page.click("#pause");
        await page.waitForTimeout(1500);
        const names = { "-60/0": "stop", "0/30": "turn", "-60/30": "spin", "0/0": "walk" };
        if (names[preset]) await page.locator("#stage").screenshot({ path: `${folder}/${names[preset]}.png`, scale: "css" });
        await page.click("#pause");
      }
    }
  },

  async "a gamepad pulls, and changes can be heard"() {
    const page = await open();
    await page.evaluate(() => {
      window.stick = [0, 0];
      navigator.getGamepads = () => [null, { axes: window.stick }];
      window.tones = 0;
      const start = OscillatorNode.prototype.start;
      OscillatorNode.prototype.start = function (...when) { window.tones += 1; return start.apply(this, when); };
      window.spoken = [];
      speechSynthesis.speak = (utterance) => window.spoken.push(utterance.text);
    });
    await untilTold(page, "walks", 4);
    await page.check("#sounds");
    await page.check("#speech");
    await page.evaluate(() => (window.stick = [0, 0.6]));
    await untilTold(page, "stands", 60);
    assert.ok(Number(await page.inputValue("#fx")) < -40, "the stick pulled down pulls back");
    await page.evaluate(() => (window.stick = [-0.6, 0]));
    await untilTold(page, "turns left", 60);
    await page.evaluate(() => (window.stick = [0.05, 0.05]));
    await untilTold(page, "The dog walks.", 60);
    assert.equal(await page.inputValue("#fy"), "0");
    // A gamepad that goes away has let go.
    await page.evaluate(() => (window.stick = [0, 0.6]));
    await page.waitForFunction(() => Number(document.querySelector("#fx").value) < -40);
    await page.evaluate(() => (navigator.getGamepads = () => [null]));
    await page.waitForFunction(() => document.querySelector("#fx").value === "0");
    assert.ok(await page.evaluate(() => window.tones) >= 6, "every change has its notes");
    const spoken = await page.evaluate(() => window.spoken);
    assert.ok(spoken.some((words) => words.includes("turns left")), `spoken: ${spoken}`);
  },

  async "the handle and the plane can be dragged"() {
    const page = await open();
    await untilTold(page, "walks", 4);
    await page.keyboard.press(" ");
    // The pointer says where the handle is.
    const canvas = await page.locator("#picture canvas").boundingBox();
    const handle = await (async () => {
      for (let y = canvas.y + 0.3 * canvas.height; y < canvas.y + 0.7 * canvas.height; y += 24)
        for (let x = canvas.x + 0.4 * canvas.width; x < canvas.x + 0.9 * canvas.width; x += 24) {
          await page.mouse.move(x, y);
          if (await page.locator("#picture canvas.over").count()) return { x, y };
        }
      throw new Error("no handle on the picture");
    })();
    await page.mouse.down({ button: "right" });
    await page.mouse.move(handle.x + 60, handle.y + 20, { steps: 4 });
    await page.mouse.up({ button: "right" });
    assert.equal(await page.inputValue("#fx"), "0", "only the first button takes the handle");
    await page.mouse.move(handle.x, handle.y);
    await page.mouse.down();
    // A second finger elsewhere takes nothing away.
    await page.evaluate(([x, y]) => {
      const finger = (kind) => new PointerEvent(kind, { pointerId: 99, pointerType: "touch", clientX: x, clientY: y, bubbles: true });
      for (const kind of ["pointerdown", "pointerup"]) document.querySelector("#picture canvas").dispatchEvent(finger(kind));
    }, [canvas.x + 20, canvas.y + canvas.height / 2]);
    await page.mouse.move(handle.x + 60, handle.y + 20, { steps: 4 });
    const pulled = Math.hypot(Number(await page.inputValue("#fx")), Number(await page.inputValue("#fy")));
    assert.ok(pulled > 15, `the handle pulls: ${pulled} N`);
    await page.mouse.up();
    assert.equal(await page.inputValue("#fx"), "0");
    const box = await page.locator("#plane svg").boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height * 0.8);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height * 0.75);
    await page.mouse.up();
    const back = Number(await page.inputValue("#fx"));
    assert.ok(back < -60 && back > -90, `the plane pulls: ${back} N`);
    await page.click("#release");
    assert.equal(await page.inputValue("#fx"), "0");
  },

  async "refuses a bad network in words and goes on"() {
    const page = await open();
    await page.setInputFiles("#file", { name: "cat.onnx", mimeType: "application/octet-stream", buffer: Buffer.from("not a network") });
    await page.waitForSelector("#notice:not([hidden])");
    assert.match(await page.textContent("#notice"), /cat\.onnx cannot be used: not a whole ONNX file/);
    await untilTold(page, "walks", 5);
    // The shipped supervisor, dropped, is taken; the dog begins again, and nobody pulls it.
    await page.click('[data-preset="-60/0"]');
    const bytes = await page.evaluate(async () => [...new Uint8Array(await (await fetch("policies/supervisor.onnx")).arrayBuffer())]);
    await page.evaluate((data) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([new Uint8Array(data)], "mine.onnx"));
      document.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
    }, bytes);
    await page.waitForFunction(() => document.querySelector("#networks").textContent.includes("supervisor: mine.onnx"));
    assert.match(await page.textContent("#networks"), /locomotion: the shipped one/);
    assert.equal(await page.inputValue("#fx"), "0");
  },

  async "a link restores the choices, a wrong one is explained"() {
    const page = await open("?ground=stairs&level=1&minds=rules,oracle&friction=0.6");
    await page.waitForFunction(() => document.querySelector("#choice-ground").value === "stairs");
    assert.equal(await page.inputValue("#choice-beside"), "oracle");
    await page.click("#link");
    const asked = new URL(page.url()).searchParams;
    assert.deepEqual([asked.get("ground"), asked.get("minds"), asked.get("friction")], ["stairs", "rules,oracle", "0.6"]);
    await page.close();
    const other = await open("?friction=9");
    await other.waitForSelector("#notice:not([hidden])");
    assert.match(await other.textContent("#notice"), /friction is 9, must be from 0.1 to 2/);
    await other.close();
    const pair = await open("?robots=2");
    await pair.waitForSelector("#notice:not([hidden])");
    assert.match(await pair.textContent("#notice"), /robots is 2, must be one of 1, 64, 128, 256/);
    assert.equal(await pair.inputValue("#choice-robots"), "1");
    await untilTold(pair, "The dog walks.", 5);
  },

  async "records and gives a CSV"() {
    const page = await open();
    await page.click("#record");
    await simulate(page, 1);
    await page.click("#record");
    const rows = await recorded(page);
    assert.ok(rows.length > 45, `${rows.length} rows`);
    assert.ok(rows.every((row, i) => i === 0 || Math.abs(row.time_s - rows[i - 1].time_s - 0.02) < 1e-6), "a row every 0.02 s");
    assert.ok(rows.every((row) => Object.values(row).every((value) => value !== undefined && value !== "")), "no empty cell");
  },

  async "a herd of 64 on rough ground"() {
    const page = await open("?robots=64&ground=rough");
    await page.waitForSelector("#choice-added_mass_kg:disabled");
    await page.waitForFunction(() => document.querySelector("#live").textContent.includes("of 64 dogs"), null, { timeout: 60_000 });
    console.log(`  ${await page.textContent("#clock")}`);
  },

  async "has the contrast of WCAG AA"() {
    const page = await open();
    await page.click('[data-preset="-60/30"]');
    await untilTold(page, "turns", 6);
    const weak = await page.evaluate(() => {
      const parse = (color) => color.match(/[\d.]+/g).map(Number);
      const luminance = ([r, g, b]) => {
        const [x, y, z] = [r, g, b].map((c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4));
        return 0.2126 * x + 0.7152 * y + 0.0722 * z;
      };
      const behind = (element) => {
        for (let e = element; e; e = e.parentElement) {
          const color = parse(getComputedStyle(e).backgroundColor);
          if (color.length === 3 || color[3] > 0.8) return color;
        }
        return [255, 255, 255];
      };
      const texts = [...document.querySelectorAll("body *")].filter((e) =>
        [...e.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()) && e.checkVisibility() && !e.matches(":disabled, :disabled *, script, noscript, text"));
      return texts.flatMap((e) => {
        const [a, b] = [luminance(parse(getComputedStyle(e).color)), luminance(behind(e))].sort((x, y) => y - x);
        const ratio = (a + 0.05) / (b + 0.05);
        return ratio < 4.5 ? [`${e.tagName} "${e.textContent.trim().slice(0, 30)}" ${ratio.toFixed(1)}`] : [];
      });
    });
    assert.deepEqual(weak, []);
  },

  async "fits a telephone"() {
    const page = await open("", { width: 390, height: 844 });
    await untilTold(page, "walks", 4);
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(width <= 390, `${width} px wide`);
  },

  async "two supervisors side by side under one pull"() {
    const page = await open("?minds=rules,learned", { width: 1180, height: 760 });
    await page.waitForSelector("#lanes:not([hidden])");
    await page.click('[data-preset="-60/0"]');
    await untilTold(page, "rules stands, learned stands", 6);
    await page.click('[data-preset="-60/30"]');
    await untilTold(page, "rules turns on the spot left, learned turns on the spot left", 6);
    assert.deepEqual(await page.locator("#lanes strong").allTextContents(), ["rules: Table II", "learned network"]);
    assert.deepEqual(await page.locator("#lanes span").allTextContents(), ["spin", "spin"]);
    assert.equal(await page.locator("#speeds tbody").count(), 2);
    await page.click('[data-preset="0/30"]');
    await simulate(page, 2);
    // Each half follows its own dog, and the second handle pulls like the first.
    await page.click("#pause");
    await page.evaluate(() => scrollTo(0, 0));
    await page.waitForTimeout(1500);
    const canvas = await page.locator("#picture canvas").boundingBox();
    const halves = new Set();
    for (let y = canvas.y + 0.35 * canvas.height; y < canvas.y + 0.7 * canvas.height && halves.size < 2; y += 32)
      for (let x = canvas.x + 16; x < canvas.x + canvas.width; x += 32) {
        await page.mouse.move(x, y);
        if (await page.locator("#picture canvas.over").count()) halves.add(x < canvas.x + canvas.width / 2 ? "left" : "right");
      }
    assert.equal(halves.size, 2, `handles in ${[...halves]}`);
    if (folder) {
      await page.mouse.move(2, 2);
      await page.locator("#stage").screenshot({ path: `${folder}/lanes.png`, scale: "css" });
    }
  },

  async "a training is watched while it runs"() {
    const robots = folder ? 1024 : 256;
    const settings = [`training.num_envs=${robots}`, `training.iterations=${folder ? 30 : 20}`];
    const training = await train(settings, ["--init-from", resolve("policies/locomotion.onnx"), "--watch", "--no-open"]);
    try {
      const page = await visit(training.url, { width: 1180, height: 720 });
      await page.waitForSelector("#loading", { state: "hidden", timeout: 120_000 });
      // The first picture comes when the training sends one, which may be after the page is ready.
      const live = (pattern) => new RegExp(pattern).test(document.querySelector("#clock").textContent);
      await page.waitForFunction(live, `^\\d+ of ${robots} robots, live`, { timeout: 120_000 });
      await page.waitForFunction(() => document.querySelector("#curves polyline")?.getAttribute("points")?.split(" ").length >= 3, null, { timeout: 120_000 });
      assert.match(await page.textContent("#training-title"), /walk: learning to walk/);
      assert.match(await page.textContent("#training-left"), /Iteration \d+ of \d+.*steps\/s · \d+ robots/);
      const told = await page.textContent("#one-speeds");
      await page.waitForFunction((before) => document.querySelector("#one-speeds").textContent !== before, told);
      const nameless = await page.$$eval("#training select, #training progress", (controls) => controls.filter((c) => !c.getAttribute("aria-label")).length);
      assert.equal(nameless, 0);
      if (folder) {
        const drawn = () => Number(document.querySelector("#training-progress").value) >= 24;
        await page.waitForFunction(drawn, null, { timeout: 300_000 });
        // Held, it is drawn finely.
        await page.click("#hold-picture");
        await page.waitForTimeout(3000);
        await page.screenshot({ path: `${folder}/training.png` });
        await page.click("#hold-picture");
      }
      await page.setViewportSize({ width: 390, height: 844 });
      assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390, "fits a telephone");
      await page.setViewportSize({ width: 1180, height: 720 });
      await page.waitForFunction(() => document.querySelector("#training-status").textContent.includes("finished"), null, { timeout: 300_000 });
      assert.equal(await page.inputValue("#curves select >> nth=0"), "episode_return");
    } finally {
      await training.end();
    }
  },

  async "closing and killing pages leaves a training to its bits"() {
    const settings = ["training.num_envs=64", "training.iterations=400", "task.terrain=flat", "ppo.actor_hidden=[16]", "ppo.critic_hidden=[16]"];
    const expected = await (await train(settings)).policy();
    const training = await train(settings, ["--watch", "--no-open"]);
    const seen = async () => {
      const page = await visit(training.url);
      await page.waitForSelector("#loading", { state: "hidden", timeout: 120_000 });
      return page;
    };
    const [closed, killed] = await Promise.all([seen(), seen()]);
    await closed.close();
    await killed.goto("chrome://crash").catch(() => {});
    assert.ok(expected.equals(await training.policy()), "the same policy, byte for byte");
  },
};

let failed = 0;
const wanted = process.env["ONLY"];
for (const [name, test] of Object.entries({ ...access, ...tests })) {
  if (wanted && !name.includes(wanted)) continue;
  const began = performance.now();
  try {
    await test();
    assert.deepEqual(complaints, []);
    console.log(`ok: ${name} (${((performance.now() - began) / 1000).toFixed(0)} s)`);
  } catch (error) {
    failed += 1;
    console.error(`FAILED: ${name}: ${[...complaints, error.message].join("\n")}`);
  }
  complaints.length = 0;
  for (const context of browser.contexts()) await context.close();
}
await browser.close();
await Promise.all(folders.map((path) => rm(path, { recursive: true, force: true })));
process.exit(failed === 0 ? 0 : 1);
