/** The four metrics over the slots. */

import "uplot/dist/uPlot.min.css";

import { effect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";

import type { Point } from "../core/series";
import * as state from "../core/state";
import { color, scheme } from "../core/theme";
import { Histogram } from "./Histogram";

interface Curve {
  label: string;
  token: string;
  value: (point: Point) => number | null;
}

interface ChartProps {
  title: string;
  curves: readonly Curve[];
  share: boolean;
  foretold: Curve | null; // the dry run's line beside them
}

const foretold = (value: Curve["value"]): Curve => ({ label: "forecast", token: "forecast", value });

const CHARTS: readonly ChartProps[] = [
  {
    title: "Age of information, slots",
    share: false,
    foretold: foretold((point) => point.aoiSoFar),
    curves: [
      { label: "users now", token: "series-b", value: (point) => point.aoiNow },
      { label: "κ so far", token: "series-a", value: (point) => point.aoiSoFar },
    ],
  },
  {
    title: "Data collected", share: true, foretold: foretold((point) => point.collected),
    curves: [{ label: "ψ so far", token: "series-a", value: (point) => point.collected }],
  },
  {
    title: "Users covered", share: true, foretold: foretold((point) => point.coverage),
    curves: [{ label: "ρ so far", token: "series-a", value: (point) => point.coverage }],
  },
  {
    title: "Energy used", share: true, foretold: foretold((point) => point.energy),
    curves: [{ label: "ζ so far", token: "series-a", value: (point) => point.energy }],
  },
  {
    title: "Policy's decision time, ms", share: false, foretold: null,
    curves: [{ label: "decision", token: "series-a", value: (point) => point.decisionMs }],
  },
];

const HEIGHT = 112;

export function Curves() {
  return (
    <section class="curves value-box" aria-label="Metrics over the slots" data-first-slot={state.points.value[0]?.slot} data-foretold={state.foretold.value.length}>
      {CHARTS.map((chart) => (
        <Chart key={chart.title} {...chart} />
      ))}
      <Histogram />
    </section>
  );
}

function options({ curves, share, foretold }: ChartProps, width: number, slots: number): uPlot.Options {
  const axis = { stroke: color("ink-2"), font: "11px 'Inter Variable', system-ui, sans-serif", grid: { stroke: color("line"), width: 1 }, ticks: { show: false } };
  const asText = (_: uPlot, values: number[]): string[] => values.map((value) => (share ? `${Math.round(100 * value)}%` : `${value}`));
  return {
    width, height: HEIGHT, padding: [8, 10, 0, 0], legend: { show: false }, cursor: { show: false },
    scales: { x: { time: false, range: [0, Math.max(1, slots)] }, y: { range: (_, __, top) => [0, share ? 1 : Math.max(2, top * 1.1)] } },
    axes: [{ ...axis, size: 24, space: 60 }, { ...axis, size: 40, space: 30, values: asText }],
    series: [{}, ...curves.map((curve) => line(curve)), ...(foretold === null ? [] : [{ ...line(foretold), dash: [5, 4] }])],
  };
}

const line = (curve: Curve): uPlot.Series => ({ label: curve.label, stroke: color(curve.token), width: 2, spanGaps: true, points: { show: false } });

function Chart(props: ChartProps) {
  const place = useRef<HTMLDivElement>(null);
  useEffect(() => (place.current === null ? undefined : draw(place.current, props)), []);
  const keys = [...props.curves, ...(props.foretold !== null && state.foretold.value.length > 0 ? [props.foretold] : [])];
  return (
    <figure>
      <figcaption>
        {props.title}
        {keys.length > 1 && keys.map((curve) => <span key={curve.label} class="series-key" style={`--dot: var(--${curve.token})`}>{curve.label}</span>)}
      </figcaption>
      <div ref={place} class="chart" />
    </figure>
  );
}

/** Draw anew when the theme or the campaign's length changes, else only hand over new points. */
function draw(container: HTMLElement, props: ChartProps): () => void {
  let plot: uPlot | null = null;
  const data = (points: readonly Point[], ahead: readonly Point[]): uPlot.AlignedData => {
    const slots = [...new Set([...points, ...ahead].map((point) => point.slot))].sort((a, b) => a - b);
    const on = (line: readonly Point[], value: Curve["value"]): (number | null)[] => {
      const known = new Map(line.map((point) => [point.slot, value(point)]));
      return slots.map((slot) => known.get(slot) ?? null);
    };
    const flown = props.curves.map((curve) => on(points, curve.value));
    return [slots, ...flown, ...(props.foretold === null ? [] : [on(ahead, props.foretold.value)])];
  };
  const stopMaking = effect(() => {
    void scheme.value;
    const slots = state.area.value?.slots ?? 1;
    plot?.destroy();
    plot = new uPlot(options(props, container.clientWidth, slots), data(state.points.peek(), state.foretold.peek()), container);
  });
  const stopFeeding = effect(() => plot?.setData(data(state.points.value, state.foretold.value)));
  const watch = new ResizeObserver(() => plot?.setSize({ width: container.clientWidth, height: HEIGHT }));
  watch.observe(container);
  return () => {
    stopMaking();
    stopFeeding();
    watch.disconnect();
    plot?.destroy();
  };
}
