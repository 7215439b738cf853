/**
 * Everything that the page knows, as signals; `receive` is the only way in for what the server says. What is shown is
 * the flight, or a recording in its place (`replayed`): the flight goes on being received meanwhile, and alerts, sound
 * and the emergency stop always belong to it.
 */

import { batch, computed, signal } from "@preact/signals";

import { allAlerts, groupKey } from "./alerts";
import { isOver, slotsAreFlown } from "./campaigns";
import { merged } from "./delta";
import { linkState } from "./freshness";
import type { Explanation } from "./explanation";
import { forecastPoints, type Forecast } from "./forecast";
import { meanAoi, withRecord, withSnapshot, type Point, type SeriesPoint } from "./series";
import { withPlaces, type Trails } from "./trails";
import type { CampaignStatic, EventMessage, HelloMessage, PlanView, ServerMessage, SnapshotMessage, UserView } from "./types";

export const KEPT_EVENTS = 500;

export const hello = signal<HelloMessage | null>(null);

/** What is looked at: one whole picture, of the flight or of a recording. */
export interface Shown {
  area: CampaignStatic | null;
  snapshot: SnapshotMessage | null;
  users: readonly UserView[];
  trails: Trails;
  /** What each drone does in the present slot; the same array while nothing in it changes. */
  plans: readonly PlanView[];
  points: readonly Point[];
  events: readonly EventMessage[];
}

/** A recording also says whether the vehicles' own reports are part of it, and what had been acknowledged by then. */
export interface Replayed extends Shown {
  /** Why the drones flew so, as it was told then; and why that, or some of it, is not there. */
  reasons: Explanation | null;
  reasonsNote: string | null;
  reported: boolean;
  acknowledged: ReadonlyMap<number, string>;
}

/** The flight itself, whatever is shown. */
export const flight = {
  area: signal<CampaignStatic | null>(null),
  snapshot: signal<SnapshotMessage | null>(null),
  users: signal<readonly UserView[]>([]),
  trails: signal<Trails>(new Map()),
  plans: signal<readonly PlanView[]>([]),
  points: signal<readonly Point[]>([]),
  events: signal<readonly EventMessage[]>([]),
};

/** The recording that is shown in the flight's place, at its present moment. */
export const replayed = signal<Replayed | null>(null);
export const replaying = computed(() => replayed.value !== null);
/** Mode, link, charge and height are what the vehicles said, now or then; false where a recording knows the slots only. */
export const reported = computed(() => replayed.value?.reported ?? true);
/** What was wrong at the recording's moment; the present's own alerts stand beside it. */
export const recordedAlerts = computed(() => {
  const then = replayed.value;
  return then === null ? [] : allAlerts(then.reported ? then.snapshot : null, then.events, then.acknowledged);
});

const shown = <K extends keyof Shown>(name: K) => computed((): Shown[K] => replayed.value?.[name] ?? (flight[name].value as Shown[K]));

export const area = shown("area");
export const snapshot = shown("snapshot");
export const users = shown("users");
export const trails = shown("trails");
export const plans = shown("plans");
export const points = shown("points");
export const events = shown("events");
export const missedEvents = signal(0);
/** Events that somebody has taken note of, and who. */
export const acknowledged = signal<ReadonlyMap<number, string>>(new Map());
/** What the shown campaign would score by its dry run. */
export const forecast = signal<Forecast | null>(null);
/** Why the drones do what they do in the present slot. */
export const explanation = signal<Explanation | null>(null);
/** Why the key at hand was not let in; null when there is nothing to say. */
export const refused = signal<string | null>(null);
export const selected = signal<number | null>(null);

const open = signal(false);
const everOpen = signal(false);
const lastMessageMs = signal<number | null>(null);
export const nowMs = signal(0);

export const silenceS = computed(() =>
  lastMessageMs.value === null ? null : Math.max(0, (nowMs.value - lastMessageMs.value) / 1000),
);
export const link = computed(() => linkState(open.value, everOpen.value, silenceS.value));
export const live = computed(() => link.value === "live");
/** Values may be shown as they are: live, or a recording that says so of itself. */
export const current = computed(() => live.value || replaying.value);
export const alerts = computed(() => allAlerts(flight.snapshot.value, flight.events.value, acknowledged.value));
/** Somebody flies a campaign now. */
export const inTheAir = computed(() => {
  const campaign = flight.snapshot.value?.campaign ?? null;
  return campaign !== null && !isOver(campaign.state);
});
export const foretold = computed(() => forecastPoints(replaying.value ? null : forecast.value));
/** Why the drones do what they do, or did then. */
export const reasons = computed(() => (replayed.value === null ? explanation.value : replayed.value.reasons));
/** Why a recording does not say that; null in flight. */
export const reasonsNote = computed(() => replayed.value?.reasonsNote ?? null);
export const mayFly = computed(() => hello.value !== null && hello.value.role !== "viewer");

export function opened(): void {
  open.value = true;
}

export function closed(): void {
  open.value = false;
}

