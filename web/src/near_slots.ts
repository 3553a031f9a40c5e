/** Where it is kept what receivers see of cells of bright surfels, whatever the light. */

export class NearSlots {
  private readonly kept = new Map<number, number>(); // slots of cells, those asked for last at the end

  constructor(readonly count: number) {}

  /** A slot for each cell, `count` of them at most; `fill` is called for those that are new, in place of the ones not asked for longest. */
  of(cells: readonly number[], fill: (cell: number, slot: number) => void): number[] {
    const { kept } = this;
    for (const cell of cells) {
      const slot = kept.get(cell);
      if (slot === undefined || !kept.delete(cell)) continue;
      kept.set(cell, slot);
    }
    return cells.map((cell) => {
      const known = kept.get(cell);
      if (known !== undefined) return known;
      let slot = kept.size;
      if (slot >= this.count) {
        const [oldest, own] = kept.entries().next().value as [number, number];
        kept.delete(oldest);
        slot = own;
      }
      kept.set(cell, slot);
      fill(cell, slot);
      return slot;
    });
  }
}
