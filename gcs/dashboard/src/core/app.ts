/** Wires stream, clock and REST to the state. The one place that knows addresses. */

import { computed, effect, signal } from "@preact/signals";

import { Api } from "./api";
import { DRAFT_ID } from "./draft";
import { keepKey, storedKey } from "./session";
import { Bell, Speaker, type Tone } from "./sound";
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
    const campaign = state.flight.area.value;
    if (campaign === null || campaign.campaign_id === asked || campaign.campaign_id === DRAFT_ID) return;
    asked = campaign.campaign_id;
    void fillCurves(campaign.campaign_id);
  });
  effect(() => void askWhy(whyAsked.value));
  listenForAlerts();
}

async function fillCurves(campaignId: string): Promise<void> {
  const [record, foretold] = await Promise.all([api.series(campaignId), api.forecast(campaignId)]);
  if (record.ok) state.receiveRecord(campaignId, record.value);
  if (foretold.ok) state.receiveForecast(campaignId, foretold.value.forecast);
}

/**
 * Which decision is to be explained: asked for once a decision, and only while somebody looks at a drone. A decision
 * comes some time after its slot has begun, and the plans tell that it is there.
 */
const whyAsked = computed(() => {
  const campaign = state.flight.snapshot.value?.campaign ?? null;
  if (campaign === null || state.selected.value === null) return null;
  const decided = state.flight.plans.value.map((plan) => `${plan.heading_deg} ${plan.speed_mps}`).join();
  return `${campaign.campaign_id} ${campaign.slot} ${decided}`;
});

async function askWhy(asked: string | null): Promise<void> {
  if (asked === null) return;
  const answer = await api.explanation(asked.split(" ")[0] ?? "");
  if (answer.ok) state.receiveExplanation(answer.value);
}

/** Cautions are quiet for this tab; warnings never are. */
export const muted = signal(false);
/** The newest tone, for who looks instead of listening. */
export const sounded = signal<{ tone: Tone; count: number } | null>(null);

function listenForAlerts(): void {
  const [bell, speaker] = [new Bell(), new Speaker()];
  effect(() => {
    const tone = bell.ring(state.alerts.value, muted.value, state.nowMs.value);
    if (tone === null) return;
    sounded.value = { tone, count: (sounded.peek()?.count ?? 0) + 1 };
    speaker.play(tone);
  });
}

/** Take note of an alert in one's own name; why not, where the server refuses. */
export async function acknowledge(sequence: number, timeS: number): Promise<string | null> {
  const answer = await api.acknowledge(sequence, timeS);
  if (!answer.ok) return answer.reason;
  state.acknowledge(sequence, answer.value.by);
  return null;
}
