/** A lightmap asset of a square plate, 2 m wide, in PlayCanvas: `?asset=FOLDER`. A point light orbits above it. */
import * as pc from "playcanvas";
import { pointLight } from "srbf";
import { SrbfRelightingMap } from "srbf/playcanvas";

const canvas = document.querySelector("canvas") as HTMLCanvasElement;
const device = await pc.createGraphicsDevice(canvas, { deviceTypes: [pc.DEVICETYPE_WEBGL2] });
const options = new pc.AppOptions();
options.graphicsDevice = device;
options.componentSystems = [pc.RenderComponentSystem, pc.CameraComponentSystem];
const app = new pc.AppBase(canvas);
app.init(options);
app.setCanvasFillMode(pc.FILLMODE_FILL_WINDOW);
app.setCanvasResolution(pc.RESOLUTION_AUTO);
app.start();

const camera = new pc.Entity("camera");
camera.addComponent("camera", { clearColor: new pc.Color(0.1, 0.1, 0.1), gammaCorrection: pc.GAMMA_SRGB });
camera.setPosition(1.05, 2.1, 1.8);
camera.lookAt(0, 0, 0);
app.root.addChild(camera);

const map = await SrbfRelightingMap.load(new URLSearchParams(location.search).get("asset") ?? "asset", device);
const plate = new pc.Entity("plate");
plate.addComponent("render", { type: "plane", material: map.material({ channel: 0, albedo: [0.75, 0.55, 0.35] }) });
plate.setLocalScale(2, 1, 2);
app.root.addChild(plate);

app.on("update", () => {
  const turn = performance.now() / 4000;
  map.lights[0] = pointLight([0.9 * Math.cos(turn), 0.9 * Math.sin(turn), 1.1], { color: [6, 6, 6], falloff: "inverse-square" });
  map.update();
});
