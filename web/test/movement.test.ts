import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Movement } from "../viewer/movement";

describe("what moves", () => {
  let busy = 0;
  const changed = vi.fn();
  beforeEach(() => {
    vi.useFakeTimers();
    busy = 0;
    changed.mockClear();
  });
  afterEach(() => void vi.useRealTimers());
  const make = () => new Movement({ wait: () => void ++busy, done: () => void --busy, changed });
  const drawn = (movement: Movement, milliseconds: number) => {
    movement.drew();
    movement.frame(milliseconds);
  };

  it("keeps the light of pixels where that is fast", () => {
    const movement = make();
    movement.moved();
    drawn(movement, 20);
    expect(movement.allowsPixels).toBe(true);
  });

  it("gives it up where it is slow, until it is at rest", () => {
    const movement = make();
    movement.moved();
    expect(movement.allowsPixels).toBe(true);
    drawn(movement, 300);
    movement.frame(16); // without the light of pixels, which is as slow as it was
    movement.moved();
    expect([movement.allowsPixels, busy, changed.mock.calls.length]).toEqual([false, 1, 0]);
    vi.advanceTimersByTime(1000);
    expect([movement.allowsPixels, busy, changed.mock.calls.length]).toEqual([true, 0, 1]);
    movement.moved();
    expect(movement.allowsPixels).toBe(false);
  });

  it("tries again after a while, and takes nothing from a first frame at rest, which compiles shaders", () => {
    const movement = make();
    drawn(movement, 900);
    movement.moved();
    expect(movement.allowsPixels).toBe(true);
    drawn(movement, 300);
    vi.advanceTimersByTime(6000);
    movement.moved();
    expect(movement.allowsPixels).toBe(true);
  });
});
