// @vitest-environment node
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Connection, socketAddress } from "./connection";

class Socket {
  static readonly OPEN = 1;
  static made: Socket[] = [];
  readyState = 0;
  sent: string[] = [];
  onopen = (): void => {};
  onclose = (): void => {};
  onmessage = (_: { data: unknown }): void => {};

  constructor(readonly address: URL) {
    Socket.made.push(this);
  }

  send(text: string): void {
    this.sent.push(text);
  }

  open(): void {
    this.readyState = Socket.OPEN;
    this.onopen();
  }

  close(): void {
    this.readyState = 3;
    this.onclose();
  }
}

describe("the connection", () => {
  const listener = { opened: vi.fn(), lost: vi.fn(), told: vi.fn(), framed: vi.fn() };
  const newest = () => Socket.made.at(-1) as Socket;

  beforeEach(() => {
    vi.useFakeTimers();
    vi.stubGlobal("WebSocket", Socket);
    Socket.made = [];
    for (const told of Object.values(listener)) told.mockReset();
  });

  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  it("tells frames from messages, and heeds no message without a type", () => {
    new Connection(new URL("ws://here/ws"), listener);
    newest().open();
    const frame = new ArrayBuffer(3);
    newest().onmessage({ data: frame });
    newest().onmessage({ data: '{"type":"seat","seat":"player"}' });
    newest().onmessage({ data: "7" });
    expect(listener.framed.mock.calls).toEqual([[frame]]);
    expect(listener.told.mock.calls).toEqual([[{ type: "seat", seat: "player" }]]);
  });

  it("is opened again whenever it is lost, after ever longer, but never long", () => {
    new Connection(new URL("ws://here/ws"), listener);
    const waits: number[] = [];
    for (let i = 0; i < 8; i++) {
      const count = Socket.made.length;
      newest().close();
      let waitedMs = 0;
      for (; Socket.made.length === count; waitedMs += 100) vi.advanceTimersByTime(100);
      waits.push(waitedMs);
    }
    expect(listener.lost).toHaveBeenCalledTimes(8);
    expect(waits).toEqual([...waits].sort((a, b) => a - b));
    expect(Math.max(...waits)).toBeLessThanOrEqual(3000);
    newest().open();
    newest().close();
    vi.advanceTimersByTime(waits[0] as number);
    expect(Socket.made).toHaveLength(10);
  });

  it("sends while it is open, and loses what is sent while it is not", () => {
    const connection = new Connection(new URL("ws://here/ws"), listener);
    connection.send({ type: "start" });
    newest().open();
    connection.send({ type: "keys", held: "wd" });
    expect(newest().sent).toEqual(['{"type":"keys","held":"wd"}']);
  });
});

describe("the address of the WebSocket", () => {
  it("is beside the page, and as safe as it", () => {
    expect(socketAddress("http://localhost:8080/").href).toBe("ws://localhost:8080/ws");
    expect(socketAddress("https://a.b/roller/?x=1#y").href).toBe("wss://a.b/roller/ws");
  });
});
