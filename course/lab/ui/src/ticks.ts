// The places of lines and numbers along an axis.

const MOST = 10000; // more than a canvas has pixels

/** Return the whole numbers from `low` to `high`, at most `MOST`; none where doubles are too coarse to count. */
export function wholeNumbers(low: number, high: number): number[] {
  const first = Math.ceil(low);
  const count = Math.min(MOST, Math.floor(high) - first + 1);
  return Number.isSafeInteger(first) && count > 0 ? Array.from({ length: count }, (_, number) => first + number) : [];
}
