import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Pace } from "../viewer/pixel_light";

describe("a camera that moves", () => {
  let busy = 0;
  const changed = vi.fn();
  beforeEach(() => {
    vi.useFakeTimers();
    busy = 0;
    changed.mockClear();
  });
  afterEach(() => void vi.useRealTimers());
  const make = () => new Pace({ wait: () => void ++busy, done: () => void --busy, changed });
  const drawn = (pace: Pace, milliseconds: number) => {
    pace.drew();
    pace.frame(milliseconds);
  };

  it("keeps the light of pixels where that is fast", () => {
    const pace = make();
    drawn(pace, 20);
    pace.moved();
    expect(pace.isFast).toBe(true);
  });

  it("gives it up where it is slow, until the camera is at rest", () => {
    const pace = make();
    drawn(pace, 300);
    expect(pace.isFast).toBe(true);
    pace.moved();
    pace.moved();
    expect([pace.isFast, busy]).toEqual([false, 1]);
    pace.frame(16); // without the light of pixels, which is as slow as it was
    expect(pace.isFast).toBe(false);
    changed.mockClear();
    vi.runAllTimers();
    expect([pace.isFast, busy, changed.mock.calls.length]).toEqual([true, 0, 1]);
  });
});
