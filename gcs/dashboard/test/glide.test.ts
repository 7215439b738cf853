import { describe, expect, it } from "vitest";

import { Glide } from "../src/map/glide";
import type { Pair } from "../src/core/types";

const places = (lng: number, lat = 47): ReadonlyMap<number, Pair> => new Map([[1, [lng, lat] as Pair]]);

describe("gliding between reports", () => {
  it("begins at the first report and arrives when the next one is due, never ahead of it", () => {
    const glide = new Glide();
    glide.report(places(8), 0);
    expect([glide.at(1, 50), glide.moving(50)]).toEqual([[8, 47], false]);
    glide.report(places(8.0002), 200);
    expect(glide.at(1, 200)).toEqual([8, 47]);
    expect(glide.at(1, 300)?.[0]).toBeCloseTo(8.0001, 9);
    expect([glide.at(1, 400)?.[0], glide.at(1, 9000)?.[0]]).toEqual([8.0002, 8.0002]);
    expect([glide.moving(399), glide.moving(400)]).toEqual([true, false]);
  });
  it("goes on from where it is drawn when a report comes early", () => {
    const glide = new Glide();
    glide.report(places(8), 0);
    glide.report(places(8.0002), 200);
    glide.report(places(8.0004), 300);
    expect(glide.at(1, 300)?.[0]).toBeCloseTo(8.0001, 9);
    expect(glide.at(1, 400)?.[0]).toBeCloseTo(8.0004, 9);
  });
  it("jumps where the way is long, and forgets who is gone", () => {
    const glide = new Glide();
    glide.report(places(8), 0);
    glide.report(places(9), 200);
    expect(glide.at(1, 200)).toEqual([9, 47]);
    glide.report(new Map(), 400);
    expect(glide.at(1, 400)).toBeUndefined();
  });
});
