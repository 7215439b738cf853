/** Which orders there are, and which drones are marked to get one together. */

import { computed, signal } from "@preact/signals";

import * as state from "./state";

export interface Order {
  command: string;
  label: string;
  /** What happens, to whom: `names` as in "UAVs 1 and 2". */
  explain: (names: string) => string;
  danger?: boolean;
}

export const ORDERS: readonly Order[] = [
  { command: "hold", label: "Hold", explain: (names) => `Hold: ${names} where they are` },
  { command: "rtl", label: "Return", explain: (names) => `Return: ${names} to the launch point, and land` },
  { command: "land", label: "Land", explain: (names) => `Land: ${names} where they are`, danger: true },
];

/** Drones that orders to several reach; one that is not there any more is not reached. */
const wanted = signal<ReadonlySet<number>>(new Set());
export const marked = computed(() => {
  const known = state.flight.snapshot.value?.vehicles.map((vehicle) => vehicle.system_id) ?? [];
  return known.filter((id) => wanted.value.has(id));
});

export function mark(ids: readonly number[], on: boolean): void {
  const next = new Set(wanted.value);
  for (const id of ids) if (on) next.add(id);
    else next.delete(id);
  wanted.value = next;
}

export const verdictText = (command: string, result: string, reason: string): string =>
  `${command}: ${result}${reason === "" ? "" : ` (${reason})`}`;
