/** What the log of a recording says of a moment: the campaign's state, stops, verdicts, and what was acknowledged. */

import type { EventMessage, VerdictView } from "./types";

export interface RecordedEvent extends EventMessage {
  at_slot: number;
  at_s: number;
}

/** The log of a recording until a moment, and what follows from it. */
export interface LogThen {
  log: readonly RecordedEvent[]; // oldest first
  newestFirst: readonly RecordedEvent[]; // timed as the slider is
  state: string | null;
  stopped: { all: boolean; ones: number[] };
  verdicts: ReadonlyMap<number, VerdictView>;
  acknowledged: ReadonlyMap<number, string>;
}

/** The newest answer for each log: ten pictures a second mostly ask for the same. */
const known = new WeakMap<readonly RecordedEvent[], LogThen>();

/** The log until `atS`; the same object while nothing is added. */
export function logAt(events: readonly RecordedEvent[], atS: number): LogThen {
  const count = events.findLastIndex((event) => event.at_s <= atS) + 1;
  const newest = known.get(events);
  if (newest?.log.length === count) return newest;
  const log = events.slice(0, count);
  const then: LogThen = {
    log, newestFirst: log.map((event) => ({ ...event, time_s: event.at_s })).reverse(), state: stateTold(log), stopped: stoppedAt(log), verdicts: verdictsAt(log), acknowledged: acknowledgedAt(log),
  };
  known.set(events, then);
  return then;
}

const stateOf = (event: RecordedEvent): string | null => {
  const state = event.kind === "campaign.state" ? event.data["state"] : null;
  return typeof state === "string" ? state : null;
};

/** The newest state that was told, null where none was. */
function stateTold(log: readonly RecordedEvent[]): string | null {
  const event = log.findLast((one) => stateOf(one) !== null);
  return event === undefined ? null : stateOf(event);
}

/** When a decision last came too late, failed or could not be flown; -Infinity where none did. */
export const givenUpS = (log: readonly RecordedEvent[]): number => log.findLast(({ kind }) => kind.startsWith("plan."))?.at_s ?? -Infinity;

/** Seconds of [fromS, toS] in which the slot clock stood still. */
export function pausedS(log: readonly RecordedEvent[], fromS: number, toS: number): number {
  let [sum, sinceS] = [0, null as number | null];
  const close = (atS: number): void => {
    if (sinceS !== null) sum += Math.max(0, Math.min(atS, toS) - Math.max(sinceS, fromS));
  };
  for (const event of log) {
    const state = stateOf(event);
    if (state === null) continue;
    close(event.at_s);
    sinceS = state === "paused" ? event.at_s : null;
  }
  close(toS);
  return sum;
}

/** Who was under the emergency stop: all, or some one by one. */
function stoppedAt(log: readonly RecordedEvent[]): { all: boolean; ones: number[] } {
  let all = false;
  const ones = new Set<number>();
  for (const { kind, system_id } of log) {
    if (kind === "safety.stop") system_id === null ? (all = true) : ones.add(system_id);
    if (kind === "safety.stop_reset") {
      if (system_id === null) [all] = [false, ones.clear()];
      else ones.delete(system_id);
    }
  }
  return { all, ones: [...ones].sort((a, b) => a - b) };
}

/** The newest answer of each drone. */
function verdictsAt(log: readonly RecordedEvent[]): Map<number, VerdictView> {
  const text = (value: unknown): string => (typeof value === "string" ? value : "");
  return new Map(log.flatMap(({ kind, system_id, time_s, message, data }): [number, VerdictView][] =>
    kind !== "command.verdict" || system_id === null
      ? []
      : [[system_id, { command: text(data["command"]), result: text(data["result"]), reason: "reason" in data ? text(data["reason"]) : message, time_s }]],
  ));
}

/** Alerts that somebody had taken note of: an acknowledgement names the words, and covers what said them before it. */
function acknowledgedAt(log: readonly RecordedEvent[]): Map<number, string> {
  const done = new Map<number, string>();
  log.forEach(({ kind, message, system_id, actor }, index) => {
    if (kind !== "alert.acknowledged") return;
    for (const one of log.slice(0, index))
      if (one.severity !== "info" && one.system_id === system_id && message === `"${one.message}" acknowledged`) done.set(one.sequence, actor);
  });
  return done;
}
