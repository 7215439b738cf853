/** A normal vehicle, campaign, ... to vary from. */

import type { CampaignStatic, CampaignView, EventMessage, SnapshotMessage, UserView, VehicleView } from "../src/core/types";

export const vehicle = (change: Partial<VehicleView>): VehicleView => ({
  system_id: 1, autopilot: "px4", mode: "guided", mode_name: "OFFBOARD", armed: true, landed: "in_air", position_ready: true,
  lat_deg: 40.42, lon_deg: -86.93, east_m: 100, north_m: 200, alt_home_m: 120, vel_ned_mps: [0, 10, 0], yaw_rad: 0,
  heading_deg: 90, speed_mps: 10, battery_fraction: 0.8, return_fraction: 0.1, battery_v: 22, loss_ratio: 0, heartbeat_age_s: 0.3, position_age_s: 0.1,
  address: "udp", last_verdict: null, texts: [], ...change,
});

export const user = (change: Partial<UserView>): UserView => ({
  user_id: "u1", east_m: 0, north_m: 0, aoi_slots: 1, data_mb: 0, served: true, ...change,
});

export const campaign = (change: Partial<CampaignView>): CampaignView => ({
  campaign_id: "c1", name: "demo", policy: "random", state: "flying", slot: 1, slots: 10, slot_s: 15, slot_elapsed_s: 0,
  reason: "", metrics: null, plans: [], users: null, users_slot: null, decision_ms: null, explanation: {}, ...change,
});

export const snapshot = (change: Partial<SnapshotMessage>): SnapshotMessage => ({
  type: "snapshot", time_s: 0, tick: 0, stopped: false, healthy: true, setpoint_period_s: 0.1, vehicles: [vehicle({})], campaign: null, ...change,
});

export const event = (change: Partial<EventMessage>): EventMessage => ({
  type: "event", sequence: 1, time_s: 0, kind: "link.lost", severity: "warning", message: "no heartbeat", campaign_id: null,
  system_id: 1, actor: "system", data: {}, ...change,
});

export const ground = (change: Partial<CampaignStatic> = {}): CampaignStatic => ({
  campaign_id: "c1", name: "demo", policy: "random", user_source: "walkers", south_west_deg: [40.42, -86.93], size_m: [1600, 1200],
  metres_per_deg: [84_870, 111_030], fence_m: [[0, 0], [1600, 0], [1600, 1200], [0, 1200]],
  obstacles: [{ name: "tower", height_m: 140, polygon_m: [[1, 1], [2, 1], [2, 2]] }, { name: "shed", height_m: 10, polygon_m: [[5, 5], [6, 5], [6, 6]] }],
  launch_m: [[800, 600], [800, 600]], altitude_m: 120, serving_radius_m: 226, max_speed_mps: 18, mcl_db: 117, slots: 10, slot_s: 15, ...change,
});
