/** The server's REST interface. Every answer is a value: what came back, or why not, in the server's words. */

import type { Explanation } from "./explanation";
import type { DryRun } from "./forecast";
import type { TelemetryPage } from "./recordedFleet";
import type { ExplanationsPage } from "./recordedReasons";
import type { Recording, SlotsPage } from "./recording";
import type { SeriesPoint } from "./series";
import type { CampaignStatic } from "./types";

export type Answer<T> = { ok: true; value: T } | { ok: false; status: number; reason: string };

export interface MissionFile {
  name: string;
  title: string | null;
  policy: string | null;
  uavs: number | null;
  slots: number | null;
  slot_s: number | null;
  user_source: string | null;
  warnings: string[];
  error: string | null; // why it cannot be flown
}

export interface Checkpoint {
  file: string;
  provenance: Record<string, unknown> | null;
}

export interface PolicyInfo {
  name: string;
  learned: boolean;
  checkpoints: Checkpoint[];
}

export interface CampaignInfo {
  id: string;
  name: string;
  policy: string;
  state: string;
  slot: number;
  slots: number;
  reason: string;
}

export interface CampaignDetail extends CampaignInfo {
  static: CampaignStatic;
  warnings: string[];
}

export interface CommandAnswer {
  result: string;
  reason: string;
}

/** What is to be created or flown dry: a mission at hand, a whole document, or (dry only) a campaign. */
export type MissionBody = { mission: string; policy?: string; checkpoint?: string } | { campaign: string } | Record<string, unknown>;

export interface MapTiles {
  kind: "none" | "tiles" | "pmtiles";
  url: string | null;
  attribution: string;
}

export interface PreflightLine {
  system_id: number; // 0: a drone that nobody has heard
  check: string;
  grade: "ok" | "caution" | "red";
  reason: string;
}

export interface Preflight {
  ok: boolean;
  lines: PreflightLine[];
}

export type CampaignAct = "start" | "pause" | "resume" | "abort";

const UNREACHABLE = "the server does not answer";

export class Api {
  constructor(
    private readonly base: string,
    private readonly key: () => string | null,
  ) {}

  me = (key: string | null): Promise<Answer<unknown>> => this.ask("GET", "me", undefined, key);
  missions = (): Promise<Answer<MissionFile[]>> => this.ask("GET", "missions");
  campaigns = (): Promise<Answer<CampaignInfo[]>> => this.ask("GET", "campaigns");
  policies = (): Promise<Answer<PolicyInfo[]>> => this.ask("GET", "policies");
  campaign = (id: string): Promise<Answer<CampaignDetail>> => this.ask("GET", `campaigns/${encodeURIComponent(id)}`);
  missionDocument = (name: string): Promise<Answer<Record<string, unknown>>> => this.ask("GET", `missions/${encodeURIComponent(name)}`);
  create = (body: MissionBody): Promise<Answer<CampaignInfo>> => this.ask("POST", "campaigns", body);
  beginDryRun = (body: MissionBody): Promise<Answer<DryRun>> => this.ask("POST", "dry-runs", body);
  dryRun = (id: string): Promise<Answer<DryRun>> => this.ask("GET", `dry-runs/${id}`);
  cancelDryRun = (id: string): Promise<Answer<DryRun>> => this.ask("DELETE", `dry-runs/${id}`);
  forecast = (id: string): Promise<Answer<DryRun>> => this.ask("GET", `campaigns/${encodeURIComponent(id)}/forecast`);
  series = (id: string): Promise<Answer<SeriesPoint[]>> => this.ask("GET", `campaigns/${encodeURIComponent(id)}/series`);
  explanation = (id: string): Promise<Answer<Explanation>> => this.ask("GET", `campaigns/${encodeURIComponent(id)}/explanation`);
  recording = (id: string): Promise<Answer<Recording>> => this.ask("GET", `campaigns/${encodeURIComponent(id)}/recording`);
  recordedSlots = (id: string, first: number): Promise<Answer<SlotsPage>> =>
    this.ask("GET", `campaigns/${encodeURIComponent(id)}/recording/slots?first=${first}`);
  recordedTelemetry = (id: string, first: number): Promise<Answer<TelemetryPage>> =>
    this.ask("GET", `campaigns/${encodeURIComponent(id)}/recording/telemetry?first=${first}`);
  recordedExplanations = (id: string, first: number): Promise<Answer<ExplanationsPage>> =>
    this.ask("GET", `campaigns/${encodeURIComponent(id)}/recording/explanations?first=${first}`);
  acknowledge = (sequence: number, time_s: number): Promise<Answer<{ by: string }>> =>
    this.ask("POST", "acknowledgements", { sequence, time_s });
  act = (id: string, act: CampaignAct, override = false): Promise<Answer<unknown>> =>
    this.ask("POST", `campaigns/${encodeURIComponent(id)}/${act}${override ? "?override=true" : ""}`);
  preflight = (id: string): Promise<Answer<Preflight>> => this.ask("GET", `campaigns/${encodeURIComponent(id)}/preflight`);
  mapTiles = (): Promise<Answer<MapTiles>> => this.ask("GET", "map");
  urlOf = (path: string): string => new URL(this.base + path, location.href).href;
  command = (systemId: number, command: string): Promise<Answer<CommandAnswer>> =>
    this.ask("POST", `drones/${systemId}/commands`, { command });
  stopOne = (systemId: number): Promise<Answer<unknown>> => this.ask("POST", `drones/${systemId}/emergency-stop`);
  releaseOne = (systemId: number): Promise<Answer<unknown>> => this.ask("POST", `drones/${systemId}/emergency-stop/reset`);
  emergencyStop = (): Promise<Answer<unknown>> => this.ask("POST", "emergency-stop");
  resetStop = (): Promise<Answer<unknown>> => this.ask("POST", "emergency-stop/reset");
  reportUrl = (id: string): string => `${this.base}campaigns/${encodeURIComponent(id)}/report?format=html`;

  private async ask<T>(method: string, path: string, body?: unknown, key = this.key()): Promise<Answer<T>> {
    const headers: Record<string, string> = { accept: "application/json" };
    if (key !== null) headers["authorization"] = `Bearer ${key}`;
    if (body !== undefined) headers["content-type"] = "application/json";
    try {
      const response = await fetch(this.base + path, { method, headers, ...(body === undefined ? {} : { body: JSON.stringify(body) }) });
      const value: unknown = await response.json().catch(() => null);
      if (response.ok) return { ok: true, value: value as T };
      return { ok: false, status: response.status, reason: problemText(value, response.status) };
    } catch {
      return { ok: false, status: 0, reason: UNREACHABLE };
    }
  }
}

/** The detail of a problem document (RFC 9457). */
export function problemText(document: unknown, status: number): string {
  const detail = (document as { detail?: unknown } | null)?.detail;
  return typeof detail === "string" && detail !== "" ? detail : `the server answered ${status}`;
}
