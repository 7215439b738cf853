/** A card a drone: grey when normal, colour only for what is abnormal, and nothing old shown as if it were live. */

import { computed } from "@preact/signals";

import { vehicleAlerts, worst } from "../core/alerts";
import { batteryText } from "../core/battery";
import { ago, fixed, percent, uavNames } from "../core/format";
import { positionStale, vehicleStale } from "../core/freshness";
import { mark, marked, ORDERS, verdictText } from "../core/marking";
import { answers, give, releaseOne, stopOne } from "../core/orders";
import { paced } from "../core/pace";
import * as state from "../core/state";
import type { VehicleView } from "../core/types";
import { HoldButton } from "./HoldButton";
import { Why } from "./Why";

const PACE_MS = 450;
const NOBODY: readonly VehicleView[] = [];
const fleet = computed(() => state.snapshot.value?.vehicles ?? NOBODY);
/** Another fleet, or another severity of a drone, is shown at once. */
const outline = (vehicles: readonly VehicleView[]): string =>
  `${state.replaying.peek()} ${vehicles.map((vehicle) => `${vehicle.system_id} ${worst(vehicleAlerts(vehicle))} ${vehicle.mode_name} ${vehicle.last_verdict?.time_s}`).join()}`;
const calm = paced(fleet, PACE_MS, outline);

export function Fleet() {
  const vehicles = calm.value;
  return (
    <section class="panel fleet-panel" aria-label="Fleet">
      <div class="panel-head">
        <h2>Fleet</h2>
        <span class="note" data-testid="fleet-summary">{summary(vehicles)}</span>
      </div>
      {vehicles.length === 0 && <p class="note">No drone has been heard yet.</p>}
      {vehicles.length > 1 && state.mayFly.value && !state.replaying.value && <OrdersToSeveral vehicles={vehicles} />}
      <ul class="fleet">
        {vehicles.map((vehicle) => (
          <Card key={vehicle.system_id} vehicle={vehicle} />
        ))}
      </ul>
    </section>
  );
}

function summary(vehicles: readonly VehicleView[]): string {
  if (vehicles.length === 0) return "";
  const count = `${vehicles.length} ${vehicles.length === 1 ? "UAV" : "UAVs"}`;
  if (!state.reported.value) return `${count}, recorded`;
  const wrong = vehicles.filter((vehicle) => vehicleAlerts(vehicle).length > 0).length;
  return `${count}, ${state.replaying.value ? "recorded, " : ""}${wrong === 0 ? "all normal" : `${wrong} not normal`}`;
}

function OrdersToSeveral({ vehicles }: { vehicles: readonly VehicleView[] }) {
  const ids = vehicles.map((vehicle) => vehicle.system_id);
  const all = marked.value.length === ids.length;
  return (
    <div class="several">
      <label class="mark">
        <input type="checkbox" checked={all} onChange={() => mark(ids, !all)} /> {marked.value.length === 0 ? "Mark all" : `${uavNames(marked.value)} marked`}
      </label>
      {marked.value.length > 0 && <Orders ids={marked.value} />}
    </div>
  );
}

function Orders({ ids }: { ids: readonly number[] }) {
  const names = uavNames(ids);
  return (
    <div class="orders" role="group" aria-label={`Orders to ${names}`}>
      {ORDERS.map((one) => (
        <HoldButton
          key={one.command} label={one.label} explain={one.explain(names)} danger={one.danger ?? false}
          disabled={!state.mayFly.value || !state.live.value} onDone={() => void give(ids, one.command)}
        />
      ))}
    </div>
  );
}

/** Without holding, as all emergency stops; releasing is held. */
function StopOne({ id }: { id: number }) {
  const stopped = state.flight.snapshot.value?.stopped_ids.includes(id) === true;
  return stopped ? (
    <HoldButton label={`Release UAV ${id}`} explain={`Release UAV ${id} from its emergency stop`} disabled={!state.live.value} onDone={() => void releaseOne(id)} />
  ) : (
    <button type="button" class="stop-one" onClick={() => void stopOne(id)}>Stop UAV {id} now</button>
  );
}

