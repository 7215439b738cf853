import { describe, expect, it } from "vitest";

import { allAlerts, grouped } from "../src/core/alerts";
import { batteryAlert, batteryText } from "../src/core/battery";
import { cardLines } from "../src/core/card";
import { withCheckpoint, withPolicy } from "../src/core/draft";
import { eventsMatching } from "../src/core/eventFilter";
import { mark, marked, ORDERS } from "../src/core/marking";
import { checklist, nameOf, verdictOf } from "../src/core/preflight";
import * as state from "../src/core/state";
import { vectorLayers } from "../src/map/vectorLayers";
import { event, snapshot, vehicle } from "./samples";

describe("the battery", () => {
  it("is judged by the way home in the air, and by its charge anywhere", () => {
    const alert = (have: number | null, home: number | null, landed = "in_air") => batteryAlert(vehicle({ battery_fraction: have, return_fraction: home, landed }));
    expect(alert(0.5, 0.2)).toBeNull();
    expect(alert(0.5, 0.55)?.[0]).toBe("warning");
    expect(alert(0.5, 0.45)).toEqual(["caution", "battery at 50%, the way home takes 45%: return soon"]);
    expect(alert(0.5, 0.55, "on_ground")).toBeNull();
    expect(alert(0.1, null)).toEqual(["warning", "battery at 10%"]);
    expect(alert(0.2, 0.01)?.[0]).toBe("caution");
    expect(alert(null, 0.5)).toBeNull();
  });
  it("says what the way home takes where it is known", () => {
    expect([batteryText(0.82, 0.05), batteryText(0.82, null), batteryText(null, null)]).toEqual(["82%, 5% to return", "82%", "–"]);
  });
});

describe("the pre-flight checklist", () => {
  const line = (system_id: number, check: string, grade: "ok" | "caution" | "red") => ({ system_id, check, grade, reason: "why" });
  it("puts what forbids the start first and counts the rest", () => {
    const list = checklist({ ok: false, lines: [line(1, "link", "ok"), line(1, "home", "caution"), line(2, "link", "red"), line(2, "home", "ok")] });
    expect([list.red.length, list.cautions.length, list.good, list.uavs]).toEqual([1, 1, 2, 2]);
    expect(verdictOf(list)).toBe("Not ready: 1 of 4 checks are red");
  });
  it("says so when all is well, and names a drone that nobody has heard", () => {
    expect(verdictOf(checklist({ ok: true, lines: [line(1, "link", "ok"), line(1, "home", "caution")] }))).toBe("Ready: 2 checks of 1 UAV, none red, 1 to know");
    expect([nameOf(line(0, "link", "red")), nameOf(line(3, "link", "ok"))]).toEqual(["A missing UAV", "UAV 3"]);
  });
});

describe("orders to several", () => {
  it("reach those marked that are there, and name them", () => {
    state.receive(snapshot({ vehicles: [1, 2, 3].map((system_id) => vehicle({ system_id })) }), 1);
    mark([1, 3, 9], true);
    expect(marked.value).toEqual([1, 3]);
    mark([3], false);
    expect(marked.value).toEqual([1]);
    state.receive(snapshot({ vehicles: [vehicle({ system_id: 2 })] }), 2);
    expect(marked.value).toEqual([]);
    for (const order of ORDERS) expect(order.explain("UAVs 1 and 3")).toContain("UAVs 1 and 3");
  });
});

describe("alerts that say the same", () => {
  it("become one line at the newest one's place, and keep every event to be acknowledged", () => {
    const late = (sequence: number) => event({ sequence, time_s: sequence, severity: "caution", message: "late", system_id: null });
    const groups = grouped(allAlerts(snapshot({ vehicles: [] }), [late(9), event({ sequence: 8, message: "lost", system_id: 2 }), late(7), late(3)], new Map([[3, "ann"]])));
    expect(groups.map((group) => [group.text, group.notes.map((note) => note.sequence)])).toEqual([["lost", [8]], ["late", [9, 7]]]);
  });
  it("are not joined over drones or severities, and conditions stay as they are", () => {
    const alerts = allAlerts(snapshot({ vehicles: [1, 2].map((system_id) => vehicle({ system_id, battery_fraction: 0.1 })) }), [event({ sequence: 1, system_id: 1 }), event({ sequence: 2, system_id: 2 })], new Map());
    expect(grouped(alerts)).toHaveLength(4);
    expect(grouped(alerts).filter((group) => group.notes.length === 0)).toHaveLength(2);
  });
});

