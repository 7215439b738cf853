/** Numbers as people read them; a dash where there is none. */

export const NONE = "–";

export const fixed = (value: number | null | undefined, digits: number, unit = ""): string =>
  value === null || value === undefined || !Number.isFinite(value) ? NONE : `${value.toFixed(digits)}${unit}`;

export const percent = (value: number | null | undefined, digits = 0): string =>
  value === null || value === undefined ? NONE : fixed(100 * value, digits, "%");

/** h:mm:ss, or m:ss below an hour. */
export function clock(seconds: number | null): string {
  if (seconds === null || !Number.isFinite(seconds)) return NONE;
  const whole = Math.max(0, Math.round(seconds));
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor((whole % 3600) / 60), whole % 60];
  const ss = String(s).padStart(2, "0");
  return h > 0 ? `${h}:${String(m).padStart(2, "0")}:${ss}` : `${m}:${ss}`;
}

/** "0.2 s ago", "17 s ago", "5 min ago": never wider than its column. */
export const ago = (seconds: number | null): string =>
  seconds === null || !Number.isFinite(seconds) ? NONE : seconds < 10 ? `${seconds.toFixed(1)} s ago` : seconds < 100 ? `${seconds.toFixed(0)} s ago` : `${(seconds / 60).toFixed(0)} min ago`;

/** "UAV 1", "UAVs 1 and 2", "UAVs 1, 2 and 3", "12 UAVs". */
export function uavNames(ids: readonly number[]): string {
  if (ids.length === 0) return "no UAV";
  if (ids.length === 1) return `UAV ${ids[0]}`;
  if (ids.length > 6) return `${ids.length} UAVs`;
  return `UAVs ${ids.slice(0, -1).join(", ")} and ${ids[ids.length - 1]}`;
}
