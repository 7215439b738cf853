/** Where a policy's model comes from: its checkpoint's own card. */

import type { PolicyInfo } from "../core/api";
import { fixed } from "../core/format";

const LONGEST = 300;

export function PolicyCard({ policy }: { policy: PolicyInfo | undefined }) {
  const checkpoint = policy?.checkpoints[0];
  if (policy === undefined || !policy.learned || checkpoint === undefined) return null;
  const facts = Object.entries(checkpoint.provenance ?? {}).filter(([, value]) => value === null || typeof value !== "object");
  return (
    <details class="card">
      <summary>Model of {policy.name}: {checkpoint.file}</summary>
      {facts.length === 0 && <p class="note">Nothing is recorded about where it comes from.</p>}
      <dl>
        {facts.map(([name, value]) => (
          <div key={name}>
            <dt>{name.replaceAll("_", " ")}</dt>
            <dd>{told(value)}</dd>
          </div>
        ))}
      </dl>
    </details>
  );
}

const told = (value: unknown): string =>
  typeof value === "number" && !Number.isInteger(value) ? fixed(value, 4) : String(value).slice(0, LONGEST);
