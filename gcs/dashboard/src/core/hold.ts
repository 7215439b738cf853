/** Hold to confirm, without clock or page: begin, ask for progress, and it is done only after the whole time. */

export const HOLD_MS = 1000;

export class Hold {
  private begunMs: number | null = null;

  constructor(private readonly durationMs = HOLD_MS) {}

  begin(nowMs: number): void {
    this.begunMs ??= nowMs;
  }

  cancel(): void {
    this.begunMs = null;
  }

  get holding(): boolean {
    return this.begunMs !== null;
  }

  /** 0 to 1. */
  progress(nowMs: number): number {
    if (this.begunMs === null) return 0;
    return Math.min(1, Math.max(0, (nowMs - this.begunMs) / this.durationMs));
  }

  /** True once, when held for the whole time. */
  take(nowMs: number): boolean {
    if (this.progress(nowMs) < 1) return false;
    this.begunMs = null;
    return true;
  }
}
