/**
 * One press, no question: every UAV in the air holds. Always at the same place, first in the tab order, and latched:
 * releasing it is what has to be held. Offered even on lost contact, for the server may still hear it.
 */

import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";

import { api } from "../core/app";
import { uavNames } from "../core/format";
import * as state from "../core/state";
import { HoldButton } from "./HoldButton";

const failure = signal<string | null>(null);

async function stopAll(): Promise<void> {
  failure.value = "Sending…";
  const answer = await api.emergencyStop();
  failure.value = answer.ok ? null : `NOT STOPPED: ${answer.reason}`;
}

async function release(): Promise<void> {
  const answer = await api.resetStop();
  failure.value = answer.ok ? null : `Not released: ${answer.reason}`;
}

export function EmergencyStop() {
  useEffect(() => {
    const onKey = (event: KeyboardEvent): void => {
      if (event.key === "Escape" && event.shiftKey && state.mayFly.value) void stopAll();
    };
    addEventListener("keydown", onKey);
    return () => removeEventListener("keydown", onKey);
  }, []);
  const snapshot = state.flight.snapshot.value;
  const stopped = snapshot?.stopped === true;
  const known = state.live.value; // what was latched may have been released by somebody else since
  const reached = uavNames(snapshot?.vehicles.map((vehicle) => vehicle.system_id) ?? []);
  return (
    <div class={`estop${stopped ? " latched" : ""}`} role="group" aria-label="Emergency stop">
      <button
        type="button"
        class="estop-button"
        disabled={!state.mayFly.value || (stopped && known)}
        title={`Shift+Esc: ${reached} hold where they are`}
        aria-keyshortcuts="Shift+Escape"
        onClick={() => void stopAll()}
      >
        <b>{stopped ? "STOPPED" : "EMERGENCY STOP"}</b>
        <small>{stopped ? (known ? "latched: UAVs hold" : "unconfirmed: press again") : `${reached} · Shift+Esc`}</small>
      </button>
      {stopped && (
        <HoldButton label="Release" explain={`Release the emergency stop of ${reached}`} disabled={!state.mayFly.value || !known} onDone={() => void release()} />
      )}
      {failure.value !== null && <p class="estop-failure" role="alert">{failure.value}</p>}
    </div>
  );
}
