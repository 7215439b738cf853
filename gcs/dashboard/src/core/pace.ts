/** Numbers that change five times a second cannot be read, and a hundred cards cannot be made so often: a calmer pace. */

import { effect, signal, untracked, type ReadonlySignal } from "@preact/signals";

/**
 * A signal that follows another at most every `everyMs`; at once when `identity` of the value is another one. What came
 * in between is not lost: the newest value follows when its time has come.
 */
export function paced<T>(source: ReadonlySignal<T>, everyMs: number, identity: (value: T) => unknown, now: () => number = () => performance.now()): ReadonlySignal<T> {
  const calm = signal(untracked(() => source.value));
  let lastMs = -Infinity;
  let timer: ReturnType<typeof setTimeout> | null = null;
  const take = (): void => {
    timer = null;
    lastMs = now();
    calm.value = source.peek();
  };
  effect(() => {
    const value = source.value;
    const waitMs = identity(value) !== identity(calm.peek()) ? 0 : lastMs + everyMs - now();
    if (waitMs <= 0) {
      if (timer !== null) clearTimeout(timer);
      take();
    } else timer ??= setTimeout(take, waitMs);
  });
  return calm;
}
