/** Orders to one drone or several: who is marked, what was ordered, and what each vehicle answered. */

import { computed, signal } from "@preact/signals";

import { api } from "./app";
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

export interface OwnAnswer {
  text: string;
  good: boolean;
}

/** The newest answer to an order from this page, by vehicle. */
export const answers = signal<ReadonlyMap<number, OwnAnswer>>(new Map());

const answered = (id: number, text: string, good: boolean): void =>
  void (answers.value = new Map([...answers.value, [id, { text, good }]]));

export const verdictText = (command: string, result: string, reason: string): string =>
  `${command}: ${result}${reason === "" ? "" : ` (${reason})`}`;

/** Each drone gets its own order at once; one that refuses does not keep the others from theirs. */
export async function give(ids: readonly number[], command: string): Promise<void> {
  await Promise.all(ids.map((id) => giveOne(id, command)));
}

async function giveOne(id: number, command: string): Promise<void> {
  answered(id, `${command}: sent…`, true);
  const answer = await api.command(id, command);
  if (!answer.ok) answered(id, `${command}: ${answer.reason}`, false);
  else answered(id, verdictText(command, answer.value.result, answer.value.reason), answer.value.result === "accepted");
}
