/** The live map: makes the map once, then hands it new data when signals change. */

import "maplibre-gl/dist/maplibre-gl.css";

import { effect, signal } from "@preact/signals";
import { LngLatBounds, Map as MapView, NavigationControl, ScaleControl, setWorkerUrl, type GeoJSONSource } from "maplibre-gl";
import workerUrl from "maplibre-gl/dist/maplibre-gl-worker.mjs?worker&url";
import { useEffect, useRef } from "preact/hooks";

import { explained, whyLines } from "../core/explanation";
import * as drafting from "../core/drafting";
import { frameOf, toLngLat } from "../core/geo";
import * as state from "../core/state";
import { scheme } from "../core/theme";
import type { CampaignStatic, Pair } from "../core/types";
import { Legend } from "../ui/Legend";
import { measured } from "./bigness";
import { drawLaunch } from "./icons";
import { layers, mapStyle, type SourceName } from "./layers";
import { Overlay, type Moving } from "./overlay";
import { addTiles } from "./tiles";
import { drawingScene, EMPTY, groundScene, userScene, type Scene } from "./scene";

setWorkerUrl(workerUrl);

const failure = signal<string | null>(null);
const tilesFailure = signal<string | null>(null);
const follow = signal(false);

export function MapPanel() {
  const place = useRef<HTMLDivElement>(null);
  const view = useRef<MapView | null>(null);
  useEffect(() => {
    if (place.current === null) return undefined;
    try {
      view.current = makeMap(place.current);
    } catch (error) {
      failure.value = error instanceof Error ? error.message : String(error);
      return undefined;
    }
    const stop = feed(view.current);
    return () => {
      stop();
      view.current?.remove();
    };
  }, []);
  const area = state.area.value;
  return (
    <section class="map-panel" aria-label="Map">
      <div
        ref={place}
        class="map"
        data-testid="map"
        data-drones={area === null ? 0 : (state.snapshot.value?.vehicles.length ?? 0)}
        data-users={state.users.value.length}
        data-obstacles={area?.obstacles.length ?? 0}
        data-why-lines={state.plans.value.length === 0 ? 0 : whyLines(explained(state.reasons.value, state.selected.value), state.users.value).length}
      />
      {failure.value !== null && <p class="map-note">The map cannot be drawn here ({failure.value}). Everything else works.</p>}
      {area === null && <p class="map-note">No campaign yet: choose a mission and create one.</p>}
      {tilesFailure.value !== null && <p class="map-note low">No map below the campaign: {tilesFailure.value}</p>}
      <div class="map-tools">
        <button type="button" disabled={area === null} onClick={() => view.current && area && fit(view.current, area)}>Whole area</button>
        <button type="button" aria-pressed={follow.value} disabled={state.selected.value === null} onClick={() => (follow.value = !follow.value)}>
          Follow {state.selected.value === null ? "a UAV" : `UAV ${state.selected.value}`}
        </button>
      </div>
      <Legend />
    </section>
  );
}

function makeMap(container: HTMLElement): MapView {
  measured();
  const map = new MapView({
    container, style: mapStyle(), center: [0, 0], zoom: 1,
    attributionControl: false, dragRotate: false, pitchWithRotate: false, maxPitch: 0, fadeDuration: 0,
  });
  map.touchZoomRotate.disableRotation();
  map.addControl(new NavigationControl({ showCompass: false }), "top-right");
  map.addControl(new ScaleControl({}), "bottom-left");
  map.getCanvas().setAttribute("aria-label", "Map of the area; the fleet list says the same in words");
  return map;
}

function fit(map: MapView, campaign: CampaignStatic): void {
  const frame = frameOf(campaign);
  map.fitBounds([toLngLat(frame, [0, 0]), toLngLat(frame, campaign.size_m)], { padding: 36, duration: 0 });
}

