// The canvas of the robot view: it is drawn when something moves, and takes the mouse, fingers and keys.

import * as React from 'react';

import { colours, draw, Ghost, RADIUS, toRoom, View, viewOf } from './robot_picture';
import { Pose, RobotState } from './robot_state';

const STEP = 0.1; // m for an arrow key
const TURN = Math.PI / 12; // rad
const AHEAD = 0.8; // m from the robot to an obstacle that a key drops
const GRIP = 12; // px around the robot where it can be taken, too
const KEYS: [string, string][] = [
  ['Space', 'pause, and go on'],
  ['Arrow keys', `move the robot by ${STEP} m`],
  ['Q, E', 'turn it to the left, to the right'],
  ['O', `drop an obstacle ${AHEAD} m ahead`],
  ['R', 'reset'],
  ['+, −', 'faster, slower']
];

interface Props {
  state: RobotState;
  controlled: boolean; // there is a world that takes orders
  dropping: boolean; // the next place that is chosen is that of an obstacle
  pause: () => void;
  reset: () => void;
  place: (x: number, y: number, heading: number) => Promise<void>;
  drop: (x: number, y: number) => void;
  faster: (by: number) => void;
  cancel: () => void;
}

export function Stage(props: Props): JSX.Element {
  const canvas = React.useRef<HTMLCanvasElement>(null);
  const now = React.useRef(props);
  now.current = props;
  const ghost = React.useRef<Ghost | null>(null);
  const view = React.useRef<View>({ scale: 1, left: 0, bottom: 0 });
  const wanted = React.useRef<{ pose: Pose; until: number } | null>(null);
  useDrawing(canvas, props.state, view, ghost);

  /** Where the robot is, or will be when the last order has been followed. */
  const pose = (): Pose | null =>
    wanted.current && wanted.current.until > performance.now() ? wanted.current.pose : props.state.pose;
  const put = (x: number, y: number, heading: number) => {
    wanted.current = { pose: [x, y, heading], until: performance.now() + 500 };
    void now.current.place(x, y, heading).then(() => (ghost.current = null));
  };
  const at = (event: React.PointerEvent): [number, number] => {
    const box = canvas.current!.getBoundingClientRect();
    return toRoom(view.current, event.clientX - box.left, event.clientY - box.top);
  };
  const down = (event: React.PointerEvent) => {
    if (!props.controlled || event.button !== 0) {
      return;
    }
    const [x, y] = at(event);
    const robot = props.state.shown(performance.now());
    if (props.dropping) {
      ghost.current = { kind: 'obstacle', at: [x, y] };
    } else if (robot && Math.hypot(x - robot[0], y - robot[1]) <= RADIUS + GRIP / view.current.scale) {
      ghost.current = { kind: 'robot', at: [x, y] };
    } else {
      return;
    }
    event.currentTarget.setPointerCapture(event.pointerId);
  };
  const move = (event: React.PointerEvent) => {
    if (ghost.current && event.currentTarget.hasPointerCapture(event.pointerId)) {
      ghost.current.at = at(event);
      props.state.version++;
    }
  };
  const up = (event: React.PointerEvent) => {
    if (!ghost.current || !event.currentTarget.hasPointerCapture(event.pointerId)) {
      return;
    }
    event.currentTarget.releasePointerCapture(event.pointerId);
    const [x, y] = at(event);
    if (ghost.current.kind === 'obstacle') {
      ghost.current = null;
      props.drop(x, y);
    } else {
      put(x, y, props.state.pose?.[2] ?? 0);
    }
    props.state.version++;
  };
  const key = (event: React.KeyboardEvent) => {
    if (event.key === 'Escape') {
      ghost.current = null;
      props.cancel();
    }
    if (!props.controlled || event.ctrlKey || event.altKey || event.metaKey) {
      return;
    }
    const robot = pose();
    const moves: { [key: string]: [number, number] } = {
      ArrowUp: [0, STEP],
      ArrowDown: [0, -STEP],
      ArrowLeft: [-STEP, 0],
      ArrowRight: [STEP, 0]
    };
    const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (robot && moves[pressed]) {
      put(robot[0] + moves[pressed][0], robot[1] + moves[pressed][1], robot[2]);
    } else if (robot && (pressed === 'q' || pressed === 'e')) {
      put(robot[0], robot[1], robot[2] + (pressed === 'q' ? TURN : -TURN));
    } else if (robot && pressed === 'o') {
      props.drop(robot[0] + AHEAD * Math.cos(robot[2]), robot[1] + AHEAD * Math.sin(robot[2]));
    } else if (pressed === ' ') {
      props.pause();
    } else if (pressed === 'r') {
      props.reset();
    } else if (pressed === '+' || pressed === '-') {
      props.faster(pressed === '+' ? 1 : -1);
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  };
  const keys = React.useId();
  return (
    <>
      <div className="ros-Robot-stage">
        <canvas
          ref={canvas}
          className={`ros-Robot-canvas${props.dropping ? ' ros-mod-dropping' : ''}`}
          data-lm-suppress-shortcuts="true"
          role="application"
          aria-label="The robot, and what it sees around it"
          aria-describedby={keys}
          tabIndex={0}
          onPointerDown={down}
          onPointerMove={move}
          onPointerUp={up}
          onPointerCancel={() => (ghost.current = null)}
          onKeyDown={key}
        />
      </div>
      {props.controlled && (
        <details className="ros-Robot-keys">
          <summary>Drag the robot, or click on the picture and use keys</summary>
          <dl id={keys}>
            {KEYS.map(([name, does]) => (
              <React.Fragment key={name}>
                <dt>
                  <kbd>{name}</kbd>
                </dt>
                <dd>{does}</dd>
              </React.Fragment>
            ))}
          </dl>
        </details>
      )}
    </>
  );
}

/** Draw with the screen's own rate while something moves; `data-frames` counts the pictures, for who measures. */
function useDrawing(
  canvas: React.RefObject<HTMLCanvasElement>,
  state: RobotState,
  view: React.MutableRefObject<View>,
  ghost: React.MutableRefObject<Ghost | null>
): void {
  React.useEffect(() => {
    const node = canvas.current!;
    const context = node.getContext('2d', { alpha: false })!;
    let [frames, seen, room, request, size] = [0, -1, state.room, 0, ''];
    let colour = colours(node);
    const theme = new MutationObserver(() => {
      colour = colours(node);
      seen = -1;
    });
    theme.observe(document.body, { attributes: true, attributeFilter: ['data-jp-theme-light', 'data-jp-theme-name'] });
    const again = (now: number) => {
      request = requestAnimationFrame(again);
      const [width, height] = [node.clientWidth, node.clientHeight];
      const ratio = window.devicePixelRatio || 1;
      const is = `${width} ${height} ${ratio}`;
      const changed = state.version !== seen || state.moving(now) || is !== size;
      if (!changed || !width || !height) {
        return;
      }
      if (is !== size || state.room !== room || !state.room.walls.length) {
        if (is !== size) {
          node.width = Math.round(width * ratio);
          node.height = Math.round(height * ratio);
        }
        view.current = viewOf(state, width, height);
        [size, room] = [is, state.room];
      }
      seen = state.version;
      draw(context, state, view.current, colour, now, ghost.current, state.nodes?.sees.length === 0);
      node.dataset.frames = String(++frames);
    };
    request = requestAnimationFrame(again);
    return () => {
      cancelAnimationFrame(request);
      theme.disconnect();
    };
  }, [state]);
}
