/**
 * The page. What is old is greyed as a whole when the server is silent. Alerts come and go beside the map, so that no
 * button moves under a hand.
 */

import { MapPanel } from "../map/MapPanel";
import * as state from "../core/state";
import { Alerts, RecordedAlerts } from "./Alerts";
import { Campaign } from "./Campaign";
import { ConnectionBanner } from "./ConnectionBanner";
import { Curves } from "./Curves";
import { Events } from "./Events";
import { Fleet } from "./Fleet";
import { HeldNames } from "./HoldButton";
import { ReplayBar } from "./ReplayBar";
import { TopBar } from "./TopBar";

export function App() {
  return (
    <div class={`page${state.current.value ? "" : " old"}${state.replaying.value ? " recorded" : ""}`}>
      <TopBar />
      <ConnectionBanner />
      <ReplayBar />
      <main>
        <div class="left">
          <Alerts />
          <RecordedAlerts />
          <MapPanel />
          <Curves />
        </div>
        <div class="right">
          <Campaign />
          <Fleet />
          <Events />
        </div>
      </main>
      <HeldNames />
    </div>
  );
}
