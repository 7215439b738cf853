/** The area that is being drawn, if any, with the mission that it will belong to. */

import { computed, effect, signal, untracked } from "@preact/signals";

import { fromFile, toGeoJson, toPlan } from "./areaFiles";
import { api } from "./app";
import { DRAFT_ID, draftOf, previewOf, withCheckpoint, withDraft, withPolicy, type Draft, type LngLat, type MissionDocument } from "./draft";
import { clicked, closedObstacle, IDLE, tookBack, type Drawing, type Tool } from "./drawing";
import * as state from "./state";
import type { CampaignStatic } from "./types";

export const draft = signal<Draft | null>(null);
export const drawing = signal<Drawing>(IDLE);
export const base = signal<MissionDocument>({});
let before: CampaignStatic | null = null;
export const notes = signal<readonly string[]>([]);

/** While UAVs fly, or a recording is shown, the map is theirs. */
export const mapTaken = computed(() => state.inTheAir.value || state.replaying.value);

effect(() => {
  const drawn = draft.value;
  const document = base.value;
  if (drawn !== null && !mapTaken.value) untracked(() => state.preview(previewOf(drawn, document)));
});

/** Begin with a mission's own area. */
export async function open(mission: string): Promise<void> {
  const answer = await api.missionDocument(mission);
  if (!answer.ok) return void (notes.value = [answer.reason]);
  before = state.flight.area.value;
  base.value = answer.value;
  notes.value = [];
  draft.value = draftOf(answer.value);
}

/** Back to what was shown before. */
export function close(): void {
  draft.value = null;
  if (state.flight.area.value?.campaign_id === DRAFT_ID) state.preview(before);
  drawing.value = IDLE;
  notes.value = [];
}

/** The mission as drawn. */
export const drawnDocument = (drawn: Draft, name: string, policy: string, checkpoint: string): MissionDocument => {
  const document = withCheckpoint(withPolicy(withDraft(base.value, drawn), policy), checkpoint);
  return { ...document, campaign: { ...(document["campaign"] as object), name } };
};

export function change(part: Partial<Draft>): void {
  if (draft.value !== null) draft.value = { ...draft.value, ...part };
}

export function take(tool: Tool): void {
  drawing.value = drawing.value.tool === tool ? IDLE : { tool, corners: [] };
}

/** A click on the map; true when it was for drawing. */
export function click(at: LngLat): boolean {
  if (draft.value === null || drawing.value.tool === null) return false;
  apply(clicked(drawing.value, draft.value, at));
  return true;
}

export function closeObstacle(): void {
  if (draft.value !== null) apply(closedObstacle(drawing.value, draft.value));
}

/** Keys while drawing; true when it was one. */
export function key(name: string): boolean {
  if (drawing.value.tool === null) return false;
  if (name === "Escape") drawing.value = IDLE;
  else if (name === "Enter") closeObstacle();
  else if (name === "Backspace") drawing.value = tookBack(drawing.value);
  else return false;
  return true;
}

export function importFile(text: string): void {
  if (draft.value === null) return;
  const read = fromFile(text, draft.value);
  notes.value = read.ok ? read.notes : [read.reason];
  if (read.ok) draft.value = read.draft;
}

export const geoJsonText = (drawn: Draft): string => JSON.stringify(toGeoJson(drawn), null, 2);
export const planText = (drawn: Draft): string => JSON.stringify(toPlan(drawn, previewOf(drawn, base.value).altitude_m), null, 2);

function apply(step: { drawing: Drawing; draft: Draft }): void {
  drawing.value = step.drawing;
  draft.value = step.draft;
}
