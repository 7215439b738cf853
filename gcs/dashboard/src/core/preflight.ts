/** The fleet's checklist in order of what matters: red lines first, then cautions; the rest is counted. */

import type { Preflight, PreflightLine } from "./api";

export interface Checklist {
  red: PreflightLine[];
  cautions: PreflightLine[];
  good: number;
  uavs: number;
}

export function checklist({ lines }: Preflight): Checklist {
  return {
    red: lines.filter((line) => line.grade === "red"),
    cautions: lines.filter((line) => line.grade === "caution"),
    good: lines.filter((line) => line.grade === "ok").length,
    uavs: new Set(lines.map((line) => line.system_id)).size,
  };
}

export const nameOf = (line: PreflightLine): string => (line.system_id === 0 ? "A missing UAV" : `UAV ${line.system_id}`);

/** One line for all of it. */
export function verdictOf(list: Checklist): string {
  if (list.red.length > 0) return `Not ready: ${list.red.length} of ${list.red.length + list.cautions.length + list.good} checks are red`;
  const cautions = list.cautions.length === 0 ? "" : `, ${list.cautions.length} to know`;
  return `Ready: ${list.good + list.cautions.length} checks of ${list.uavs} ${list.uavs === 1 ? "UAV" : "UAVs"}, none red${cautions}`;
}
