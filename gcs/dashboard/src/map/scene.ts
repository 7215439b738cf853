/** The map's content as GeoJSON, from what the server says. No map library here. */

import type { Feature, FeatureCollection, Geometry } from "geojson";

import { aoiStep } from "../core/aoi";
import { vehicleAlerts, worst } from "../core/alerts";
import { positionStale, vehicleStale } from "../core/freshness";
import { areaRingM, closed, frameOf, toLngLat, type Frame } from "../core/geo";
import type { Trails } from "../core/trails";
import type { CampaignStatic, Pair, PlanView, UserView, VehicleView } from "../core/types";

export type Scene = FeatureCollection;

const collection = (features: Feature[]): Scene => ({ type: "FeatureCollection", features });
const feature = (geometry: Geometry, properties: Record<string, unknown> = {}): Feature => ({
  type: "Feature",
  geometry,
  properties,
});
const ringOf = (frame: Frame, ring: readonly Pair[]): Pair[] => closed(ring).map((corner) => toLngLat(frame, corner));
const lineOf = (frame: Frame, line: readonly Pair[]): Geometry => ({
  type: "LineString",
  coordinates: line.map((point) => toLngLat(frame, point)),
});

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
function placed<T extends { [K in keyof Place]: number | null }>(things: readonly T[]): (T & Place)[] {
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

export type DroneLook = "normal" | "stale" | "caution" | "warning";

/** Stale comes first: a colour would pretend to know how it is now. */
export function droneLook(vehicle: VehicleView, live: boolean): DroneLook {
  if (!live || vehicleStale(vehicle) || positionStale(vehicle)) return "stale";
  const severity = worst(vehicleAlerts(vehicle));
  return severity === null || severity === "info" ? "normal" : severity;
}

/** Drones where they were last seen; `serves` while off the ground. */
export function droneScene(
  campaign: CampaignStatic,
  vehicles: readonly VehicleView[],
  selected: number | null,
  live: boolean,
): Scene {
  const frame = frameOf(campaign);
  return collection(
    placed(vehicles).map((vehicle) => {
      const here: Pair = [vehicle.east_m, vehicle.north_m];
      const chosen = vehicle.system_id === selected;
      const look = droneLook(vehicle, live);
      const serves = vehicle.landed !== "on_ground";
      const marks = { kind: "drone", id: vehicle.system_id, heading: vehicle.heading_deg, look, chosen, serves };
      return feature({ type: "Point", coordinates: toLngLat(frame, here) }, marks);
    }),
  );
}

/** Trails behind and planned ways ahead. */
export function wayScene(campaign: CampaignStatic, trails: Trails, plans: readonly PlanView[], live: boolean): Scene {
  const frame = frameOf(campaign);
  const behind = [...trails]
    .filter(([, trail]) => trail.length > 1)
    .map(([id, trail]) => feature(lineOf(frame, trail), { kind: "trail", id }));
  const ahead = (live ? plans : [])
    .filter((plan) => plan.path_m.length > 1)
    .map((plan) => feature(lineOf(frame, plan.path_m), { kind: "plan", id: plan.system_id }));
  return collection([...behind, ...ahead]);
}
