/** Time slider and speed of a recording. In a colour of its own and always in sight, so that nobody takes it for live. */

import { clock } from "../core/format";
import { SPEED_STEPS, wallMs, type Recording } from "../core/recording";
import * as replaying from "../core/replaying";

export function ReplayBar() {
  const { recording, loading, notice } = replaying;
  if (recording.value === null)
    return loading.value || notice.value !== null ? (
      <p class="banner quiet" role="status" data-testid="replay-notice">
        {loading.value ? "Opening the recording…" : notice.value}{" "}
        {!loading.value && <button type="button" onClick={() => replaying.leave(null)}>Close</button>}
      </p>
    ) : null;
  return (
    <section class="replay" aria-label="Replay" data-testid="replay" data-position={replaying.slot.value.toFixed(2)} data-at-s={replaying.position.value.toFixed(1)} data-samples={replaying.samples.value.length} data-frames={replaying.frames.value.length}>
      <Title recording={recording.value} />
      <Buttons />
      <Slider recording={recording.value} />
      <Speed />
      <button type="button" onClick={() => replaying.leave(null)}>Leave replay</button>
      {notice.value !== null && <p class="verdict bad" role="alert">{notice.value}</p>}
    </section>
  );
}

function Title({ recording }: { recording: Recording }) {
  const wall = wallMs(recording, replaying.position.value);
  return (
    <p class="replay-title">
      <b>Replay</b>
      <span>{wall === null ? "not live" : new Date(wall).toLocaleString()}</span>
    </p>
  );
}

function Buttons() {
  const { playing, nextAlarm } = replaying;
  const alarm = nextAlarm.value;
  return (
    <div class="replay-buttons" role="group" aria-label="Play">
      <button type="button" aria-label="To the beginning" title="To the beginning" onClick={() => replaying.seek(0)}>|◂</button>
      <button type="button" aria-label="One slot back" title="One slot back" onClick={() => replaying.stepSlot(-1)}>◂</button>
      <button type="button" class="primary" aria-label={playing.value ? "Pause the replay" : "Play"} onClick={replaying.toggle}>{playing.value ? "❚❚" : "▶"}</button>
      <button type="button" aria-label="One slot on" title="One slot on" onClick={() => replaying.stepSlot(1)}>▸</button>
      <button type="button" disabled={alarm === null} title={alarm?.message ?? "No caution or warning from here on"} onClick={() => alarm !== null && replaying.seek(alarm.at_s)}>
        Next alert
      </button>
    </div>
  );
}

function Slider({ recording }: { recording: Recording }) {
  const { position, end, slot } = replaying;
  const whole = Math.max(1, recording.length_s);
  const marks = recording.events.filter((event) => event.severity !== "info");
  return (
    <div class="replay-time">
      <input
        type="range" aria-label="Time of the replay, seconds" min={0} max={Math.ceil(whole)} step={1} value={position.value}
        aria-valuetext={`${clock(position.value)} of ${clock(recording.length_s)}, slot ${Math.floor(slot.value)} of ${recording.campaign.slots}`}
        onInput={(event) => replaying.seek(event.currentTarget.valueAsNumber)}
      />
      <div class="replay-marks" aria-hidden="true">
        {marks.map((event) => <i key={event.sequence} class={event.severity} style={`left: ${(100 * event.at_s) / whole}%`} />)}
      </div>
      <span class="note">{clock(position.value)} of {clock(end.value)} · slot {Math.floor(slot.value)}{recording.samples === 0 && " · recorded at the ends of slots only"}</span>
    </div>
  );
}

function Speed() {
  const { speed, speedStep } = replaying;
  return (
    <label class="replay-speed">
      <span class="note">Speed <b data-testid="replay-speed">{speed.value}×</b></span>
      <input
        type="range" min={0} max={SPEED_STEPS} step={1} value={speedStep.value} aria-label="Speed of the replay" aria-valuetext={`${speed.value} times real time`}
        onInput={(event) => (speedStep.value = event.currentTarget.valueAsNumber)}
      />
    </label>
  );
}
