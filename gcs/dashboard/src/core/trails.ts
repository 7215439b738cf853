/** Where each drone has been lately, the same map while nothing moved: bounded, and thinned by distance so that hovering adds nothing. */

import type { Pair, VehicleView } from "./types";
import { positionStale } from "./freshness";

export const TRAIL_POINTS = 240;
const STEP_M = 4;

export type Trails = ReadonlyMap<number, readonly Pair[]>;

export function withPlaces(trails: Trails, vehicles: readonly VehicleView[]): Trails {
  let next: Map<number, readonly Pair[]> | null = null;
  for (const vehicle of vehicles) {
    if (vehicle.east_m === null || vehicle.north_m === null || positionStale(vehicle)) continue;
    const trail = trails.get(vehicle.system_id) ?? [];
    const here: Pair = [vehicle.east_m, vehicle.north_m];
    const last = trail[trail.length - 1];
    if (last !== undefined && Math.hypot(here[0] - last[0], here[1] - last[1]) < STEP_M) continue;
    next ??= new Map(trails);
    next.set(vehicle.system_id, [...trail.slice(-(TRAIL_POINTS - 1)), here]);
  }
  return next ?? trails;
}
