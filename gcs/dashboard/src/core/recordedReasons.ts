/** Why the drones of a recording flew so: what the policy told beside each decision then, and nothing made up since. */

import type { Alternative, Explanation } from "./explanation";
import { lastAt, type Timed } from "./timeline";
import type { Pair, UserView } from "./types";

export interface RecordedDecision extends Timed {
  slot: number;
  duration_ms: number | null;
  moves: Pair[]; // heading in degrees, speed in m/s, a row a UAV
  told: "reasons" | "unknown" | "failed" | "wiped";
  note: string;
  value: number | null;
  predicted_gain: number | null;
  horizon_slots: number | null;
  uavs: { uav: number; path_m: Pair[]; alternatives: Alternative[]; relations: { user: number; weight: number; expected_m: Pair | null }[] }[];
}

export interface ExplanationsPage {
  decisions: (Omit<RecordedDecision, "atS"> & { at_s: number })[];
  next_first: number | null;
}

export const decisionsOf = (page: ExplanationsPage): RecordedDecision[] => page.decisions.map(({ at_s, ...told }) => ({ atS: at_s, ...told }));

/** A slot as far as it is needed here; `decided`: whether its end says that a decision was flown. */
export interface SlotThen {
  campaignId: string;
  policy: string;
  slot: number;
  systemIds: readonly number[];
  users: readonly UserView[];
  decided: boolean;
  givenUpS: number; // when a decision last failed to come, by the log; -Infinity: never
}

/** The reasons of a moment, and why there are none or not all of them. */
export interface ReasonsThen {
  reasons: Explanation | null;
  note: string | null;
}

const GRACE_S = 1.5; // a decision comes so long after its slot's beginning, and is that slot's from there on

/** The decision that was being flown; null where none was. In the order of recording. */
export function decisionAt(decisions: readonly RecordedDecision[], slot: number, atS: number): RecordedDecision | null {
  const newest = lastAt(decisions, atS + GRACE_S);
  for (let k = newest; k >= 0 && (decisions[k]?.slot ?? -1) >= slot; k -= 1) {
    const one = decisions[k];
    if (one !== undefined && one.slot === slot && (one.atS <= atS || decisions[k - 1]?.slot !== slot)) return one;
  }
  return null;
}

const HELD: ReasonsThen = { reasons: null, note: "No decision was flown at this moment: the UAVs held." };
const MISSING: ReasonsThen = { reasons: null, note: "Why it flew so is not in this recording." };
const known = new WeakMap<RecordedDecision, ReasonsThen>();

/** `decisions`: null while they are being read. */
export function reasonsAt(decisions: readonly RecordedDecision[] | null, then: SlotThen, atS: number): ReasonsThen {
  if (decisions === null) return { reasons: null, note: "The reasons of this recording have not been read." };
  const decision = decisionAt(decisions, then.slot, atS);
  if (decision !== null && then.givenUpS > decision.atS) return HELD;
  if (decision === null) return then.decided ? MISSING : HELD;
  const told = known.get(decision) ?? toldBy(decision, then);
  known.set(decision, told);
  return told;
}

function toldBy(decision: RecordedDecision, then: SlotThen): ReasonsThen {
  if (decision.told === "unknown") return { reasons: null, note: "Why it flew so is not in this recording: the version that flew kept no reasons." };
  if (decision.told === "failed") return { reasons: null, note: `The policy could not say why (${decision.note}).` };
  const byUav = new Map(decision.uavs.map((uav) => [uav.uav, uav]));
  const uavs = then.systemIds.map((system_id, row) => {
    const [heading_deg, speed_mps] = decision.moves[row] ?? [NaN, NaN];
    const uav = byUav.get(row);
    const relations = (uav?.relations ?? []).flatMap(({ user, weight, expected_m }) => {
      const user_id = then.users[user]?.user_id;
      return user_id === undefined ? [] : [{ user_id, weight, expected_m }];
    });
    return { system_id, move: { heading_deg, speed_mps }, path_m: uav?.path_m ?? [], alternatives: uav?.alternatives ?? [], relations };
  });
  const { value, predicted_gain, horizon_slots } = decision;
  return {
    reasons: { campaign_id: then.campaignId, policy: then.policy, slot: then.slot, value, predicted_gain, horizon_slots, uavs },
    note: decision.told === "wiped" ? "Whom it attended to was wiped with the users' places." : null,
  };
}
