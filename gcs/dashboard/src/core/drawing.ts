/** Drawing with clicks, without map or page: which tool, and the corners given so far. */

import { boundsOf, NEW_OBSTACLE_M, type Draft, type LngLat } from "./draft";

export type Tool = "area" | "obstacle" | "launch";

export interface Drawing {
  tool: Tool | null;
  corners: readonly LngLat[];
}

export const IDLE: Drawing = { tool: null, corners: [] };

export const HINTS: Record<Tool, string> = {
  area: "Click two opposite corners of the area. Esc: stop.",
  obstacle: "Click the obstacle's corners; Enter or Close ends it. Backspace takes one back, Esc: stop.",
  launch: "Click where the UAVs start. Esc: stop.",
};

interface Step {
  drawing: Drawing;
  draft: Draft;
}

/** What one click does. */
export function clicked(drawing: Drawing, draft: Draft, at: LngLat): Step {
  const corners = [...drawing.corners, at];
  switch (drawing.tool) {
    case "area": {
      if (corners.length < 2) return { drawing: { ...drawing, corners }, draft };
      const [southWest, northEast] = boundsOf(corners);
      return { drawing: IDLE, draft: { ...draft, southWest, northEast } };
    }
    case "obstacle":
      return { drawing: { ...drawing, corners }, draft };
    case "launch":
      return { drawing: IDLE, draft: { ...draft, launches: [at] } };
    case null:
      return { drawing, draft };
  }
}

export const mayClose = (drawing: Drawing): boolean => drawing.tool === "obstacle" && drawing.corners.length >= 3;

/** The obstacle is complete; nothing happens before it has three corners. */
export function closedObstacle(drawing: Drawing, draft: Draft): Step {
  if (!mayClose(drawing)) return { drawing, draft };
  const obstacle = { name: `obstacle ${draft.obstacles.length + 1}`, height_m: NEW_OBSTACLE_M, ring: [...drawing.corners] };
  return { drawing: { tool: "obstacle", corners: [] }, draft: { ...draft, obstacles: [...draft.obstacles, obstacle] } };
}

export const tookBack = (drawing: Drawing): Drawing => ({ ...drawing, corners: drawing.corners.slice(0, -1) });
