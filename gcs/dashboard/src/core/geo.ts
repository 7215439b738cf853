/** Local metres (east, north of the area's south-west corner) to map coordinates, by the server's own scale. */

import type { CampaignStatic, Pair } from "./types";

export interface Frame {
  southWestDeg: Pair; // latitude, longitude
  metresPerDeg: Pair; // east a degree of longitude, north a degree of latitude
}

export const frameOf = (campaign: CampaignStatic): Frame => ({
  southWestDeg: campaign.south_west_deg,
  metresPerDeg: campaign.metres_per_deg,
});

/** [longitude, latitude] in degrees, the order that maps use. */
export function toLngLat(frame: Frame, [eastM, northM]: Pair): Pair {
  return [
    frame.southWestDeg[1] + eastM / frame.metresPerDeg[0],
    frame.southWestDeg[0] + northM / frame.metresPerDeg[1],
  ];
}

const EQUATOR_M = 2 * Math.PI * 6378137; // of web Mercator's sphere
const TILE_PX = 512; // the world's width at zoom 0, in the map library's pixels

/** How many pixels `lengthM` is at zoom 0 and this latitude; doubles with each zoom step. */
export const pixelsAtZoom0 = (lengthM: number, latDeg: number): number =>
  (lengthM * TILE_PX) / (EQUATOR_M * Math.cos((latDeg * Math.PI) / 180));

/** The ring with its first corner again at the end. */
export function closed(ring: readonly Pair[]): Pair[] {
  const first = ring[0];
  return first === undefined ? [] : [...ring, first];
}

/** Corners of the area, from the south-west. */
export const areaRingM = ([eastM, northM]: Pair): Pair[] => [[0, 0], [eastM, 0], [eastM, northM], [0, northM]];

const SEMI_MAJOR_M = 6378137; // WGS 84
const FLATTENING = 1 / 298.257223563;

/** The server's own scale (`policy/world/frames.py`) at a south-west corner that it has not seen yet. */
export function frameAt([lng, lat]: Pair): Frame {
  const [latRad, degree] = [(lat * Math.PI) / 180, Math.PI / 180];
  const eccentricity2 = FLATTENING * (2 - FLATTENING);
  const w2 = 1 - eccentricity2 * Math.sin(latRad) ** 2;
  const east = degree * (SEMI_MAJOR_M / Math.sqrt(w2)) * Math.cos(latRad);
  return { southWestDeg: [lat, lng], metresPerDeg: [east, (degree * SEMI_MAJOR_M * (1 - eccentricity2)) / w2 ** 1.5] };
}

/** Longitude and latitude to metres east and north of the frame's corner. */
export const toMetres = (frame: Frame, [lng, lat]: Pair): Pair => [
  (lng - frame.southWestDeg[1]) * frame.metresPerDeg[0],
  (lat - frame.southWestDeg[0]) * frame.metresPerDeg[1],
];
