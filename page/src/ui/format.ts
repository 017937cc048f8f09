/** Numbers as people read them. */

/** A time: "12.3 s", from a minute on "1:02.3". */
export function formatTime(seconds: number): string {
  const tenths = Math.max(0, Math.round(seconds * 10));
  if (tenths < 600) return `${(tenths / 10).toFixed(1)} s`;
  const minutes = Math.floor(tenths / 600);
  return `${minutes}:${((tenths % 600) / 10).toFixed(1).padStart(4, "0")}`;
}

/** A time beside another one, as both are read: "−1.2 s" is faster. */
export function formatLead(seconds: number, other: number): string {
  const lead = (Math.round(seconds * 10) - Math.round(other * 10)) / 10;
  return `${lead > 0 ? "+" : lead < 0 ? "−" : "±"}${Math.abs(lead).toFixed(1)} s`;
}

/** A number of things: "1 coin", "2 coins". */
export function counted(count: number, one: string, many = `${one}s`): string {
  return `${count} ${count === 1 ? one : many}`;
}

/** A quantity of a policy, in a width that does not jump: "0.123", "-12.3", "1.2e+5". */
export function formatValue(value: number): string {
  const size = Math.abs(value);
  if (size >= 10000) return value.toExponential(1);
  return value.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3);
}
