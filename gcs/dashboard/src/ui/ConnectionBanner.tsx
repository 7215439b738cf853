/** Large, over everything that has become old. */

import { fixed } from "../core/format";
import * as state from "../core/state";

export function ConnectionBanner() {
  const link = state.link.value;
  if (link === "live") return null;
  if (link === "connecting" && state.refused.value !== null)
    return <p class="banner quiet" role="status">This server shows nothing without a key: sign in above.</p>;
  if (link === "connecting") return <p class="banner quiet" role="status">Connecting to the server…</p>;
  const age = state.silenceS.value;
  return (
    <div class="banner lost" role="alert" data-testid="lost">
      <b>{link === "lost" ? "Connection to the server lost" : "The server sends nothing"}</b>
      <span>
        What you see is {age === null ? "old" : `${fixed(age, 0)} s old`}. Drones go on by their own rules. Trying again…
      </span>
    </div>
  );
}
