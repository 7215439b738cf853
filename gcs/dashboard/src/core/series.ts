/** The curves: one point a finished slot, filled up from the report when the page was opened later. */

import type { CampaignView, MetricsView } from "./types";

export interface Point {
  slot: number;
  aoiSoFar: number;
  aoiNow: number | null;
  collected: number;
  coverage: number;
  energy: number;
}

/** A slot as the server's report lists it; slot 0 has no metrics. */
export interface ReportSlot {
  slot: number;
  metrics: MetricsView | null;
  users: { aoi_slots: number }[];
}

export const meanAoi = (users: readonly { aoi_slots: number }[]): number | null =>
  users.length === 0 ? null : users.reduce((sum, user) => sum + user.aoi_slots, 0) / users.length;

const pointOf = (slot: number, metrics: MetricsView, aoiNow: number | null): Point => ({
  slot,
  aoiSoFar: metrics.episodic_aoi,
  aoiNow,
  collected: metrics.data_collection_ratio,
  coverage: metrics.user_coverage,
  energy: metrics.energy_ratio,
});

/** The curves with the campaign's newest slot; the same array when nothing is new. */
export function withSnapshot(points: readonly Point[], campaign: CampaignView, aoiNow: number | null): readonly Point[] {
  const { metrics, users_slot: slot } = campaign;
  if (metrics === null || slot === null || slot < 1) return points;
  const last = points[points.length - 1];
  if (last !== undefined && last.slot >= slot) return points;
  return [...points, pointOf(slot, metrics, aoiNow)];
}

/** Points of the report, with those that arrived since. */
export function withReport(points: readonly Point[], slots: readonly ReportSlot[]): readonly Point[] {
  const past = slots.flatMap(({ slot, metrics, users }) =>
    metrics === null ? [] : [pointOf(slot, metrics, meanAoi(users))],
  );
  const lastSlot = past[past.length - 1]?.slot ?? 0;
  return [...past, ...points.filter((point) => point.slot > lastSlot)];
}