describe("an alert that repeats itself", () => {
  const late = (sequence: number, slot: number, took: number) =>
    event({ sequence, time_s: 10 * sequence, kind: "plan.late", severity: "caution", message: `slot ${slot}: no decision ${took} s into the slot; the drones hold`, system_id: null });
  const groups = (told: ReturnType<typeof late>[], done: number[] = []) => grouped(allAlerts(null, told, new Map(done.map((one) => [one, "ann"]))));
  it("is one line with the newest words, whatever its figures, and names its number and last time", () => {
    const [one, ...others] = groups([late(9, 7, 2.4), late(7, 6, 2.1), late(3, 5, 2.0)]);
    expect([one?.text.slice(0, 7), one?.notes.length, one?.notes[0]?.timeS, others.length]).toEqual(["slot 7:", 3, 90, 0]);
  });
  it("comes back when it occurs again after it was acknowledged", () => {
    expect(groups([late(7, 6, 2.1), late(3, 5, 2.0)], [3, 7])).toEqual([]);
    expect(groups([late(9, 7, 2.4), late(7, 6, 2.1), late(3, 5, 2.0)], [3, 7])[0]?.notes).toEqual([{ sequence: 9, timeS: 90 }]);
  });
  it("is not joined with what another drone or another number of drones does", () => {
    const about = (sequence: number, message: string) => event({ sequence, message, system_id: null });
    expect(groups([about(3, "drone 3 is near drone 1"), about(2, "drone 2 is near drone 1"), about(1, "2 drones hold")])).toHaveLength(3);
  });
  it("never pushes out a warning that nobody has acknowledged", () => {
    const first = 10_000;
    state.receive(event({ sequence: first, message: "UAV 4 is lost", system_id: 4 }), 1);
    state.receive(event({ sequence: first + 1, severity: "caution", message: "another caution", system_id: null }), 1);
    for (let k = 2; k < state.KEPT_EVENTS + 300; k++) state.receive(late(first + k, k, 2), 1);
    expect(state.flight.events.value).toHaveLength(state.KEPT_EVENTS);
    const texts = grouped(state.alerts.value).map((alert) => alert.text);
    expect(texts).toContain("UAV 4 is lost");
    expect(texts).toContain("another caution");
  });
});

describe("the log's filter", () => {
  const log = [event({ sequence: 1, severity: "info", kind: "api.start", message: "start asked for", actor: "ann", system_id: null }), event({ sequence: 2, message: "no heartbeat", system_id: 2 })];
  it("wants every word, in the line, its kind, its author or its drone", () => {
    const found = (words: string, least: "info" | "warning" = "info") => eventsMatching(log, least, words).map((one) => one.sequence);
    expect([found(""), found("ann"), found("START ann"), found("uav 2"), found("ann 2"), found("link.lost"), found("", "warning")])
      .toEqual([[1, 2], [1], [1], [2], [], [2], [2]]);
  });
});

describe("a model's card", () => {
  it("tells the telling facts first, in words, and leaves out what is nested", () => {
    const lines = cardLines({ zeta: 1, shapes: { a: 1 }, data: "walkers", episodic_aoi_last_20: 4.87992, method: "GCRL" });
    expect(lines).toEqual([{ name: "method", text: "GCRL" }, { name: "learned from", text: "walkers" }, { name: "AoI, last 20 episodes", text: "4.88" }, { name: "zeta", text: "1" }]);
    expect(cardLines(null)).toEqual([]);
  });
  it("goes into a drawn mission beside the policy, and not after another policy was chosen", () => {
    const document = { policy: { name: "gcrl", checkpoint: "old" } };
    expect(withCheckpoint(withPolicy(document, "gcrl"), "new.safetensors")).toEqual({ policy: { name: "gcrl", checkpoint: "new.safetensors" } });
    expect(withCheckpoint(withPolicy(document, "random"), "")).toEqual({ policy: { name: "random" } });
  });
});

describe("vector tiles", () => {
  it("need no letters and no pictures from anywhere", () => {
    const layers = vectorLayers("tiles", (token) => `#${token}`);
    expect(layers.map((layer) => layer.type).filter((type) => type === "symbol")).toEqual([]);
    expect(JSON.stringify(layers)).toContain("#map-water");
  });
});

describe("a replay", () => {
  const recorded = { area: null, snapshot: snapshot({ vehicles: [vehicle({ system_id: 9 })] }), users: [], trails: new Map(), plans: [], points: [], events: [], reasons: null, reasonsNote: null, reported: true, acknowledged: new Map() };
  it("is shown in the flight's place, and hides neither the flight's alerts nor its end", () => {
    state.opened();
    state.receive(snapshot({ vehicles: [vehicle({ system_id: 1, heartbeat_age_s: 60 })] }), 10);
    state.replayed.value = recorded;
    expect(state.snapshot.value?.vehicles[0]?.system_id).toBe(9);
    expect(state.alerts.value.map((alert) => alert.systemId)).toContain(1);
    state.receive(snapshot({ vehicles: [vehicle({ system_id: 2 })] }), 11);
    expect(state.flight.snapshot.value?.vehicles[0]?.system_id).toBe(2);
    expect(state.current.value).toBe(true);
    state.replayed.value = null;
    expect(state.snapshot.value?.vehicles[0]?.system_id).toBe(2);
  });
});
