/** Why the chosen drone does what it does: what else it could do and what that would cost, and whom it attends to. */

import { bestAlternatives, explained, moveOf } from "../core/explanation";
import { fixed, percent } from "../core/format";
import * as state from "../core/state";

export function Why({ id }: { id: number }) {
  const why = state.reasons.value;
  const uav = explained(why, id);
  const plan = state.plans.value.find((one) => one.system_id === id);
  const note = state.reasonsNote.value;
  if (note !== null && (why === null || uav === null))
    return <section class="why" aria-label={`Why UAV ${id} flies so`} data-testid={`why-${id}`}><p class="note">{note}</p></section>;
  const move = uav === null ? null : moveOf(uav, plan);
  if (why === null || uav === null || plan === undefined || move === null) return null;
  const others = bestAlternatives(uav);
  return (
    <section class="why" aria-label={`Why UAV ${id} flies so`} data-testid={`why-${id}`}>
      <p>
        <b>Why</b> {why.policy} flies {fixed(move.heading_deg, 0, "°")} at {fixed(move.speed_mps, 1, " m/s")} in slot {why.slot}
        {why.horizon_slots !== null && <span class="note"> · looks {why.horizon_slots} slots ahead</span>}
      </p>
      {others.length === 0 && uav.relations.length === 0 && why.horizon_slots === null && note === null && <p class="note">This policy gives no reasons.</p>}
      {others.length === 0 && why.horizon_slots !== null && <p class="note">Every plan that was weighed in the end begins with this move.</p>}
      {others.length > 0 && (
        <table>
          <caption class="note">Instead, and what it would cost (AoI, slots)</caption>
          <tbody>
            {others.map((other) => (
              <tr key={`${other.heading_deg} ${other.speed_mps}`}>
                <th scope="row">{fixed(other.heading_deg, 0, "°")} at {fixed(other.speed_mps, 1, " m/s")}</th>
                <td>{other.worse_by >= 0 ? "+" : "−"}{fixed(Math.abs(other.worse_by), 2)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
      {uav.relations.length > 0 && (
        <p class="note">Attends to {uav.relations.map(({ user_id, weight }) => `${user_id} (${percent(weight, 1)})`).join(", ")}</p>
      )}
      {note !== null && <p class="note">{note}</p>}
    </section>
  );
}
