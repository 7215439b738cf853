import { beforeEach, describe, expect, it } from "vitest";

import * as state from "../src/core/state";
import { campaign, event, ground, snapshot, user } from "./samples";

const hello = { type: "hello", version: "0", role: "operator", actor: "me", rate_hz: 5, topics: [], campaign: ground() } as const;

beforeEach(() => {
  state.flight.area.value = null;
  state.flight.events.value = [];
  state.acknowledged.value = new Map();
  state.opened();
  state.receive({ ...hello, topics: [] }, 0);
});

describe("the page's state", () => {
  it("is live while messages come, silent after a pause, lost when the connection closes", () => {
    expect(state.link.value).toBe("live");
    state.nowMs.value = 2500;
    expect(state.link.value).toBe("silent");
    state.receive(snapshot({}), 2600);
    expect(state.link.value).toBe("live");
    state.closed();
    expect(state.link.value).toBe("lost");
    expect(state.live.value).toBe(false);
  });
  it("keeps the users until new ones come", () => {
    state.receive(snapshot({ campaign: campaign({ users: [user({})], users_slot: 0 }) }), 1);
    state.receive(snapshot({ campaign: campaign({ users: null, users_slot: 0 }) }), 2);
    expect(state.users.value).toHaveLength(1);
  });
  it("forgets curves, users and trails when another campaign begins, not when the same is told again", () => {
    state.receive(snapshot({ campaign: campaign({ users: [user({})], users_slot: 0 }) }), 1);
    state.receive({ type: "campaign", campaign: ground() }, 2);
    expect(state.users.value).toHaveLength(1);
    state.receive({ type: "campaign", campaign: ground({ campaign_id: "c2" }) }, 3);
    expect([state.users.value, state.points.value, state.trails.value.size]).toEqual([[], [], 0]);
  });
  it("takes an event once, newest first, and counts those that it missed", () => {
    for (const sequence of [4, 5, 5, 8]) state.receive(event({ sequence }), sequence);
    expect(state.events.value.map((one) => one.sequence)).toEqual([8, 5, 4]);
    expect(state.missedEvents.value).toBe(2);
  });
  it("begins the log anew with another server, and not when the same one tells again", () => {
    for (const sequence of [1, 2, 3]) state.receive(event({ sequence, message: `before ${sequence}` }), sequence);
    state.receive(event({ sequence: 2, message: "before 2" }), 4);
    expect(state.events.value).toHaveLength(3);
    state.receive(event({ sequence: 2, message: "after" }), 5);
    expect(state.events.value.map((one) => one.message)).toEqual(["after"]);
  });
  it("never drops a warning for harmless events", () => {
    state.receive(event({ sequence: 1, severity: "warning" }), 1);
    for (let k = 2; k < 2 * state.KEPT_EVENTS; k++) state.receive(event({ sequence: k, severity: "info" }), k);
    expect(state.events.value).toHaveLength(state.KEPT_EVENTS);
    expect(state.events.value.at(-1)?.sequence).toBe(1);
  });
  it("offers flying to operators and not to viewers", () => {
    expect(state.mayFly.value).toBe(true);
    state.receive({ ...hello, role: "viewer", topics: [] }, 9);
    expect(state.mayFly.value).toBe(false);
  });
});
