/**
 * The fleet of a recording, from the telemetry that was kept about once a second: places between two samples lie on the
 * straight way, everything else is as the newer sample before said. Where samples are missing, values grow old as they
 * do in flight, and the page greys them.
 */

import { POSITION_LIMIT_S } from "./freshness";
import { between, lastAt, turned, type Timed } from "./timeline";
import type { Pair, VehicleView } from "./types";

type Row = readonly unknown[];

export interface TelemetryPage {
  columns: string[];
  samples: { at_s: number; vehicles: unknown[][] }[];
  next_first: number | null;
}

/** Rows as they came: vehicles are made of those that are looked at. */
export interface Sample extends Timed {
  columns: readonly string[];
  rows: readonly Row[];
}

export const samplesOf = (page: TelemetryPage): Sample[] =>
  page.samples.map(({ at_s, vehicles }) => ({ atS: at_s, columns: page.columns, rows: vehicles }));

const UNKNOWN: Omit<VehicleView, "system_id"> = {
  autopilot: "unknown", mode: "unknown", mode_name: "", armed: false, landed: "unknown", position_ready: false,
  lat_deg: null, lon_deg: null, east_m: null, north_m: null, alt_home_m: null, vel_ned_mps: [0, 0, 0], yaw_rad: 0, heading_deg: 0, speed_mps: 0,
  battery_fraction: null, return_fraction: null, battery_v: null, loss_ratio: 0, heartbeat_age_s: null, position_age_s: null,
  address: "", last_verdict: null, texts: [],
};

const vehicleOf = (columns: readonly string[], row: Row): VehicleView =>
  ({ ...UNKNOWN, ...Object.fromEntries(columns.map((name, k) => [name, row[k]])) }) as VehicleView;

/** A gap so many times as long as the one before is none of the sampling's. */
const HOLE = 2.5;

/** The vehicles at a moment; null where no telemetry was kept. */
export function fleetAt(samples: readonly Sample[], atS: number): VehicleView[] | null {
  const index = Math.max(0, lastAt(samples, atS));
  const [before, here, next] = [samples[index - 1], samples[index], samples[index + 1]];
  if (here === undefined) return null;
  const usualS = Math.max(1, before === undefined ? 0 : here.atS - before.atS);
  const whole = next !== undefined && next.atS - here.atS <= HOLE * usualS;
  const sinceS = Math.max(0, atS - here.atS);
  const later = whole ? new Map(next.rows.map((row) => [row[next.columns.indexOf("system_id")], row])) : null;
  return here.rows.map((row) => {
    const vehicle = vehicleOf(here.columns, row);
    const then = later?.get(vehicle.system_id);
    if (whole && then !== undefined) return moved(vehicle, vehicleOf(next.columns, then), sinceS / (next.atS - here.atS));
    return { ...vehicle, heartbeat_age_s: older(vehicle.heartbeat_age_s, sinceS), position_age_s: older(vehicle.position_age_s, sinceS) };
  });
}

const older = (ageS: number | null, byS: number): number | null => (ageS === null ? null : ageS + byS);

function moved(from: VehicleView, to: VehicleView, share: number): VehicleView {
  const way = (name: "lat_deg" | "lon_deg" | "east_m" | "north_m" | "alt_home_m" | "battery_fraction" | "return_fraction") => between(from[name], to[name], share);
  return {
    ...from,
    lat_deg: way("lat_deg"), lon_deg: way("lon_deg"), east_m: way("east_m"), north_m: way("north_m"), alt_home_m: way("alt_home_m"),
    battery_fraction: way("battery_fraction"), return_fraction: way("return_fraction"),
    heading_deg: turned(from.heading_deg, to.heading_deg, share), speed_mps: between(from.speed_mps, to.speed_mps, share) ?? 0,
  };
}

const STEP_M = 4;

/** Where each drone was since `fromS`, thinned by distance, up to where it is drawn now. */
export function trailsOf(samples: readonly Sample[], fromS: number, atS: number, now: readonly VehicleView[]): Map<number, Pair[]> {
  const trails = new Map<number, Pair[]>();
  const add = (id: number, here: Pair, always = false): void => {
    const trail = trails.get(id);
    const last = trail?.at(-1);
    if (trail === undefined || last === undefined) trails.set(id, [here]);
    else if (always || Math.hypot(here[0] - last[0], here[1] - last[1]) >= STEP_M) trail.push(here);
  };
  for (const { columns, rows } of samples.slice(lastAt(samples, fromS) + 1, lastAt(samples, atS) + 1)) {
    const [id, east, north, age] = ["system_id", "east_m", "north_m", "position_age_s"].map((name) => columns.indexOf(name)) as [number, number, number, number];
    for (const row of rows) {
      const [x, y, old] = [row[east], row[north], row[age]];
      if (typeof x === "number" && typeof y === "number" && typeof old === "number" && old <= POSITION_LIMIT_S) add(row[id] as number, [x, y]);
    }
  }
  for (const { system_id, east_m, north_m } of now) if (east_m !== null && north_m !== null) add(system_id, [east_m, north_m], true);
  return trails;
}
