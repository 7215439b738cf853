/** What the stream says, field by field as in `gcs/api/schemas.py` (a test in `tests/dashboard` compares the two). */

export type Pair = [number, number];

export interface MetricsView {
  episodic_aoi: number;
  data_collection_ratio: number;
  user_coverage: number;
  energy_ratio: number;
  final_aoi: number;
}

export interface ObstacleView {
  name: string;
  height_m: number;
  polygon_m: Pair[];
}

export interface CampaignStatic {
  campaign_id: string;
  name: string;
  policy: string;
  user_source: "trace" | "walkers" | "live";
  south_west_deg: Pair;
  size_m: Pair;
  metres_per_deg: Pair;
  fence_m: Pair[];
  obstacles: ObstacleView[];
  launch_m: Pair[];
  altitude_m: number;
  serving_radius_m: number;
  max_speed_mps: number;
  mcl_db: number;
  slots: number;
  slot_s: number;
}

export interface VerdictView {
  command: string;
  result: string;
  reason: string;
  time_s: number;
}

export interface VehicleView {
  system_id: number;
  autopilot: string;
  mode: string;
  mode_name: string;
  armed: boolean;
  landed: string;
  position_ready: boolean;
  lat_deg: number | null;
  lon_deg: number | null;
  east_m: number | null;
  north_m: number | null;
  alt_home_m: number | null;
  vel_ned_mps: [number, number, number];
  yaw_rad: number;
  heading_deg: number;
  speed_mps: number;
  battery_fraction: number | null;
  return_fraction: number | null;
  battery_v: number | null;
  loss_ratio: number;
  heartbeat_age_s: number | null;
  position_age_s: number | null;
  address: string;
  last_verdict: VerdictView | null;
  texts: string[];
}

export interface PlanView {
  system_id: number;
  heading_deg: number;
  speed_mps: number;
  path_m: Pair[];
}

export interface UserView {
  user_id: string;
  east_m: number | null;
  north_m: number | null;
  aoi_slots: number;
  data_mb: number;
  served: boolean;
}

export interface CampaignView {
  campaign_id: string;
  name: string;
  policy: string;
  state: string;
  slot: number;
  slots: number;
  slot_s: number;
  slot_elapsed_s: number;
  reason: string;
  metrics: MetricsView | null;
  plans: PlanView[];
  users: UserView[] | null;
  users_slot: number | null;
  decision_ms: number | null;
  explanation: Record<string, unknown>;
}

export interface SnapshotMessage {
  type: "snapshot";
  time_s: number;
  tick: number;
  stopped: boolean;
  healthy: boolean;
  setpoint_period_s: number | null;
  vehicles: VehicleView[];
  campaign: CampaignView | null;
}

export type Severity = "info" | "caution" | "warning";

export interface DeltaMessage {
  type: "delta";
  changed: Record<string, unknown>;
  vehicles: Record<string, unknown>[];
  campaign: Record<string, unknown>;
}

export interface EventMessage {
  type: "event";
  sequence: number;
  time_s: number;
  kind: string;
  severity: Severity;
  message: string;
  campaign_id: string | null;
  system_id: number | null;
  actor: string;
  data: Record<string, unknown>;
}

export interface HelloMessage {
  type: "hello";
  version: string;
  role: "viewer" | "operator" | "admin";
  actor: string;
  rate_hz: number;
  topics: string[];
  campaign: CampaignStatic | null;
}

export interface CampaignMessage {
  type: "campaign";
  campaign: CampaignStatic;
}

export interface ProblemMessage {
  type: "problem";
  detail: string;
}

export type ServerMessage = HelloMessage | CampaignMessage | SnapshotMessage | DeltaMessage | EventMessage | ProblemMessage;
