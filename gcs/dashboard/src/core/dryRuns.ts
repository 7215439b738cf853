/** The dry run that this page asked for: begun, followed, cancelled. */

import { signal } from "@preact/signals";

import type { Answer, MissionBody } from "./api";
import { api } from "./app";
import type { DryRun } from "./forecast";
import * as state from "./state";

const POLL_MS = 500;

export const dryRun = signal<DryRun | null>(null);
export const refusal = signal<string | null>(null);

/** Begin one and follow it to its end; `campaignId` gets the forecast when it is one campaign's own. */
export async function begin(body: MissionBody, campaignId: string | null): Promise<void> {
  const run = take(await api.beginDryRun(body));
  if (run === null) return;
  const done = await followed(run.id);
  if (campaignId !== null && done?.forecast != null) state.receiveForecast(campaignId, done.forecast);
}

export async function cancel(): Promise<void> {
  if (dryRun.value !== null) take(await api.cancelDryRun(dryRun.value.id));
}

async function followed(id: string): Promise<DryRun | null> {
  for (;;) {
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    if (dryRun.value?.id !== id || dryRun.value.state !== "running") return dryRun.value;
    if (take(await api.dryRun(id)) === null) return null;
  }
}

function take(answer: Answer<DryRun>): DryRun | null {
  refusal.value = answer.ok ? null : answer.reason;
  if (!answer.ok) return null;
  dryRun.value = answer.value;
  return answer.value;
}
