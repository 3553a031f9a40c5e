/** The page: loads an asset and shows it, or says in one line why it cannot. */
import { load, loadFacts } from "./loading";
import { element, lineOf } from "./messages";
import { Viewer } from "./viewer";

async function main(): Promise<void> {
  const loading = element("loading");
  const [what, bar] = [loading.querySelector("p") as HTMLElement, loading.querySelector("progress") as HTMLProgressElement];
  document.body.dataset.state = "busy";
  try {
    const facts = await loadFacts();
    const loaded = await load(facts, assetOf(location.hash, facts.assets.length), (done, name) => {
      if (document.body.dataset.state === "failed") return;
      bar.value = done;
      what.textContent = name ? `Loading ${name.split("/").pop()}` : "Loading";
    });
    await Viewer.start(loaded);
    loading.remove();
  } catch (error) {
    document.body.dataset.state = "failed";
    loading.classList.add("failed");
    what.textContent = lineOf(error);
  }
}

/** Index of the asset that an address names; 0 where it names none that exists. */
function assetOf(hash: string, count: number): number {
  const index = Number(/'asset':(\d+)/.exec(decodeURIComponent(hash))?.[1] ?? 0);
  return index < count ? index : 0;
}

void main();
