/** The log of this session, newest first, with a filter. */

import { signal } from "@preact/signals";

import { clock } from "../core/format";
import * as state from "../core/state";
import type { Severity } from "../core/types";

const least = signal<Severity>("info");
const RANK: Record<Severity, number> = { info: 0, caution: 1, warning: 2 };
const SHOWN = 200;

export function Events() {
  const shown = state.events.value.filter((event) => RANK[event.severity] >= RANK[least.value]).slice(0, SHOWN);
  return (
    <section class="panel events" aria-label="Events">
      <div class="panel-head">
        <h2>Events</h2>
        <label class="note">
          show{" "}
          <select value={least.value} onChange={(event) => (least.value = event.currentTarget.value as Severity)}>
            <option value="info">all</option>
            <option value="caution">cautions and warnings</option>
            <option value="warning">warnings</option>
          </select>
        </label>
      </div>
      {state.missedEvents.value > 0 && <p class="note">{state.missedEvents.value} events did not reach this page; the server's log has them.</p>}
      {shown.length === 0 && <p class="note">None yet.</p>}
      <ol tabIndex={0} aria-label="Event log">
        {shown.map((event) => (
          <li key={event.sequence} class={event.severity}>
            <time>{clock(event.time_s)}</time> <span>{event.message}</span>
            {event.actor !== "system" && <span class="note"> · {event.actor}</span>}
          </li>
        ))}
      </ol>
    </section>
  );
}
