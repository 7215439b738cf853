/** The key for this tab only: gone when the tab is closed. */

import { signal } from "@preact/signals";

const NAME = "gcs-key";
const kept = signal<string | null>(typeof sessionStorage === "undefined" ? null : sessionStorage.getItem(NAME));

export const storedKey = (): string | null => kept.value;

export function keepKey(key: string | null): void {
  kept.value = key;
  if (key === null) sessionStorage.removeItem(NAME);
  else sessionStorage.setItem(NAME, key);
}
