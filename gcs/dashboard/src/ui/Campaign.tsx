/** Create from a mission, start, pause, resume, abort. What moves drones has to be held and says how many it reaches. */

import { effect, signal } from "@preact/signals";
import { useEffect } from "preact/hooks";

import type { CampaignAct, CampaignInfo, MissionBody, MissionFile, PolicyInfo } from "../core/api";
import { api } from "../core/app";
import { allowed, isOver } from "../core/campaigns";
import { begin, dryRun } from "../core/dryRuns";
import * as drafting from "../core/drafting";
import { uavNames } from "../core/format";
import { addressOf, recording } from "../core/replaying";
import * as state from "../core/state";
import { DraftEditor } from "./DraftEditor";
import { DryRunResult } from "./DryRunResult";
import { HoldButton } from "./HoldButton";
import { PolicyCard } from "./PolicyCard";
import { Preflight, preflightOf } from "./Preflight";

const missions = signal<readonly MissionFile[]>([]);
const policies = signal<readonly PolicyInfo[]>([]);
const campaigns = signal<readonly CampaignInfo[]>([]);
const mission = signal("");
const policy = signal("");
const checkpoint = signal(""); // file name; empty: the policy's own
const name = signal("drawn"); // of a campaign with an area of its own
const chosen = signal<string | null>(null);
/** `whileIn`: states in which it is still true. */
const message = signal<{ text: string; good: boolean; whileIn?: readonly string[] } | null>(null);

const say = (text: string, good: boolean, whileIn?: readonly string[]): void => void (message.value = { text, good, ...(whileIn && { whileIn }) });

async function refresh(): Promise<void> {
  const [files, methods, known] = await Promise.all([api.missions(), api.policies(), api.campaigns()]);
  if (files.ok) missions.value = files.value;
  if (methods.ok) policies.value = methods.value;
  if (known.ok) campaigns.value = known.value;
  if (mission.value === "") mission.value = missions.value.find((file) => file.error === null)?.name ?? "";
}

async function show(id: string): Promise<void> {
  chosen.value = id;
  if (recording.value !== null) return void (location.hash = addressOf(id)); // from one replay to another
  const answer = await api.campaign(id);
  if (answer.ok && chosen.value === id) state.preview(answer.value.static);
}

/** What the form says. */
function wanted(): MissionBody {
  if (drafting.draft.value !== null) return drafting.drawnDocument(drafting.draft.value, name.value, policy.value, checkpoint.value);
  return {
    mission: mission.value,
    ...(policy.value === "" ? {} : { policy: policy.value }),
    ...(checkpoint.value === "" ? {} : { checkpoint: checkpoint.value }),
  };
}

async function create(event: Event): Promise<void> {
  event.preventDefault();
  const answer = await api.create(wanted());
  if (!answer.ok) return say(answer.reason, false);
  say(`${answer.value.name} created`, true);
  drafting.close();
  await Promise.all([refresh(), show(answer.value.id)]);
}

const DONE: Record<CampaignAct, readonly [string, readonly string[]]> = {
  start: ["Starting", ["ready", "launching"]],
  pause: ["Paused: the UAVs hold", ["paused"]],
  resume: ["Flying on", ["flying"]],
  abort: ["Aborted: the UAVs return", ["recovering"]],
};

async function act(id: string, what: CampaignAct, override = false): Promise<void> {
  const answer = await api.act(id, what, override);
  if (answer.ok) say(DONE[what][0], true, DONE[what][1]);
  else say(answer.reason, false);
  await refresh();
}

/** The campaign that the buttons act on: the one in the air, else the chosen or newest one. */
function current(): CampaignInfo | null {
  const flown = state.flight.snapshot.value?.campaign ?? null;
  const wanted = recording.value?.campaign.campaign_id ?? chosen.value ?? flown?.campaign_id ?? null;
  const known = campaigns.value.find((campaign) => campaign.id === wanted) ?? null;
  if (flown === null || flown.campaign_id !== wanted) return known;
  return { id: flown.campaign_id, name: flown.name, policy: flown.policy, state: flown.state, slot: flown.slot, slots: flown.slots, reason: flown.reason };
}

