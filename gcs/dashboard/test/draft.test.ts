import { describe, expect, it } from "vitest";

import { fromFile, toGeoJson, toPlan } from "../src/core/areaFiles";
import { cornersFrom, cornersText, draftOf, metresOf, previewOf, withDraft, withPolicy, type Draft } from "../src/core/draft";
import { clicked, closedObstacle, IDLE, mayClose, tookBack, type Drawing } from "../src/core/drawing";
import { frameAt, toLngLat, toMetres } from "../src/core/geo";
import type { Pair } from "../src/core/types";

/** Longitude and latitude, metres a degree east and north. */
const SERVER = [[[-86.93, 40.4203], 84867.99848226004, 111042.72024583102], [[151.2, -33.5], 92922.54371694526, 110913.38772461266], [[0.0, 0.0], 111319.49079327357, 110574.27582159435]];

const mission = {
  campaign: { name: "demo", slots: 60, slot_s: 15 },
  area: {
    south_west: [47.396, 8.54], size_m: [1600, 1200],
    obstacles: [{ name: "tower", height_m: 150, polygon_m: [[430, 660], [500, 660], [500, 730]] }, { height_m: 40, polygon_m: [[700, 820], [880, 820], [880, 920]] }],
  },
  fleet: { uavs: 2, altitude_m: 120, launch_m: [800, 600] },
  policy: { name: "gcrl", checkpoint: "mine" },
};

describe("the local frame", () => {
  it("has the server's own scale (numbers of policy.world.frames)", () => {
    for (const [at, east, north] of SERVER) {
      const [e, n] = frameAt(at as Pair).metresPerDeg;
      expect(e).toBeCloseTo(east as number, 6);
      expect(n).toBeCloseTo(north as number, 6);
    }
  });
  it("goes there and back", () => {
    const frame = frameAt([8.54, 47.396]);
    const [e, n] = toMetres(frame, toLngLat(frame, [123.4, 567.8]));
    expect(e).toBeCloseTo(123.4, 6);
    expect(n).toBeCloseTo(567.8, 6);
  });
});

describe("a draft", () => {
  const draft = draftOf(mission);
  it("comes from a mission and goes back into it unchanged", () => {
    const back = withDraft(mission, draft);
    const named = mission.area.obstacles.map((one) => ({ name: "", ...one }));
    expect(back["area"]).toEqual({ ...mission.area, obstacles: named });
    expect(back["fleet"]).toEqual({ ...mission.fleet, launch_m: [[800, 600]] });
    expect(back["campaign"]).toBe(mission.campaign);
  });
  it("keeps everything in its place when the area's corner moves", () => {
    const wider: Draft = { ...draft, southWest: toLngLat(frameAt(draft.southWest), [-100, -50]) };
    const [east, north] = metresOf(wider, wider.launches[0] as Pair);
    expect(Math.abs(east - 900)).toBeLessThan(0.2);
    expect(north).toBeCloseTo(650, 1);
  });
  it("flies with another policy without the first one's checkpoint", () => {
    expect(withPolicy(mission, "random")["policy"]).toEqual({ name: "random" });
    expect(withPolicy(mission, "")).toBe(mission);
  });
  it("can be shown on the map", () => {
    const shown = previewOf(draft, mission);
    expect([shown.size_m, shown.altitude_m, shown.obstacles.length, shown.launch_m]).toEqual([[1600, 1200], 120, 2, [[800, 600]]]);
  });
  it("reads corners that are typed, and refuses what is none", () => {
    expect(cornersFrom(" 0 0, 10.5 0,10 -5 ", 3)).toEqual([[0, 0], [10.5, 0], [10, -5]]);
    for (const text of ["", "1", "1 2, 3", "a b", "1 2 3", "1 2, 3 4"]) expect(cornersFrom(text, 3)).toBeNull();
    expect(cornersText([[1, 2], [3.5, 4]])).toBe("1 2, 3.5 4");
  });
});

