/** The log's filter: a least severity, and words that all must be in the line, its kind or its author. */

import type { EventMessage, Severity } from "./types";

const RANK: Record<Severity, number> = { info: 0, caution: 1, warning: 2 };

export function eventsMatching(events: readonly EventMessage[], least: Severity, words: string): EventMessage[] {
  const wanted = words.toLowerCase().split(/\s+/).filter((word) => word !== "");
  return events.filter((event) => {
    if (RANK[event.severity] < RANK[least]) return false;
    const line = `${event.message} ${event.kind} ${event.actor} ${event.system_id === null ? "" : `uav ${event.system_id}`}`.toLowerCase();
    return wanted.every((word) => line.includes(word));
  });
}
