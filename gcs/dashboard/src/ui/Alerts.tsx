/**
 * What is wrong now: warnings on top and red, cautions yellow below, each until it is over or somebody has taken note of
 * it by name. None is left out for want of room: the list scrolls. Nothing here when all is normal.
 */

import { signal } from "@preact/signals";

import { grouped, type AlertGroup } from "../core/alerts";
import { acknowledge, muted, sounded } from "../core/app";
import { clock } from "../core/format";
import * as state from "../core/state";

const refusal = signal<string | null>(null);

/** Oldest first; the first refusal is told and ends it. */
async function takeNote(notes: AlertGroup["notes"]): Promise<void> {
  for (const { sequence, timeS } of notes.toReversed()) {
    refusal.value = await acknowledge(sequence, timeS);
    if (refusal.value !== null) return;
  }
}

export function Alerts() {
  const alerts = grouped(state.alerts.value);
  if (alerts.length === 0) return null;
  return (
    <section class="alerts" aria-label="Alerts">
      <div class="alerts-head">
        <span class="note">{state.replaying.value && "Now: "}{summary(alerts)}</span>
        {refusal.value !== null && <span class="verdict bad" role="status">Not acknowledged: {refusal.value}</span>}
        <Mute />
      </div>
      <ul aria-live="assertive" tabIndex={0} aria-label="Alerts by priority">
        {alerts.map((alert) => (
          <AlertLine key={alert.key} alert={alert} />
        ))}
      </ul>
    </section>
  );
}

/** What was wrong at the moment that a replay shows: silent, nothing to acknowledge, and beside the present's alerts. */
export function RecordedAlerts() {
  const alerts = grouped(state.recordedAlerts.value);
  if (alerts.length === 0) return null;
  return (
    <section class="alerts then" aria-label="Wrong at that time" data-testid="recorded-alerts">
      <p class="note">In the recording: {summary(alerts)}</p>
      <ul tabIndex={0} aria-label="What was wrong, by priority">
        {alerts.map((alert) => <AlertLine key={alert.key} alert={alert} recorded />)}
      </ul>
    </section>
  );
}

function summary(alerts: readonly AlertGroup[]): string {
  const warnings = alerts.filter((alert) => alert.severity === "warning").length;
  return `${count(warnings, "warning")}, ${count(alerts.length - warnings, "caution")}`;
}

const count = (number: number, what: string): string => `${number} ${what}${number === 1 ? "" : "s"}`;

function Mute() {
  return (
    <button
      type="button"
      aria-pressed={muted.value}
      title="Cautions make no sound while this is pressed; warnings always do"
      data-testid="mute"
      data-sounded={sounded.value?.tone}
      data-times={sounded.value?.count ?? 0}
      onClick={() => (muted.value = !muted.value)}
    >
      Mute cautions
    </button>
  );
}

function AlertLine({ alert, recorded = false }: { alert: AlertGroup; recorded?: boolean }) {
  const { notes } = alert;
  const lastS = notes[0]?.timeS ?? null;
  return (
    <li class={alert.severity}>
      <span>
        <b>{alert.severity === "warning" ? "Warning" : "Caution"}</b> {alert.text}
        {notes.length > 1 && <span class="times"> {notes.length} times, last at {clock(lastS)}</span>}
      </span>
      {notes.length > 0 && !recorded && state.mayFly.value && (
        <button type="button" aria-label={`Acknowledge as ${state.hello.value?.actor}: ${alert.text}`} onClick={() => void takeNote(notes)}>
          Acknowledge
        </button>
      )}
    </li>
  );
}
