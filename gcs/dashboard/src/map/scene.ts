/** What the map shows, from what the server says: still things as GeoJSON, and how a drone is to look. No map library here. */

import type { Feature, FeatureCollection, Geometry } from "geojson";

import { aoiStep } from "../core/aoi";
import { vehicleAlerts, worst } from "../core/alerts";
import { positionStale, vehicleStale } from "../core/freshness";
import { areaRingM, closed, frameOf, toLngLat, type Frame } from "../core/geo";
import type { CampaignStatic, Pair, UserView, VehicleView } from "../core/types";

export type Scene = FeatureCollection;

const collection = (features: Feature[]): Scene => ({ type: "FeatureCollection", features });
const feature = (geometry: Geometry, properties: Record<string, unknown> = {}): Feature => ({
  type: "Feature",
  geometry,
  properties,
});
const ringOf = (frame: Frame, ring: readonly Pair[]): Pair[] => closed(ring).map((corner) => toLngLat(frame, corner));

export const EMPTY: Scene = collection([]);

/** Area, fence, obstacles and launch points: `kind` says which. */
export function groundScene(campaign: CampaignStatic): Scene {
  const frame = frameOf(campaign);
  const polygon = (ring: readonly Pair[], properties: Record<string, unknown>): Feature =>
    feature({ type: "Polygon", coordinates: [ringOf(frame, ring)] }, properties);
  const launches = new Set(campaign.launch_m.map((point) => JSON.stringify(point)));
  return collection([
    polygon(areaRingM(campaign.size_m), { kind: "area" }),
    polygon(campaign.fence_m, { kind: "fence" }),
    ...campaign.obstacles.map((obstacle) =>
      polygon(obstacle.polygon_m, { kind: "obstacle", name: obstacle.name, high: obstacle.height_m >= campaign.altitude_m }),
    ),
    ...[...launches].map((text) =>
      feature({ type: "Point", coordinates: toLngLat(frame, JSON.parse(text) as Pair) }, { kind: "launch" }),
    ),
  ]);
}

interface Place {
  east_m: number;
  north_m: number;
}

/** Those whose place is known. */
export function placed<T extends { [K in keyof Place]: number | null }>(things: readonly T[]): (T & Place)[] {
  return things.filter((one): one is T & Place => one.east_m !== null && one.north_m !== null);
}

/** One point a user; oldest last, so that they lie on top. */
export function userScene(campaign: CampaignStatic, users: readonly UserView[]): Scene {
  const frame = frameOf(campaign);
  const byAge = placed(users).sort((a, b) => a.aoi_slots - b.aoi_slots);
  return collection(
    byAge.map((user) =>
      feature(
        { type: "Point", coordinates: toLngLat(frame, [user.east_m, user.north_m]) },
        { id: user.user_id, step: aoiStep(user.aoi_slots), aoi: user.aoi_slots, waiting: user.data_mb },
      ),
    ),
  );
}

/** The corners given so far, and the line through them. */
export function drawingScene(corners: readonly Pair[]): Scene {
  const points = corners.map((at) => feature({ type: "Point", coordinates: at }));
  return collection(corners.length < 2 ? points : [...points, feature({ type: "LineString", coordinates: [...corners] })]);
}

export type DroneLook = "normal" | "stale" | "caution" | "warning";

/** Stale comes first: a colour would pretend to know how it is now. */
export function droneLook(vehicle: VehicleView, live: boolean): DroneLook {
  if (!live || vehicleStale(vehicle) || positionStale(vehicle)) return "stale";
  const severity = worst(vehicleAlerts(vehicle));
  return severity === null || severity === "info" ? "normal" : severity;
}

/** Names for drones on the screen: one that is as near as `samePx` to an earlier one is named with it. */
export function namesAt(drones: readonly { id: number; at: Pair }[], samePx: number): Map<number, string> {
  const heads: { id: number; at: Pair; all: number[] }[] = [];
  for (const { id, at } of drones) {
    const head = heads.find((one) => Math.hypot(one.at[0] - at[0], one.at[1] - at[1]) <= samePx);
    if (head === undefined) heads.push({ id, at, all: [id] });
    else head.all.push(id);
  }
  return new Map(heads.map(({ id, all }) => [id, all.length > 4 ? `${all.slice(0, 3).join(", ")} … ${all.length} UAVs` : all.join(", ")]));
}
