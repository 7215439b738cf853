/** Vector tiles of the Protomaps basemap schema as a quiet ground: land, water, ways and buildings, no words. */

import type { LayerSpecification } from "maplibre-gl";

export function vectorLayers(source: string, color: (token: string) => string): LayerSpecification[] {
  const fill = (layer: string, token: string, opacity: number): LayerSpecification => ({
    id: `tiles-${layer}`, type: "fill", source, "source-layer": layer, paint: { "fill-color": color(token), "fill-opacity": opacity },
  });
  return [
    fill("earth", "map-ground", 1),
    fill("landuse", "map-land", 0.6),
    fill("water", "map-water", 1),
    {
      id: "tiles-roads", type: "line", source, "source-layer": "roads",
      paint: { "line-color": color("map-road"), "line-width": ["interpolate", ["linear"], ["zoom"], 12, 0.6, 17, 4] },
    },
    fill("buildings", "map-building", 0.8),
  ];
}
