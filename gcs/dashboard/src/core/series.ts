/** The curves: one point a finished slot, filled up from the server's records when the page was opened later. */

import type { CampaignView, MetricsView } from "./types";

export interface Point {
  slot: number;
  aoiSoFar: number;
  aoiNow: number | null;
  collected: number;
  coverage: number;
  energy: number;
  decisionMs: number | null;
}

/** A finished slot as the server lists it. */
export interface SeriesPoint {
  slot: number;
  metrics: MetricsView;
  mean_aoi_slots: number | null;
  decision_ms: number | null;
}

export const meanAoi = (users: readonly { aoi_slots: number }[]): number | null =>
  users.length === 0 ? null : users.reduce((sum, user) => sum + user.aoi_slots, 0) / users.length;

export const pointOf = ({ slot, metrics, mean_aoi_slots, decision_ms }: SeriesPoint): Point => ({
  slot,
  aoiSoFar: metrics.episodic_aoi,
  aoiNow: mean_aoi_slots,
  collected: metrics.data_collection_ratio,
  coverage: metrics.user_coverage,
  energy: metrics.energy_ratio,
  decisionMs: decision_ms,
});

/** The curves with the campaign's newest slot; the same array when nothing is new. */
export function withSnapshot(points: readonly Point[], campaign: CampaignView, aoiNow: number | null): readonly Point[] {
  const { metrics, users_slot: slot, decision_ms } = campaign;
  if (metrics === null || slot === null || slot < 1) return points;
  const last = points[points.length - 1];
  if (last !== undefined && last.slot >= slot) return points;
  return [...points, pointOf({ slot, metrics, mean_aoi_slots: aoiNow, decision_ms })];
}

/** Points of the record, with those that arrived since. */
export function withRecord(points: readonly Point[], record: readonly SeriesPoint[]): readonly Point[] {
  const past = record.map(pointOf);
  const lastSlot = past[past.length - 1]?.slot ?? 0;
  return [...past, ...points.filter((point) => point.slot > lastSlot)];
}
