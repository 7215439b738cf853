/** What the map's marks mean. */

import { AOI_STEPS } from "../core/aoi";
import { explained } from "../core/explanation";
import { fixed } from "../core/format";
import * as state from "../core/state";

export function Legend() {
  const radiusM = state.area.value?.serving_radius_m ?? 0; // 0: of an area that is being drawn
  const explains = explained(state.reasons.value, state.selected.value) !== null && state.plans.value.length > 0;
  return (
    <details class="legend" open={matchMedia("(min-width: 700px)").matches}>
      <summary>Legend</summary>
      <p>Users' AoI, slots</p>
      <ul class="scale">
        {AOI_STEPS.map((step, index) => (
          <li key={step.token} title={step.label}>
            <span class="dot" style={`--dot: var(--${step.token}); --size: ${7.6 + 1.4 * index}px`} /> {step.short}
          </li>
        ))}
      </ul>
      <ul>
        {radiusM > 0 && <li><span class="line reach" /> service radius {fixed(radiusM, 0, " m")}</li>}
        <li><span class="line plan" /> planned this slot</li>
        <li><span class="line trail" /> flown</li>
        {explains && <li><span class="line why" /> attends to, by weight</li>}
        {explains && <li><span class="dot expected" /> expected there at the slot's end</li>}
        {explains && <li><span class="line other" /> alternative, and its cost</li>}
      </ul>
    </details>
  );
}
