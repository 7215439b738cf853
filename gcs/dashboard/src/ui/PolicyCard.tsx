/** Where a policy's model comes from: its checkpoint's own card. */

import type { PolicyInfo } from "../core/api";
import { cardLines } from "../core/card";

/** `file`: the chosen checkpoint; empty for the policy's own, which is its first. */
export function PolicyCard({ policy, file }: { policy: PolicyInfo | undefined; file: string }) {
  const checkpoint = policy?.checkpoints.find((one) => one.file === file) ?? policy?.checkpoints[0];
  if (policy === undefined || !policy.learned || checkpoint === undefined) return null;
  const lines = cardLines(checkpoint.provenance);
  return (
    <details class="card" data-testid="policy-card">
      <summary>Card of {checkpoint.file}</summary>
      {lines.length === 0 && <p class="note">Nothing is recorded about where it comes from.</p>}
      <dl>
        {lines.map(({ name, text }) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd>{text}</dd>
          </div>
        ))}
      </dl>
    </details>
  );
}