/** Keep the map's sources equal to the state; returns how to stop. */
function feed(map: MapView): () => void {
  const stops: (() => void)[] = [];
  const show = (name: SourceName, scene: () => Scene): void => {
    stops.push(effect(() => void (map.getSource(name) as GeoJSONSource | undefined)?.setData(scene())));
  };
  const overlay = new Overlay(map);
  map.on("click", ({ point, lngLat }) => {
    if (drafting.click([lngLat.lng, lngLat.lat])) return;
    state.selected.value = overlay.pick(point.x, point.y) ?? state.selected.value;
  });
  stops.push(effect(() => overlay.show(moving())));
  const begin = (): void => {
    void addTiles(map).then((reason) => (tilesFailure.value = reason));
    const { area, users } = state;
    stops.push(effect(() => repaint(map, scheme.value)));
    map.on("resize", () => measured() && repaint(map, scheme.peek()));
    show("ground", () => (area.value === null ? EMPTY : groundScene(area.value)));
    show("users", () => (area.value === null ? EMPTY : userScene(area.value, users.value)));
    show("draft", () => drawingScene(drafting.drawing.value.corners));
    stops.push(effect(() => void (map.getCanvas().style.cursor = drafting.drawing.value.tool === null ? "" : "crosshair")));
    stops.push(fitOnEntry(map), showFleet(map), followSelected(map));
  };
  if (map.isStyleLoaded()) begin();
  else map.once("load", begin);
  return () => stops.forEach((stop) => stop());
}

const moving = (): Moving => ({
  campaign: state.area.value,
  vehicles: state.snapshot.value?.vehicles ?? [],
  trails: state.trails.value,
  plans: state.plans.value,
  selected: state.selected.value,
  live: state.current.value,
  why: explained(state.reasons.value, state.selected.value),
  users: state.users.value,
});

function repaint(map: MapView, _scheme: string): void {
  drawLaunch(map);
  for (const layer of layers()) {
    if (map.getLayer(layer.id) === undefined) continue;
    for (const [property, value] of Object.entries(layer.paint ?? {})) {
      map.setPaintProperty(layer.id, property as never, value as never);
    }
  }
}

/** The whole area when a campaign is entered, and whenever the panel's size changes until someone moves the map. */
function fitOnEntry(map: MapView): () => void {
  let shown: string | null = null;
  let moved = false;
  map.on("movestart", (event) => void (moved ||= event.originalEvent !== undefined));
  map.on("resize", () => {
    const campaign = state.area.peek();
    if (!moved && campaign !== null) fit(map, campaign);
  });
  return effect(() => {
    const campaign = state.area.value;
    const place = campaign === null ? null : `${campaign.campaign_id} ${campaign.south_west_deg}`;
    if (campaign === null || place === shown) return;
    [shown, moved] = [place, false];
    fit(map, campaign);
  });
}

/** Without a campaign there is still a fleet: where it stands, not the whole world. */
function showFleet(map: MapView): () => void {
  let done = false;
  map.on("movestart", (event) => void (done ||= event.originalEvent !== undefined));
  return effect(() => {
    const places = (state.snapshot.value?.vehicles ?? []).flatMap(({ lat_deg, lon_deg }): Pair[] => (lat_deg === null || lon_deg === null ? [] : [[lon_deg, lat_deg]]));
    if (done || state.area.value !== null || places[0] === undefined) return;
    done = true;
    map.fitBounds(places.reduce((bounds, place) => bounds.extend(place), new LngLatBounds(places[0], places[0])), { padding: 80, maxZoom: 15, duration: 0 });
  });
}

function followSelected(map: MapView): () => void {
  return effect(() => {
    const vehicle = state.snapshot.value?.vehicles.find((one) => one.system_id === state.selected.value);
    const campaign = state.area.value;
    if (!follow.value || campaign === null || vehicle?.east_m == null || vehicle.north_m === null) return;
    map.easeTo({ center: toLngLat(frameOf(campaign), [vehicle.east_m, vehicle.north_m]), duration: 180, easing: (t) => t });
  });
}
