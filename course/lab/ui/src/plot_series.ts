// The data of a plot, values over time, and the picture and the table of them.

import { wholeNumbers } from './ticks';

export interface Series {
  topic: string;
  field: string;
  unit: string; // '' if unknown
  place: number; // of its colour, which it keeps when others go
  from: string; // the path of the notebook that was in front when it was chosen
  times: number[]; // s, by the plot's clock
  values: Value[];
}

const GAP = 'gap'; // a time in which nothing came
type Value = number | null | typeof GAP; // null is a message without a number

export interface Frame {
  from: number; // s
  until: number;
}

/** The plot's clock, as the kernel has told it: it follows the simulation, if there is one. */
export interface Clock {
  id: string; // of the kernel's clock
  at: number; // s since 1970, of the wall clock, when it was told
  now: number; // s, at that moment
  rate: number; // s per s
  shift: number; // s from the kernel's clock to this one, which goes on where another kernel's was
}

/** Return the present time of the plot, in s; the wall clock's before a kernel has told one. */
export function nowOf(clock: Clock | null): number {
  const wall = Date.now() / 1000;
  return clock ? clock.now + clock.rate * (wall - clock.at) : wall;
}

/** Return the clock after a message of a kernel. */
export function heard(before: Clock | null, told: { id: string; now: number; rate: number }): Clock {
  const shift = before?.id === told.id ? before.shift : nowOf(before) - told.now;
  return { id: told.id, at: Date.now() / 1000, now: told.now + shift, rate: told.rate, shift };
}

/** Return the name of the time axis. */
export function timeName(simulated: boolean): string {
  return `${simulated ? 'world time' : 'time'} since the plot began (s)`;
}

const MOST = 20000; // values of a series
const MARGIN = { left: 62, right: 12, top: 10, bottom: 42 }; // px
const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3]];
const NAMES = ['front', 'beam', 'left', 'body', 'right', 'ink'];

/** Return the name of a series for the reader. */
export function nameOf(series: Series): string {
  return `${series.topic} ${series.field}`;
}

// REP 103: https://www.ros.org/reps/rep-0103.html
const UNITS: [RegExp, string][] = [
  [/(^|\.)linear\.[xyz]$/, 'm/s'],
  [/(^|\.)angular(_velocity)?\.[xyz]$/, 'rad/s'],
  [/(^|\.)position\.[xyz]$|^ranges\[\d+\]$|^range(_min|_max)?$/, 'm'],
  [/^angle_(min|max|increment)$/, 'rad']
];

/** Return the unit of a field of a type, '' if it is unknown. */
export function unitOf(type: string, field: string): string {
  const accelerates = type.includes('/Accel'); // whose fields are called as those of a velocity
  return accelerates ? '' : (UNITS.find(([pattern]) => pattern.test(field))?.[1] ?? '');
}

/** Return the first place of a colour that none of these series has. */
export function freePlace(all: Series[]): number {
  const taken = new Set(all.map(({ place }) => place));
  return [...all.keys(), all.length].find(place => !taken.has(place))!;
}

/** Return the colour of a series, by its place, as a variable of the theme. */
export function colourOf(place: number): string {
  return `--ros-robot-${NAMES[place % NAMES.length]}`;
}

/** Add points, of which null is a gap, `shift` s later; the oldest are dropped if there are too many. */
export function add(series: Series, points: ([number, number | null] | null)[], shift: number): void {
  for (const point of points) {
    const last = series.times.length - 1;
    if (point || (last >= 0 && series.values[last] !== GAP)) {
      const [time, value]: [number, Value] = point ?? [series.times[last] - shift, GAP];
      series.times.push(time + shift);
      series.values.push(value);
    }
  }
  const more = series.times.length - MOST;
  if (more > 0) {
    series.times.splice(0, more);
    series.values.splice(0, more);
  }
}

/** Return all values as CSV: a row for each time, a column for each series; a simulation's time begins with the plot. */
export function csv(all: Series[], began: number, simulated: boolean): string {
  const rows = new Map<number, string[]>();
  all.forEach((series, place) =>
    series.times.forEach((time, number) => {
      const value = series.values[number];
      if (value !== GAP) {
        const row = rows.get(time) ?? all.map(() => '');
        row[place] = value === null ? '' : String(value);
        rows.set(time, row);
      }
    })
  );
  const quoted = (text: string) => `"${text.replace(/"/g, '""')}"`;
  const head = [simulated ? timeName(true) : 'time (s since 1970)', ...all.map(nameOf)].map(quoted).join(',');
  const lines = [...rows].sort(([one], [other]) => one - other).map(([time, row]) => [(time - (simulated ? began : 0)).toFixed(3), ...row].join(','));
  return `${[head, ...lines].join('\n')}\n`;
}

/** Return the last value up to a time; undefined before the first and in a gap. */
export function valueAt(series: Series, time: number): number | null | undefined {
  let [low, high] = [0, series.times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    [low, high] = series.times[middle] <= time ? [middle + 1, high] : [low, middle];
  }
  const value = series.values[low - 1];
  return value === GAP ? undefined : value;
}

const ALIKE = 1e-6; // values that differ by no more than this part of them are drawn as equal

