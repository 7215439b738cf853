/** How far the dry run is, and what it foretells, beside what chance would get. */

import { cancel, dryRun, refusal } from "../core/dryRuns";
import { concerns, type DryRun, type Forecast } from "../core/forecast";
import { fixed, percent } from "../core/format";
import type { MetricsView } from "../core/types";

export function DryRunResult() {
  const run = dryRun.value;
  return (
    <div data-testid="dry-run" data-state={run?.state} aria-live="polite">
      {refusal.value !== null && <p class="verdict bad" role="status">Dry run: {refusal.value}</p>}
      {run !== null && run.state === "running" && <Running run={run} />}
      {run !== null && (run.state === "failed" || run.state === "cancelled") && <p class="verdict bad" role="status">Dry run of {run.name}: {run.reason}</p>}
      {run?.forecast != null && <ForecastTable run={run} forecast={run.forecast} />}
    </div>
  );
}

function Running({ run }: { run: DryRun }) {
  return (
    <p class="dry-run">
      <progress max={run.slots} value={run.slot} aria-label={`Dry run of ${run.name}`} />
      <span class="note">{run.slot === 0 ? "preparing…" : `slot ${run.slot} of ${run.slots}`}</span>
      <button type="button" onClick={() => void cancel()}>Cancel dry run</button>
    </p>
  );
}

const ROWS: readonly [string, string, (metrics: MetricsView) => string][] = [
  ["κ", "age of information, slots", (metrics) => fixed(metrics.episodic_aoi, 2)],
  ["ψ", "data collected", (metrics) => percent(metrics.data_collection_ratio, 1)],
  ["ρ", "users covered", (metrics) => percent(metrics.user_coverage, 1)],
  ["ζ", "energy used", (metrics) => percent(metrics.energy_ratio, 1)],
];

function ForecastTable({ run, forecast }: { run: DryRun; forecast: Forecast }) {
  return (
    <table class="forecast">
      <caption>
        Forecast for {run.name} <span class="note">at most {fixed(forecast.max_speed_mps, 1)} m/s and {fixed(forecast.max_accel_mps2, 1)} m/s², no wind</span>
        {concerns(forecast).map((text) => <span key={text} class="drone-alert caution">{text}</span>)}
      </caption>
      <thead>
        <tr><th scope="col">Metric</th><th scope="col">{forecast.policy}</th><th scope="col">{forecast.baseline.policy}</th></tr>
      </thead>
      <tbody>
        {ROWS.map(([symbol, name, text]) => (
          <tr key={symbol}>
            <th scope="row"><i>{symbol}</i> {name}</th>
            <td>{text(forecast.metrics)}</td>
            <td>{text(forecast.baseline.metrics)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
