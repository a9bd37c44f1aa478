// The picture of the robot in its room, on a canvas, in the theme's colours.

import { Place, Pose, RobotState, Scan } from './robot_state';
import { wholeNumbers } from './ticks';

export const RADIUS = 0.18; // m, of the robot
const OBSTACLE = 0.15; // m, radius of a dropped obstacle
const MARGIN = { left: 34, right: 12, top: 12, bottom: 26 }; // px, with room for the numbers at the axes
const SMALLEST = 8; // px, least radius of the robot, so that it is visible
const NOSE = { angle: 0.6, length: 1.75 }; // rad to each side of ahead, and times the robot's radius
const APART = 34; // px at least between two numbers at an axis
const DASH = [5, 4]; // px of the trail, drawn and left out
const FADES = [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1]; // opacity of the trail's pieces, from the oldest one
const AROUND = 4; // m shown to each side of a robot without a room
const DEGREE = Math.PI / 180;
const SECTORS: [string, number, number][] = [
  ['front', -30, 30],
  ['left', 30, 90],
  ['right', -90, -30]
]; // degrees, as in course/robot/sectors.py

/** The mapping from metres to the pixels of a canvas, y up. */
export interface View {
  scale: number; // px in a metre
  left: number; // px where x is 0
  bottom: number; // px where y is 0
}

/** The zoom relative to the whole room; `at` is the centre (m), null for the robot. */
export interface Zoom {
  factor: number;
  at: [number, number] | null;
}

export interface Ghost {
  kind: 'robot' | 'obstacle';
  at: [number, number]; // m
}

interface Colours {
  [name: string]: string;
}

const NAMES = ['ground', 'ink', 'line', 'front', 'left', 'right', 'beam', 'hit', 'trail', 'body'];

/** The colours of the current theme. */
export function colours(node: HTMLElement): Colours {
  const style = getComputedStyle(node);
  return Object.fromEntries(NAMES.map(name => [name, style.getPropertyValue(`--ros-robot-${name}`).trim()]));
}

/** Return the mapping for the whole room, the robot's surroundings or a part of it, on this many pixels. */
export function viewOf(state: RobotState, width: number, height: number, zoom: Zoom, now: number): View {
  const walls = state.room.walls;
  const xs = walls.filter((_, number) => number % 2 === 0);
  const ys = walls.filter((_, number) => number % 2 === 1);
  const robot = state.shown(now) ?? [0, 0, 0];
  const [x, y] = state.pose ?? [0, 0];
  const [west, east] = ends(xs) ?? [x - AROUND, x + AROUND];
  const [south, north] = ends(ys) ?? [y - AROUND, y + AROUND];
  const [wide, high] = [width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom];
  const whole = Math.max(1, Math.min(wide / Math.max(east - west, 0.1), high / Math.max(north - south, 0.1)));
  const scale = zoom.factor * whole;
  const [middle, level] = zoom.factor > 1 ? (zoom.at ?? robot) : [(west + east) / 2, (south + north) / 2];
  return {
    scale,
    left: MARGIN.left + wide / 2 - scale * middle,
    bottom: MARGIN.top + high / 2 + scale * level
  };
}

/** Return the least and the greatest of these numbers, however many there are; null if there are none. */
function ends(values: number[]): [number, number] | null {
  return values.length ? values.reduce(([low, high], each) => [Math.min(low, each), Math.max(high, each)], [Infinity, -Infinity]) : null;
}

export function toRoom(view: View, x: number, y: number): [number, number] {
  return [(x - view.left) / view.scale, (view.bottom - y) / view.scale];
}

