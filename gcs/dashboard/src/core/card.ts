/** A model's own card in words that people look for: what it is, what it learned from, how it did, where it comes from. */

import { fixed } from "./format";

export interface CardLine {
  name: string;
  text: string;
}

const LONGEST = 300;
/** Worth reading first, in this order; names as the cards have them. */
const FIRST = ["method", "data", "episodes", "episodic_aoi_last_20", "training_s", "date_utc", "git_commit", "command"];
const NAMES: Record<string, string> = {
  episodic_aoi_last_20: "AoI, last 20 episodes", training_s: "trained for, s", date_utc: "made on", git_commit: "of commit", data: "learned from",
};

/** Plain facts of a card, the telling ones first; nested ones (shapes, settings) are for who opens the file. */
export function cardLines(provenance: Record<string, unknown> | null): CardLine[] {
  const facts = Object.entries(provenance ?? {}).filter(([, value]) => value === null || typeof value !== "object");
  const rank = (name: string): number => (FIRST.includes(name) ? FIRST.indexOf(name) : FIRST.length);
  return facts.sort(([a], [b]) => rank(a) - rank(b)).map(([name, value]) => ({ name: NAMES[name] ?? name.replaceAll("_", " "), text: told(value) }));
}

const told = (value: unknown): string =>
  typeof value === "number" && !Number.isInteger(value) ? fixed(value, 2) : String(value).slice(0, LONGEST);
