/** How many users wait how long, now. */

import { AOI_STEPS } from "../core/aoi";
import { aoiHistogram, histogramText } from "../core/histogram";
import * as state from "../core/state";

export function Histogram() {
  const bins = aoiHistogram(state.users.value);
  const most = Math.max(1, ...bins.map((bin) => bin.count));
  return (
    <figure>
      <figcaption>Users by AoI, slots</figcaption>
      <div class="bars" role="img" aria-label={`Users by age of information: ${histogramText(bins)}`} data-testid="histogram" data-users={state.users.value.length}>
        {bins.map((bin) => (
          <div key={bin.label} class="bar">
            <span class="bar-count">{bin.count > 0 ? bin.count : ""}</span>
            <span class="bar-fill" style={`height: ${(62 * bin.count) / most}px; background: var(--${AOI_STEPS[bin.step]?.token})`} />
            <span class="bar-label" title={bin.label}>{bin.short}</span>
          </div>
        ))}
      </div>
    </figure>
  );
}
