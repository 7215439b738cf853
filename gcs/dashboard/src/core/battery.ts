/** How much is left, and whether it still brings the drone home. */

import { percent } from "./format";
import type { Severity, VehicleView } from "./types";

export const BATTERY_WARNING = 0.15;
export const BATTERY_CAUTION = 0.3;
/** Above what the way home takes: below it there is nothing left to decide. */
export const RETURN_MARGIN = 0.1;

export const batteryText = (have: number | null, home: number | null): string =>
  home === null ? percent(have) : `${percent(have)}, ${percent(home)} to return`;

/** What is wrong with it; null when nothing is. */
export function batteryAlert({ battery_fraction: have, return_fraction: home, landed }: VehicleView): [Severity, string] | null {
  if (have === null) return null;
  const text = `battery at ${percent(have)}`;
  if (home !== null && landed !== "on_ground") {
    if (have < home) return ["warning", `${text}, the way home takes ${percent(home)}`];
    if (have < home + RETURN_MARGIN) return ["caution", `${text}, the way home takes ${percent(home)}: return soon`];
  }
  if (have < BATTERY_WARNING) return ["warning", text];
  return have < BATTERY_CAUTION ? ["caution", text] : null;
}
