import { describe, expect, it } from "vitest";

import { droneLook, droneScene, groundScene, userScene, wayScene } from "../src/map/scene";
import { ground, user, vehicle } from "./samples";

const plan = { system_id: 1, heading_deg: 90, speed_mps: 18, path_m: [[0, 0], [270, 0]] as [number, number][] };

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
  it("leaves out drones without a place, and the reach of those on the ground", () => {
    const scene = droneScene(ground(), [vehicle({}), vehicle({ system_id: 2, landed: "on_ground" }), vehicle({ system_id: 3, east_m: null })], 1, true);
    expect(scene.features.map((one) => [one.properties?.["id"], one.properties?.["serves"]])).toEqual([[1, true], [2, false]]);
  });
  it("shows plans only while they are live", () => {
    const trails = new Map([[1, [[0, 0], [9, 0]] as [number, number][]]]);
    const kinds = (live: boolean) => wayScene(ground(), trails, [plan], live).features.map((one) => one.properties?.["kind"]);
    expect(kinds(true)).toEqual(["trail", "plan"]);
    expect(kinds(false)).toEqual(["trail"]);
  });
});
