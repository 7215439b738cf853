/** The map's content as GeoJSON, from what the server says. No map library here. */

import type { Feature, FeatureCollection, Geometry } from "geojson";

import { aoiStep } from "../core/aoi";
import { vehicleAlerts, worst } from "../core/alerts";
import { positionStale, vehicleStale } from "../core/freshness";
import { areaRingM, circleM, closed, frameOf, toLngLat, type Frame } from "../core/geo";
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

/** One point a user; oldest last, so that they lie on top. */
export function userScene(campaign: CampaignStatic, users: readonly UserView[]): Scene {
  const frame = frameOf(campaign);
  const byAge = [...users].sort((a, b) => a.aoi_slots - b.aoi_slots);
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

const placed = (vehicles: readonly VehicleView[]): (VehicleView & { east_m: number; north_m: number })[] =>
  vehicles.filter(
    (vehicle): vehicle is VehicleView & { east_m: number; north_m: number } =>
      vehicle.east_m !== null && vehicle.north_m !== null,
  );

/** Drones where they were last seen, with their reach while they serve. */
export function droneScene(
  campaign: CampaignStatic,
  vehicles: readonly VehicleView[],
  selected: number | null,
  live: boolean,
): Scene {
  const frame = frameOf(campaign);
  return collection(
    placed(vehicles).flatMap((vehicle) => {
      const here: Pair = [vehicle.east_m, vehicle.north_m];
      const chosen = vehicle.system_id === selected;
      const look = droneLook(vehicle, live);
      const marks = [
        feature(
          { type: "Point", coordinates: toLngLat(frame, here) },
          { kind: "drone", id: vehicle.system_id, heading: vehicle.heading_deg, look, chosen },
        ),
      ];
      if (vehicle.landed !== "on_ground") {
        const ring = circleM(here, campaign.serving_radius_m).map((corner) => toLngLat(frame, corner));
        marks.push(feature({ type: "Polygon", coordinates: [ring] }, { kind: "reach", chosen, stale: look === "stale" }));
      }
      return marks;
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
