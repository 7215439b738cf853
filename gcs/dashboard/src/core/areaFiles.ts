/** Areas in and out of files: GeoJSON (RFC 7946) and QGroundControl's `.plan` (version 1, geoFence version 2). */

import type { Feature, FeatureCollection, Position } from "geojson";

import { boundsOf, NEW_OBSTACLE_M, NO_FLY_HEIGHT_M, type Draft, type DraftObstacle, type LngLat } from "./draft";
import { closed, frameAt, toLngLat } from "./geo";
import type { Pair } from "./types";

export type AreaFile = { ok: true; draft: Draft; notes: string[] } | { ok: false; reason: string };

const RECTANGULAR = 1e-6; // degrees, a decimetre
const CIRCLE_CORNERS = 16;

const ringOf = ([[west, south], [east, north]]: [LngLat, LngLat]): LngLat[] => [[west, south], [east, south], [east, north], [west, north]];
const areaRing = (draft: Draft): LngLat[] => ringOf([draft.southWest, draft.northEast]);

export function toGeoJson(draft: Draft): FeatureCollection {
  const polygon = (ring: readonly LngLat[], properties: Record<string, unknown>): Feature =>
    ({ type: "Feature", properties, geometry: { type: "Polygon", coordinates: [closed(ring)] } });
  return {
    type: "FeatureCollection",
    features: [
      polygon(areaRing(draft), { kind: "area" }),
      ...draft.obstacles.map(({ name, height_m, ring }) => polygon(ring, { kind: "obstacle", name, height_m })),
      ...draft.launches.map((at): Feature => ({ type: "Feature", properties: { kind: "launch" }, geometry: { type: "Point", coordinates: at } })),
    ],
  };
}

/** The area is the fence; obstacles that reach the flight altitude are zones to keep out of. */
export function toPlan(draft: Draft, altitudeM: number): Record<string, unknown> {
  const latLng = ([lng, lat]: LngLat): Pair => [lat, lng];
  const polygon = (ring: readonly LngLat[], inclusion: boolean) => ({ inclusion, polygon: ring.map(latLng), version: 1 });
  const high = draft.obstacles.filter((obstacle) => obstacle.height_m >= altitudeM);
  const home = draft.launches[0] ?? draft.southWest;
  return {
    fileType: "Plan", groundStation: "QGroundControl", version: 1,
    geoFence: { circles: [], polygons: [polygon(areaRing(draft), true), ...high.map((one) => polygon(one.ring, false))], version: 2 },
    mission: {
      cruiseSpeed: 15, hoverSpeed: 5, firmwareType: 12, globalPlanAltitudeMode: 1, items: [],
      plannedHomePosition: [...latLng(home), 0], vehicleType: 2, version: 2,
    },
    rallyPoints: { points: [], version: 2 },
  };
}

/** Either kind of file; `base` gives what the file does not say. */
export function fromFile(text: string, base: Draft): AreaFile {
  let document: unknown;
  try {
    document = JSON.parse(text);
  } catch {
    return { ok: false, reason: "the file is not JSON: choose a GeoJSON or a QGroundControl .plan file" };
  }
  const found = record(document);
  if (found["type"] === "FeatureCollection") return fromGeoJson(found, base);
  if (found["fileType"] === "Plan") return fromPlan(found, base);
  return { ok: false, reason: "the file is neither a GeoJSON FeatureCollection nor a QGroundControl plan" };
}

function fromGeoJson(document: Record<string, unknown>, base: Draft): AreaFile {
  const features = list(document["features"]).map(record);
  const polygons = features.flatMap((feature) => {
    const ring = openRing(polygonRing(feature));
    return ring === null ? [] : [{ ring, properties: record(feature["properties"]) }];
  });
  const area = polygons.find(({ properties }) => ["area", "fence"].includes(String(properties["kind"])))
    ?? polygons.filter(({ properties }) => properties["kind"] === undefined).sort((a, b) => extent(b.ring) - extent(a.ring))[0];
  if (area === undefined) return { ok: false, reason: "the GeoJSON has no polygon that could be the area (kind \"area\", or the largest without a kind)" };
  const obstacles = polygons.filter((one) => one !== area).map(({ ring, properties }, index): DraftObstacle => {
    const height = properties["height_m"];
    return { name: String(properties["name"] ?? `obstacle ${index + 1}`), height_m: typeof height === "number" ? height : NEW_OBSTACLE_M, ring };
  });
  const launches = features.flatMap((feature) => {
    const geometry = record(feature["geometry"]);
    const at = geometry["type"] === "Point" ? position(geometry["coordinates"]) : null;
    return at === null ? [] : [at];
  });
  return drafted([area.ring], obstacles, launches, base);
}

