/** Wires stream, clock and REST to the state. The one place that knows addresses. */

import { effect } from "@preact/signals";

import { Api } from "./api";
import { keepKey, storedKey } from "./session";
import * as state from "./state";
import { Stream, streamUrl } from "./stream";

const CLOCK_MS = 250;

export const api = new Api(new URL("api/v1/", location.href).pathname, storedKey);

const stream = new Stream(streamUrl(location), storedKey, {
  opened: state.opened,
  closed: state.closed,
  message: (message) => state.receive(message, performance.now()),
});

/** Sign in with a key, or out with null; the connection is made anew. A key that is not known is not kept. */
export async function signIn(key: string | null): Promise<void> {
  await check(key);
  if (state.refused.value !== null && key !== null) return;
  keepKey(key);
  state.hello.value = null;
  state.closed();
  stream.connect();
}

/** A refused WebSocket does not say why; this does. */
async function check(key: string | null): Promise<void> {
  const answer = await api.me(key);
  state.refused.value = !answer.ok && [401, 403].includes(answer.status) ? answer.reason : null;
}

export function start(): void {
  setInterval(() => (state.nowMs.value = performance.now()), CLOCK_MS);
  void check(storedKey());
  stream.connect();
  let asked: string | null = null;
  effect(() => {
    const campaign = state.area.value;
    if (campaign === null || campaign.campaign_id === asked) return;
    asked = campaign.campaign_id;
    void fillCurves(campaign.campaign_id);
  });
}

async function fillCurves(campaignId: string): Promise<void> {
  const answer = await api.reportSlots(campaignId);
  if (answer.ok) state.receiveReport(campaignId, answer.value);
}
