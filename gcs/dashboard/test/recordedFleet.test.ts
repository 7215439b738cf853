import { describe, expect, it } from "vitest";

import { vehicleAlerts } from "../src/core/alerts";
import { fleetAt, samplesOf, trailsOf } from "../src/core/recordedFleet";
import { logAt, pausedS, type RecordedEvent } from "../src/core/recordedLog";
import { framesOf, pointsOf, shownAt, wallMs, type Recording } from "../src/core/recording";
import { turned } from "../src/core/timeline";
import type { VehicleView } from "../src/core/types";
import { event, ground, vehicle } from "./samples";

const columns = [
  "system_id", "mode", "mode_name", "armed", "landed", "lat_deg", "lon_deg", "east_m", "north_m", "alt_home_m", "heading_deg", "speed_mps",
  "battery_fraction", "return_fraction", "loss_ratio", "heartbeat_age_s", "position_age_s",
] as const;
const row = (change: Partial<VehicleView>) => columns.map((name) => vehicle(change)[name]);
const page = (...told: [number, Partial<VehicleView>[]][]) =>
  samplesOf({ columns: [...columns], samples: told.map(([at_s, vehicles]) => ({ at_s, vehicles: vehicles.map(row) })), next_first: null });

const climbing = page(
  [0, [{ mode_name: "TAKEOFF", alt_home_m: 10, east_m: 0, north_m: 0, heading_deg: 350, battery_fraction: 0.9, heartbeat_age_s: 0.2 }]],
  [1, [{ mode_name: "OFFBOARD", alt_home_m: 14, east_m: 8, north_m: 6, heading_deg: 20, battery_fraction: 0.8, heartbeat_age_s: 0.4 }]],
);

describe("the fleet of a recording", () => {
  it("is between two samples on the straight way, in the mode that was told before", () => {
    const one = fleetAt(climbing, 0.5)?.[0];
    expect([one?.mode_name, one?.alt_home_m, one?.east_m, one?.north_m, one?.heading_deg]).toEqual(["TAKEOFF", 12, 4, 3, 5]);
    expect(one?.battery_fraction).toBeCloseTo(0.85, 9);
    expect(fleetAt(climbing, 1)?.[0]?.mode_name).toBe("OFFBOARD");
  });
  it("turns the short way round", () => {
    expect([turned(350, 20, 0.5), turned(20, 350, 0.5), turned(10, 190, 0), turned(90, 90, 0.3)]).toEqual([5, 5, 10, 90]);
  });
  it("grows old where samples are missing, as in flight: what is stale is never shown as it was", () => {
    const holed = page([0, [{}]], [1, [{ heartbeat_age_s: 0.4 }]], [30, [{}]]);
    expect(fleetAt(holed, 10)?.[0]?.heartbeat_age_s).toBeCloseTo(9.4, 9);
    expect(vehicleAlerts(fleetAt(holed, 10)?.[0] ?? vehicle({}))[0]?.text).toBe("UAV 1: no heartbeat for 9 s");
    expect(fleetAt(holed, 30)?.[0]?.heartbeat_age_s).toBe(0.3);
  });
  it("does not grow old between samples that were wider by rule", () => {
    const wide = page([0, [{}]], [1, [{}]], [3, [{}]], [5, [{}]], [9, [{}]]);
    expect([2, 4, 7].map((atS) => fleetAt(wide, atS)?.[0]?.heartbeat_age_s)).toEqual([0.3, 0.3, 0.3]);
  });
  it("shows a drone from when it was heard, and one whose place nobody knew without one", () => {
    const joined = page([0, [{}]], [1, [{}, { system_id: 2, east_m: null, north_m: null, lat_deg: null, heartbeat_age_s: null }]]);
    expect(fleetAt(joined, 0.9)?.map((one) => one.system_id)).toEqual([1]);
    expect([fleetAt(joined, 1)?.[1]?.east_m, fleetAt(joined, 5)?.[1]?.heartbeat_age_s]).toEqual([null, null]);
  });
  it("is unknown where nothing was kept", () => expect(fleetAt([], 1)).toBeNull());
  it("leaves a trail until the moment, thinned, that jumps over places nobody knew", () => {
    const way = page([0, [{ east_m: 0, north_m: 0 }]], [1, [{ east_m: 1, north_m: 0 }]], [2, [{ east_m: 9, north_m: 0 }]], [3, [{ east_m: 50, north_m: 0, position_age_s: 9 }]]);
    expect(trailsOf(way, -1, 3, [vehicle({ east_m: 12, north_m: 0 })]).get(1)).toEqual([[0, 0], [9, 0], [12, 0]]);
    expect(trailsOf(way, 1.5, 2, []).get(1)).toEqual([[9, 0]]);
  });
});

let sequence = 0;
const line = (at_s: number, kind: string, change: Partial<RecordedEvent> = {}): RecordedEvent =>
  ({ ...event({ sequence: ++sequence, kind, severity: "info", system_id: null }), at_slot: 0, at_s, ...change });
const state = (at_s: number, name: string) => line(at_s, "campaign.state", { data: { state: name } });