function fromPlan(document: Record<string, unknown>, base: Draft): AreaFile {
  const fence = record(document["geoFence"]);
  const swapped = (value: unknown): LngLat | null => {
    const at = position(value);
    return at === null ? null : [at[1], at[0]]; // plans say latitude first
  };
  const shapes = [
    ...list(fence["polygons"]).map(record).map((one) => ({ inside: one["inclusion"] !== false, ring: openRing(list(one["polygon"]).map(swapped)) })),
    ...list(fence["circles"]).map(record).map((one) => ({ inside: one["inclusion"] !== false, ring: circleRing(record(one["circle"]), swapped) })),
  ].flatMap(({ inside, ring }) => (ring === null ? [] : [{ inside, ring }]));
  const inclusions = shapes.filter((shape) => shape.inside).map((shape) => shape.ring);
  if (inclusions.length === 0) return { ok: false, reason: "the plan has no inclusion fence: draw one in QGroundControl (Plan, Fence) and save it again" };
  const keepOut = shapes.filter((shape) => !shape.inside);
  const obstacles = keepOut.map(({ ring }, index) => ({ name: `no-fly zone ${index + 1}`, height_m: NO_FLY_HEIGHT_M, ring }));
  const home = swapped(record(document["mission"])["plannedHomePosition"]);
  return drafted(inclusions, obstacles, home === null ? [] : [home], base);
}

function drafted(inclusions: LngLat[][], obstacles: DraftObstacle[], launches: LngLat[], base: Draft): AreaFile {
  const [southWest, northEast] = boundsOf(inclusions.flat());
  const notes: string[] = [];
  if (inclusions.length > 1) notes.push("Several fences: the area is the rectangle around all of them.");
  else if (!isRectangle(inclusions[0] ?? [], [southWest, northEast])) notes.push("The fence is no upright rectangle: the area is the rectangle around it. Draw obstacles where UAVs must not fly.");
  if (launches.length === 0) notes.push("The file names no launch point: the one before stays.");
  return { ok: true, notes, draft: { southWest, northEast, obstacles, launches: launches.length > 0 ? launches : base.launches } };
}

const isRectangle = (ring: readonly LngLat[], bounds: [LngLat, LngLat]): boolean =>
  ring.length === 4 && ringOf(bounds).every(([lng, lat]) => ring.some((at) => Math.abs(at[0] - lng) < RECTANGULAR && Math.abs(at[1] - lat) < RECTANGULAR));

const record = (value: unknown): Record<string, unknown> =>
  typeof value === "object" && value !== null && !Array.isArray(value) ? (value as Record<string, unknown>) : {};
const list = (value: unknown): unknown[] => (Array.isArray(value) ? value : []);

function position(value: unknown): LngLat | null {
  const [lng, lat] = list(value) as Position;
  if (typeof lng !== "number" || typeof lat !== "number" || !Number.isFinite(lng) || !Number.isFinite(lat)) return null;
  return [lng, lat];
}

function polygonRing(feature: Record<string, unknown>): (LngLat | null)[] {
  const geometry = record(feature["geometry"]);
  return geometry["type"] === "Polygon" ? list(list(geometry["coordinates"])[0]).map(position) : [];
}

/** At least three corners, without the first one again at the end. */
function openRing(corners: readonly (LngLat | null)[]): LngLat[] | null {
  if (corners.some((corner) => corner === null)) return null;
  const ring = [...(corners as LngLat[])];
  const [first, last] = [ring[0], ring[ring.length - 1]];
  if (first !== undefined && last !== undefined && ring.length > 1 && first[0] === last[0] && first[1] === last[1]) ring.pop();
  return ring.length >= 3 ? ring : null;
}

/** A polygon around the circle, so that no part of it is left out. */
function circleRing(circle: Record<string, unknown>, swapped: (value: unknown) => LngLat | null): LngLat[] | null {
  const [centre, radius] = [swapped(circle["center"]), circle["radius"]];
  if (centre === null || typeof radius !== "number" || !(radius > 0)) return null;
  const reach = radius / Math.cos(Math.PI / CIRCLE_CORNERS);
  return Array.from({ length: CIRCLE_CORNERS }, (_, k) => {
    const angle = (2 * Math.PI * (k + 0.5)) / CIRCLE_CORNERS;
    return toLngLat(frameAt(centre), [reach * Math.sin(angle), reach * Math.cos(angle)]);
  });
}

function extent(ring: readonly LngLat[]): number {
  const [[west, south], [east, north]] = boundsOf(ring);
  return (east - west) * (north - south);
}
