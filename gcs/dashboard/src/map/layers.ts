/** How what stands still looks: sources and layers, with colours from the style sheet. Works with no tiles and no network. */

import type { LayerSpecification, StyleSpecification } from "maplibre-gl";

import { AOI_STEPS } from "../core/aoi";
import { color } from "../core/theme";
import { bigness } from "./bigness";
import { EMPTY } from "./scene";

export const SOURCES = ["ground", "users", "draft"] as const;
export type SourceName = (typeof SOURCES)[number];

const kind = (name: string): ["==", ["get", string], string] => ["==", ["get", "kind"], name];

/** Bottom to top. */
export function layers(): LayerSpecification[] {
  const stepColors = AOI_STEPS.flatMap((step, index) => [index, color(step.token)]);
  return [
    { id: "background", type: "background", paint: { "background-color": color("map-outside") } },
    { id: "area", type: "fill", source: "ground", filter: kind("area"), paint: { "fill-color": color("map-ground") } },
    {
      id: "obstacles", type: "fill", source: "ground", filter: kind("obstacle"),
      paint: { "fill-color": ["case", ["get", "high"], color("obstacle-high"), color("obstacle")] },
    },
    {
      id: "obstacle-edges", type: "line", source: "ground", filter: kind("obstacle"),
      paint: { "line-color": color("ink-2"), "line-width": 1 },
    },
    {
      id: "fence", type: "line", source: "ground", filter: kind("fence"),
      paint: { "line-color": color("ink-2"), "line-width": 2 },
    },
    {
      id: "launch", type: "symbol", source: "ground", filter: kind("launch"),
      layout: { "icon-image": "launch", "icon-allow-overlap": true },
    },
    {
      id: "users", type: "circle", source: "users",
      paint: {
        "circle-radius": ["*", bigness(), ["+", 3.8, ["*", 0.7, ["get", "step"]]]],
        "circle-color": ["match", ["get", "step"], ...stepColors, color("aoi-4")] as unknown as string,
        "circle-stroke-color": color("user-edge"),
        "circle-stroke-width": 1,
      },
    },
    { id: "draft-line", type: "line", source: "draft", filter: ["==", ["geometry-type"], "LineString"], paint: { "line-color": color("plan"), "line-width": 2.5 } },
    { id: "draft-corners", type: "circle", source: "draft", filter: ["==", ["geometry-type"], "Point"], paint: { "circle-radius": 5, "circle-color": color("plan") } },
  ];
}

export function mapStyle(): StyleSpecification {
  const sources = Object.fromEntries(SOURCES.map((name) => [name, { type: "geojson" as const, data: EMPTY }]));
  return { version: 8, sources, layers: layers() };
}
