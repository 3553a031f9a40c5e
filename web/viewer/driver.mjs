// A browser for the viewer's tests: JSON lines in, JSON lines out. node driver.mjs CHROMIUM
import { readFile } from "node:fs/promises";
import { createInterface } from "node:readline";
import { chromium } from "playwright-core";

const browser = await chromium.launch({
  executablePath: process.argv[2],
  args: [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--use-gl=angle",
    "--ignore-gpu-blocklist",
    "--force-color-profile=srgb",
    "--disable-background-networking",
    "--disable-sync",
    "--no-first-run",
    "--disable-gpu-rasterization",
  ],
});
const said = [];
let context;
let page;

const settled = () => page.waitForFunction(() => document.body.dataset.state !== "busy" && document.body.dataset.state, undefined, { timeout: 60_000, polling: 20 });

const commands = {
  /** `moving`: do not wait for the page to come to rest. */
  async open({ url, width = 900, height = 700, touch = false, moving = false }) {
    await context?.close();
    context = await browser.newContext({ viewport: { width, height }, acceptDownloads: true, hasTouch: touch });
    context.setDefaultTimeout(30_000);
    page = await context.newPage();
    page.on("console", (message) => said.push(`${message.type()}: ${message.text()}`));
    page.on("pageerror", (error) => said.push(`error: ${error}`));
    page.on("request", (request) => {
      const home = new URL(url).protocol === "file:" ? url.split("#")[0] : new URL(url).origin;
      if (!request.url().startsWith(home) && !/^(blob|data):/.test(request.url())) said.push(`error: asked for ${request.url()}`);
    });
    await page.goto(url);
    if (!moving) await settled();
  },
  async run({ script }) {
    const value = await page.evaluate(script);
    return value;
  },
  /** The address, once it is up to date. */
  async address() {
    await page.waitForFunction(() => document.body.dataset.address !== "old", undefined, { timeout: 60_000, polling: 20 });
    return page.url();
  },
  async drag({ path }) {
    await page.mouse.move(...path[0]);
    await page.mouse.down();
    for (const point of path.slice(1)) await page.mouse.move(...point, { steps: 3 });
    await page.mouse.up();
    await settled();
  },
  /** Several taps are one gesture: on a machine too busy to make them in time they are made again. */
  async touch({ at, count = 1 }) {
    for (let tries = 0; tries < 8; ++tries) {
      const began = Date.now();
      for (let i = 0; i < count; ++i) await page.touchscreen.tap(...at);
      const took = Date.now() - began;
      await settled();
      if (count === 1 || took < 250) break;
    }
  },
  async click({ at, count = 1 }) {
    await page.mouse.click(...at, { clickCount: count });
    await settled();
  },
  async press({ keys }) {
    for (const key of keys) await page.keyboard.press(key);
    await settled();
  },
  /** Type a number into the panel's row of that name. */
  async number({ name, value }) {
    const input = page.locator(`.lil-gui .controller:has(.name:text-is("${name}")) input`).first();
    await input.fill(String(value));
    await input.press("Enter");
    await settled();
  },
  async choose({ selector, value }) {
    await page.selectOption(selector, value);
    await settled();
  },
  /** Click what hands out a file; its name and bytes. */
  async download({ text }) {
    const [download] = await Promise.all([page.waitForEvent("download"), page.getByText(text, { exact: true }).click()]);
    await settled();
    return { name: download.suggestedFilename(), bytes: (await readFile(await download.path())).toString("base64") };
  },
  /** `moving`: as for `open`. */
  async drop({ name, bytes, moving = false }) {
    const data = await page.evaluateHandle(
      ([file, text]) => {
        const transfer = new DataTransfer();
        transfer.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], file));
        return transfer;
      },
      [name, bytes],
    );
    await page.dispatchEvent("#stage", "drop", { dataTransfer: data });
    await page.waitForTimeout(50);
    if (!moving) await settled();
  },
  /** The canvas as RGBA bytes, top row first. */
  async canvas() {
    return page.evaluate(() => {
      const source = document.getElementById("canvas");
      const copy = document.createElement("canvas");
      copy.width = source.width;
      copy.height = source.height;
      const context = copy.getContext("2d");
      context.drawImage(source, 0, 0);
      const { data } = context.getImageData(0, 0, copy.width, copy.height);
      let text = "";
      for (let i = 0; i < data.length; i += 32768) text += String.fromCharCode(...data.subarray(i, i + 32768));
      return { width: copy.width, height: copy.height, bytes: btoa(text) };
    });
  },
  async shot({ path }) {
    await page.screenshot({ path, timeout: 60_000 });
  },
};

process.stdout.write(`${JSON.stringify({ ready: browser.version() })}\n`);
for await (const line of createInterface({ input: process.stdin })) {
  said.length = 0;
  const { do: what, ...job } = JSON.parse(line);
  let response;
  try {
    response = { value: await commands[what](job) };
  } catch (error) {
    response = { error: String(error) };
  }
  process.stdout.write(`${JSON.stringify({ ...response, said })}\n`);
}
await browser.close();
