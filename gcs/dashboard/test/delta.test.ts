import { describe, expect, it } from "vitest";

import { merged } from "../src/core/delta";
import { campaign, snapshot, user, vehicle } from "./samples";

describe("a snapshot from changes", () => {
  const before = snapshot({ vehicles: [vehicle({}), vehicle({ system_id: 2 })], campaign: campaign({ users: [user({})], slot: 3 }) });
  it("takes what changed and keeps the rest, the very same objects where nothing did", () => {
    const now = merged(before, { type: "delta", changed: { tick: 9, stopped: true }, vehicles: [{ system_id: 2, east_m: 7 }], campaign: { slot: 4 } });
    expect([now.tick, now.stopped, now.campaign?.slot, now.campaign?.name]).toEqual([9, true, 4, "demo"]);
    expect(now.vehicles[0]).toBe(before.vehicles[0]);
    expect(now.vehicles[1]).toEqual({ ...before.vehicles[1], east_m: 7 });
  });
  it("has users only when they were told anew", () => {
    expect(merged(before, { type: "delta", changed: {}, vehicles: [], campaign: {} }).campaign?.users).toBeNull();
    expect(merged(before, { type: "delta", changed: {}, vehicles: [], campaign: { users: [] } }).campaign?.users).toEqual([]);
  });
  it("stays without a campaign where there was none", () => {
    expect(merged(snapshot({}), { type: "delta", changed: {}, vehicles: [], campaign: {} }).campaign).toBeNull();
  });
});
