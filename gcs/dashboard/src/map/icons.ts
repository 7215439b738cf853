/** The launch point's picture, drawn here, so that the map needs no sprite and no font files. */

import type { Map as MapView } from "maplibre-gl";

import { color } from "../core/theme";
import { bigness } from "./bigness";

const SCALE = 2; // pixels a point, for sharp edges
const SIZE = 22;

/** In the present colours. */
export function drawLaunch(map: MapView): void {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIZE * SCALE;
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("this browser cannot draw on a canvas");
  context.scale(SCALE, SCALE);
  context.translate(SIZE / 2, SIZE / 2);
  context.lineWidth = 2;
  context.strokeStyle = color("ink-2");
  context.fillStyle = color("map-ground");
  context.beginPath();
  context.arc(0, 0, 8, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  context.font = "700 11px system-ui, 'DejaVu Sans', sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = color("ink-2");
  context.fillText("H", 0, 0.5);
  if (map.hasImage("launch")) map.removeImage("launch");
  map.addImage("launch", context.getImageData(0, 0, canvas.width, canvas.height), { pixelRatio: SCALE / bigness() });
}
