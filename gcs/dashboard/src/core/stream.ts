/** The WebSocket: connects, tells what arrives, and comes back by itself after a loss. No state of the page here. */

import type { ServerMessage } from "./types";

const PROTOCOL = "ucs.v1";
const KEY_PREFIX = "bearer.";
export const RATE_HZ = 5;
const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 5000;

export interface StreamHandlers {
  opened: () => void;
  message: (message: ServerMessage) => void;
  closed: () => void;
}

/** Waiting time before try number `failures` + 1: doubling, at most 5 s. */
export const retryDelayMs = (failures: number): number =>
  Math.min(LONGEST_WAIT_MS, FIRST_WAIT_MS * 2 ** Math.min(failures, 10));

export class Stream {
  private socket: WebSocket | null = null;
  private failures = 0;
  private timer: ReturnType<typeof setTimeout> | null = null;

  constructor(
    private readonly url: string,
    private readonly key: () => string | null,
    private readonly handlers: StreamHandlers,
  ) {}

  /** Connect, or connect anew with another key. */
  connect(): void {
    this.stop();
    const key = this.key();
    const socket = new WebSocket(this.url, key === null ? [PROTOCOL] : [PROTOCOL, KEY_PREFIX + key]);
    this.socket = socket;
    socket.onopen = () => {
      this.failures = 0;
      socket.send(JSON.stringify({ type: "subscribe", rate_hz: RATE_HZ, topics: ["snapshot", "events"], deltas: true }));
      this.handlers.opened();
    };
    socket.onmessage = (event: MessageEvent<string>) => this.handlers.message(JSON.parse(event.data) as ServerMessage);
    socket.onclose = () => this.lost(socket);
  }

  stop(): void {
    if (this.timer !== null) clearTimeout(this.timer);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
  }

  private lost(socket: WebSocket): void {
    if (socket !== this.socket) return; // closed by ourselves
    this.socket = null;
    this.handlers.closed();
    this.timer = setTimeout(() => this.connect(), retryDelayMs(this.failures));
    this.failures += 1;
  }
}

/** The stream's address beside the page's own. */
export function streamUrl(page: Location): string {
  const url = new URL("api/v1/stream", page.href);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  url.hash = "";
  return url.href;
}
