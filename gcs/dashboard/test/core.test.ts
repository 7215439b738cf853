import { describe, expect, it } from "vitest";

import { allAlerts, vehicleAlerts } from "../src/core/alerts";
import { AOI_STEPS, aoiStep } from "../src/core/aoi";
import { problemText } from "../src/core/api";
import { allowed } from "../src/core/campaigns";
import { clock, fixed, NONE, uavNames } from "../src/core/format";
import { linkState, positionStale, vehicleStale } from "../src/core/freshness";
import { closed, pixelsAtZoom0, toLngLat } from "../src/core/geo";
import { Hold } from "../src/core/hold";
import { meanAoi, withRecord, withSnapshot } from "../src/core/series";
import { retryDelayMs } from "../src/core/stream";
import { TRAIL_POINTS, withPlaces } from "../src/core/trails";
import type { Pair } from "../src/core/types";
import { campaign, event, snapshot, user, vehicle } from "./samples";

describe("the AoI scale", () => {
  it("rises with age and has a step for every age", () => {
    expect([1, 2, 4.9, 5, 10, 19, 20, 1e9, Infinity].map(aoiStep)).toEqual([0, 1, 1, 2, 3, 3, 4, 4, 4]);
    expect(AOI_STEPS.at(-1)?.belowSlots).toBe(Infinity);
  });
});

describe("places", () => {
  const frame = { southWestDeg: [40.42, -86.93] as Pair, metresPerDeg: [84_870, 111_030] as Pair };
  it("turns metres into longitude and latitude, in this order", () => {
    expect(toLngLat(frame, [0, 0])).toEqual([-86.93, 40.42]);
    const [lng, lat] = toLngLat(frame, [848.7, 1110.3]);
    expect(lng).toBeCloseTo(-86.92, 9);
    expect(lat).toBeCloseTo(40.43, 9);
  });
  it("scales lengths as web Mercator does", () => {
    expect(pixelsAtZoom0(40_075_016.686, 0)).toBeCloseTo(512, 3);
    expect(pixelsAtZoom0(100, 60)).toBeCloseTo(2 * pixelsAtZoom0(100, 0), 9);
  });
  it("closes rings, and leaves none open when there is none", () => {
    expect(closed([[0, 0], [1, 0]])).toEqual([[0, 0], [1, 0], [0, 0]]);
    expect(closed([])).toEqual([]);
  });
});

describe("freshness", () => {
  it("is live only while messages come on an open connection", () => {
    expect(linkState(false, false, null)).toBe("connecting");
    expect(linkState(true, true, 0.4)).toBe("live");
    expect(linkState(true, true, 2.1)).toBe("silent");
    expect(linkState(false, true, 0.1)).toBe("lost");
  });
  it("takes a vehicle that was never heard for stale", () => {
    expect(vehicleStale(vehicle({ heartbeat_age_s: null }))).toBe(true);
    expect(vehicleStale(vehicle({ heartbeat_age_s: 4.1 }))).toBe(true);
    expect(vehicleStale(vehicle({ heartbeat_age_s: 1 }))).toBe(false);
    expect(positionStale(vehicle({ position_age_s: 3.5 }))).toBe(true);
  });
});

describe("hold to confirm", () => {
  it("does nothing before its time, and acts once after it", () => {
    const hold = new Hold(1000);
    hold.begin(0);
    expect(hold.take(999)).toBe(false);
    expect(hold.progress(500)).toBeCloseTo(0.5);
    expect(hold.take(1000)).toBe(true);
    expect(hold.take(5000)).toBe(false);
  });
  it("begins again after being let go", () => {
    const hold = new Hold(1000);
    hold.begin(0);
    hold.cancel();
    expect(hold.take(2000)).toBe(false);
    hold.begin(2000);
    hold.begin(2900); // repeated presses do not prolong or shorten it
    expect(hold.take(2999)).toBe(false);
    expect(hold.take(3000)).toBe(true);
  });
});

