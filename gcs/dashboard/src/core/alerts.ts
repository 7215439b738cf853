/** What is wrong now: conditions read from the snapshot, and events until someone has acknowledged them. */

import { batteryAlert } from "./battery";
import { HEARTBEAT_LIMIT_S, POSITION_LIMIT_S } from "./freshness";
import type { EventMessage, Severity, SnapshotMessage, VehicleView } from "./types";

export interface Alert {
  key: string;
  severity: Severity;
  text: string;
  systemId: number | null;
  sequence: number | null; // of the event, when it can be acknowledged
  timeS: number | null; // of the event
}

export const LOSS_CAUTION = 0.2;

const RANK: Record<Severity, number> = { warning: 0, caution: 1, info: 2 };

/** A vehicle's abnormal conditions; empty is normal. */
export function vehicleAlerts(vehicle: VehicleView): Alert[] {
  const id = vehicle.system_id;
  const found: Alert[] = [];
  const add = (severity: Severity, what: string, text: string): void => {
    found.push({ key: `${id}:${what}`, severity, text: `UAV ${id}: ${text}`, systemId: id, sequence: null, timeS: null });
  };
  const { heartbeat_age_s: heartbeat, position_age_s: position } = vehicle;
  const battery = batteryAlert(vehicle);
  if (heartbeat === null) add("caution", "silent", "never heard");
  else if (heartbeat > HEARTBEAT_LIMIT_S) add("warning", "silent", `no heartbeat for ${heartbeat.toFixed(0)} s`);
  else if (vehicle.armed && (position === null || position > POSITION_LIMIT_S)) add("warning", "position", "position is old");
  if (battery !== null) add(battery[0], "battery", battery[1]);
  if (vehicle.mode === "pilot" && vehicle.armed) add("caution", "pilot", `flown by a pilot (${vehicle.mode_name})`);
  if (vehicle.loss_ratio > LOSS_CAUTION) add("caution", "loss", `loses ${(100 * vehicle.loss_ratio).toFixed(0)}% of its messages`);
  return found;
}

/** Everything wrong, warnings first; `acknowledged` holds the events that were, and by whom. */
export function allAlerts(
  snapshot: SnapshotMessage | null,
  events: readonly EventMessage[],
  acknowledged: ReadonlyMap<number, string>,
): Alert[] {
  const found = snapshot === null ? [] : snapshot.vehicles.flatMap(vehicleAlerts);
  if (snapshot !== null && !snapshot.healthy) {
    const text = "The flight loop is late: drones hold by themselves";
    found.push({ key: "loop", severity: "warning", text, systemId: null, sequence: null, timeS: null });
  }
  if (snapshot?.stopped === true) {
    const text = "Emergency stop: UAVs hold until it is released";
    found.push({ key: "stopped", severity: "warning", text, systemId: null, sequence: null, timeS: null });
  }
  for (const id of snapshot?.stopped_ids ?? []) {
    const text = `UAV ${id}: emergency stop, it holds until it is released`;
    found.push({ key: `${id}:stopped`, severity: "warning", text, systemId: id, sequence: null, timeS: null });
  }
  for (const event of events) {
    if (event.severity === "info" || acknowledged.has(event.sequence)) continue;
    const key = `event:${event.sequence}`;
    const { severity, message: text, system_id: systemId, sequence, time_s: timeS } = event;
    found.push({ key, severity, text, systemId, sequence, timeS });
  }
  return found.sort((a, b) => RANK[a.severity] - RANK[b.severity] || (b.sequence ?? Infinity) - (a.sequence ?? Infinity));
}

export interface AlertGroup extends Alert {
  /** The events that say the same, newest first; empty for a condition, which nobody can acknowledge away. */
  notes: { sequence: number; timeS: number }[];
}

/** "slot 7: no decision 2.1 s into the slot" says the same as "slot 9: no decision 2.4 s into the slot". */
const sameWords = (text: string): string => text.replace(/^slot \d+: /, "").replace(/\d+(\.\d+)?(?= (s|ms|ticks)\b)/g, "#");

/** Events with the same key are one line. */
export const groupKey = ({ severity, systemId, text }: Pick<Alert, "severity" | "systemId" | "text">): string =>
  `${severity} ${systemId} ${sameWords(text)}`;

/**
 * What says the same becomes one line with the newest one's words, at its place: a fault that repeats itself hides
 * nothing else. Acknowledging takes note of all until then; the next one makes a new line.
 */
export function grouped(alerts: readonly Alert[]): AlertGroup[] {
  const groups = new Map<string, AlertGroup>();
  for (const alert of alerts) {
    const { sequence, timeS } = alert;
    const key = sequence === null ? alert.key : groupKey(alert);
    const group = groups.get(key) ?? { ...alert, key, notes: [] };
    if (sequence !== null && timeS !== null) group.notes.push({ sequence, timeS });
    groups.set(key, group);
  }
  return [...groups.values()];
}

export const worst = (alerts: readonly Alert[]): Severity | null => alerts[0]?.severity ?? null;
