import { describe, expect, it } from "vitest";

import { bignessOf } from "../src/map/bigness";
import { droneLook, groundScene, namesAt, placed, userScene } from "../src/map/scene";
import { ground, user, vehicle } from "./samples";

describe("the map's content", () => {
  it("marks one launch point once and closes every outline", () => {
    const scene = groundScene(ground());
    expect(scene.features.filter((one) => one.properties?.["kind"] === "launch")).toHaveLength(1);
    for (const one of scene.features)
      if (one.geometry.type === "Polygon") expect(one.geometry.coordinates[0]?.[0]).toEqual(one.geometry.coordinates[0]?.at(-1));
  });
  it("tells obstacles that reach the UAVs from those they fly over", () => {
    const high = groundScene(ground()).features.filter((one) => one.properties?.["kind"] === "obstacle").map((one) => one.properties?.["high"]);
    expect(high).toEqual([true, false]);
  });
  it("lays the oldest users on top", () => {
    const scene = userScene(ground(), [user({ aoi_slots: 30 }), user({ aoi_slots: 1 }), user({ aoi_slots: 7 }), user({ east_m: null })]);
    expect(scene.features.map((one) => one.properties?.["step"])).toEqual([0, 2, 4]);
  });
  it("never shows a drone as live when it or the server is silent", () => {
    const low = { battery_fraction: 0.05 };
    expect(droneLook(vehicle({}), true)).toBe("normal");
    expect(droneLook(vehicle(low), true)).toBe("warning");
    expect(droneLook(vehicle({ ...low, heartbeat_age_s: 20 }), true)).toBe("stale");
    expect(droneLook(vehicle({ ...low, position_age_s: 20 }), true)).toBe("stale");
    expect(droneLook(vehicle(low), false)).toBe("stale");
  });
  it("places only those whose place is known", () => {
    expect(placed([vehicle({}), vehicle({ system_id: 3, east_m: null })]).map((one) => one.system_id)).toEqual([1]);
  });
});

describe("marks on the map", () => {
  it("grow with the screen, in steps", () => expect([360, 1920, 2560, 3840].map(bignessOf)).toEqual([1, 1, 1.3, 1.8]));
  it("names drones at one place together, so that no name covers another", () => {
    const at = (id: number, x: number) => ({ id, at: [x, 0] as [number, number] });
    expect([...namesAt([at(1, 0), at(2, 5), at(3, 50)], 9)]).toEqual([[1, "1, 2"], [3, "3"]]);
    expect([...namesAt([1, 2, 3, 4, 5].map((id) => at(id, 0)), 9)]).toEqual([[1, "1, 2, 3 … 5 UAVs"]]);
  });
});
