/** When a value may still be shown as live. Ages grow here between messages: a silent server makes everything old. */

import type { VehicleView } from "./types";

/** Without a message for this long the page says so, large. The stream comes at 5 Hz. */
export const SILENCE_LIMIT_S = 2;
/** Four missed heartbeats (MAVLink heartbeat protocol). */
export const HEARTBEAT_LIMIT_S = 4;
export const POSITION_LIMIT_S = 3;

export type Link = "connecting" | "live" | "silent" | "lost";

/** What the connection is worth: `sinceMessageS` is null before the first message of this connection. */
export function linkState(open: boolean, everOpen: boolean, sinceMessageS: number | null): Link {
  if (!open) return everOpen ? "lost" : "connecting";
  if (sinceMessageS === null) return everOpen ? "lost" : "connecting";
  return sinceMessageS > SILENCE_LIMIT_S ? "silent" : "live";
}

/** Never heard counts as stale. */
export function vehicleStale(vehicle: VehicleView): boolean {
  return vehicle.heartbeat_age_s === null || vehicle.heartbeat_age_s > HEARTBEAT_LIMIT_S;
}

export function positionStale(vehicle: VehicleView): boolean {
  return vehicle.position_age_s === null || vehicle.position_age_s > POSITION_LIMIT_S;
}
