/** When to sound: once for what is new, again and again for a warning that nobody has taken note of. */

import type { Alert } from "./alerts";
import type { Severity } from "./types";

export type Tone = Exclude<Severity, "info">;
export const REPEAT_MS = 8000;

export class Bell {
  private known = new Set<string>();
  private lastMs = -Infinity;

  /** The tone to play now, if any. A mute silences cautions; warnings sound in spite of it. */
  ring(alerts: readonly Alert[], muted: boolean, nowMs: number): Tone | null {
    const fresh = alerts.filter((alert) => !this.known.has(alert.key));
    this.known = new Set(alerts.map((alert) => alert.key));
    const unnoted = alerts.some((alert) => alert.severity === "warning" && alert.sequence !== null);
    const again = unnoted && nowMs - this.lastMs >= REPEAT_MS;
    const tone = fresh.some((alert) => alert.severity === "warning") || again ? "warning" : null;
    const chosen = tone ?? (!muted && fresh.some((alert) => alert.severity === "caution") ? "caution" : null);
    if (chosen === "warning") this.lastMs = nowMs;
    return chosen;
  }
}

interface Beep {
  hz: number;
  at: number; // seconds from now
}

const BEEPS: Record<Tone, readonly Beep[]> = {
  warning: [{ hz: 880, at: 0 }, { hz: 660, at: 0.2 }, { hz: 880, at: 0.4 }],
  caution: [{ hz: 520, at: 0 }],
};
const BEEP_S = 0.16;
const LOUDNESS = 0.25;

/** Tones made by the browser itself: no file to load. Browsers keep quiet until the page was touched once. */
export class Speaker {
  private context: AudioContext | null = null;

  play(tone: Tone): void {
    this.context ??= new AudioContext();
    void this.context.resume();
    for (const beep of BEEPS[tone]) this.beep(this.context, beep);
  }

  private beep(context: AudioContext, { hz, at }: Beep): void {
    const begin = context.currentTime + at;
    const [oscillator, gain] = [context.createOscillator(), context.createGain()];
    oscillator.frequency.value = hz;
    gain.gain.setValueAtTime(LOUDNESS, begin);
    gain.gain.exponentialRampToValueAtTime(0.001, begin + BEEP_S);
    oscillator.connect(gain).connect(context.destination);
    oscillator.start(begin);
    oscillator.stop(begin + BEEP_S);
  }
}
