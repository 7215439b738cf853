/** Draw an area on the map, or type it, or bring it from a file. Everything that a click does can also be typed. */

import { useEffect } from "preact/hooks";

import { cornersFrom, cornersText, metresOf, sizeM, type Draft, type DraftObstacle, type LngLat } from "../core/draft";
import { change, closeObstacle, drawing, geoJsonText, importFile, key, notes, planText, take } from "../core/drafting";
import { HINTS, mayClose, type Tool } from "../core/drawing";
import { frameAt, toLngLat } from "../core/geo";
import type { Pair } from "../core/types";

const TOOLS: readonly [Tool, string][] = [["area", "Draw area"], ["obstacle", "Draw obstacle"], ["launch", "Set launch point"]];

export function DraftEditor({ draft }: { draft: Draft }) {
  useEffect(listenForKeys, []);
  const tool = drawing.value.tool;
  return (
    <fieldset class="draft" data-testid="draft" onKeyDown={onEnter}>
      <legend>Area of the new campaign</legend>
      <div class="orders">
        {TOOLS.map(([name, label]) => (
          <button key={name} type="button" aria-pressed={tool === name} onClick={() => take(name)}>{label}</button>
        ))}
        {tool === "obstacle" && <button type="button" disabled={!mayClose(drawing.value)} onClick={closeObstacle}>Close obstacle</button>}
      </div>
      {tool !== null && <p class="note" role="status">{HINTS[tool]}</p>}
      <Corners draft={draft} />
      <Text label="Launch points" hint="east north in metres, separated by commas" text={cornersText(draft.launches.map((at) => metresOf(draft, at)))}
        onText={(text) => withCorners(draft, text, 1, (launches) => change({ launches }))} />
      <ul class="obstacles">
        {draft.obstacles.map((obstacle, index) => <ObstacleFields key={index} draft={draft} obstacle={obstacle} index={index} />)}
      </ul>
      <Files draft={draft} />
      {notes.value.map((text) => <p key={text} class="drone-alert caution" role="status">{text}</p>)}
    </fieldset>
  );
}

function listenForKeys(): () => void {
  const onKey = (event: KeyboardEvent): void => {
    const typing = event.target instanceof Element && event.target.matches("input, select, textarea, button");
    if (event.shiftKey || (typing && event.key !== "Escape")) return; // Shift+Esc is the emergency stop
    if (key(event.key)) event.preventDefault();
  };
  addEventListener("keydown", onKey);
  return () => removeEventListener("keydown", onKey);
}

/** Enter takes the value in; it does not create a campaign. */
function onEnter(event: KeyboardEvent): void {
  if (event.key !== "Enter" || !(event.target instanceof HTMLInputElement)) return;
  event.preventDefault();
  event.target.blur();
  event.target.focus();
}

/** The south-west corner and the size, as a mission has them. */
function Corners({ draft }: { draft: Draft }) {
  const [lng, lat] = draft.southWest;
  const [east, north] = sizeM(draft);
  const move = (southWest: LngLat, size: Pair): void => change({ southWest, northEast: toLngLat(frameAt(southWest), size) });
  return (
    <div class="numbers">
      <NumberField label="South-west latitude" value={lat} onValue={(value) => move([lng, value], [east, north])} />
      <NumberField label="South-west longitude" value={lng} onValue={(value) => move([value, lat], [east, north])} />
      <NumberField label="Size east, m" value={east} onValue={(value) => move([lng, lat], [value, north])} />
      <NumberField label="Size north, m" value={north} onValue={(value) => move([lng, lat], [east, value])} />
    </div>
  );
}

function ObstacleFields({ draft, obstacle, index }: { draft: Draft; obstacle: DraftObstacle; index: number }) {
  const replace = (part: Partial<DraftObstacle>): void =>
    change({ obstacles: draft.obstacles.map((one, k) => (k === index ? { ...one, ...part } : one)) });
  return (
    <li>
      <div class="numbers">
        <Text label={`Name of obstacle ${index + 1}`} text={obstacle.name} onText={(name) => (replace({ name }), true)} />
        <NumberField label={`Height of ${obstacle.name}, m`} value={obstacle.height_m} onValue={(height_m) => replace({ height_m })} />
      </div>
      <Text label={`Corners of ${obstacle.name}`} hint="east north in metres, separated by commas"
        text={cornersText(obstacle.ring.map((at) => metresOf(draft, at)))} onText={(text) => withCorners(draft, text, 3, (ring) => replace({ ring }))} />
      <button type="button" onClick={() => change({ obstacles: draft.obstacles.filter((_, k) => k !== index) })}>Remove {obstacle.name}</button>
    </li>
  );
}

function withCorners(draft: Draft, text: string, least: number, then: (corners: LngLat[]) => void): boolean {
  const corners = cornersFrom(text, least);
  if (corners === null) return false;
  then(corners.map((corner) => toLngLat(frameAt(draft.southWest), corner)));
  return true;
}

function NumberField({ label, value, onValue }: { label: string; value: number; onValue: (value: number) => void }) {
  return (
    <label>
      <span class="note">{label}</span>
      <input type="number" step="any" value={value} onChange={(event) => Number.isFinite(event.currentTarget.valueAsNumber) && onValue(event.currentTarget.valueAsNumber)} />
    </label>
  );
}

/** `onText` says whether the text could be understood. */
function Text({ label, hint, text, onText }: { label: string; hint?: string; text: string; onText: (text: string) => boolean }) {
  return (
    <label>
      <span class="note">{label}</span>
      <input
        type="text" value={text} title={hint}
        onChange={({ currentTarget: input }) => {
          input.setCustomValidity(onText(input.value) ? "" : `not understood: give ${hint}`);
          input.reportValidity();
        }}
      />
    </label>
  );
}

function Files({ draft }: { draft: Draft }) {
  const save = (name: string, type: string, text: string): void => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type }));
    link.download = name;
    link.click();
    URL.revokeObjectURL(link.href);
  };
  const load = async (input: HTMLInputElement): Promise<void> => {
    const file = input.files?.[0];
    if (file !== undefined) importFile(await file.text());
    input.value = "";
  };
  return (
    <div class="orders">
      <label class="file">
        <span class="note">Import GeoJSON or .plan</span>
        <input type="file" accept=".geojson,.json,.plan" onChange={(event) => void load(event.currentTarget)} />
      </label>
      <button type="button" onClick={() => save("area.geojson", "application/geo+json", geoJsonText(draft))}>Export GeoJSON</button>
      <button type="button" onClick={() => save("area.plan", "application/json", planText(draft))}>Export .plan</button>
    </div>
  );
}