function Card({ vehicle }: { vehicle: VehicleView }) {
  const id = vehicle.system_id;
  const chosen = state.selected.value === id;
  const replaying = state.replaying.value;
  const recorded = !state.reported.value;
  const alerts = recorded ? [] : vehicleAlerts(vehicle);
  const stale = vehicleStale(vehicle);
  const orders = chosen && !replaying && state.mayFly.value;
  return (
    <li class={`drone ${worst(alerts) ?? "normal"}${chosen ? " chosen" : ""}`} data-testid={`drone-${id}`}>
      <div class="drone-top">
        {state.mayFly.value && !replaying && (
          <input type="checkbox" aria-label={`Mark UAV ${id}`} checked={marked.value.includes(id)} onChange={(event) => mark([id], event.currentTarget.checked)} />
        )}
        <button type="button" class="drone-head" aria-pressed={chosen} onClick={() => (state.selected.value = chosen ? null : id)}>
          <b>UAV {id}</b>
          <span class="pill">{vehicle.mode_name || vehicle.mode}</span>
          {!recorded && <span class="note">{vehicle.armed ? "armed" : "disarmed"} · {vehicle.landed.replaceAll("_", " ")}</span>}
        </button>
      </div>
      <Battery vehicle={vehicle} stale={stale} recorded={recorded} />
      <Values vehicle={vehicle} stale={stale} recorded={recorded} />
      {alerts.map((alert) => (
        <p key={alert.key} class={`drone-alert ${alert.severity}`}>{alert.text.replace(`UAV ${id}: `, "")}</p>
      ))}
      {!recorded && <LastVerdict vehicle={vehicle} />}
      {orders && <Orders ids={[id]} />}
      {orders && <StopOne id={id} />}
      {chosen && <Why id={id} />}
    </li>
  );
}

/** The charge, with a mark at what the way home takes from here. */
function Battery({ vehicle, stale, recorded }: { vehicle: VehicleView; stale: boolean; recorded: boolean }) {
  const { battery_fraction: have, return_fraction: home } = vehicle;
  return (
    <div class={`battery${stale ? " stale" : ""}`}>
      <span class="battery-name">{recorded ? "battery by energy used" : "battery"}</span>
      <span class="battery-bar" aria-hidden="true">
        <i style={`width: ${100 * Math.min(1, Math.max(0, have ?? 0))}%`} />
        {home !== null && <em style={`left: ${100 * Math.min(1, home)}%`} />}
      </span>
      <span class="battery-text">{batteryText(have, home)}{stale && <span class="sr"> (old)</span>}</span>
    </div>
  );
}

function Values({ vehicle, stale, recorded }: { vehicle: VehicleView; stale: boolean; recorded: boolean }) {
  const oldPlace = stale || positionStale(vehicle);
  const flown: [string, string, boolean][] = [["speed", fixed(vehicle.speed_mps, 1, " m/s"), oldPlace], ["heading", fixed(vehicle.heading_deg, 0, "°"), oldPlace]];
  const reported: [string, string, boolean][] = [
    ["height", fixed(vehicle.alt_home_m, 0, " m"), oldPlace],
    ["heading", fixed(vehicle.heading_deg, 0, "°"), oldPlace],
    ["link", percent(1 - vehicle.loss_ratio), stale],
    ["heard", ago(vehicle.heartbeat_age_s), stale],
  ];
  return (
    <dl class="values">
      {(recorded ? flown : [flown[0] ?? ["", "", false], ...reported]).map(([name, value, old]) => (
        <div key={name} class={old ? "stale" : ""}>
          <dt>{name}</dt>
          <dd>{value}{old && <span class="sr"> (old)</span>}</dd>
        </div>
      ))}
    </dl>
  );
}

function LastVerdict({ vehicle }: { vehicle: VehicleView }) {
  const own = state.replaying.value ? undefined : answers.value.get(vehicle.system_id);
  const last = vehicle.last_verdict;
  if (own !== undefined) return <p class={`verdict${own.good ? "" : " bad"}`} role="status">{own.text}</p>;
  if (last === null) return null;
  return <p class={`verdict${["accepted", ""].includes(last.result) ? "" : " bad"}`}>{verdictText(last.command, last.result, last.reason)}</p>;
}
