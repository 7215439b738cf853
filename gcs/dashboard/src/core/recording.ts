/**
 * A recorded campaign as the page shows it: the same picture as of a flight, made for any moment of the recording, in
 * seconds since its first record. Users and metrics were recorded at the ends of slots, the fleet about once a second.
 * A recording of an older version knows the fleet at the ends of slots only: then a drone is drawn on the straight way
 * between two of them, and mode, link and charge as reported stay unknown.
 */

import { reasonsAt, type RecordedDecision } from "./recordedReasons";
import { fleetAt, trailsOf, type Sample } from "./recordedFleet";
import { givenUpS, logAt, pausedS, type RecordedEvent } from "./recordedLog";
import { between, lastAt, type Timed } from "./timeline";
import { meanAoi, type Point } from "./series";
import type { Replayed } from "./state";
import type { CampaignStatic, MetricsView, Pair, PlanView, SnapshotMessage, UserView, VehicleView } from "./types";

export interface RecordedUav {
  system_id: number;
  east_m: number | null;
  north_m: number | null;
  heading_deg: number; // flown to get there
  speed_mps: number;
  energy_j: number;
  active: boolean;
}

/** Place in `user_ids`; east, north; age of information; waiting data; served. */
export type UserRow = [number, number | null, number | null, number, number, boolean];

export interface RecordedSlot {
  slot: number;
  decision_ms: number | null;
  metrics: MetricsView | null;
  uavs: RecordedUav[];
  users: UserRow[];
}

export interface SlotsPage {
  user_ids: string[];
  slots: RecordedSlot[];
  next_first: number | null;
}

export interface Recording {
  campaign: CampaignStatic;
  state: string;
  reason: string;
  begun_at: string | null;
  ended_at: string | null;
  begun_at_s: number; // where these two are on the slider
  ended_at_s: number;
  first_slot: number | null; // null: it ended before its first slot
  last_slot: number | null;
  battery_j: number;
  length_s: number;
  slot_at_s: Pair[]; // [slot, seconds]
  samples: number; // of telemetry
  events: RecordedEvent[];
}

/** A slot with its users by name, made once. */
export interface Frame extends Timed {
  slot: number;
  decisionMs: number | null;
  metrics: MetricsView | null;
  uavs: readonly RecordedUav[];
  users: readonly UserView[];
}

const TRAIL_SLOTS = 12;

export function framesOf(page: SlotsPage, slotAtS: readonly Pair[]): Frame[] {
  const times = new Map(slotAtS);
  return page.slots.map(({ slot, decision_ms, metrics, uavs, users }) => ({
    slot, atS: times.get(slot) ?? 0, decisionMs: decision_ms, metrics, uavs,
    users: users.map(([index, east_m, north_m, aoi_slots, data_mb, served]) => ({
      user_id: page.user_ids[index] ?? `${index}`, east_m, north_m, aoi_slots, data_mb, served,
    })),
  }));
}

/** Curves of all frames that have metrics. */
export const pointsOf = (frames: readonly Frame[]): Point[] =>
  frames.flatMap(({ slot, metrics, users, decisionMs }) =>
    metrics === null ? [] : [{
      slot, aoiSoFar: metrics.episodic_aoi, aoiNow: meanAoi(users), collected: metrics.data_collection_ratio,
      coverage: metrics.user_coverage, energy: metrics.energy_ratio, decisionMs,
    }],
  );

/** Slots and their parts at a moment; the first slot before it began. */
export function slotAt(frames: readonly Frame[], atS: number): number {
  const index = Math.max(0, lastAt(frames, atS));
  const [here, next] = [frames[index], frames[index + 1]];
  return here === undefined ? 0 : here.slot + shareOf(here, next, atS) * ((next?.slot ?? here.slot) - here.slot);
}

const shareOf = (here: Frame, next: Frame | undefined, atS: number): number =>
  next === undefined ? 0 : Math.min(1, Math.max(0, (atS - here.atS) / Math.max(1e-9, next.atS - here.atS)));

/** Everything that was recorded of a campaign, as far as it has come. */
export interface Records {
  recording: Recording;
  frames: readonly Frame[];
  points: readonly Point[];
  samples: readonly Sample[];
  decisions: readonly RecordedDecision[] | null; // null: not read
}

/** Of a campaign that ended before its first slot: there is its launch, its log and its reason. */
const NO_SLOT: Frame = { atS: Infinity, slot: 0, decisionMs: null, metrics: null, uavs: [], users: [] };

