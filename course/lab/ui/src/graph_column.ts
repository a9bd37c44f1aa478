// The lines of a graph whose boxes stand in a column: they run beside the boxes, and none ends where another one begins.

export interface Line {
  from: string; // the id of a box
  to: string;
}

interface Place {
  id: string;
  kind: string;
  x: number; // px, of the middle
  y: number;
  width: number;
}

/** A way from top to bottom, which the lines to a node share, or those from it. */
interface Lane {
  top: number; // the numbers of the boxes at its ends
  bottom: number;
  x: number; // px
}

const HALF = 6; // px from the middle of a box, up to where lines arrive, and down to where they leave
const BEND = 7; // px
const TIP = 18; // px between a box and a lane at least: an arrow's head and the bend
const APART = 9; // px between two lanes
// px by which the side of a box stands back at that height; 0 for a topic, which is a rectangle.
const BACK: { [kind: string]: number } = { node: 1.5, service: 3.7, action: 3.7 };

/** Return the path of each line, and how far they reach to the right; the boxes are those of a column, from the top. */
export function linesBeside(lines: Line[], boxes: Place[]): { paths: string[]; reach: number } {
  const number = new Map(boxes.map(({ id }, index) => [id, index]));
  const nodes = new Set(boxes.filter(({ kind }) => kind === 'node').map(({ id }) => id));
  const laneOf = (line: Line) => (nodes.has(line.from) ? `from ${line.from}` : `to ${line.to}`);
  const lanes = new Map<string, Lane>();
  for (const line of lines) {
    const ends = [number.get(line.from)!, number.get(line.to)!];
    const { top, bottom } = lanes.get(laneOf(line)) ?? { top: Infinity, bottom: -Infinity };
    lanes.set(laneOf(line), { top: Math.min(top, ...ends), bottom: Math.max(bottom, ...ends), x: 0 });
  }
  const right = ({ x, width }: Place) => x + width / 2;
  const set: Lane[] = [];
  for (const lane of [...lanes.values()].sort((one, other) => one.bottom - one.top - (other.bottom - other.top))) {
    lane.x = Math.max(...boxes.slice(lane.top, lane.bottom + 1).map(right)) + TIP;
    const beside = set.filter(({ top, bottom }) => top <= lane.bottom && bottom >= lane.top);
    while (beside.some(({ x }) => Math.abs(x - lane.x) < APART)) {
      lane.x += 1;
    }
    set.push(lane);
  }
  const paths = lines.map(line => {
    const [from, to] = [line.from, line.to].map(id => boxes[number.get(id)!]);
    const { x } = lanes.get(laneOf(line))!;
    const [begin, end] = [from.y + HALF, to.y - HALF];
    const bend = Math.sign(end - begin) * BEND;
    const tip = right(to) - (BACK[to.kind] ?? 0);
    return (
      `M${(right(from) - HALF).toFixed(1)} ${begin}H${x - BEND}Q${x} ${begin} ${x} ${begin + bend}` +
      `V${end - bend}Q${x} ${end} ${x - BEND} ${end}H${tip.toFixed(1)}`
    );
  });
  return { paths, reach: Math.max(0, ...set.map(({ x }) => x)) };
}
