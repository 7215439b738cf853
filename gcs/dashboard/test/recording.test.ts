import { describe, expect, it } from "vitest";

import { advanced, framesOf, pointsOf, shownAt, slotAt, SPEED_STEPS, speedOf, wallMs, type Recording, type RecordedSlot } from "../src/core/recording";
import type { Sample } from "../src/core/recordedFleet";
import { lastAt } from "../src/core/timeline";
import { event, ground } from "./samples";

const metrics = (aoi: number) => ({ episodic_aoi: aoi, data_collection_ratio: 0.5, user_coverage: 0.4, energy_ratio: 0.1, final_aoi: aoi });
const slot = (number: number, east: number, change: Partial<RecordedSlot> = {}): RecordedSlot => ({
  slot: number, decision_ms: number === 0 ? null : 2, metrics: number === 0 ? null : metrics(number),
  uavs: [{ system_id: 7, east_m: east, north_m: 100, heading_deg: 90, speed_mps: 18, energy_j: 1000 * number, active: true }],
  users: [[0, 10, 20, number + 1, 0.5, false], [1, null, null, 1, 0, true]], ...change,
});
const slotAtS: [number, number][] = [[0, 0], [1, 15], [2, 30]];
const frames = framesOf({ user_ids: ["ann", "bob"], slots: [slot(0, 0), slot(1, 270), slot(2, 540)], next_first: null }, slotAtS);
const recording: Recording = {
  campaign: ground(), state: "aborted", reason: "by ann", begun_at: "2026-11-01T10:00:00Z", ended_at: "2026-11-01T10:00:30Z",
  begun_at_s: 0, ended_at_s: 30, first_slot: 0, last_slot: 2, battery_j: 100_000, length_s: 30, slot_at_s: slotAtS, samples: 0,
  events: [{ ...event({ sequence: 4, severity: "info" }), at_slot: 0, at_s: 0 }, { ...event({ sequence: 5 }), at_slot: 1.5, at_s: 22.5 }],
};
const NONE: readonly Sample[] = [];
const at = (slots: number) => {
  const shown = shownAt({ recording, frames, points: pointsOf(frames), samples: NONE, decisions: null }, 15 * slots);
  if (shown === null) throw new Error("nothing is shown");
  return shown;
};

describe("a recording at a moment", () => {
  it("draws a drone on the straight way between the ends of two slots", () => {
    const vehicle = at(0.5).snapshot?.vehicles[0];
    expect([vehicle?.system_id, vehicle?.east_m, vehicle?.north_m]).toEqual([7, 135, 100]);
    expect(vehicle?.lon_deg).toBeCloseTo(-86.93 + 135 / 84_870, 9);
    expect(vehicle?.battery_fraction).toBeCloseTo(0.995, 9);
  });
  it("names users and shows those of the slot that has ended", () => {
    expect(at(1.9).users.map((user) => [user.user_id, user.aoi_slots, user.east_m])).toEqual([["ann", 2, 10], ["bob", 1, null]]);
  });
  it("never tells what came later: curves, log and trails end at the moment", () => {
    expect(at(1.4).points.map((point) => point.slot)).toEqual([1]);
    expect(at(1.4).events.map((one) => one.sequence)).toEqual([4]);
    expect(at(1.5).events.map((one) => one.sequence)).toEqual([5, 4]);
    expect(at(1.5).trails.get(7)).toEqual([[0, 100], [270, 100], [405, 100]]);
  });
  it("is over in the last slot, with the state and reason that the campaign ended in", () => {
    expect(at(1.99).snapshot?.campaign?.state).toBe("flying");
    expect([at(2).snapshot?.campaign?.state, at(2).snapshot?.campaign?.reason]).toEqual(["aborted", "by ann"]);
    expect(at(2).snapshot?.vehicles[0]?.speed_mps).toBe(0);
  });
  it("shows the slot's way as it was flown", () => {
    expect(at(1.2).plans).toEqual([{ system_id: 7, heading_deg: 90, speed_mps: 18, path_m: [[270, 100], [540, 100]] }]);
    expect(at(2).plans).toEqual([]);
  });
  it("is nothing while no slot has come, and stays with the last place of a drone that was lost", () => {
    expect(shownAt({ recording, frames: [], points: [], samples: NONE, decisions: null }, 0)).toBeNull();
    const lost = framesOf({ user_ids: [], slots: [slot(0, 0), slot(1, 270, { uavs: [] })], next_first: null }, slotAtS);
    expect(shownAt({ recording, frames: lost, points: [], samples: NONE, decisions: null }, 10.5)?.snapshot?.vehicles[0]?.east_m).toBe(0);
  });
  it("says that the vehicles' own reports are not part of it", () => {
    expect([at(1).reported, at(1).snapshot?.vehicles[0]?.mode]).toEqual([false, "unknown"]);
  });
  it("tells the slot and its part of every moment", () => {
    expect([0, 7.5, 15, 30, 99].map((atS) => slotAt(frames, atS))).toEqual([0, 0.5, 1, 2, 2]);
  });
  it("finds what counts at every moment, as a plain search does", () => {
    const things = [2, 3, 7, 8].map((atS) => ({ atS }));
    for (let atS = 0; atS < 10; atS += 0.25) expect(lastAt(things, atS)).toBe(things.findLastIndex((one) => one.atS <= atS));
  });
});

describe("the replay's clock", () => {
  it("goes from real time to a thousand times as fast, ever faster", () => {
    const speeds = Array.from({ length: SPEED_STEPS + 1 }, (_, step) => speedOf(step));
    expect([speeds[0], speeds.at(-1)]).toEqual([1, 1000]);
    expect(speeds.every((speed, k) => k === 0 || speed > (speeds[k - 1] ?? 0))).toBe(true);
  });
  it("moves by flight seconds and stops at the end", () => {
    expect(advanced(15, 0.1, 15, 900)).toBeCloseTo(16.5, 9);
    expect(advanced(899, 1, 1000, 900)).toBe(900);
  });
  it("tells the wall clock's time in between", () => {
    expect(wallMs(recording, 15)).toBe(Date.parse("2026-11-01T10:00:15Z"));
    expect(wallMs({ ...recording, begun_at: null }, 15)).toBeNull();
  });
});
