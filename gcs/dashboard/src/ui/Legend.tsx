/** What the map's marks mean. */

import { AOI_STEPS } from "../core/aoi";
import { fixed } from "../core/format";
import * as state from "../core/state";

export function Legend() {
  return (
    <details class="legend" open={matchMedia("(min-width: 700px)").matches}>
      <summary>Legend</summary>
      <p>Users' AoI, slots</p>
      <ul>
        {AOI_STEPS.map((step, index) => (
          <li key={step.token}>
            <span class="dot" style={`--dot: var(--${step.token}); --size: ${7.6 + 1.4 * index}px`} /> {step.label}
          </li>
        ))}
      </ul>
      <ul>
        <li><span class="line reach" /> service radius {fixed(state.area.value?.serving_radius_m || null, 0, " m")}</li>
        <li><span class="line plan" /> planned this slot</li>
        <li><span class="line trail" /> flown</li>
        {state.selected.value !== null && <li><span class="line why" /> attends to, by weight</li>}
        {state.selected.value !== null && <li><span class="dot expected" /> expected there at the slot's end</li>}
        {state.selected.value !== null && <li><span class="line other" /> alternative, and its cost</li>}
      </ul>
    </details>
  );
}