describe("the log of a recording", () => {
  const events = [
    state(0, "launching"), state(10, "flying"), line(12, "link.lost", { severity: "warning", message: "UAV 2 is lost", system_id: 2 }),
    line(13, "alert.acknowledged", { message: '"UAV 2 is lost" acknowledged', system_id: 2, actor: "ann" }),
    line(14, "command.verdict", { system_id: 1, data: { command: "hold", result: "refused", reason: "no GPS" } }),
    line(15, "safety.stop"), state(15, "paused"), line(16, "safety.stop", { system_id: 2 }), line(20, "safety.stop_reset"), state(25, "flying"),
    line(26, "link.lost", { severity: "warning", message: "UAV 2 is lost", system_id: 2 }),
  ];
  it("tells state, stops and verdicts of a moment", () => {
    expect([5, 12, 17, 99].map((atS) => logAt(events, atS).state)).toEqual(["launching", "flying", "paused", "flying"]);
    expect(logAt(events, 17).stopped).toEqual({ all: true, ones: [2] });
    expect(logAt(events, 21).stopped).toEqual({ all: false, ones: [] });
    expect([logAt(events, 13).verdicts.get(1), logAt(events, 14).verdicts.get(1)?.reason]).toEqual([undefined, "no GPS"]);
  });
  it("knows what had been acknowledged by then, and not what came again after", () => {
    expect(logAt(events, 12).acknowledged.size).toBe(0);
    expect([...logAt(events, 30).acknowledged.values()]).toEqual(["ann"]);
    expect(logAt(events, 30).acknowledged.has(events.at(-1)?.sequence ?? 0)).toBe(false);
  });
  it("counts how long the slot clock stood still", () => {
    expect([pausedS(events, 10, 15), pausedS(events, 10, 18), pausedS(events, 10, 40), pausedS(events, 20, 22)]).toEqual([0, 3, 10, 2]);
  });
  it("is the same object while nothing is added", () => expect(logAt(events, 16.2)).toBe(logAt(events, 16.9)));
});

describe("a recording with telemetry", () => {
  const slotAtS: [number, number][] = [[0, 10], [1, 35]]; // 10 s of it paused
  const events = [state(0, "launching"), state(10, "flying"), state(15, "paused"), state(25, "flying"), state(35, "recovering"), state(40, "done")];
  const recording: Recording = {
    campaign: ground({ slots: 1 }), state: "done", reason: "", begun_at: "2026-11-01T10:00:10Z", ended_at: "2026-11-01T10:00:35Z",
    begun_at_s: 10, ended_at_s: 35, first_slot: 0, last_slot: 1, battery_j: 1, length_s: 40, slot_at_s: slotAtS, samples: 41, events,
  };
  const uav = { system_id: 1, east_m: 0, north_m: 0, heading_deg: 0, speed_mps: 0, energy_j: 0, active: true };
  const slots = [0, 1].map((slot) => ({ slot, decision_ms: null, metrics: null, uavs: [uav], users: [] }));
  const frames = framesOf({ user_ids: [], slots, next_first: null }, slotAtS);
  const samples = page(...Array.from({ length: 41 }, (_, k): [number, Partial<VehicleView>[]] => [k, [{ alt_home_m: k < 10 ? 12 * k : 120 }]]));
  const at = (atS: number) => shownAt({ recording, frames, points: pointsOf(frames), samples, decisions: null }, atS);
  it("shows launch and way home, the state of the moment, and a slot clock that stands while paused", () => {
    const told = [5, 12, 20, 30, 37, 40].map((atS) => at(atS)?.snapshot?.campaign);
    expect(told.map((one) => one?.state)).toEqual(["launching", "flying", "paused", "flying", "recovering", "done"]);
    expect(told.map((one) => one?.slot_elapsed_s)).toEqual([0, 2, 5, 10, 0, 0]);
    expect(at(5)?.snapshot?.vehicles[0]?.alt_home_m).toBe(60);
    expect([at(5)?.reported, at(5)?.plans]).toEqual([true, []]);
  });
  it("shows the launch of a campaign that failed before its first slot, with its reason, and no slot", () => {
    const log = [state(0, "launching"), state(40, "failed")];
    const failed: Recording = { ...recording, state: "failed", reason: "no drone is left", first_slot: null, last_slot: null, slot_at_s: [], events: log };
    const then = (atS: number) => shownAt({ recording: failed, frames: [], points: [], samples, decisions: [] }, atS)?.snapshot;
    expect([then(5)?.vehicles[0]?.alt_home_m, then(5)?.campaign?.state, then(5)?.campaign?.reason]).toEqual([60, "launching", ""]);
    expect([then(40)?.campaign?.state, then(40)?.campaign?.reason, then(40)?.campaign?.slot, then(40)?.campaign?.metrics]).toEqual(["failed", "no drone is left", 0, null]);
    expect(shownAt({ recording: failed, frames: [], points: [], samples: [], decisions: [] }, 40)?.snapshot?.campaign?.reason).toBe("no drone is left");
  });
  it("tells the wall clock's time before the first slot and after the last", () => {
    expect(wallMs(recording, 0)).toBe(Date.parse("2026-11-01T10:00:00Z"));
    expect(wallMs(recording, 40)).toBe(Date.parse("2026-11-01T10:00:40Z"));
  });
});
