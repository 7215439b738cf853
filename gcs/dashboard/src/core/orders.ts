/** Orders given to one drone or several, and what each vehicle answered. */

import { signal } from "@preact/signals";

import { api } from "./app";
import { verdictText } from "./marking";

export interface OwnAnswer {
  text: string;
  good: boolean;
}

/** The newest answer to an order from this page, by vehicle. */
export const answers = signal<ReadonlyMap<number, OwnAnswer>>(new Map());

const answered = (id: number, text: string, good: boolean): void =>
  void (answers.value = new Map([...answers.value, [id, { text, good }]]));

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