/** Return the lowest and the highest value in a frame, with a margin. */
function range(all: Series[], { from, until }: Frame): [number, number] {
  let [least, most] = [Infinity, -Infinity];
  for (const { times, values } of all) {
    for (let number = times.length - 1; number >= 0 && times[number] >= from; number--) {
      const value = values[number];
      if (typeof value === 'number' && times[number] <= until) {
        [least, most] = [Math.min(least, value), Math.max(most, value)];
      }
    }
  }
  if (least > most) {
    return [0, 1];
  }
  const flat = most - least <= ALIKE * Math.max(Math.abs(least), Math.abs(most)); // by rounding errors at most
  const room = flat ? Math.max(Math.abs(least) * 0.1, 0.1) : 0.08 * (most - least);
  return [least - room, most + room];
}

/** Return a round step size, about `wanted` of which fill a span. */
function stepOf(span: number, wanted: number): number {
  const rough = span / Math.max(1, wanted);
  const power = 10 ** Math.floor(Math.log10(rough));
  return ([1, 2, 5, 10].find(each => each * power >= rough) ?? 10) * power;
}

/** Draw the series within a frame.
 *
 * `began` is where the time axis has its 0 (s), `name` its name, `mark` a time with a line of its own; `legend` writes
 * the names of the series.
 */
export function draw(
  context: CanvasRenderingContext2D,
  all: Series[],
  frame: Frame,
  began: number,
  name: string,
  mark: number | null,
  [width, height]: [number, number],
  style: CSSStyleDeclaration,
  legend: boolean
): void {
  const colour = (name: string) => style.getPropertyValue(name).trim();
  const [ground, ink, line] = ['ground', 'ink', 'line'].map(name => colour(`--ros-robot-${name}`));
  const top = MARGIN.top + (legend ? 18 * all.length : 0);
  const [right, bottom] = [width - MARGIN.right, height - MARGIN.bottom];
  const [low, high] = range(all, frame);
  const px = (time: number) => MARGIN.left + ((time - frame.from) / (frame.until - frame.from)) * (right - MARGIN.left);
  const py = (value: number) => bottom - ((value - low) / (high - low)) * (bottom - top);
  context.fillStyle = ground;
  context.fillRect(0, 0, width, height);
  context.font = '11px sans-serif';
  context.lineWidth = 1;
  context.strokeStyle = line;
  context.fillStyle = ink;
  context.textBaseline = 'middle';
  context.textAlign = 'right';
  const rise = stepOf(high - low, Math.max(4, (bottom - top) / 40));
  const digits = Math.min(12, Math.max(0, -Math.floor(Math.log10(rise) + 1e-9)));
  context.beginPath();
  for (const number of wholeNumbers(low / rise, high / rise)) {
    const value = number * rise;
    const text = Math.abs(value) >= 1e6 ? value.toExponential(2) : value.toFixed(digits);
    context.fillText(text.replace('-', '−'), MARGIN.left - 5, py(value));
    context.moveTo(MARGIN.left, py(value));
    context.lineTo(right, py(value));
  }
  context.textAlign = 'center';
  const step = stepOf(frame.until - frame.from, (right - MARGIN.left) / 55);
  for (const number of wholeNumbers((frame.from - began) / step, (frame.until - began) / step)) {
    const time = began + number * step;
    const text = (number * step).toFixed(step < 1 ? 1 : 0).replace('-', '−');
    context.fillText(text, px(time), bottom + 12);
    context.moveTo(px(time), top);
    context.lineTo(px(time), bottom);
  }
  context.stroke();
  context.fillText(name, (MARGIN.left + right) / 2, height - 11); // below the numbers
  const units = new Set(all.map(each => each.unit));
  if (units.size === 1) {
    context.save();
    context.translate(9, (top + bottom) / 2);
    context.rotate(-Math.PI / 2);
    context.textAlign = 'center';
    context.fillText([...units][0], 0, 0);
    context.restore();
  }
  context.strokeStyle = ink;
  context.strokeRect(MARGIN.left, top, right - MARGIN.left, bottom - top);
  all.forEach((series, row) => {
    context.strokeStyle = context.fillStyle = colour(colourOf(series.place));
    context.lineWidth = 2;
    context.setLineDash(DASHES[Math.floor(series.place / NAMES.length) % DASHES.length]);
    if (legend) {
      context.textAlign = 'left';
      const unit = series.unit && ` (${series.unit})`;
      context.fillText(`▬ ${nameOf(series)}${unit}`, MARGIN.left, MARGIN.top + 18 * row + 6);
    }
    context.save();
    context.beginPath();
    context.rect(MARGIN.left, top - 2, right - MARGIN.left, bottom - top + 4);
    context.clip();
    curve(context, series, frame, px, py);
    context.restore();
  });
  if (mark !== null) {
    context.strokeStyle = ink;
    context.lineWidth = 1;
    context.setLineDash([4, 3]);
    context.beginPath();
    context.moveTo(px(mark), top);
    context.lineTo(px(mark), bottom);
    context.stroke();
  }
  context.setLineDash([]);
}

function curve(
  context: CanvasRenderingContext2D,
  { times, values }: Series,
  { from, until }: Frame,
  px: (time: number) => number,
  py: (value: number) => number
): void {
  let begin = times.length;
  while (begin > 0 && times[begin - 1] >= from) {
    begin--;
  }
  context.beginPath();
  let pen = false;
  for (let number = Math.max(0, begin - 1); number < times.length; number++) {
    const value = values[number];
    if (typeof value !== 'number') {
      pen = false;
    } else {
      const [x, y] = [px(times[number]), py(value)];
      if (!pen) {
        context.fillRect(x - 1, y - 1, 2, 2); // so that a value between two gaps is visible, too
      }
      pen ? context.lineTo(x, y) : context.moveTo(x, y);
      pen = true;
    }
    if (times[number] > until) {
      break;
    }
  }
  context.stroke();
}
