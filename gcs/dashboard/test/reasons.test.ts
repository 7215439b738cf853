import { describe, expect, it } from "vitest";

import type { Alert } from "../src/core/alerts";
import { bestAlternatives, explained, moveEndM, whyLines, type Explanation } from "../src/core/explanation";
import { concerns, forecastPoints, type Forecast } from "../src/core/forecast";
import { aoiHistogram, histogramText } from "../src/core/histogram";
import { Bell, REPEAT_MS } from "../src/core/sound";
import { user } from "./samples";

const metrics = { episodic_aoi: 2, data_collection_ratio: 0.9, user_coverage: 0.4, energy_ratio: 0.1, final_aoi: 2 };

describe("why a drone flies so", () => {
  const move = (worse_by: number) => ({ heading_deg: 90, speed_mps: 10, value: 5 + worse_by, worse_by });
  const why: Explanation = {
    campaign_id: "c1", policy: "gcrl", slot: 3, value: 5, predicted_gain: null, horizon_slots: 8,
    uavs: [{
      system_id: 4, path_m: [[0, 0]], alternatives: [5, 1, 4, 2, 3].map(move),
      relations: [{ user_id: "ann", weight: 0.4, expected_m: [3, 4] }, { user_id: "bob", weight: 0.1, expected_m: null }, { user_id: "eve", weight: 0.1, expected_m: null }],
    }],
  };
  it("draws a line to each user whose place is known, the strongest as 1", () => {
    const users = [user({ user_id: "bob", east_m: 7, north_m: 8 }), user({ user_id: "ann", east_m: 1, north_m: 2 }), user({ user_id: "eve", east_m: null })];
    expect(whyLines(explained(why, 4), users)).toEqual([{ toM: [1, 2], strength: 1, expectedM: [3, 4] }, { toM: [7, 8], strength: 0.25, expectedM: null }]);
  });
  it("has nothing to say of another drone, or of a policy without reasons", () => {
    expect(explained(why, 5)).toBeNull();
    expect(whyLines(null, [])).toEqual([]);
    expect(whyLines({ system_id: 4, path_m: [], alternatives: [], relations: [{ user_id: "ann", weight: 0, expected_m: null }] }, [user({ user_id: "ann" })])).toEqual([]);
  });
  it("shows the cheapest alternatives first, and where they lead", () => {
    expect(bestAlternatives(explained(why, 4)).map((one) => one.worse_by)).toEqual([1, 2, 3, 4]);
    const [east, north] = moveEndM([100, 50], move(1), 15);
    expect(east).toBeCloseTo(250, 9);
    expect(north).toBeCloseTo(50, 9);
  });
});

describe("the histogram of waiting", () => {
  it("counts every user once, with bounds that belong to the upper bin", () => {
    const bins = aoiHistogram([1, 1, 1.5, 2, 4, 5, 9, 10, 29, 30, 500].map((aoi_slots) => ({ aoi_slots })));
    expect(bins.map((bin) => bin.count)).toEqual([3, 1, 1, 1, 1, 1, 0, 1, 1, 1]);
    expect(histogramText(bins.slice(0, 2))).toBe("AoI 1: 3, AoI 2: 1");
    expect(histogramText(aoiHistogram([]))).toBe("no users yet");
  });
  it("has bins that never straddle two of the map's colours", () => {
    const bins = aoiHistogram([]);
    for (const [k, bin] of bins.entries()) expect(bins[k + 1]?.step ?? bin.step).toBeGreaterThanOrEqual(bin.step);
    expect(new Set(bins.map((bin) => bin.step)).size).toBe(5);
  });
});

describe("a forecast", () => {
  const forecast: Forecast = {
    policy: "gcrl", metrics, baseline: { policy: "random", metrics }, decision_ms: { p50: 1, p99: 2 }, energy_left: [0.6, 0.1],
    series: [{ slot: 1, metrics, mean_aoi_slots: 3, decision_ms: 4 }], violations: { geofence: 0, battery: 2 }, max_speed_mps: 18, max_accel_mps2: 4,
  };
  it("becomes a curve", () => {
    expect(forecastPoints(forecast)).toEqual([{ slot: 1, aoiSoFar: 2, aoiNow: 3, collected: 0.9, coverage: 0.4, energy: 0.1, decisionMs: 4 }]);
    expect(forecastPoints(null)).toEqual([]);
  });
  it("names what is to be looked at before flying", () => {
    expect(concerns(forecast)).toEqual(["battery: broken in 2 UAV-slots", "UAV 2 of the mission ends with 10% of its battery"]);
    expect(concerns({ ...forecast, violations: { geofence: 0 }, energy_left: [0.5] })).toEqual([]);
  });
});

describe("the bell", () => {
  const alert = (severity: Alert["severity"], key: string, sequence: number | null = null): Alert => ({ key, severity, text: key, systemId: 1, sequence, timeS: 0 });
  it("rings once for what is new", () => {
    const bell = new Bell();
    expect(bell.ring([alert("caution", "a")], false, 0)).toBe("caution");
    expect(bell.ring([alert("caution", "a")], false, 1e6)).toBeNull();
    expect(bell.ring([alert("caution", "a"), alert("warning", "b")], false, 1e6)).toBe("warning");
    expect(bell.ring([], false, 2e6)).toBeNull();
    expect(bell.ring([alert("warning", "b")], false, 3e6)).toBe("warning");
  });
  it("is muted for cautions and never for warnings", () => {
    const bell = new Bell();
    expect(bell.ring([alert("caution", "a")], true, 0)).toBeNull();
    expect(bell.ring([alert("caution", "a"), alert("warning", "b")], true, 0)).toBe("warning");
  });
  it("repeats a warning until somebody has taken note", () => {
    const bell = new Bell();
    const standing = [alert("warning", "event:7", 7)];
    expect([0, 100, REPEAT_MS - 1, REPEAT_MS, REPEAT_MS + 1, 2 * REPEAT_MS].map((now) => bell.ring(standing, true, now))).toEqual(
      ["warning", null, null, "warning", null, "warning"],
    );
    expect(bell.ring([], true, 3 * REPEAT_MS)).toBeNull();
  });
});
