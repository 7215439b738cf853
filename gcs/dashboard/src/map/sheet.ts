/** A canvas as large as the map, above it. */

import type { Map as MapView } from "maplibre-gl";

export class Sheet {
  readonly canvas = document.createElement("canvas");

  constructor() {
    this.canvas.className = "overlay";
  }

  /** Empty, in the map's pixels; null where there is nothing to draw on. */
  cleared(map: MapView): CanvasRenderingContext2D | null {
    const { clientWidth: width, clientHeight: height } = map.getContainer();
    const scale = devicePixelRatio;
    if (this.canvas.width !== Math.round(width * scale) || this.canvas.height !== Math.round(height * scale)) {
      this.canvas.width = Math.round(width * scale);
      this.canvas.height = Math.round(height * scale);
      this.canvas.style.width = `${width}px`;
      this.canvas.style.height = `${height}px`;
    }
    const context = this.canvas.getContext("2d");
    context?.setTransform(scale, 0, 0, scale, 0, 0);
    context?.clearRect(0, 0, width, height);
    return context;
  }
}
