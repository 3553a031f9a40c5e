/** Files of an asset's folder, fetched and compared with the checksums that asset.json records. */
import { SrbfError } from "./errors";
import { insidePath, type Manifest } from "./manifest";

export type Fetch = (url: string) => Promise<Response>;

export class AssetFiles {
  constructor(
    private readonly folder: string,
    private readonly fetcher: Fetch,
    private readonly manifest: Manifest,
    private readonly verify: boolean,
  ) {}

  /** The bytes of a file. @throws SrbfError where it is missing or, with `verify`, not as it was written. */
  async bytes(name: string): Promise<ArrayBuffer> {
    const url = this.folder + insidePath(name);
    const buffer = await (await fetched(this.fetcher, url)).arrayBuffer();
    const expected = this.manifest.sha256?.[name];
    if (this.verify && expected !== undefined && (await sha256(buffer)) !== expected) {
      throw new SrbfError(`expected ${url} as it was written, found another checksum: it is damaged or was changed; upload the asset again`);
    }
    return buffer;
  }
}

/** @throws SrbfError with the status where the server does not return the file. */
export async function fetched(fetcher: Fetch, url: string): Promise<Response> {
  let response: Response;
  try {
    response = await fetcher(url);
  } catch (error) {
    throw new SrbfError(`expected a response for ${url}, found ${error instanceof Error ? error.message : String(error)}; is the server up?`);
  }
  if (!response.ok) throw new SrbfError(`expected a file at ${url}, found status ${response.status}; serve the asset's whole folder`);
  return response;
}

async function sha256(buffer: ArrayBuffer): Promise<string> {
  const digest = await crypto.subtle.digest("SHA-256", buffer);
  return [...new Uint8Array(digest)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
