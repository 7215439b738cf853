/** Which of the campaign's controls its state allows; the server decides again. */

import type { CampaignAct } from "./api";

const ALLOWED: Record<CampaignAct, readonly string[]> = {
  start: ["draft", "ready"],
  pause: ["flying"],
  resume: ["paused"],
  abort: ["launching", "flying", "paused"],
};

export const allowed = (act: CampaignAct, state: string | null): boolean => state !== null && ALLOWED[act].includes(state);

export const isOver = (state: string): boolean => ["done", "aborted", "failed"].includes(state);

/** Its drones fly slots, or hold within one. */
export const slotsAreFlown = (state: string): boolean => ["flying", "paused"].includes(state);
