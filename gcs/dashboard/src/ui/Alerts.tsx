/** What is wrong now: warnings on top and red, cautions yellow below. Nothing here when all is normal. */

import type { Alert } from "../core/alerts";
import * as state from "../core/state";

const SHOWN = 6;

export function Alerts() {
  const alerts = state.alerts.value;
  if (alerts.length === 0) return null;
  return (
    <section class="alerts" aria-label="Alerts" aria-live="assertive">
      <ul>
        {alerts.slice(0, SHOWN).map((alert) => (
          <AlertLine key={alert.key} alert={alert} />
        ))}
      </ul>
      {alerts.length > SHOWN && <p class="note">and {alerts.length - SHOWN} more, in the events and on the cards</p>}
    </section>
  );
}

function AlertLine({ alert }: { alert: Alert }) {
  const { sequence } = alert;
  return (
    <li class={alert.severity}>
      <span>
        <b>{alert.severity === "warning" ? "Warning" : "Caution"}</b> {alert.text}
      </span>
      {sequence !== null && (
        <button type="button" aria-label={`Acknowledge: ${alert.text}`} onClick={() => state.acknowledge(sequence)}>
          Acknowledge
        </button>
      )}
    </li>
  );
}
