import { signal } from "@preact/signals";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";

import { paced } from "../src/core/pace";

describe("a calmer pace", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());
  const make = () => {
    const source = signal({ id: 1, value: 0 });
    return { source, calm: paced(source, 500, (one) => one.id, () => Date.now()) };
  };
  it("follows at most so often, and ends with the newest", () => {
    const { source, calm } = make();
    for (let k = 1; k <= 4; k++) {
      vi.advanceTimersByTime(100);
      source.value = { id: 1, value: k };
    }
    expect(calm.value.value).toBe(0);
    vi.advanceTimersByTime(100);
    expect(calm.value.value).toBe(4);
    vi.advanceTimersByTime(5000);
    source.value = { id: 1, value: 9 };
    expect(calm.value.value).toBe(9);
  });
  it("shows another identity at once", () => {
    const { source, calm } = make();
    source.value = { id: 1, value: 1 };
    source.value = { id: 2, value: 2 };
    expect(calm.value).toEqual({ id: 2, value: 2 });
  });
});
