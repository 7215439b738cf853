/**
 * Drones between two reports: the server tells places five times a second, the eye wants more. Each drone glides from
 * where it was drawn to where it was reported, in the time between the reports, so it is never drawn ahead of what is
 * known. No clock and no map here.
 */

import type { Pair } from "../core/types";

const LONGEST_MS = 400; // a late report is not stretched over a long way
const FARTHEST_DEG = 0.001; // some 100 m: a jump is a jump

interface Leg {
  from: Pair;
  to: Pair;
  begunMs: number;
}

export class Glide {
  private legs = new Map<number, Leg>();
  private lastMs = -Infinity;
  private lengthMs = 0;

  /** New places by drone, [longitude, latitude]; those not named any more are forgotten. */
  report(places: ReadonlyMap<number, Pair>, nowMs: number): void {
    const moved = [...places].some(([id, [lng, lat]]) => {
      const to = this.legs.get(id)?.to;
      return to === undefined || to[0] !== lng || to[1] !== lat;
    });
    if (!moved && places.size === this.legs.size) return;
    const next = new Map<number, Leg>();
    for (const [id, to] of places) {
      const from = this.at(id, nowMs) ?? to;
      const far = Math.abs(from[0] - to[0]) > FARTHEST_DEG || Math.abs(from[1] - to[1]) > FARTHEST_DEG;
      next.set(id, { from: far ? to : from, to, begunMs: nowMs });
    }
    this.legs = next;
    this.lengthMs = Math.min(LONGEST_MS, nowMs - this.lastMs);
    this.lastMs = nowMs;
  }

  /** Where to draw it now; undefined for a drone without a place. */
  at(id: number, nowMs: number): Pair | undefined {
    const leg = this.legs.get(id);
    if (leg === undefined) return undefined;
    const share = this.lengthMs <= 0 ? 1 : Math.min(1, (nowMs - leg.begunMs) / this.lengthMs);
    return [leg.from[0] + share * (leg.to[0] - leg.from[0]), leg.from[1] + share * (leg.to[1] - leg.from[1])];
  }

  /** Somebody is still on the way. */
  moving(nowMs: number): boolean {
    if (nowMs - this.lastMs >= this.lengthMs) return false;
    return [...this.legs.values()].some(({ from, to }) => from[0] !== to[0] || from[1] !== to[1]);
  }
}
