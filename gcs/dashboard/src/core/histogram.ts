/** How many users wait how long. Bounds are finer than the map's colours and never straddle one of them. */

import { aoiStep } from "./aoi";

export interface Bin {
  label: string;
  short: string; // the lower bound
  from: number; // slots, inclusive
  step: number; // colour
  count: number;
}

const FROM = [0, 2, 3, 5, 7, 10, 15, 20, 30, 50];
const SHORT = ["1", "2", "3", "5", "7", "10", "15", "20", "30", "50"]; // where the bars are too narrow for both bounds
const LABELS = ["1", "2", "3–4", "5–6", "7–9", "10–14", "15–19", "20–29", "30–49", "50+"];

export function aoiHistogram(users: readonly { aoi_slots: number }[]): Bin[] {
  const bins = FROM.map((from, k) => ({ label: LABELS[k] ?? "", short: SHORT[k] ?? "", from, step: aoiStep(from), count: 0 }));
  for (const { aoi_slots } of users) {
    const bin = bins.findLast((one) => aoi_slots >= one.from);
    if (bin !== undefined) bin.count += 1;
  }
  return bins;
}

/** The same in words, for who does not see the bars. */
export const histogramText = (bins: readonly Bin[]): string =>
  bins.filter((bin) => bin.count > 0).map((bin) => `AoI ${bin.label}: ${bin.count}`).join(", ") || "no users yet";