/** Take in one message that arrived at `atMs` of the page's clock. */
export function receive(message: ServerMessage, atMs: number): void {
  batch(() => {
    if (message.type !== "problem") lastMessageMs.value = nowMs.value = atMs;
    everOpen.value = true;
    switch (message.type) {
      case "hello":
        hello.value = message;
        if (message.campaign !== null) enter(message.campaign);
        break;
      case "campaign":
        enter(message.campaign);
        break;
      case "snapshot":
        takeSnapshot(message);
        break;
      case "delta":
        if (flight.snapshot.value !== null) takeSnapshot(merged(flight.snapshot.value, message));
        break;
      case "event":
        takeEvent(message);
        break;
      case "problem":
        console.warn("the server did not understand:", message.detail);
    }
  });
}

/** Curves of slots that were flown before the page was opened. */
export function receiveRecord(campaignId: string, record: readonly SeriesPoint[]): void {
  if (flight.area.value?.campaign_id === campaignId) flight.points.value = withRecord(flight.points.value, record);
}

/** The forecast of a campaign, or null when it has none. */
export function receiveForecast(campaignId: string, value: Forecast | null): void {
  if (flight.area.value?.campaign_id === campaignId) forecast.value = value;
}

export function receiveExplanation(value: Explanation): void {
  if (flight.area.value?.campaign_id === value.campaign_id) explanation.value = value;
}

/** Show a campaign that is not in the air (yet), or none; the stream takes over when another one starts. */
export function preview(campaign: CampaignStatic | null): void {
  batch(() => (campaign === null ? (flight.area.value = null) : enter(campaign)));
}

export function acknowledge(sequence: number, by: string): void {
  if (!acknowledged.value.has(sequence)) acknowledged.value = new Map([...acknowledged.value, [sequence, by]]);
}

function enter(campaign: CampaignStatic): void {
  const another = campaign.campaign_id !== flight.area.value?.campaign_id;
  flight.area.value = campaign;
  if (!another) return;
  flight.points.value = [];
  flight.users.value = flownUsers?.campaignId === campaign.campaign_id ? flownUsers.users : [];
  flight.plans.value = [];
  flight.trails.value = new Map();
  forecast.value = null;
  explanation.value = null;
}

/** Told only when they change, so kept for when another campaign was looked at meanwhile. */
let flownUsers: { campaignId: string; users: readonly UserView[] } | null = null;

function takeSnapshot(message: SnapshotMessage): void {
  flight.snapshot.value = message;
  const campaign = message.campaign;
  if (campaign?.users != null) flownUsers = { campaignId: campaign.campaign_id, users: campaign.users };
  if (campaign === null || campaign.campaign_id !== flight.area.value?.campaign_id) return; // metres of another area
  flight.trails.value = withPlaces(flight.trails.value, message.vehicles);
  const plans = slotsAreFlown(campaign.state) ? campaign.plans : []; // on the way home there is no slot to be planned
  if (JSON.stringify(plans) !== JSON.stringify(flight.plans.value)) flight.plans.value = plans;
  if (campaign.users !== null) flight.users.value = campaign.users;
  flight.points.value = withSnapshot(flight.points.value, campaign, meanAoi(flight.users.value));
}

function takeEvent(event: EventMessage): void {
  const newest = flight.events.value[0];
  if (newest !== undefined && event.sequence <= newest.sequence) {
    const known = flight.events.value.find((one) => one.sequence === event.sequence);
    if (known === undefined || sameEvent(known, event)) return; // told again after a reconnect
    flight.events.value = []; // another server, which numbers its events anew
    acknowledged.value = new Map();
  } else if (newest !== undefined && event.sequence > newest.sequence + 1) {
    missedEvents.value += event.sequence - newest.sequence - 1;
  }
  const noted = event.kind === "alert.acknowledged" ? event.data["sequence"] : null;
  if (typeof noted === "number") acknowledge(noted, event.actor);
  flight.events.value = keep([event, ...flight.events.value]);
}

const sameEvent = (a: EventMessage, b: EventMessage): boolean =>
  a.time_s === b.time_s && a.kind === b.kind && a.message === b.message;

/** Bounded: harmless lines go first, then what a newer line says as well, then cautions; warnings last of all. */
function keep(all: EventMessage[]): EventMessage[] {
  if (all.length <= KEPT_EVENTS) return all;
  const oldest = (gone: (event: EventMessage) => boolean): number => all.findLastIndex(gone);
  let out = oldest((event) => event.severity === "info" || acknowledged.value.has(event.sequence));
  if (out < 0) out = repeated(all);
  if (out < 0) out = oldest((event) => event.severity === "caution");
  return all.filter((_, k) => k !== (out < 0 ? all.length - 1 : out));
}

/** The oldest line that a newer one repeats; -1 when all are different. */
function repeated(all: readonly EventMessage[]): number {
  const newer = new Set<string>();
  let found = -1;
  all.forEach(({ severity, system_id: systemId, message: text }, index) => {
    const key = groupKey({ severity, systemId, text });
    if (newer.has(key)) found = index;
    newer.add(key);
  });
  return found;
}
