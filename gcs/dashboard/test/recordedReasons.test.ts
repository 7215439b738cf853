import { describe, expect, it } from "vitest";

import { decisionAt, decisionsOf, reasonsAt, type RecordedDecision, type SlotThen } from "../src/core/recordedReasons";
import { user } from "./samples";

const decision = (slot: number, atS: number, change: Partial<RecordedDecision> = {}): RecordedDecision => ({
  slot, atS, duration_ms: 2, moves: [[90, 18], [180, 3]], told: "reasons", note: "", value: 5, predicted_gain: null, horizon_slots: 8,
  uavs: [{
    uav: 1, path_m: [[1, 2]], alternatives: [{ heading_deg: 0, speed_mps: 1, value: 6, worse_by: 1 }],
    relations: [{ user: 1, weight: 0.4, expected_m: [7, 8] }, { user: 9, weight: 0.1, expected_m: null }],
  }],
  ...change,
});
const slot = (number: number, change: Partial<SlotThen> = {}): SlotThen => ({
  campaignId: "c1", policy: "gcrl", slot: number, systemIds: [4, 7], users: [user({ user_id: "ann" }), user({ user_id: "bob" })], decided: true, givenUpS: -Infinity, ...change,
});

describe("the decision of a moment", () => {
  const all = [decision(0, 10), decision(1, 25.4), decision(1, 33), decision(3, 55)];
  it("is the newest one of the slot, and the slot's first one from its beginning on", () => {
    const told = [[0, 10], [0, 24.9], [1, 25], [1, 30], [1, 33], [1, 39.9], [3, 55]].map(([n = 0, atS = 0]) => decisionAt(all, n, atS));
    expect(told.map((one) => one?.atS)).toEqual([10, 10, 25.4, 25.4, 33, 33, 55]);
  });
  it("is none in a slot that had none, nor long before it came", () => {
    expect([decisionAt(all, 2, 41), decisionAt(all, 3, 50), decisionAt([], 0, 0)]).toEqual([null, null, null]);
  });
  it("is read from what the server tells", () => {
    const { atS, ...told } = decision(2, 40);
    expect(decisionsOf({ decisions: [{ ...told, at_s: atS }], next_first: null })).toEqual([decision(2, 40)]);
  });
});

describe("the reasons of a moment", () => {
  it("are those that were told then, with the names of that slot's users", () => {
    const told = reasonsAt([decision(0, 10)], slot(0), 12);
    expect(told.note).toBeNull();
    expect([told.reasons?.policy, told.reasons?.slot, told.reasons?.horizon_slots]).toEqual(["gcrl", 0, 8]);
    expect(told.reasons?.uavs.map((uav) => [uav.system_id, uav.move])).toEqual([[4, { heading_deg: 90, speed_mps: 18 }], [7, { heading_deg: 180, speed_mps: 3 }]]);
    expect(told.reasons?.uavs[1]?.relations).toEqual([{ user_id: "bob", weight: 0.4, expected_m: [7, 8] }]);
    expect(told.reasons?.uavs[0]?.alternatives).toEqual([]);
  });
  it("are missing for a reason that is said", () => {
    const note = (decisions: RecordedDecision[] | null, change: Partial<SlotThen> = {}) => {
      const { reasons, note: words } = reasonsAt(decisions, slot(0, change), 12);
      return [reasons === null, words];
    };
    expect(note(null)).toEqual([true, expect.stringContaining("have not been read")]);
    expect(note([])).toEqual([true, expect.stringContaining("not in this recording")]);
    expect(note([], { decided: false })).toEqual([true, expect.stringContaining("the UAVs held")]);
    expect(note([decision(0, 10)], { givenUpS: 11 })).toEqual([true, expect.stringContaining("the UAVs held")]);
    expect(note([decision(0, 10)], { givenUpS: 9 })).toEqual([false, null]);
    expect(note([decision(0, 10, { told: "unknown" })])).toEqual([true, expect.stringContaining("kept no reasons")]);
    expect(note([decision(0, 10, { told: "failed", note: "boom" })])).toEqual([true, expect.stringContaining("could not say why (boom)")]);
    expect(note([decision(0, 10, { told: "wiped" })])).toEqual([false, expect.stringContaining("wiped")]);
  });
});
