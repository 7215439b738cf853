/** Colours for what is drawn on a canvas, read from the style sheet so that there is one place for them. */

import { signal } from "@preact/signals";

const dark = matchMedia("(prefers-color-scheme: dark)");

/** Changes when the system goes from light to dark or back. */
export const scheme = signal(dark.matches ? "dark" : "light");
const known = new Map<string, string>();
dark.addEventListener("change", () => {
  known.clear(); // before anybody who waits for the scheme asks anew
  scheme.value = dark.matches ? "dark" : "light";
});

/** Kept: a hundred drones ask for their colours with every picture. */
export function color(token: string): string {
  const before = known.get(token);
  if (before !== undefined) return before;
  const value = getComputedStyle(document.documentElement).getPropertyValue(`--${token}`).trim();
  known.set(token, value);
  return value;
}
