/** A card a drone: grey when normal, colour only for what is abnormal, and nothing old shown as if it were live. */

import { signal } from "@preact/signals";

import { vehicleAlerts, worst } from "../core/alerts";
import { api } from "../core/app";
import { fixed, percent } from "../core/format";
import { positionStale, vehicleStale } from "../core/freshness";
import * as state from "../core/state";
import type { VehicleView } from "../core/types";
import { HoldButton } from "./HoldButton";
import { Why } from "./Why";

interface Order {
  command: string;
  label: string;
  explain: (id: number) => string;
  danger?: boolean;
}

const ORDERS: readonly Order[] = [
  { command: "hold", label: "Hold", explain: (id) => `UAV ${id} holds where it is` },
  { command: "rtl", label: "Return", explain: (id) => `UAV ${id} returns to its launch point and lands` },
  { command: "land", label: "Land", explain: (id) => `UAV ${id} lands where it is`, danger: true },
];

/** The newest answer to an order from this page, by vehicle. */
const answers = signal<ReadonlyMap<number, { text: string; good: boolean }>>(new Map());

function answered(id: number, text: string, good: boolean): void {
  answers.value = new Map([...answers.value, [id, { text, good }]]);
}

async function order(id: number, command: string): Promise<void> {
  answered(id, `${command}: sent…`, true);
  const answer = await api.command(id, command);
  if (!answer.ok) answered(id, `${command}: ${answer.reason}`, false);
  else answered(id, verdictText(command, answer.value.result, answer.value.reason), answer.value.result === "accepted");
}

const verdictText = (command: string, result: string, reason: string): string =>
  `${command}: ${result}${reason === "" ? "" : ` (${reason})`}`;

export function Fleet() {
  const vehicles = state.snapshot.value?.vehicles ?? [];
  return (
    <section class="panel" aria-label="Fleet">
      <h2>Fleet</h2>
      {vehicles.length === 0 && <p class="note">No drone has been heard yet.</p>}
      <ul class="fleet">
        {vehicles.map((vehicle) => (
          <Card key={vehicle.system_id} vehicle={vehicle} />
        ))}
      </ul>
    </section>
  );
}

function Card({ vehicle }: { vehicle: VehicleView }) {
  const id = vehicle.system_id;
  const chosen = state.selected.value === id;
  const alerts = vehicleAlerts(vehicle);
  const stale = vehicleStale(vehicle);
  return (
    <li class={`drone ${worst(alerts) ?? "normal"}${chosen ? " chosen" : ""}`} data-testid={`drone-${id}`}>
      <button type="button" class="drone-head" aria-pressed={chosen} onClick={() => (state.selected.value = chosen ? null : id)}>
        <b>UAV {id}</b>
        <span>{vehicle.mode_name || vehicle.mode}</span>
        <span>{vehicle.armed ? "armed" : "disarmed"}</span>
        <span class="note">{vehicle.landed.replaceAll("_", " ")}</span>
      </button>
      <Values vehicle={vehicle} stale={stale} />
      {alerts.map((alert) => (
        <p key={alert.key} class={`drone-alert ${alert.severity}`}>{alert.text}</p>
      ))}
      <LastVerdict vehicle={vehicle} />
      {chosen && <Orders id={id} />}
      {chosen && <Why id={id} />}
    </li>
  );
}

function Values({ vehicle, stale }: { vehicle: VehicleView; stale: boolean }) {
  const oldPlace = stale || positionStale(vehicle);
  const values: [string, string, boolean][] = [
    ["battery", percent(vehicle.battery_fraction), stale],
    ["speed", fixed(vehicle.speed_mps, 1, " m/s"), oldPlace],
    ["height", fixed(vehicle.alt_home_m, 0, " m"), oldPlace],
    ["link", percent(1 - vehicle.loss_ratio), stale],
    ["heard", fixed(vehicle.heartbeat_age_s, 1, " s ago"), stale],
  ];
  return (
    <dl class="values">
      {values.map(([name, value, old]) => (
        <div key={name} class={old ? "stale" : ""}>
          <dt>{name}</dt>
          <dd>{value}{old && <span class="sr"> (old)</span>}</dd>
        </div>
      ))}
    </dl>
  );
}

function LastVerdict({ vehicle }: { vehicle: VehicleView }) {
  const own = answers.value.get(vehicle.system_id);
  const last = vehicle.last_verdict;
  if (own !== undefined) return <p class={`verdict${own.good ? "" : " bad"}`} role="status">{own.text}</p>;
  if (last === null) return null;
  return <p class={`verdict${last.result === "accepted" ? "" : " bad"}`}>{verdictText(last.command, last.result, last.reason)}</p>;
}

function Orders({ id }: { id: number }) {
  return (
    <div class="orders" role="group" aria-label={`Orders to UAV ${id}`}>
      {ORDERS.map((one) => (
        <HoldButton
          key={one.command}
          label={one.label}
          explain={one.explain(id)}
          danger={one.danger ?? false}
          disabled={!state.mayFly.value || !state.live.value}
          onDone={() => void order(id, one.command)}
        />
      ))}
    </div>
  );
}