function listen(): () => void {
  let before = "";
  return effect(() => {
    const flown = state.flight.snapshot.value?.campaign;
    const now = `${state.hello.value?.actor}|${flown?.campaign_id}|${flown?.state}|${recording.value?.campaign.campaign_id}`;
    if (state.hello.value === null || now === before) return;
    before = now;
    if (flown != null && !isOver(flown.state)) chosen.value = flown.campaign_id;
    void refresh();
  });
}

export function Campaign() {
  useEffect(listen, []);
  const campaign = current();
  return (
    <section class="panel campaign" aria-label="Campaign">
      <h2>Campaign</h2>
      {campaigns.value.length > 0 && (
        <p class="row">
          <label for="campaign-choice">Campaign</label>
          <select id="campaign-choice" value={campaign?.id ?? ""} onChange={(event) => void show(event.currentTarget.value)}>
            {campaign === null && <option value="">none chosen</option>}
            {campaigns.value.map((one) => (
              <option key={one.id} value={one.id}>
                {one.name} · {one.policy} · {one.id === campaign?.id ? campaign.state : one.state}
              </option>
            ))}
          </select>
        </p>
      )}
      {campaign !== null && campaign.reason !== "" && <p class={`verdict${campaign.state === "failed" ? " bad" : ""}`}><b>{campaign.state}</b>: {campaign.reason}</p>}
      {campaign !== null && !state.replaying.value && <Controls campaign={campaign} />}
      {campaign !== null && (campaign.slot > 0 || isOver(campaign.state)) && <Afterwards campaign={campaign} />}
      {message.value !== null && !state.replaying.value && (message.value.whileIn?.includes(campaign?.state ?? "") ?? true) && <p class={`verdict${message.value.good ? "" : " bad"}`} role="status">{message.value.text}</p>}
      <DryRunResult />
      {state.replaying.value ? null : state.mayFly.value ? <Create /> : <p class="note">Sign in with an operator's key to create and fly campaigns.</p>}
    </section>
  );
}

function Controls({ campaign }: { campaign: CampaignInfo }) {
  const reached = uavNames(state.flight.snapshot.value?.vehicles.map((vehicle) => vehicle.system_id) ?? []);
  const waiting = allowed("start", campaign.state) && !state.inTheAir.value;
  const red = waiting ? (preflightOf(campaign.id)?.red.length ?? 0) : 0;
  const may = (what: CampaignAct): boolean =>
    state.mayFly.value && state.live.value && allowed(what, campaign.state) && (what !== "start" || red === 0);
  const hold = (what: CampaignAct, label: string, explain: string, danger = false) => (
    <HoldButton label={label} explain={explain} danger={danger} disabled={!may(what)} onDone={() => void act(campaign.id, what)} />
  );
  return (
    <>
      {state.mayFly.value && <div class="orders" role="group" aria-label={`Controls of ${campaign.name}`}>
        {hold("start", "Start", `Start ${campaign.name}: ${reached} take off`)}
        <button type="button" disabled={!may("pause")} title={`${reached} hold where they are`} onClick={() => void act(campaign.id, "pause")}>
          Pause
        </button>
        {hold("resume", "Resume", `Resume ${campaign.name}: ${reached} fly on`)}
        {hold("abort", "Abort: return all", `Abort: return all of ${campaign.name}: ${reached} fly home in their layers and land`, true)}
      </div>}
      {waiting && <Preflight id={campaign.id} />}
      {red > 0 && state.hello.value?.role === "admin" && (
        <HoldButton
          label={`Start in spite of ${red} red ${red === 1 ? "line" : "lines"}`} danger disabled={!state.live.value}
          explain={`${reached} take off for ${campaign.name}; it is recorded in your name`} onDone={() => void act(campaign.id, "start", true)}
        />
      )}
      {campaign.slot === 0 && !isOver(campaign.state) && state.mayFly.value && (
        <button type="button" disabled={!mayDryRun()} onClick={() => void begin({ campaign: campaign.id }, campaign.id)}>
          Dry run of {campaign.name}
        </button>
      )}
    </>
  );
}

/** What a campaign leaves behind: its report and, once it is over, its replay. */
function Afterwards({ campaign }: { campaign: CampaignInfo }) {
  return (
    <p class="links">
      {campaign.slot > 0 && <a href={api.reportUrl(campaign.id)} target="_blank" rel="noreferrer">Report of {campaign.name}</a>}
      {!state.inTheAir.value && <a href={addressOf(campaign.id)}>Replay {campaign.name}</a>}
    </p>
  );
}

/** Off until somebody wants another area than the mission's. */
function DrawnArea() {
  const draft = drafting.draft.value;
  if (draft === null)
    return (
      <p class="orders">
        <button type="button" disabled={mission.value === "" || drafting.mapTaken.value} title={drafting.mapTaken.value ? "the map shows the campaign in the air" : ""} onClick={() => void drafting.open(mission.value)}>
          Change the area
        </button>
      </p>
    );
  return (
    <>
      <p class="row">
        <label for="draft-name">Name</label>
        <input id="draft-name" value={name.value} maxLength={100} required onInput={(event) => (name.value = event.currentTarget.value)} />
      </p>
      <DraftEditor draft={draft} />
      <p class="orders"><button type="button" onClick={drafting.close}>Keep the mission's own area</button></p>
    </>
  );
}

const mayDryRun = (): boolean => state.mayFly.value && state.live.value && dryRun.value?.state !== "running";

function choosePolicy(name: string): void {
  policy.value = name;
  checkpoint.value = ""; // of the policy before
}

/** Which trained model flies; there is something to choose only where a policy learns. */
function CheckpointChoice({ chosen }: { chosen: PolicyInfo | undefined }) {
  if (chosen === undefined || !chosen.learned || chosen.checkpoints.length === 0) return null;
  return (
    <p class="row">
      <label for="checkpoint-choice">Model</label>
      <select id="checkpoint-choice" value={checkpoint.value} onChange={(event) => (checkpoint.value = event.currentTarget.value)}>
        <option value="">as the policy has it</option>
        {chosen.checkpoints.map((one) => <option key={one.file} value={one.file}>{one.file}</option>)}
      </select>
    </p>
  );
}

function Create() {
  const file = missions.value.find((one) => one.name === mission.value);
  const chosenPolicy = policies.value.find((one) => one.name === (policy.value || file?.policy));
  return (
    <details open={campaigns.value.length === 0}>
      <summary>New campaign</summary>
      <form onSubmit={(event) => void create(event)}>
        <p class="row">
          <label for="mission-choice">Mission</label>
          <select id="mission-choice" value={mission.value} disabled={drafting.draft.value !== null} onChange={(event) => (mission.value = event.currentTarget.value)}>
            {missions.value.map((one) => (
              <option key={one.name} value={one.name} disabled={one.error !== null}>
                {one.name}
                {one.uavs !== null && ` · ${one.uavs} UAVs, ${one.slots} slots`}
                {one.error !== null && " · cannot be flown"}
              </option>
            ))}
          </select>
        </p>
        <p class="row">
          <label for="policy-choice">Policy</label>
          <select id="policy-choice" value={policy.value} onChange={(event) => choosePolicy(event.currentTarget.value)}>
            <option value="">as in the mission{file?.policy ? ` (${file.policy})` : ""}</option>
            {policies.value.map((one) => (
              <option key={one.name} value={one.name}>
                {one.name}
              </option>
            ))}
          </select>
        </p>
        <CheckpointChoice chosen={chosenPolicy} />
        {file?.warnings.map((text) => <p key={text} class="caution">{text}</p>)}
        <DrawnArea />
        <PolicyCard policy={chosenPolicy} file={checkpoint.value} />
        <div class="orders">
          <button type="button" disabled={mission.value === "" || !mayDryRun()} onClick={() => void begin(wanted(), null)}>
            Dry run
          </button>
          <button type="submit" disabled={mission.value === "" || !state.live.value}>
            Create
          </button>
        </div>
      </form>
    </details>
  );
}
