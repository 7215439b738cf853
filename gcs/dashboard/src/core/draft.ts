/**
 * An area being drawn: rectangle, obstacles, launch points. Kept in degrees, so that moving the area's corner moves
 * nothing else; metres are made when it becomes part of a mission document.
 */

import { areaRingM, frameAt, toLngLat, toMetres } from "./geo";
import type { CampaignStatic, Pair } from "./types";

export type LngLat = Pair; // longitude, latitude

export interface DraftObstacle {
  name: string;
  height_m: number;
  ring: LngLat[]; // open
}

export interface Draft {
  southWest: LngLat;
  northEast: LngLat;
  obstacles: DraftObstacle[];
  launches: LngLat[];
}

export type MissionDocument = Record<string, unknown>;

export const DRAFT_ID = "draft"; // never a campaign's
export const NO_FLY_HEIGHT_M = 1000; // as high as a mission's obstacle can be
export const NEW_OBSTACLE_M = 150;

const table = (document: MissionDocument, name: string): Record<string, unknown> => {
  const value = document[name];
  return typeof value === "object" && value !== null ? (value as Record<string, unknown>) : {};
};

/** The area of a mission document that the server has checked. */
export function draftOf(document: MissionDocument): Draft {
  const [area, fleet] = [table(document, "area"), table(document, "fleet")];
  const [lat, lng] = area["south_west"] as Pair;
  const frame = frameAt([lng, lat]);
  const given = fleet["launch_m"] as Pair | Pair[];
  const launches = typeof given[0] === "number" ? [given as Pair] : (given as Pair[]);
  const obstacles = (area["obstacles"] ?? []) as { name?: string; height_m: number; polygon_m: Pair[] }[];
  return {
    southWest: [lng, lat],
    northEast: toLngLat(frame, area["size_m"] as Pair),
    launches: launches.map((point) => toLngLat(frame, point)),
    obstacles: obstacles.map(({ name, height_m, polygon_m }) => ({
      name: name ?? "", height_m, ring: polygon_m.map((corner) => toLngLat(frame, corner)),
    })),
  };
}

const decimetres = ([east, north]: Pair): Pair => [Math.round(10 * east) / 10, Math.round(10 * north) / 10];

/** Metres from the south-west corner, as missions have them. */
export const metresOf = (draft: Draft, point: LngLat): Pair => decimetres(toMetres(frameAt(draft.southWest), point));
export const sizeM = (draft: Draft): Pair => metresOf(draft, draft.northEast);

/** The document with the drawn area in place of its own. */
export function withDraft(document: MissionDocument, draft: Draft): MissionDocument {
  const launches = draft.launches.map((point) => metresOf(draft, point));
  const area = {
    south_west: [draft.southWest[1], draft.southWest[0]],
    size_m: sizeM(draft),
    obstacles: draft.obstacles.map(({ name, height_m, ring }) => ({ name, height_m, polygon_m: ring.map((corner) => metresOf(draft, corner)) })),
  };
  return { ...document, area, fleet: { ...table(document, "fleet"), launch_m: launches } };
}

/** The document flown by another policy, without the checkpoint that belongs to its own. */
export const withPolicy = (document: MissionDocument, policy: string): MissionDocument =>
  policy === "" ? document : { ...document, policy: { name: policy } };

/** The document flown with another trained model of its policy. */
export const withCheckpoint = (document: MissionDocument, file: string): MissionDocument =>
  file === "" ? document : { ...document, policy: { ...table(document, "policy"), checkpoint: file } };

/** What the map shows of it; numbers that only the server knows are left at 0. */
export function previewOf(draft: Draft, document: MissionDocument): CampaignStatic {
  const [frame, size, fleet] = [frameAt(draft.southWest), sizeM(draft), table(document, "fleet")];
  const drawn = withDraft(document, draft);
  const altitude = fleet["altitude_m"];
  return {
    campaign_id: DRAFT_ID, name: "draft", policy: "", user_source: "walkers",
    south_west_deg: frame.southWestDeg, metres_per_deg: frame.metresPerDeg, size_m: size, fence_m: areaRingM(size),
    obstacles: table(drawn, "area")["obstacles"] as CampaignStatic["obstacles"],
    launch_m: table(drawn, "fleet")["launch_m"] as Pair[],
    altitude_m: typeof altitude === "number" ? altitude : 120,
    serving_radius_m: 0, max_speed_mps: 0, mcl_db: 0, slots: 1, slot_s: 1,
  };
}

/** The smallest rectangle around points. */
export function boundsOf(points: readonly LngLat[]): [LngLat, LngLat] {
  const [lngs, lats] = [points.map(([lng]) => lng), points.map(([, lat]) => lat)];
  return [[Math.min(...lngs), Math.min(...lats)], [Math.max(...lngs), Math.max(...lats)]];
}

/** "0 0, 10 0, 10 5" to corners; null when it is not a list of at least `least` pairs. */
export function cornersFrom(text: string, least: number): Pair[] | null {
  const pairs = text.split(",").map((part) => part.trim().split(/\s+/).map(Number));
  const good = pairs.length >= least && pairs.every((pair) => pair.length === 2 && pair.every(Number.isFinite));
  return good ? (pairs as Pair[]) : null;
}

export const cornersText = (corners: readonly Pair[]): string => corners.map(([east, north]) => `${east} ${north}`).join(", ");
