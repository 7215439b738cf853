/** The pre-flight checklist of the whole fleet, asked for again and again while a campaign waits for its start. */

import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";

import type { Preflight as Lines, PreflightLine } from "../core/api";
import { api } from "../core/app";
import { checklist, nameOf, verdictOf, type Checklist } from "../core/preflight";

const POLL_MS = 1500;

/** Of which campaign, and what was found; old findings are never shown for another campaign. */
const found = signal<{ id: string; lines: Lines } | null>(null);

export const preflightOf = (id: string): Checklist | null => (found.value?.id === id ? checklist(found.value.lines) : null);

export function Preflight({ id }: { id: string }) {
  useEffect(() => watch(id), [id]);
  const list = preflightOf(id);
  if (list === null) return <p class="note" role="status">Checking the fleet…</p>;
  const shown = [...list.red, ...list.cautions];
  return (
    <section class="preflight" aria-label="Pre-flight checklist" data-testid="preflight" data-red={list.red.length}>
      <p class={`preflight-verdict ${list.red.length > 0 ? "warning" : "good"}`} role="status">{verdictOf(list)}</p>
      {shown.length > 0 && (
        <ul tabIndex={0} aria-label="Findings, red ones first">
          {shown.map((line) => <Finding key={`${line.system_id} ${line.check}`} line={line} />)}
        </ul>
      )}
      {list.good > 0 && <p class="note">{list.good} checks are in order.</p>}
    </section>
  );
}

const Finding = ({ line }: { line: PreflightLine }) => (
  <li class={line.grade === "red" ? "warning" : "caution"}>
    <b>{nameOf(line)}</b> {line.check}: {line.reason}
  </li>
);

function watch(id: string): () => void {
  let over = false;
  const ask = async (): Promise<void> => {
    const answer = await api.preflight(id);
    if (!over) found.value = answer.ok ? { id, lines: answer.value } : null;
  };
  void ask();
  const timer = setInterval(() => void ask(), POLL_MS);
  return () => {
    over = true;
    clearInterval(timer);
  };
}
