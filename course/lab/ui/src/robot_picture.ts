// The picture of the robot in its room, on a canvas, in the theme's colours.

import { Pose, RobotState } from './robot_state';

export const RADIUS = 0.18; // m, of the robot
export const OBSTACLE = 0.15; // m, radius of what is dropped
const MARGIN = 14; // px
const AROUND = 4; // m shown to each side of a robot without a room
const DEGREE = Math.PI / 180;
const SECTORS: [string, number, number][] = [
  ['front', -30, 30],
  ['left', 30, 90],
  ['right', -90, -30]
]; // degrees, as in course/robot/sectors.py

/** From metres to the pixels of a canvas, y up. */
export interface View {
  scale: number; // px in a metre
  left: number; // px where x is 0
  bottom: number; // px where y is 0
}

export interface Ghost {
  kind: 'robot' | 'obstacle';
  at: [number, number]; // m
}

export interface Colours {
  [name: string]: string;
}

const NAMES = ['ground', 'ink', 'line', 'front', 'left', 'right', 'beam', 'hit', 'trail'];

/** The colours of the current theme. */
export function colours(node: HTMLElement): Colours {
  const style = getComputedStyle(node);
  return Object.fromEntries(NAMES.map(name => [name, style.getPropertyValue(`--ros-robot-${name}`).trim()]));
}

/** How to show the whole room, or what is around the robot, on this many pixels. */
export function viewOf(state: RobotState, width: number, height: number): View {
  const walls = state.room.walls;
  const xs = walls.filter((_, number) => number % 2 === 0);
  const ys = walls.filter((_, number) => number % 2 === 1);
  const [x, y] = state.pose ?? [0, 0];
  const [west, east] = xs.length ? [Math.min(...xs), Math.max(...xs)] : [x - AROUND, x + AROUND];
  const [south, north] = ys.length ? [Math.min(...ys), Math.max(...ys)] : [y - AROUND, y + AROUND];
  const scale = Math.max(
    1,
    Math.min((width - 2 * MARGIN) / Math.max(east - west, 0.1), (height - 2 * MARGIN) / Math.max(north - south, 0.1))
  );
  return {
    scale,
    left: width / 2 - (scale * (west + east)) / 2,
    bottom: height / 2 + (scale * (south + north)) / 2
  };
}

export function toRoom(view: View, x: number, y: number): [number, number] {
  return [(x - view.left) / view.scale, (view.bottom - y) / view.scale];
}

/** Draw one moment; `dim` when what is shown is over. */
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
  if (pose && state.scan && !dim) {
    sectors(context, state, state.scan.from ?? pose, view, colour);
  }
  polyline(context, state.trail, px, py, colour.trail);
  lines(context, state.room.walls, px, py, colour.ink);
  if (state.scan) {
    beams(context, state, view, colour.beam, pose);
  }
  for (const [x, y] of state.collisions.places) {
    cross(context, px(x), py(y), colour.hit);
  }
  if (pose) {
    robot(context, px(pose[0]), py(pose[1]), pose[2], view.scale * RADIUS, colour);
  } else if (state.scan) {
    robot(context, px(0), py(0), 0, view.scale * RADIUS, colour);
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
}

function grid(context: CanvasRenderingContext2D, view: View, colour: string, width: number, height: number): void {
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.beginPath();
  const [west, north] = toRoom(view, 0, 0);
  const [east, south] = toRoom(view, width, height);
  for (let x = Math.ceil(west); x <= east; x++) {
    context.moveTo(view.left + view.scale * x, 0);
    context.lineTo(view.left + view.scale * x, height);
  }
  for (let y = Math.ceil(south); y <= north; y++) {
    context.moveTo(0, view.bottom - view.scale * y);
    context.lineTo(width, view.bottom - view.scale * y);
  }
  context.stroke();
}

/** Each sector as a piece of a circle, as far as its nearest distance. */
function sectors(
  context: CanvasRenderingContext2D,
  state: RobotState,
  [x, y, heading]: Pose,
  view: View,
  colour: Colours
): void {
  const [cx, cy] = [view.left + view.scale * x, view.bottom - view.scale * y];
  for (const [name, low, high] of SECTORS) {
    const nearest = state.scan!.sectors[name];
    const radius = view.scale * Math.max(nearest ?? state.scan!.reach ?? AROUND, RADIUS);
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
  state: RobotState,
  view: View,
  colour: string,
  pose: Pose | null
): void {
  const scan = state.scan!;
  const [x, y, heading] = scan.from ?? pose ?? [0, 0, 0];
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
  radius: number,
  colour: Colours
): void {
  context.fillStyle = colour.ground;
  context.strokeStyle = colour.ink;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  context.fillStyle = colour.ink;
  context.beginPath();
  const [cos, sin] = [Math.cos(heading), -Math.sin(heading)];
  context.moveTo(x + radius * cos, y + radius * sin);
  context.lineTo(x - 0.5 * radius * cos - 0.55 * radius * sin, y - 0.5 * radius * sin + 0.55 * radius * cos);
  context.lineTo(x - 0.5 * radius * cos + 0.55 * radius * sin, y - 0.5 * radius * sin - 0.55 * radius * cos);
  context.fill();
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

function polyline(
  context: CanvasRenderingContext2D,
  points: [number, number][],
  px: (x: number) => number,
  py: (y: number) => number,
  colour: string
): void {
  context.strokeStyle = colour;
  context.lineWidth = 2;
  context.beginPath();
  points.forEach(([x, y], number) => (number ? context.lineTo(px(x), py(y)) : context.moveTo(px(x), py(y))));
  context.stroke();
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