describe("drawing", () => {
  const draft = draftOf(mission);
  const clicks = (drawing: Drawing, ...at: Pair[]) => at.reduce((step, point) => clicked(step.drawing, step.draft, point), { drawing, draft });
  it("makes an area of any two opposite corners", () => {
    const { drawing, draft: drawn } = clicks({ tool: "area", corners: [] }, [9, 48], [8, 49]);
    expect([drawing, drawn.southWest, drawn.northEast]).toEqual([IDLE, [8, 48], [9, 49]]);
  });
  it("closes an obstacle only with three corners, and can take one back", () => {
    const two = clicks({ tool: "obstacle", corners: [] }, [0, 0], [1, 0]);
    expect(mayClose(two.drawing)).toBe(false);
    expect(closedObstacle(two.drawing, draft).draft).toBe(draft);
    const four = clicks(two.drawing, [1, 1], [7, 7]);
    const done = closedObstacle(tookBack(four.drawing), draft);
    expect(done.draft.obstacles.at(-1)).toEqual({ name: "obstacle 3", height_m: 150, ring: [[0, 0], [1, 0], [1, 1]] });
    expect(done.drawing.corners).toEqual([]);
  });
  it("sets the launch point with one click, and does nothing without a tool", () => {
    expect(clicks({ tool: "launch", corners: [] }, [5, 6]).draft.launches).toEqual([[5, 6]]);
    expect(clicked(IDLE, draft, [1, 1]).draft).toBe(draft);
  });
});

describe("files", () => {
  const draft = draftOf(mission);
  const read = (document: unknown) => {
    const found = fromFile(JSON.stringify(document), draft);
    if (!found.ok) throw new Error(found.reason);
    return found;
  };
  it("brings a GeoJSON back as it went out", () => {
    expect(read(toGeoJson(draft))).toEqual({ ok: true, draft, notes: [] });
  });
  it("writes a plan that QGroundControl reads: latitude first, high obstacles as exclusions", () => {
    const plan = toPlan(draft, 120) as { geoFence: { polygons: { inclusion: boolean; polygon: Pair[] }[] }; mission: { plannedHomePosition: number[] } };
    expect(plan).toMatchObject({ fileType: "Plan", version: 1, geoFence: { version: 2 }, mission: { version: 2 }, rallyPoints: { version: 2 } });
    expect(plan.geoFence.polygons.map((one) => one.inclusion)).toEqual([true, false]);
    expect(plan.geoFence.polygons[0]?.polygon[0]).toEqual([47.396, 8.54]);
    expect(plan.mission.plannedHomePosition).toHaveLength(3);
  });
  it("brings a plan back: the fence is the area, exclusions are flown around at any height", () => {
    const { draft: back, notes } = read(toPlan(draft, 120));
    expect([back.southWest, back.northEast, back.launches, notes]).toEqual([draft.southWest, draft.northEast, draft.launches, []]);
    expect(back.obstacles).toEqual([{ name: "no-fly zone 1", height_m: 1000, ring: draft.obstacles[0]?.ring }]);
  });
  it("goes round a fence of another shape and says so, and round circles from outside", () => {
    const fence = { polygons: [{ inclusion: true, polygon: [[0, 0], [0, 1], [1, 0]] }], circles: [{ inclusion: false, circle: { center: [0.5, 0.5], radius: 100 } }] };
    const { draft: back, notes } = read({ fileType: "Plan", geoFence: fence, mission: {} });
    expect([back.southWest, back.northEast]).toEqual([[0, 0], [1, 1]]);
    expect(notes).toHaveLength(2);
    const frame = frameAt([0.5, 0.5]);
    const ring = (back.obstacles[0]?.ring ?? []).map((at) => toMetres(frame, at));
    ring.forEach(([e, n], k) => {
      const [e2, n2] = ring[(k + 1) % ring.length] as Pair;
      expect(Math.hypot((e + e2) / 2, (n + n2) / 2)).toBeGreaterThanOrEqual(99.999);
    });
  });
  it("takes the largest polygon without a kind for the area", () => {
    const square = (size: number) => ({ type: "Feature", properties: {}, geometry: { type: "Polygon", coordinates: [[[0, 0], [size, 0], [size, size], [0, size], [0, 0]]] } });
    const { draft: back } = read({ type: "FeatureCollection", features: [square(0.1), square(1)] });
    expect([back.northEast, back.obstacles.length, back.launches]).toEqual([[1, 1], 1, draft.launches]);
  });
  it("says in one line what is wrong with any other file", () => {
    for (const text of ["", "{", "null", "[]", "{}", '{"type":"FeatureCollection"}', '{"fileType":"Plan"}', '{"type":"FeatureCollection","features":[null,{"geometry":{"type":"Polygon","coordinates":[[["a",1]]]}}]}']) {
      const found = fromFile(text, draft);
      expect(found.ok).toBe(false);
      if (!found.ok) expect(found.reason).not.toContain("\n");
    }
  });
});
