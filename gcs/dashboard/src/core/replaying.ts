/** The recording that is being shown, if any: fetched, played, left. It never hides a campaign that is in the air. */

import { computed, effect, signal, untracked } from "@preact/signals";

import { api } from "./app";
import { advanced, framesOf, pointsOf, shownAt, slotAt, speedOf, type Frame, type Recording } from "./recording";
import { samplesOf, type Sample } from "./recordedFleet";
import { decisionsOf, type RecordedDecision } from "./recordedReasons";
import * as state from "./state";

const NEAR_S = 1e-3;
const PICTURE_MS = 100; // 10 pictures a second are plenty for what was recorded once a second

export const recording = signal<Recording | null>(null);
export const frames = signal<readonly Frame[]>([]);
/** What the vehicles said, from when all of it is there. */
export const samples = signal<readonly Sample[]>([]);
/** What was decided and why; null until all of it is there. */
export const decisions = signal<readonly RecordedDecision[] | null>(null);
export const loading = signal(false);
/** Why there is no recording to see, or why it was left. */
export const notice = signal<string | null>(null);
export const position = signal(0); // seconds since the first record
export const playing = signal(false);
export const speedStep = signal(11); // 24x
export const speed = computed(() => speedOf(speedStep.value));
const points = computed(() => pointsOf(frames.value));
/** As far as can be looked at now. */
export const end = computed(() => (loading.value ? (frames.value.at(-1)?.atS ?? 0) : (recording.value?.length_s ?? 0)));
export const slot = computed(() => slotAt(frames.value, position.value));
let wanted: string | null = null;

/** Follow the address: `#replay=ID` shows a recording, nothing leaves it. */
export function begin(): void {
  addEventListener("hashchange", follow);
  effect(() => {
    const { value } = recording;
    state.replayed.value = value === null ? null : shownAt({ recording: value, frames: frames.value, points: points.value, samples: samples.value, decisions: decisions.value }, position.value);
  });
  effect(() => {
    if (!state.inTheAir.value || recording.value === null) return;
    untracked(() => leave("The replay was left: a campaign is in the air."));
  });
  effect(() => {
    if (!playing.value) return undefined;
    let last = performance.now();
    const timer = setInterval(() => {
      const now = performance.now();
      tick((now - last) / 1000);
      last = now;
    }, PICTURE_MS);
    return () => clearInterval(timer);
  });
  follow();
}

function follow(): void {
  const id = new URLSearchParams(location.hash.slice(1)).get("replay");
  if (id !== null) void open(id);
  else if (recording.value !== null || wanted !== null) leave(null);
}

export const addressOf = (campaignId: string): string => `#replay=${encodeURIComponent(campaignId)}`;

async function open(id: string): Promise<void> {
  if (wanted === id) return;
  wanted = id;
  clear();
  loading.value = true;
  const answer = await api.recording(id);
  if (wanted !== id) return; // another one was asked for meanwhile
  if (!answer.ok) return leave(`No replay: ${answer.reason}`);
  recording.value = answer.value;
  position.value = 0;
  const failure = (await fetchFrames(id, answer.value)) ?? (await fetchSamples(id));
  if (wanted !== id) return;
  loading.value = false;
  notice.value = failure;
  playing.value = failure === null;
  const unread = await fetchDecisions(id);
  if (wanted === id && unread !== null) notice.value ??= unread;
}

/** All slots, part by part; the first part is shown while the next ones come. */
async function fetchFrames(id: string, { first_slot, slot_at_s }: Recording): Promise<string | null> {
  for (let next = first_slot; next !== null; ) {
    const answer = await api.recordedSlots(id, next);
    if (wanted !== id) return null;
    if (!answer.ok) return `Not all of the recording could be read: ${answer.reason}`;
    frames.value = [...frames.value, ...framesOf(answer.value, slot_at_s)];
    next = answer.value.next_first;
  }
  return null;
}

/** All telemetry; shown when it is whole, for half of it would look like a fleet that fell silent. */
async function fetchSamples(id: string): Promise<string | null> {
  const all: Sample[] = [];
  for (let next: number | null = 0; next !== null; ) {
    const answer = await api.recordedTelemetry(id, next);
    if (wanted !== id) return null;
    if (!answer.ok) return `The telemetry could not be read: ${answer.reason}`;
    all.push(...samplesOf(answer.value));
    next = answer.value.next_first;
  }
  samples.value = all;
  return null;
}

/** All reasons; nobody waits for them to see the flight. */
async function fetchDecisions(id: string): Promise<string | null> {
  const all: RecordedDecision[] = [];
  for (let next: number | null = 0; next !== null; ) {
    const answer = await api.recordedExplanations(id, next);
    if (wanted !== id) return null;
    if (!answer.ok) return `The reasons could not be read: ${answer.reason}`;
    all.push(...decisionsOf(answer.value));
    next = answer.value.next_first;
  }
  decisions.value = all;
  return null;
}

/** Back to the flight. */
export function leave(why: string | null): void {
  wanted = null;
  clear();
  notice.value = why;
  if (location.hash !== "") history.replaceState(null, "", location.pathname + location.search);
}

function clear(): void {
  recording.value = null;
  frames.value = [];
  samples.value = [];
  decisions.value = null;
  playing.value = loading.value = false;
  notice.value = null;
}

export function seek(atS: number): void {
  position.value = Math.min(end.value, Math.max(0, atS));
}

/** To the end of a slot: the next one, or the one before. */
export function stepSlot(by: 1 | -1): void {
  const times = frames.value.map((frame) => frame.atS);
  const here = position.value;
  seek((by > 0 ? times.find((atS) => atS > here + NEAR_S) : times.findLast((atS) => atS < here - NEAR_S)) ?? (by > 0 ? end.value : 0));
}

/** Play on; from the beginning when it is at its end. */
export function toggle(): void {
  if (!playing.value && position.value >= end.value) seek(0);
  playing.value = !playing.value;
}

function tick(seconds: number): void {
  position.value = advanced(position.value, seconds, speed.value, end.value);
  if (position.value >= end.value && !loading.value) playing.value = false;
}

/** The next warning or caution after this moment. */
export const nextAlarm = computed(
  () => recording.value?.events.find((event) => event.severity !== "info" && event.at_s > position.value + NEAR_S) ?? null,
);
