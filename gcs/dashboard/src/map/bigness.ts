/** How much larger marks on the map are drawn on a wide screen, which is looked at from farther away. */

const STEPS: readonly [number, number][] = [[3400, 1.8], [2400, 1.3]]; // pixels of width from which on

export const bignessOf = (width: number): number => STEPS.find(([from]) => width >= from)?.[1] ?? 1;

let now = 1;

/** Of the present window; known to who draws without asking for the page's layout. */
export const bigness = (): number => now;

/** Look at the window again; true when marks have another size now. */
export function measured(): boolean {
  const before = now;
  now = bignessOf(innerWidth);
  return now !== before;
}
