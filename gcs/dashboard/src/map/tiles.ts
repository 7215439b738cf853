/**
 * What lies under the campaign, by the server's configuration: nothing (the plain background needs no network), tiles
 * of a URL, or a PMTiles file. Vector tiles are drawn without words: letters would need font files from somewhere.
 */

import { addProtocol, AttributionControl, type LayerSpecification, type Map as MapView, type SourceSpecification } from "maplibre-gl";

import { api } from "../core/app";
import { storedKey } from "../core/session";
import { color } from "../core/theme";
import { vectorLayers } from "./vectorLayers";

const SOURCE = "tiles";
const ABOVE = "area"; // tiles lie below it, and it becomes see-through

const raster: LayerSpecification = { id: "tiles", type: "raster", source: SOURCE };

/** Put the configured tiles under everything else; what went wrong otherwise, null when all is well. */
export async function addTiles(map: MapView): Promise<string | null> {
  const answer = await api.mapTiles();
  if (!answer.ok || answer.value.url === null) return null;
  const { kind, url, attribution } = answer.value;
  try {
    const [source, layers] = kind === "pmtiles"
      ? await archive(api.urlOf(url), attribution)
      : remote(url, attribution);
    map.addSource(SOURCE, source);
    for (const layer of layers) map.addLayer(layer, ABOVE);
    if (attribution !== "") map.addControl(new AttributionControl({ compact: true }), "bottom-left");
    map.setPaintProperty(ABOVE, "fill-opacity", 0.35);
    return null;
  } catch (error) {
    return error instanceof Error ? error.message : String(error);
  }
}

const remote = (url: string, attribution: string): [SourceSpecification, LayerSpecification[]] =>
  [{ type: "raster", tiles: [url], tileSize: 256, attribution }, [raster]];

/** The library comes only where there is such a file. */
async function archive(url: string, attribution: string): Promise<[SourceSpecification, LayerSpecification[]]> {
  const { FetchSource, PMTiles, Protocol, TileType } = await import("pmtiles");
  const key = storedKey();
  const file = new PMTiles(new FetchSource(url, new Headers(key === null ? {} : { authorization: `Bearer ${key}` })));
  const protocol = new Protocol();
  protocol.add(file);
  addProtocol("pmtiles", protocol.tile);
  const { tileType } = await file.getHeader();
  const address = `pmtiles://${url}`;
  if (tileType === TileType.Mvt) return [{ type: "vector", url: address, attribution }, vectorLayers(SOURCE, color)];
  return [{ type: "raster", url: address, tileSize: 256, attribution }, [raster]];
}