describe("alerts", () => {
  it("are none for a normal vehicle", () => {
    expect(vehicleAlerts(vehicle({}))).toEqual([]);
  });
  it("name the vehicle and put warnings first", () => {
    const message = snapshot({ vehicles: [vehicle({ battery_fraction: 0.25 }), vehicle({ system_id: 2, heartbeat_age_s: 7 })] });
    const found = allAlerts(message, [], new Map());
    expect(found.map((alert) => alert.severity)).toEqual(["warning", "caution"]);
    expect(found[0]?.text).toContain("UAV 2: no heartbeat for 7 s");
  });
  it("keep events until they are acknowledged, and leave notes alone", () => {
    const log = [event({ sequence: 3, severity: "warning" }), event({ sequence: 2, severity: "info" }), event({ sequence: 1, severity: "caution" })];
    expect(allAlerts(null, log, new Map()).map((alert) => alert.sequence)).toEqual([3, 1]);
    expect(allAlerts(null, log, new Map([[3, "ann"]])).map((alert) => alert.sequence)).toEqual([1]);
  });
  it("tell when the flight loop is late", () => {
    expect(allAlerts(snapshot({ healthy: false, vehicles: [] }), [], new Map())[0]?.severity).toBe("warning");
  });
});

describe("curves", () => {
  const metrics = { episodic_aoi: 2, data_collection_ratio: 0.9, user_coverage: 0.4, energy_ratio: 0.1, final_aoi: 2 };
  it("get one point a slot, however often a snapshot comes", () => {
    let points = withSnapshot([], campaign({ users_slot: 1, metrics }), 2.5);
    expect(withSnapshot(points, campaign({ users_slot: 1, metrics }), 2.5)).toBe(points);
    points = withSnapshot(points, campaign({ users_slot: 2, metrics }), 3);
    expect(points.map((point) => [point.slot, point.aoiNow])).toEqual([[1, 2.5], [2, 3]]);
  });
  it("have no point before a slot has ended", () => {
    expect(withSnapshot([], campaign({ users_slot: 0, metrics: null }), 1)).toEqual([]);
  });
  it("take the past from the record and keep what came since", () => {
    const late = withSnapshot([], campaign({ users_slot: 3, metrics }), 3);
    const record = [1, 2].map((slot) => ({ slot, metrics, mean_aoi_slots: slot, decision_ms: 2 }));
    expect(withRecord(late, record).map((point) => point.slot)).toEqual([1, 2, 3]);
    expect(withRecord(withRecord(late, record), record).map((point) => point.slot)).toEqual([1, 2, 3]);
  });
  it("have no mean without users", () => {
    expect(meanAoi([])).toBeNull();
    expect(meanAoi([user({ aoi_slots: 1 }), user({ aoi_slots: 4 })])).toBe(2.5);
  });
});

describe("trails", () => {
  it("stay bounded and leave out hovering and old places", () => {
    let trails = withPlaces(new Map(), [vehicle({ east_m: 0 })]);
    trails = withPlaces(trails, [vehicle({ east_m: 1 })]);
    trails = withPlaces(trails, [vehicle({ east_m: 500, position_age_s: 60 })]);
    expect(trails.get(1)?.length).toBe(1);
    for (let k = 1; k < 2 * TRAIL_POINTS; k++) trails = withPlaces(trails, [vehicle({ east_m: 10 * k })]);
    expect(trails.get(1)?.length).toBe(TRAIL_POINTS);
    expect(trails.get(1)?.at(-1)?.[0]).toBe(10 * (2 * TRAIL_POINTS - 1));
  });
});

describe("words", () => {
  it("say times, numbers and names", () => {
    expect([clock(0), clock(59.6), clock(3725), clock(null)]).toEqual(["0:00", "1:00", "1:02:05", NONE]);
    expect([fixed(null, 1), fixed(NaN, 1), fixed(1.26, 1, " m")]).toEqual([NONE, NONE, "1.3 m"]);
    expect([uavNames([]), uavNames([3]), uavNames([1, 2, 3])]).toEqual(["no UAV", "UAV 3", "UAVs 1, 2 and 3"]);
    expect(uavNames([1, 2, 3, 4, 5, 6, 7])).toBe("7 UAVs");
  });
  it("quote the server's problem, or its status when it says nothing", () => {
    expect(problemText({ detail: "the campaign is done" }, 409)).toBe("the campaign is done");
    expect(problemText("<html>", 502)).toBe("the server answered 502");
  });
});

describe("the campaign's controls", () => {
  it("follow its state", () => {
    expect(["start", "pause", "resume", "abort"].map((act) => allowed(act as "start", "flying"))).toEqual([false, true, false, true]);
    expect(allowed("start", "done")).toBe(false);
    expect(allowed("start", null)).toBe(false);
  });
});

describe("trying again", () => {
  it("waits longer each time, but never long", () => {
    const waits = [0, 1, 2, 3, 4, 100].map(retryDelayMs);
    expect(waits).toEqual([...waits].sort((a, b) => a - b));
    expect(waits.at(-1)).toBe(5000);
  });
});
