/** Who, what, when: the campaign's state, the slot clock and how far it is. */

import { slotsAreFlown } from "../core/campaigns";
import { clock, fixed, NONE, percent } from "../core/format";
import * as state from "../core/state";
import { EmergencyStop } from "./EmergencyStop";
import { SignIn } from "./SignIn";

export function TopBar() {
  return (
    <header class="top">
      <EmergencyStop />
      <div class="brand">
        <h1>Ground control</h1>
        <Connection />
      </div>
      <SlotClock />
      <Scores />
      <SignIn />
    </header>
  );
}

function Connection() {
  const words = { connecting: "connecting…", live: "live", silent: "no data", lost: "connection lost" };
  const link = state.link.value;
  return (
    <span class={`link link-${link}`} role="status" data-testid="link">
      {words[link]}
    </span>
  );
}

function SlotClock() {
  const campaign = state.snapshot.value?.campaign ?? null;
  if (campaign === null) return <div class="slot-clock note">No campaign in the air</div>;
  const flown = slotsAreFlown(campaign.state);
  const left = campaign.slots * campaign.slot_s - campaign.slot * campaign.slot_s - campaign.slot_elapsed_s;
  return (
    <div class="slot-clock value-box" data-testid="slot-clock">
      <p>
        <b>{campaign.name}</b> <State name={campaign.state} />
        <span class="note"> {campaign.policy}</span>
      </p>
      <progress max={campaign.slots} value={campaign.slot + campaign.slot_elapsed_s / campaign.slot_s} aria-label="Progress of the campaign" />
      <p class="note one-line" title={campaign.reason}>
        slot {campaign.slot} of {campaign.slots}
        {flown && ` · ${fixed(campaign.slot_elapsed_s, 0)} of ${fixed(campaign.slot_s, 0, " s")} · ${clock(left)} left`}
        {campaign.reason !== "" && <span class="reason"> · {campaign.reason}</span>}
      </p>
    </div>
  );
}

/** A recording says first of all that it is one. */
const State = ({ name }: { name: string }) =>
  state.replaying.value ? <span class="state state-recorded" data-testid="recorded-state">recorded{name === "flying" ? "" : `, ${name}`}</span> : <span class={`state state-${name}`} data-testid="campaign-state">{name}</span>;

function Scores() {
  const metrics = state.snapshot.value?.campaign?.metrics ?? null;
  const scores: [string, string, string][] = [
    ["κ", "AoI", metrics === null ? NONE : fixed(metrics.episodic_aoi, 2)],
    ["ψ", "collected", percent(metrics?.data_collection_ratio)],
    ["ρ", "covered", percent(metrics?.user_coverage)],
    ["ζ", "energy", percent(metrics?.energy_ratio)],
  ];
  return (
    <dl class="scores value-box">
      {scores.map(([symbol, name, value]) => (
        <div key={symbol}>
          <dt>
            <i>{symbol}</i> {name}
          </dt>
          <dd>{value}</dd>
        </div>
      ))}
    </dl>
  );
}
