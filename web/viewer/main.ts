/** The page: loads an asset and shows it, or says in one line why not. */
import { load } from "./loading";
import { element, lineOf } from "./messages";
import { Viewer } from "./viewer";

async function main(): Promise<void> {
  const loading = element("loading");
  const [what, bar] = [loading.querySelector("p") as HTMLElement, loading.querySelector("progress") as HTMLProgressElement];
  document.body.dataset.state = "busy";
  try {
    const loaded = await load((done, name) => {
      if (document.body.dataset.state === "failed") return;
      bar.value = done;
      what.textContent = name ? `Loading ${name.split("/").pop()}` : "Loading";
    });
    new Viewer(loaded);
    loading.remove();
  } catch (error) {
    document.body.dataset.state = "failed";
    loading.classList.add("failed");
    what.textContent = lineOf(error);
  }
}

void main();
