/** How the map looks: sources and layers, with colours from the style sheet. Works with no tiles and no network. */

import type { LayerSpecification, StyleSpecification } from "maplibre-gl";

import { AOI_STEPS } from "../core/aoi";
import { color } from "../core/theme";
import { EMPTY } from "./scene";

export const SOURCES = ["ground", "ways", "users", "drones"] as const;
const MAX_ZOOM = 22;
export type SourceName = (typeof SOURCES)[number];

const kind = (name: string): ["==", ["get", string], string] => ["==", ["get", "kind"], name];

/** Bottom to top. `reachPx`: the service radius in pixels at zoom 0. */
export function layers(reachPx: number): LayerSpecification[] {
  const stepColors = AOI_STEPS.flatMap((step, index) => [index, color(step.token)]);
  const chosen = (yes: number, no: number): ["case", ["get", string], number, number] => ["case", ["get", "chosen"], yes, no];
  return [
    { id: "background", type: "background", paint: { "background-color": color("map-outside") } },
    { id: "area", type: "fill", source: "ground", filter: kind("area"), paint: { "fill-color": color("map-ground") } },
    {
      id: "reach", type: "circle", source: "drones", filter: ["==", ["get", "serves"], true],
      paint: {
        "circle-radius": ["interpolate", ["exponential", 2], ["zoom"], 0, reachPx, MAX_ZOOM, reachPx * 2 ** MAX_ZOOM],
        "circle-color": color("reach"), "circle-opacity": chosen(0.18, 0.1),
        "circle-stroke-color": color("reach"), "circle-stroke-width": chosen(2.6, 1.4), "circle-stroke-opacity": 0.9,
      },
    },
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
      id: "trails", type: "line", source: "ways", filter: kind("trail"),
      paint: { "line-color": color("trail"), "line-width": 1.6, "line-opacity": 0.8 },
    },
    {
      id: "plans", type: "line", source: "ways", filter: kind("plan"),
      paint: { "line-color": color("plan"), "line-width": 2.6, "line-dasharray": [2, 1.4] },
    },
    {
      id: "launch", type: "symbol", source: "ground", filter: kind("launch"),
      layout: { "icon-image": "launch", "icon-allow-overlap": true },
    },
    {
      id: "users", type: "circle", source: "users",
      paint: {
        "circle-radius": ["+", 3.8, ["*", 0.7, ["get", "step"]]],
        "circle-color": ["match", ["get", "step"], ...stepColors, color("aoi-4")] as unknown as string,
        "circle-stroke-color": color("user-edge"),
        "circle-stroke-width": 1,
      },
    },
    {
      id: "drones", type: "symbol", source: "drones", filter: kind("drone"),
      layout: {
        "icon-image": ["concat", "drone-", ["get", "look"]],
        "icon-rotate": ["get", "heading"], "icon-rotation-alignment": "map",
        "icon-size": ["case", ["get", "chosen"], 1.25, 1],
        "icon-allow-overlap": true, "icon-ignore-placement": true,
      },
    },
    {
      id: "drone-names", type: "symbol", source: "drones", filter: kind("drone"),
      layout: {
        "icon-image": ["concat", "name-", ["to-string", ["get", "id"]]],
        "icon-offset": [17, -15], "icon-allow-overlap": true, "icon-ignore-placement": true,
      },
    },
  ];
}

export function mapStyle(): StyleSpecification {
  const sources = Object.fromEntries(SOURCES.map((name) => [name, { type: "geojson" as const, data: EMPTY }]));
  return { version: 8, sources, layers: layers(0) };
}
