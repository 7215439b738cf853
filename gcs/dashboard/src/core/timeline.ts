/** Things in the order of a recording's seconds, and the one that counts at a moment. */

export interface Timed {
  atS: number;
}

/** Index of the last thing at `atS` or before; -1 before the first. */
export function lastAt(things: readonly Timed[], atS: number): number {
  let [low, high] = [0, things.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((things[middle]?.atS ?? Infinity) <= atS) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Between two values; the one that is known where the other is not. */
export const between = (a: number | null, b: number | null | undefined, share: number): number | null =>
  a === null ? (b ?? null) : b === null || b === undefined ? a : a + share * (b - a);

/** The short way round, in [0, 360). */
export const turned = (fromDeg: number, toDeg: number, share: number): number => {
  const turn = ((((toDeg - fromDeg) % 360) + 540) % 360) - 180;
  return (((fromDeg + share * turn) % 360) + 360) % 360;
};