/** Everything that the page shows `atS` into the recording; null while the frames of that moment are not there. */
export function shownAt({ recording, frames, points, samples, decisions }: Records, atS: number): Replayed | null {
  const index = Math.max(0, lastAt(frames, atS));
  const [here, next] = recording.first_slot === null ? [NO_SLOT, undefined] : [frames[index], frames[index + 1]];
  if (here === undefined) return null;
  const { campaign } = recording;
  const log = logAt(recording.events, atS);
  const state = atS >= recording.length_s ? recording.state : (log.state ?? (next === undefined ? recording.state : "flying"));
  const told = fleetAt(samples, atS);
  const vehicles = told === null ? here.uavs.map((uav) => vehicleAt(recording, uav, partner(next, uav), shareOf(here, next, atS))) : told.map((vehicle) => ({ ...vehicle, last_verdict: log.verdicts.get(vehicle.system_id) ?? null }));
  const flying = atS >= here.atS && here.slot < campaign.slots;
  const elapsed = flying ? Math.min(campaign.slot_s, atS - here.atS - pausedS(log.log, here.atS, atS)) : 0;
  const snapshot: SnapshotMessage = {
    type: "snapshot", time_s: atS, tick: 0, stopped: log.stopped.all, stopped_ids: log.stopped.ones, healthy: true, setpoint_period_s: null, vehicles,
    campaign: {
      campaign_id: campaign.campaign_id, name: campaign.name, policy: campaign.policy, slots: campaign.slots, slot_s: campaign.slot_s,
      state, reason: state === recording.state ? recording.reason : "",
      slot: here.slot, slot_elapsed_s: elapsed, metrics: here.metrics, plans: flying ? plansOf(here, next) : [], users: null, users_slot: here.slot,
      decision_ms: here.decisionMs, explanation: {},
    },
  };
  const then = { campaignId: campaign.campaign_id, policy: campaign.policy, slot: here.slot, systemIds: here.uavs.map((uav) => uav.system_id), users: here.users, decided: next?.decisionMs != null, givenUpS: givenUpS(log.log) };
  const why = flying && next !== undefined ? reasonsAt(decisions, then, atS) : { reasons: null, note: null };
  return {
    reasons: why.reasons, reasonsNote: why.note,
    area: campaign, snapshot, users: here.users, plans: snapshot.campaign?.plans ?? [],
    trails: told === null ? trailsTo(frames, index, vehicles) : trailsOf(samples, atS - TRAIL_SLOTS * campaign.slot_s, atS, vehicles),
    points: points.slice(0, points.findLastIndex((point) => point.slot <= here.slot && atS >= here.atS) + 1),
    events: log.newestFirst, reported: told !== null, acknowledged: log.acknowledged,
  };
}

const partner = (next: Frame | undefined, uav: RecordedUav): RecordedUav | undefined => next?.uavs.find((one) => one.system_id === uav.system_id);

function vehicleAt(recording: Recording, here: RecordedUav, next: RecordedUav | undefined, share: number): VehicleView {
  const { campaign } = recording;
  const flown = next ?? here; // the way of this slot is told at its end
  const [east_m, north_m] = [between(here.east_m, next?.east_m, share), between(here.north_m, next?.north_m, share)];
  const [lat, lng] = campaign.south_west_deg;
  const [eastScale, northScale] = campaign.metres_per_deg;
  const energy = between(here.energy_j, next?.energy_j, share) ?? 0;
  return {
    system_id: here.system_id, autopilot: "unknown", mode: "unknown", mode_name: here.active ? "in the campaign" : "out of the campaign",
    armed: here.active, landed: here.active ? "in_air" : "unknown", position_ready: true,
    lat_deg: north_m === null ? null : lat + north_m / northScale, lon_deg: east_m === null ? null : lng + east_m / eastScale,
    east_m, north_m, alt_home_m: null, vel_ned_mps: [0, 0, 0], yaw_rad: 0,
    heading_deg: ((flown.heading_deg % 360) + 360) % 360, speed_mps: next === undefined ? 0 : flown.speed_mps,
    battery_fraction: 1 - energy / recording.battery_j, return_fraction: null, battery_v: null, loss_ratio: 0,
    heartbeat_age_s: 0, position_age_s: 0, address: "", last_verdict: null, texts: [],
  };
}

const pair = (uav: RecordedUav): Pair[] => (uav.east_m === null || uav.north_m === null ? [] : [[uav.east_m, uav.north_m]]);

/** The way of the slot, as it was flown. */
const plansOf = (here: Frame, next: Frame | undefined): PlanView[] =>
  (next?.uavs ?? []).flatMap((uav) => {
    const from = here.uavs.find((one) => one.system_id === uav.system_id);
    const path_m = from === undefined ? [] : [...pair(from), ...pair(uav)];
    return path_m.length < 2 ? [] : [{ system_id: uav.system_id, heading_deg: uav.heading_deg, speed_mps: uav.speed_mps, path_m }];
  });

function trailsTo(frames: readonly Frame[], index: number, vehicles: readonly VehicleView[]): Map<number, Pair[]> {
  const lately = frames.slice(Math.max(0, index - TRAIL_SLOTS), index + 1);
  return new Map(vehicles.map((vehicle) => {
    const past = lately.flatMap((frame) => frame.uavs.filter((uav) => uav.system_id === vehicle.system_id).flatMap(pair));
    const now: Pair[] = vehicle.east_m === null || vehicle.north_m === null ? [] : [[vehicle.east_m, vehicle.north_m]];
    return [vehicle.system_id, [...past, ...now]];
  }));
}

/** Speeds from real time to a campaign in a few seconds: 0 is 1x, each step 10 ^ (1/8); flight seconds a second. */
export const SPEED_STEPS = 24;
export const speedOf = (step: number): number => {
  const exact = 10 ** (step / 8);
  return exact < 10 ? Math.round(exact * 10) / 10 : Math.round(exact);
};

/** Where the clock stands after `seconds` more of playing; never beyond what is there. */
export const advanced = (atS: number, seconds: number, speed: number, endS: number): number => Math.min(endS, atS + seconds * speed);

/** The wall clock's time `atS` into the recording, in ms, by two moments of which it is known; null where none is. */
export function wallMs(recording: Recording, atS: number): number | null {
  const [first, last] = [recording.begun_at_s, recording.ended_at_s];
  if (recording.begun_at === null || recording.ended_at === null) return null;
  const [begun, ended] = [Date.parse(recording.begun_at), Date.parse(recording.ended_at)];
  const msASecond = last > first ? (ended - begun) / (last - first) : 1000;
  return begun + (atS - first) * msASecond;
}
