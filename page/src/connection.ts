/** The WebSocket to the game's server, opened again whenever it is lost. */

import type { FromServer, ToServer } from "./types";
import { decodeMessage, encodeMessage } from "./wire";

const FIRST_WAIT_MS = 300;
const LONGEST_WAIT_MS = 3000;

export interface Listener {
  opened(): void;
  lost(): void;
  told(message: FromServer): void;
  /** A frame has come, not yet decoded. */
  framed(data: ArrayBuffer): void;
}

export class Connection {
  private socket: WebSocket | null = null;
  private waitMs = FIRST_WAIT_MS;

  constructor(
    private readonly address: URL,
    private readonly listener: Listener,
  ) {
    this.open();
  }

  /** Send a message, or lose it where there is no connection. */
  send(message: ToServer): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(encodeMessage(message));
  }

  private open(): void {
    const socket = new WebSocket(this.address);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.waitMs = FIRST_WAIT_MS;
      this.listener.opened();
    };
    socket.onmessage = ({ data }: MessageEvent<ArrayBuffer | string>) => {
      if (typeof data !== "string") return this.listener.framed(data);
      const message = decodeMessage(data);
      if (message) this.listener.told(message);
    };
    socket.onclose = () => {
      this.listener.lost();
      setTimeout(() => this.open(), this.waitMs);
      this.waitMs = Math.min(2 * this.waitMs, LONGEST_WAIT_MS);
    };
  }
}

/** Return the address of the WebSocket of a page. */
export function socketAddress(page: string): URL {
  const address = new URL("ws", page);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.hash = address.search = "";
  return address;
}
