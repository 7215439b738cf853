/** Why a drone does what it does: the server's explanation, and what of it belongs on the map. */

import type { Pair, PlanView, UserView } from "./types";

export interface Alternative {
  heading_deg: number;
  speed_mps: number;
  value: number;
  worse_by: number; // in the price's unit: slots of mean AoI over the horizon
}

export interface Relation {
  user_id: string;
  weight: number;
  expected_m: Pair | null; // where the policy expects the user at the slot's end
}

export interface Move {
  heading_deg: number;
  speed_mps: number;
}

export interface UavExplanation {
  system_id: number;
  move?: Move; // as it was decided; in flight the plan says it
  path_m: Pair[]; // ends of this slot and the next ones
  alternatives: Alternative[];
  relations: Relation[];
}

export interface Explanation {
  campaign_id: string;
  policy: string;
  slot: number;
  value: number | null;
  predicted_gain: number | null;
  horizon_slots: number | null;
  uavs: UavExplanation[];
}

export interface WhyLine {
  toM: Pair;
  strength: number; // 0 to 1, of the greatest weight
  expectedM: Pair | null;
}

export const SHOWN_ALTERNATIVES = 4;

export const explained = (why: Explanation | null, systemId: number | null): UavExplanation | null =>
  why?.uavs.find((uav) => uav.system_id === systemId) ?? null;

/** Lines to the users that the drone attends to, as far as their places are known. */
export function whyLines(uav: UavExplanation | null, users: readonly UserView[]): WhyLine[] {
  const greatest = Math.max(0, ...(uav?.relations ?? []).map((relation) => relation.weight));
  if (uav === null || greatest <= 0) return [];
  return uav.relations.flatMap(({ user_id, weight, expected_m }) => {
    const user = users.find((one) => one.user_id === user_id);
    if (user?.east_m == null || user.north_m === null) return [];
    return [{ toM: [user.east_m, user.north_m] as Pair, strength: weight / greatest, expectedM: expected_m }];
  });
}

/** What the drone was told to do: as recorded with the decision, else as the plan says. */
export const moveOf = (uav: UavExplanation, plan: PlanView | undefined): Move | null => uav.move ?? plan ?? null;

/** The best few, best first. */
export const bestAlternatives = (uav: UavExplanation | null): Alternative[] =>
  [...(uav?.alternatives ?? [])].sort((a, b) => a.worse_by - b.worse_by).slice(0, SHOWN_ALTERNATIVES);

/** Where a move leads from here: metres after `seconds`. */
export function moveEndM([eastM, northM]: Pair, move: Alternative, seconds: number): Pair {
  const heading = (move.heading_deg * Math.PI) / 180;
  const way = move.speed_mps * seconds;
  return [eastM + way * Math.sin(heading), northM + way * Math.cos(heading)];
}
