// The page by keyboard, for who does not see it, and where something is missing.

import assert from "node:assert/strict";
import { address, complaints, open, standing, time, untilSaid, untilTold, visit } from "./visitor.mjs";

/** Drops a file of zeros. */
const drop = (page, name, bytes) =>
  page.evaluate(([name, bytes]) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([new Uint8Array(bytes)], name));
    document.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
  }, [name, bytes]);

export const access = {
  async "everything by keyboard"() {
    const page = await open();
    await untilTold(page, "walks", 4);
    await page.keyboard.press("Tab");
    assert.equal(await page.evaluate(() => document.activeElement.textContent), "Skip to the handle");
    await page.keyboard.press("Enter");
    // In a slider the arrows are its own: the thumb and the pull go the same way.
    await page.focus("#fy");
    await page.keyboard.press("ArrowRight");
    assert.equal(await page.getAttribute("#fy", "aria-valuetext"), "1 N right");
    await page.keyboard.press("Escape");
    // With the focus in a checkbox they still pull.
    await page.focus("#hold");
    for (let i = 0; i < 12; i++) await page.keyboard.press("ArrowDown");
    assert.equal(await page.inputValue("#fx"), "-60");
    await untilSaid(page, "60 N back");
    await untilTold(page, "stands", 3);
    await page.keyboard.press("Escape");
    await untilSaid(page, "no pull");
    await untilTold(page, "walks", 4);
    await page.evaluate(() => document.activeElement.blur());
    await page.keyboard.press(" ");
    await untilSaid(page, "paused");
    const stopped = await standing(page);
    await page.keyboard.press(".");
    await page.waitForFunction((t) => Number.parseFloat(document.querySelector("#clock").textContent) > t, stopped);
    assert.ok(Math.abs((await time(page)) - stopped - 0.02) < 0.001, "one step");
    await untilSaid(page, `stepped to ${(await time(page)).toFixed(2)} s`);
    await page.keyboard.press(" ");
    await untilSaid(page, "goes on");
    // Held down, a key begins anew once: the same words would come a second time.
    await page.evaluate(() => (window.begun = 0));
    await page.evaluate(() => new MutationObserver(() => (window.begun += 1)).observe(document.querySelector("#said"), { childList: true }));
    for (let i = 0; i < 5; i++) await page.keyboard.down("r");
    await page.keyboard.up("r");
    await untilSaid(page, "begun anew");
    assert.equal(await page.evaluate(() => window.begun), 1);
  },

  async "every control is reached by Tab and has a name"() {
    const page = await open();
    // Of the controls of one choice, the Tab key reaches the one that is chosen.
    const expected = await page.evaluate(() => {
      window.controls = [...document.querySelectorAll("a[href], button, input, select, [tabindex='0']")].filter(
        (c) => c.checkVisibility() && !c.matches(":disabled, [type=radio]:not(:checked)"),
      );
      return window.controls.length;
    });
    const reached = new Set();
    for (let i = 0; i < expected + 5; i++) {
      await page.keyboard.press("Tab");
      reached.add(await page.evaluate(() => window.controls.indexOf(document.activeElement)));
    }
    reached.delete(-1);
    const missed = await page.evaluate((found) => window.controls.filter((_, i) => !found.includes(i)).map((c) => c.outerHTML), [...reached]);
    assert.deepEqual(missed, []);
    const nameless = await page.$$eval("button, input, select", (controls) =>
      controls.filter((c) => !c.hidden && !(c.labels?.length || c.textContent.trim() || c.getAttribute("aria-label"))).map((c) => c.id),
    );
    assert.deepEqual(nameless, []);
  },

  async "without WebGL 2 all but the picture is there"() {
    const page = await open("?minds=rules,learned", undefined, (page) => page.addInitScript(() => (HTMLCanvasElement.prototype.getContext = () => null)));
    assert.equal(await page.textContent("#picture"), "No picture: this browser has no WebGL 2.");
    await page.click('[data-preset="-60/0"]');
    await untilTold(page, "rules stands, learned stands", 6);
    await page.keyboard.press("Escape");
    await untilTold(page, "rules walks, learned walks", 6);
    // The library says on the console that there is no picture.
    complaints.length = 0;
  },

  async "what is missing or breaks is told"() {
    const missing = await visit(address, undefined, (page) => page.route("**/worker.js", (route) => route.abort()));
    await missing.waitForFunction(() => document.querySelector("#loading").textContent === "The dog cannot come: its script cannot be loaded");
    // A module that stops in the middle of a call: here after a second.
    const broken = await open("", undefined, (page) =>
      page.route("**/worker.js", async (route) => {
        const answer = await route.fetch();
        const trap = `const whole = WebAssembly.instantiate; let calls = 0;
          WebAssembly.instantiate = async (...of) => {
            const { exports } = (await whole(...of)).instance;
            const advance = (steps) => { if (++calls > 40) throw new WebAssembly.RuntimeError("unreachable"); return exports.advance(steps); };
            return { instance: { exports: { ...exports, advance } } };
          };`;
        await route.fulfill({ response: answer, body: trap + (await answer.text()) });
      }),
    );
    await broken.waitForFunction(() => document.querySelector("#notice").textContent.startsWith("The simulation stopped: unreachable"));
    complaints.length = 0;
  },

  async "refuses what is too large or cannot be read, in words"() {
    const page = await open();
    await drop(page, "whale.onnx", 65e6);
    await page.waitForSelector("#notice:not([hidden])");
    assert.equal(await page.textContent("#notice"), "whale.onnx cannot be used: it has 65.0 MB, must have at most 64");
    await page.evaluate(() => (File.prototype.arrayBuffer = () => Promise.reject(new Error("not found"))));
    await drop(page, "folder", 0);
    await page.waitForFunction(() => document.querySelector("#notice").textContent === "folder cannot be read; is it a folder? not found");
  },

  async "paused, what is chosen is drawn"() {
    const page = await open();
    await untilTold(page, "walks", 4);
    await page.keyboard.press(" ");
    await standing(page);
    const stage = page.locator("#picture");
    const drawn = async () => String(await stage.screenshot());
    const becomes = async (change) => {
      const before = await drawn();
      await change();
      for (let i = 0; i < 30; i++) {
        if ((await drawn()) !== before) return;
        await page.waitForTimeout(500);
      }
      assert.fail(`${change}: nothing changed`);
    };
    await page.waitForTimeout(2000);
    await becomes(() => page.uncheck("#traces"));
    await becomes(() => page.keyboard.press("d"));
    assert.match(await page.textContent("#clock"), /^\d+\.\d\d s, paused$/);
  },
};
