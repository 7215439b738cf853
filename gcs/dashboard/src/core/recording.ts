/**
 * A recorded campaign as the page shows it: the same picture as of a flight, made for any moment of the slot clock.
 * Places are recorded at the ends of slots; between two of them a drone is drawn on the straight way. What was not
 * recorded (mode, link, charge as reported) stays unknown.
 */

import { meanAoi, type Point } from "./series";
import type { Shown } from "./state";
import type { CampaignStatic, EventMessage, MetricsView, Pair, PlanView, SnapshotMessage, UserView, VehicleView } from "./types";

export interface RecordedEvent extends EventMessage {
  at_slot: number;
}

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
  first_slot: number;
  last_slot: number;
  battery_j: number;
  events: RecordedEvent[];
}

/** A slot with its users by name, made once. */
export interface Frame {
  slot: number;
  decisionMs: number | null;
  metrics: MetricsView | null;
  uavs: readonly RecordedUav[];
  users: readonly UserView[];
}

const TRAIL_SLOTS = 12;

export function framesOf(page: SlotsPage): Frame[] {
  return page.slots.map(({ slot, decision_ms, metrics, uavs, users }) => ({
    slot, decisionMs: decision_ms, metrics, uavs,
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

/** Index of the frame that `position` (slots) lies in or after; -1 before the first. */
export function frameIndex(frames: readonly Frame[], position: number): number {
  let [low, high] = [0, frames.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((frames[middle]?.slot ?? Infinity) <= position) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Everything that the page shows at `position`; null while the frames of that moment are not there. */
export function shownAt(recording: Recording, frames: readonly Frame[], points: readonly Point[], position: number): Shown | null {
  const index = Math.max(0, frameIndex(frames, position));
  const [here, next] = [frames[index], frames[index + 1]];
  if (here === undefined) return null;
  const share = next === undefined ? 0 : Math.min(1, Math.max(0, (position - here.slot) / (next.slot - here.slot)));
  const vehicles = here.uavs.map((uav) => vehicleAt(recording, uav, next?.uavs.find((one) => one.system_id === uav.system_id), share));
  const { campaign } = recording;
  const elapsed = Math.max(0, position - here.slot) * campaign.slot_s;
  const snapshot: SnapshotMessage = {
    type: "snapshot", time_s: position * campaign.slot_s, tick: 0, stopped: false, healthy: true, setpoint_period_s: null, vehicles,
    campaign: {
      campaign_id: campaign.campaign_id, name: campaign.name, policy: campaign.policy, slots: campaign.slots, slot_s: campaign.slot_s,
      state: next === undefined ? recording.state : "flying", reason: next === undefined ? recording.reason : "",
      slot: here.slot, slot_elapsed_s: elapsed, metrics: here.metrics, plans: plansOf(here, next), users: null, users_slot: here.slot,
      decision_ms: here.decisionMs, explanation: {},
    },
  };
  return {
    area: campaign, snapshot, users: here.users, plans: snapshot.campaign?.plans ?? [],
    trails: trailsTo(frames, index, vehicles),
    points: points.slice(0, points.findLastIndex((point) => point.slot <= here.slot) + 1),
    events: recording.events.slice(0, recording.events.findLastIndex((event) => event.at_slot <= position) + 1).reverse(),
  };
}

function vehicleAt(recording: Recording, here: RecordedUav, next: RecordedUav | undefined, share: number): VehicleView {
  const between = (a: number | null, b: number | null | undefined): number | null =>
    a === null ? (b ?? null) : b === null || b === undefined ? a : a + share * (b - a);
  const { campaign } = recording;
  const flown = next ?? here; // the way of this slot is told at its end
  const [east_m, north_m] = [between(here.east_m, next?.east_m), between(here.north_m, next?.north_m)];
  const [lat, lng] = campaign.south_west_deg;
  const [eastScale, northScale] = campaign.metres_per_deg;
  const energy = between(here.energy_j, next?.energy_j) ?? 0;
  return {
    system_id: here.system_id, autopilot: "unknown", mode: "unknown", mode_name: here.active ? "in the campaign" : "out of the campaign",
    armed: here.active, landed: here.active ? "in_air" : "unknown", position_ready: true,
    lat_deg: north_m === null ? null : lat + north_m / northScale, lon_deg: east_m === null ? null : lng + east_m / eastScale,
    east_m, north_m, alt_home_m: null, vel_ned_mps: [0, 0, 0], yaw_rad: 0,
    heading_deg: flown.heading_deg, speed_mps: next === undefined ? 0 : flown.speed_mps,
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
export const advanced = (position: number, seconds: number, speed: number, slotS: number, end: number): number =>
  Math.min(end, position + (seconds * speed) / slotS);

/** The wall clock's time at `position`, in ms, between the first and the last slot; null where none was recorded. */
export function wallMs(recording: Recording, position: number): number | null {
  if (recording.begun_at === null || recording.ended_at === null) return null;
  const [begun, ended] = [Date.parse(recording.begun_at), Date.parse(recording.ended_at)];
  const slots = Math.max(1, recording.last_slot - recording.first_slot);
  return begun + ((ended - begun) * (position - recording.first_slot)) / slots;
}
