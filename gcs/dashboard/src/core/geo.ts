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

/** A closed ring of corners around a centre. */
export function circleM([eastM, northM]: Pair, radiusM: number, corners = 72): Pair[] {
  return Array.from({ length: corners + 1 }, (_, k): Pair => {
    const angle = (2 * Math.PI * (k % corners)) / corners;
    return [eastM + radiusM * Math.sin(angle), northM + radiusM * Math.cos(angle)];
  });
}

/** The ring with its first corner again at the end. */
export function closed(ring: readonly Pair[]): Pair[] {
  const first = ring[0];
  return first === undefined ? [] : [...ring, first];
}

/** Corners of the area, from the south-west. */
export const areaRingM = ([eastM, northM]: Pair): Pair[] => [[0, 0], [eastM, 0], [eastM, northM], [0, northM]];
