// A browser that runs jobs: JSON lines in, JSON lines out. node driver.mjs CHROMIUM PAGES ASSETS
import { createReadStream, existsSync, statSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { createInterface } from "node:readline";
import { chromium } from "playwright-core";

const [executablePath, pages, assets] = process.argv.slice(2);
const PATIENCE = 60_000;
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".json": "application/json", ".wasm": "application/wasm", ".png": "image/png" };

const server = createServer((request, response) => {
  const path = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
  const file = normalize(path.startsWith("/served/") ? join(assets, path.slice(8)) : join(pages, path === "/" ? "index.html" : path));
  if (!file.startsWith(normalize(assets)) && !file.startsWith(normalize(pages))) return response.writeHead(403).end();
  if (!existsSync(file) || !statSync(file).isFile()) return response.writeHead(404).end();
  response.writeHead(200, { "content-type": TYPES[extname(file)] ?? "application/octet-stream" });
  return createReadStream(file).pipe(response);
});
await new Promise((ready) => server.listen(0, "127.0.0.1", ready));

const browser = await chromium.launch({
  executablePath,
  args: [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--use-gl=angle",
    "--ignore-gpu-blocklist",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-features=Vulkan",
    "--disable-background-networking",
    "--disable-sync",
    "--no-first-run",
  ],
});
const page = await browser.newPage();
const said = [];
page.on("console", (message) => said.push(message.text()));
page.on("pageerror", (error) => said.push(String(error)));
await page.goto(`http://127.0.0.1:${server.address().port}/`);
try {
  await page.waitForFunction(() => window.runJob !== undefined, undefined, { timeout: 60_000 });
} catch (error) {
  process.stderr.write(`${said.join("\n")}\n`);
  throw error;
}
process.stdout.write(`${JSON.stringify({ ready: await browser.version() })}\n`);

for await (const line of createInterface({ input: process.stdin })) {
  said.length = 0;
  let response;
  try {
    const late = new Promise((_, reject) => setTimeout(() => reject(new Error(`no response within ${PATIENCE} ms`)), PATIENCE).unref());
    response = await Promise.race([page.evaluate((job) => window.runJob(job), JSON.parse(line)), late]);
  } catch (error) {
    response = { error: String(error) };
  }
  process.stdout.write(`${JSON.stringify({ ...response, console: said })}\n`);
}
await browser.close();
server.close();
