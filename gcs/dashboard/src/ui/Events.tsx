/** The log of this session, newest first, with a filter. */

import { signal } from "@preact/signals";

import { eventsMatching } from "../core/eventFilter";
import { clock } from "../core/format";
import * as state from "../core/state";
import type { Severity } from "../core/types";

const least = signal<Severity>("info");
const words = signal("");
const SHOWN = 200;

export function Events() {
  const shown = eventsMatching(state.events.value, least.value, words.value).slice(0, SHOWN);
  return (
    <section class="panel events" aria-label="Events">
      <div class="panel-head">
        <h2>Events</h2>
        <div class="filters">
          <input type="search" placeholder="filter" aria-label="Filter events by words" value={words.value} onInput={(event) => (words.value = event.currentTarget.value)} />
          <select aria-label="Least severity shown" value={least.value} onChange={(event) => (least.value = event.currentTarget.value as Severity)}>
            <option value="info">all</option>
            <option value="caution">cautions too</option>
            <option value="warning">warnings</option>
          </select>
        </div>
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
