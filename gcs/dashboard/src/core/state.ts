/** Everything that the page knows, as signals; `receive` is the only way in for what the server says. */

import { batch, computed, signal } from "@preact/signals";

import { allAlerts } from "./alerts";
import { merged } from "./delta";
import { linkState } from "./freshness";
import type { Explanation } from "./explanation";
import { forecastPoints, type Forecast } from "./forecast";
import { meanAoi, withRecord, withSnapshot, type Point, type SeriesPoint } from "./series";
import { withPlaces, type Trails } from "./trails";
import type { CampaignStatic, EventMessage, HelloMessage, PlanView, ServerMessage, SnapshotMessage, UserView } from "./types";

export const KEPT_EVENTS = 500;

export const hello = signal<HelloMessage | null>(null);
export const area = signal<CampaignStatic | null>(null);
export const snapshot = signal<SnapshotMessage | null>(null);
export const users = signal<readonly UserView[]>([]);
export const trails = signal<Trails>(new Map());
/** What each drone does in the present slot; the same array while nothing in it changes. */
export const plans = signal<readonly PlanView[]>([]);
export const points = signal<readonly Point[]>([]);
export const events = signal<readonly EventMessage[]>([]);
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
export const alerts = computed(() => allAlerts(snapshot.value, events.value, acknowledged.value));
export const foretold = computed(() => forecastPoints(forecast.value));
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
        if (snapshot.value !== null) takeSnapshot(merged(snapshot.value, message));
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
  if (area.value?.campaign_id === campaignId) points.value = withRecord(points.value, record);
}

/** The forecast of a campaign, or null when it has none. */
export function receiveForecast(campaignId: string, value: Forecast | null): void {
  if (area.value?.campaign_id === campaignId) forecast.value = value;
}

export function receiveExplanation(value: Explanation): void {
  if (area.value?.campaign_id === value.campaign_id) explanation.value = value;
}

/** Show a campaign that is not in the air (yet), or none; the stream takes over when another one starts. */
export function preview(campaign: CampaignStatic | null): void {
  batch(() => (campaign === null ? (area.value = null) : enter(campaign)));
}

export function acknowledge(sequence: number, by: string): void {
  if (!acknowledged.value.has(sequence)) acknowledged.value = new Map([...acknowledged.value, [sequence, by]]);
}

function enter(campaign: CampaignStatic): void {
  const another = campaign.campaign_id !== area.value?.campaign_id;
  area.value = campaign;
  if (!another) return;
  points.value = [];
  users.value = flownUsers?.campaignId === campaign.campaign_id ? flownUsers.users : [];
  plans.value = [];
  trails.value = new Map();
  forecast.value = null;
  explanation.value = null;
}

/** Told only when they change, so kept for when another campaign was looked at meanwhile. */
let flownUsers: { campaignId: string; users: readonly UserView[] } | null = null;

function takeSnapshot(message: SnapshotMessage): void {
  snapshot.value = message;
  const campaign = message.campaign;
  if (campaign?.users != null) flownUsers = { campaignId: campaign.campaign_id, users: campaign.users };
  if (campaign === null || campaign.campaign_id !== area.value?.campaign_id) return; // metres of another area
  trails.value = withPlaces(trails.value, message.vehicles);
  if (JSON.stringify(campaign.plans) !== JSON.stringify(plans.value)) plans.value = campaign.plans;
  if (campaign.users !== null) users.value = campaign.users;
  points.value = withSnapshot(points.value, campaign, meanAoi(users.value));
}

function takeEvent(event: EventMessage): void {
  const newest = events.value[0];
  if (newest !== undefined && event.sequence <= newest.sequence) {
    const known = events.value.find((one) => one.sequence === event.sequence);
    if (known === undefined || sameEvent(known, event)) return; // told again after a reconnect
    events.value = []; // another server, which numbers its events anew
    acknowledged.value = new Map();
  } else if (newest !== undefined && event.sequence > newest.sequence + 1) {
    missedEvents.value += event.sequence - newest.sequence - 1;
  }
  const noted = event.kind === "alert.acknowledged" ? event.data["sequence"] : null;
  if (typeof noted === "number") acknowledge(noted, event.actor);
  events.value = keep([event, ...events.value]);
}

const sameEvent = (a: EventMessage, b: EventMessage): boolean =>
  a.time_s === b.time_s && a.kind === b.kind && a.message === b.message;

/** Bounded, but what is not acknowledged is never dropped for what is harmless. */
function keep(all: EventMessage[]): EventMessage[] {
  if (all.length <= KEPT_EVENTS) return all;
  const harmless = all.findLastIndex((event) => event.severity === "info" || acknowledged.value.has(event.sequence));
  return harmless < 0 ? all.slice(0, KEPT_EVENTS) : all.filter((_, k) => k !== harmless);
}
