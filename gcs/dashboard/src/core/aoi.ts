/**
 * Colours for the age of information: grey is normal, the older the more salient (ISA-101), and each step differs in
 * lightness and size as well as in hue. The same bounds and names as the report's (`gcs/report/aoi_scale.py`).
 */

export interface AoiStep {
  token: string;
  label: string;
  short: string; // for the legend's scale
  belowSlots: number;
}

export const AOI_STEPS: readonly AoiStep[] = [
  { token: "aoi-0", label: "1 (just served)", short: "1", belowSlots: 2 },
  { token: "aoi-1", label: "2 to 4", short: "2–4", belowSlots: 5 },
  { token: "aoi-2", label: "5 to 9", short: "5–9", belowSlots: 10 },
  { token: "aoi-3", label: "10 to 19", short: "10–19", belowSlots: 20 },
  { token: "aoi-4", label: "20 or more", short: "20+", belowSlots: Infinity },
];

/** Index of the step that an age belongs to. */
export function aoiStep(aoiSlots: number): number {
  const index = AOI_STEPS.findIndex((step) => aoiSlots < step.belowSlots);
  return index < 0 ? AOI_STEPS.length - 1 : index;
}