/** Draw one moment; `dim` if the drive is over. */
export function draw(
  context: CanvasRenderingContext2D,
  state: RobotState,
  view: View,
  colour: Colours,
  now: number,
  ghost: Ghost | null,
  dim: boolean
): void {
  const { width, height } = context.canvas;
  const px = (x: number) => view.left + view.scale * x;
  const py = (y: number) => view.bottom - view.scale * y;
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.fillStyle = colour.ground;
  context.fillRect(0, 0, width, height);
  const ratio = window.devicePixelRatio || 1;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.globalAlpha = dim ? 0.45 : 1;
  context.lineCap = 'round';
  grid(context, view, colour.line, width / ratio, height / ratio);
  const pose = state.shown(now);
  const scan = state.scan;
  // A scan is drawn where it was seen from.  If that is unknown it is left out, unless nothing tells where the robot is.
  const from: Pose | null = scan && (scan.from ?? (pose ? null : [0, 0, 0]));
  // The robot is drawn on its way to where it scanned last: what is fixed to it goes with it.
  const carried = from && pose && from.every((value, part) => value === state.pose?.[part]) ? pose : from;
  if (carried && pose && !dim) {
    sectors(context, scan!, carried === pose ? state.sectors(now) : scan!.sectors, carried, view, colour);
  }
  trail(context, state.trail, px, py, colour.trail);
  lines(context, state.room.walls, px, py, colour.ink);
  if (scan && from) {
    beams(context, scan, from, view, colour.beam);
  }
  for (const [x, y] of state.collisions.places) {
    cross(context, px(x), py(y), colour.hit);
  }
  if (scan && carried && !dim) {
    firstBeam(context, carried, scan.first, view, colour);
  }
  if (pose) {
    robot(context, px(pose[0]), py(pose[1]), pose[2], view.scale * RADIUS, colour);
  } else if (scan) {
    robot(context, px(0), py(0), 0, view.scale * RADIUS, colour);
  }
  if (carried && !dim) {
    origin(context, carried, view, colour);
  }
  if (ghost) {
    context.setLineDash([4, 3]);
    context.strokeStyle = colour.ink;
    context.lineWidth = 2;
    context.beginPath();
    const radius = view.scale * (ghost.kind === 'robot' ? RADIUS : OBSTACLE);
    context.arc(px(ghost.at[0]), py(ghost.at[1]), radius, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
  }
  context.globalAlpha = 1;
  axes(context, view, colour, width / ratio, height / ratio);
}

function grid(context: CanvasRenderingContext2D, view: View, colour: string, width: number, height: number): void {
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.beginPath();
  const [west, north] = toRoom(view, 0, 0);
  const [east, south] = toRoom(view, width, height);
  for (const x of wholeNumbers(west, east)) {
    context.moveTo(view.left + view.scale * x, 0);
    context.lineTo(view.left + view.scale * x, height);
  }
  for (const y of wholeNumbers(south, north)) {
    context.moveTo(0, view.bottom - view.scale * y);
    context.lineTo(width, view.bottom - view.scale * y);
  }
  context.stroke();
}

/** Draw each sector as a sector of a circle, up to its nearest distance. */
function sectors(
  context: CanvasRenderingContext2D,
  scan: Scan,
  distances: { [name: string]: number | null },
  [x, y, heading]: Pose,
  view: View,
  colour: Colours
): void {
  const [cx, cy] = [view.left + view.scale * x, view.bottom - view.scale * y];
  for (const [name, low, high] of SECTORS) {
    const nearest = distances[name];
    const radius = view.scale * Math.max(nearest ?? scan.reach ?? AROUND, RADIUS);
    const [from, to] = [-(heading + high * DEGREE), -(heading + low * DEGREE)];
    context.fillStyle = colour[name];
    context.strokeStyle = colour[name];
    context.save();
    context.globalAlpha *= 0.16;
    context.beginPath();
    context.moveTo(cx, cy);
    context.arc(cx, cy, radius, from, to);
    context.closePath();
    context.fill();
    context.restore();
    if (nearest !== null) {
      context.lineWidth = 3;
      context.beginPath();
      context.arc(cx, cy, radius, from + 0.02, to - 0.02);
      context.stroke();
    }
  }
}

function beams(
  context: CanvasRenderingContext2D,
  scan: Scan,
  [x, y, heading]: Pose,
  view: View,
  colour: string
): void {
  context.fillStyle = colour;
  scan.ranges.forEach((range, number) => {
    if (range > 0) {
      const angle = heading + scan.first + scan.step * number;
      const [bx, by] = [x + (range / 100) * Math.cos(angle), y + (range / 100) * Math.sin(angle)];
      context.fillRect(view.left + view.scale * bx - 1.5, view.bottom - view.scale * by - 1.5, 3, 3);
    }
  });
}

function robot(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  heading: number,
  wanted: number,
  colour: Colours
): void {
  const radius = Math.max(SMALLEST, wanted);
  const [cos, sin] = [Math.cos(heading), -Math.sin(heading)];
  context.fillStyle = colour.body;
  context.strokeStyle = colour.ink;
  context.lineWidth = 2;
  context.lineJoin = 'round';
  context.beginPath(); // a circle with a nose
  context.arc(x, y, radius, NOSE.angle - heading, 2 * Math.PI - NOSE.angle - heading);
  context.lineTo(x + NOSE.length * radius * cos, y + NOSE.length * radius * sin);
  context.closePath();
  context.fill();
  context.stroke();
}

function lines(
  context: CanvasRenderingContext2D,
  walls: number[],
  px: (x: number) => number,
  py: (y: number) => number,
  colour: string
): void {
  context.strokeStyle = colour;
  context.lineWidth = 2.5;
  context.beginPath();
  for (let number = 0; number + 3 < walls.length; number += 4) {
    context.moveTo(px(walls[number]), py(walls[number + 1]));
    context.lineTo(px(walls[number + 2]), py(walls[number + 3]));
  }
  context.stroke();
}

/** Draw the path so far as a thin dashed line, in pieces of equal time: the older, the fainter. */
function trail(
  context: CanvasRenderingContext2D,
  places: Place[],
  px: (x: number) => number,
  py: (y: number) => number,
  colour: string
): void {
  if (places.length < 2) {
    return;
  }
  const began = places[0][2];
  const each = Math.max(1e-9, places[places.length - 1][2] - began) / FADES.length;
  context.save();
  context.strokeStyle = colour;
  context.lineWidth = 1.5;
  context.lineCap = 'butt'; // round ends would fill the gaps
  context.setLineDash(DASH);
  const whole = context.globalAlpha;
  let [first, length] = [0, 0]; // of this piece: its first place, and px before it
  FADES.forEach((fade, number) => {
    let next = first;
    context.globalAlpha = whole * fade;
    context.lineDashOffset = length; // the dashes go on from piece to piece
    context.beginPath();
    context.moveTo(px(places[first][0]), py(places[first][1]));
    while (next + 1 < places.length && (number === FADES.length - 1 || places[next][2] < began + (number + 1) * each)) {
      next++;
      const [x, y] = [px(places[next][0]), py(places[next][1])];
      length += Math.hypot(x - px(places[next - 1][0]), y - py(places[next - 1][1]));
      context.lineTo(x, y);
    }
    context.stroke();
    first = next;
  });
  context.restore();
}

/** Draw a line from the place of the scan towards its first beam: below the robot, whose nose says where it heads. */
function firstBeam(
  context: CanvasRenderingContext2D,
  [x, y, heading]: Pose,
  first: number,
  view: View,
  colour: Colours
): void {
  const [cx, cy] = [view.left + view.scale * x, view.bottom - view.scale * y];
  const length = 2.8 * Math.max(SMALLEST, view.scale * RADIUS);
  context.strokeStyle = colour.beam;
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(cx, cy);
  context.lineTo(cx + length * Math.cos(heading + first), cy - length * Math.sin(heading + first));
  context.stroke();
}

/** Draw the place of the scan. */
function origin(context: CanvasRenderingContext2D, [x, y]: Pose, view: View, colour: Colours): void {
  context.fillStyle = colour.beam;
  context.beginPath();
  context.arc(view.left + view.scale * x, view.bottom - view.scale * y, 3, 0, 2 * Math.PI);
  context.fill();
}

/** Draw numbers (m) along the lower and the left edge, far enough apart to be readable. */
function axes(context: CanvasRenderingContext2D, view: View, colour: Colours, width: number, height: number): void {
  const step = [0.1, 0.2, 0.5, 1, 2, 5, 10].find(each => each * view.scale >= APART) ?? 20;
  const digits = step < 1 ? 1 : 0;
  const label = (value: number) => (step * value).toFixed(digits).replace('-', '−');
  context.fillStyle = colour.ground;
  context.fillRect(0, height - 18, width, 18);
  context.fillRect(0, 0, 26, height);
  context.fillStyle = colour.ink;
  context.strokeStyle = colour.ink;
  context.lineWidth = 1;
  context.font = '11px sans-serif';
  context.textBaseline = 'middle';
  const [west, north] = toRoom(view, 32, 20);
  const [east, south] = toRoom(view, width - 46, height - 26);
  context.beginPath();
  context.textAlign = 'center';
  for (const number of wholeNumbers(west / step, east / step)) {
    const x = view.left + view.scale * step * number;
    context.fillText(label(number), x, height - 8);
    context.moveTo(x, height - 18);
    context.lineTo(x, height - 15);
  }
  context.textAlign = 'right';
  for (const number of wholeNumbers(south / step, north / step)) {
    const y = view.bottom - view.scale * step * number;
    context.fillText(label(number), 21, y);
    context.moveTo(23, y);
    context.lineTo(26, y);
  }
  context.stroke();
  context.fillText('x (m)', width - 8, height - 8);
  context.textAlign = 'left';
  context.fillText('y (m)', 2, 8);
}

function cross(context: CanvasRenderingContext2D, x: number, y: number, colour: string): void {
  context.strokeStyle = colour;
  context.lineWidth = 3;
  context.beginPath();
  context.moveTo(x - 5, y - 5);
  context.lineTo(x + 5, y + 5);
  context.moveTo(x - 5, y + 5);
  context.lineTo(x + 5, y - 5);
  context.stroke();
}
