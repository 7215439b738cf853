/** What a campaign would score: a dry run as the server tells it, and its curve beside the flown one. */

import type { Point, SeriesPoint } from "./series";
import { pointOf } from "./series";
import type { MetricsView } from "./types";

export interface Forecast {
  policy: string;
  metrics: MetricsView;
  baseline: { policy: string; metrics: MetricsView };
  series: SeriesPoint[];
  decision_ms: { p50: number; p99: number };
  violations: Record<string, number>;
  energy_left: number[]; // of a full battery, a UAV
  max_speed_mps: number;
  max_accel_mps2: number;
}

export interface DryRun {
  id: string;
  name: string;
  policy: string;
  state: "running" | "done" | "failed" | "cancelled";
  slot: number;
  slots: number;
  reason: string;
  forecast: Forecast | null;
}

export const forecastPoints = (forecast: Forecast | null): Point[] => (forecast?.series ?? []).map(pointOf);

/** What is to be looked at before flying: broken rules, and batteries that would come home empty. Empty when all is well. */
export function concerns(forecast: Forecast, reserve = 0.15): string[] {
  const broken = Object.entries(forecast.violations).filter(([, count]) => count > 0);
  const found = broken.map(([rule, count]) => `${rule}: broken in ${count} UAV-slots`);
  forecast.energy_left.forEach((left, uav) => {
    if (left < reserve) found.push(`UAV ${uav + 1} of the mission ends with ${Math.round(100 * left)}% of its battery`);
  });
  return found;
}
