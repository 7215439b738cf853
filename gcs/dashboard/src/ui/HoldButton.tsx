/** A button that acts only when held: with the pointer, or with Space or Enter. Its name says whom it reaches. */

import { signal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";

import { Hold } from "../core/hold";

/** What the button that is being held will do, to whom; shown large while it is held. */
export const held = signal<string | null>(null);

export const HeldNames = () => (held.value === null ? null : <p class="holding-names" role="status">Keep holding. {held.value}</p>);

interface Props {
  label: string;
  /** Spoken and shown on hover: what happens, and to whom. */
  explain: string;
  onDone: () => void;
  disabled?: boolean;
  danger?: boolean;
}

export function HoldButton({ label, explain, onDone, disabled = false, danger = false }: Props) {
  const hold = useRef(new Hold());
  const [progress, setProgress] = useState(0);
  const frame = useRef(0);
  const spoken = explain.startsWith(label) ? explain : `${label}: ${explain}`; // the name says what is seen (WCAG 2.5.3)
  const stop = (): void => {
    cancelAnimationFrame(frame.current);
    if (hold.current.holding) held.value = null;
    hold.current.cancel();
    setProgress(0);
  };
  const step = (now: number): void => {
    if (hold.current.take(now)) {
      held.value = null;
      setProgress(0);
      onDone();
    } else if (hold.current.holding) {
      setProgress(hold.current.progress(now));
      frame.current = requestAnimationFrame(step);
    }
  };
  const begin = (): void => {
    if (disabled || hold.current.holding) return;
    hold.current.begin(performance.now());
    held.value = spoken;
    frame.current = requestAnimationFrame(step);
  };
  useEffect(() => stop, []);
  useEffect(() => {
    if (disabled) stop();
  }, [disabled]);
  const isKey = (event: KeyboardEvent): boolean => event.key === " " || event.key === "Enter";
  return (
    <button
      type="button"
      class={`hold${danger ? " danger" : ""}${progress > 0 ? " holding" : ""}`}
      style={`--progress: ${progress}`}
      title={`Hold: ${explain}`}
      aria-label={`${spoken} (hold to confirm)`}
      disabled={disabled}
      onPointerDown={(event) => event.button === 0 && begin()}
      onPointerUp={stop}
      onPointerLeave={stop}
      onPointerCancel={stop}
      onBlur={stop}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if (!isKey(event)) return;
        event.preventDefault();
        if (!event.repeat) begin();
      }}
      onKeyUp={(event) => isKey(event) && stop()}
    >
      <span>{progress > 0 ? `Hold… ${label}` : label}</span>
    </button>
  );
}
