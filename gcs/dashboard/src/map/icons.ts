/** Small pictures drawn here, so that the map needs no sprite and no font files. */

import type { Map as MapView } from "maplibre-gl";

import { color } from "../core/theme";
import type { DroneLook } from "./scene";

const SCALE = 2; // pixels a point, for sharp edges
const LOOKS: readonly [DroneLook, string][] = [
  ["normal", "drone"],
  ["stale", "drone-stale"],
  ["caution", "caution"],
  ["warning", "warning"],
];

function picture(size: number, draw: (context: CanvasRenderingContext2D) => void): ImageData {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size * SCALE;
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("this browser cannot draw on a canvas");
  context.scale(SCALE, SCALE);
  context.translate(size / 2, size / 2);
  draw(context);
  return context.getImageData(0, 0, canvas.width, canvas.height);
}

function arrow(fill: string, hollow: boolean): ImageData {
  return picture(34, (context) => {
    context.beginPath();
    context.moveTo(0, -13);
    context.lineTo(10, 11);
    context.lineTo(0, 6);
    context.lineTo(-10, 11);
    context.closePath();
    context.lineJoin = "round";
    context.lineWidth = hollow ? 3 : 4;
    context.strokeStyle = hollow ? fill : color("map-ground");
    context.stroke();
    context.fillStyle = hollow ? color("map-ground") : fill;
    context.fill();
  });
}

function name(text: string): ImageData {
  return picture(36, (context) => {
    context.font = "700 15px system-ui, 'DejaVu Sans', sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineJoin = "round";
    context.lineWidth = 4;
    context.strokeStyle = color("map-ground");
    context.strokeText(text, 0, 0);
    context.fillStyle = color("ink");
    context.fillText(text, 0, 0);
  });
}

function launch(): ImageData {
  return picture(22, (context) => {
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
  });
}

function put(map: MapView, id: string, image: ImageData): void {
  if (map.hasImage(id)) map.removeImage(id);
  map.addImage(id, image, { pixelRatio: SCALE });
}

/** All pictures in the present colours. */
export function drawIcons(map: MapView, ids: Iterable<number>): void {
  for (const [look, token] of LOOKS) put(map, `drone-${look}`, arrow(color(token), look === "stale"));
  put(map, "launch", launch());
  for (const id of ids) put(map, `name-${id}`, name(String(id)));
}

/** Names of drones that appeared. */
export function drawNames(map: MapView, ids: Iterable<number>): void {
  for (const id of ids) if (!map.hasImage(`name-${id}`)) put(map, `name-${id}`, name(String(id)));
}
