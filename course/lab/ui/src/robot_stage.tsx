// The canvas of the robot view: it is drawn when something moves, and handles mouse, touch and keys.

import * as React from 'react';

import { drawAgain } from './drawing';
import { Driver, Way } from './robot_drive';
import { colours, draw, Ghost, RADIUS, toRoom, View, viewOf, Zoom } from './robot_picture';
import { Pose, RobotState } from './robot_state';

const STEP = 0.1; // m for an arrow key
const TURN = Math.PI / 12; // rad
const AHEAD = 0.8; // m from the robot to an obstacle that a key drops
const GRIP = 12; // px around the robot where it can also be picked up
const CLOSEST = 16; // times the whole room
const ROUNDED = 1e-6; // of a zoom that is back at the whole room
const KEYS: [string, string][] = [
  ['Space', 'pause, continue'],
  ['O', `drop an obstacle ${AHEAD} m ahead`],
  ['Shift+R', 'reset'],
  ['+, −', 'faster, slower simulation']
];
const DRIVE: [string, string][] = [['Arrow keys', 'drive, as long as they are held']];
const CARRY: [string, string][] = [
  ['Arrow keys', `move the robot by ${STEP} m`],
  ['Q, E', 'turn it to the left, to the right']
];
const LOOK: [string, string][] = [
  ['I, U, 0', 'zoom in, zoom out, the whole room'],
  ['Ctrl and wheel', 'zoom in, zoom out'],
  ['Drag', 'move the picture, when it is zoomed in']
];
const DRAWN: [string, string][] = [
  ['circle', 'the robot; its nose points ahead'],
  ['black or white lines', 'walls and obstacles'],
  ['orange dots', 'where the laser’s last scan hit something'],
  ['orange line', 'from the laser towards its first beam'],
  ['sectors', 'how far it is free to the front, to the left and to the right'],
  ['dashed line', 'the way so far; the older, the fainter'],
  ['crosses', 'collisions']
];

interface Props {
  state: RobotState;
  controlled: boolean; // true if there is a world that can be controlled
  driver: Driver;
  carrying: boolean; // true if the robot can be picked up; otherwise arrow keys drive it
  dropping: boolean; // true if the next chosen place is for an obstacle
  pause: () => void;
  reset: () => void;
  place: (x: number, y: number, heading: number) => Promise<void>;
  drop: (x: number, y: number) => void;
  drive: (way: Way) => void;
  faster: (by: number) => void;
  cancel: () => void;
}

export function Stage(props: Props): JSX.Element {
  const canvas = React.useRef<HTMLCanvasElement>(null);
  const now = React.useRef(props);
  now.current = props;
  const ghost = React.useRef<Ghost | null>(null);
  const view = React.useRef<View>({ scale: 1, left: 0, bottom: 0 });
  const zoom = React.useRef<Zoom>({ factor: 1, at: null });
  const [factor, setFactor] = React.useState(1); // of the zoom: its buttons show how far it goes
  const pan = React.useRef<[number, number] | null>(null); // m: the place that stays below the pointer
  const wanted = React.useRef<{ pose: Pose; until: number } | null>(null);
  useDrawing(canvas, props.state, view, ghost, zoom);
  const closer = (by: number) => {
    const wanted = by * zoom.current.factor;
    const factor = wanted < 1 + ROUNDED ? 1 : Math.min(CLOSEST, wanted);
    zoom.current = { factor, at: factor > 1 ? zoom.current.at : null };
    setFactor(factor);
    props.state.version++;
  };
  const whole = () => closer(0);
  useWheel(canvas, closer);

  /** Return where the robot is, or will be after the last command. */
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
    if (event.button !== 0) {
      return;
    }
    const [x, y] = at(event);
    const robot = props.state.shown(performance.now());
    if (props.controlled && props.dropping) {
      ghost.current = { kind: 'obstacle', at: [x, y] };
    } else if (props.controlled && props.carrying && robot && Math.hypot(x - robot[0], y - robot[1]) <= RADIUS + GRIP / view.current.scale) {
      ghost.current = { kind: 'robot', at: [x, y] };
    } else if (zoom.current.factor > 1) {
      pan.current = [x, y];
    } else {
      return;
    }
    event.currentTarget.setPointerCapture(event.pointerId);
  };
  const move = (event: React.PointerEvent) => {
    const robot = props.state.shown(performance.now());
    if (pan.current && (zoom.current.at || robot)) {
      const { left, bottom, scale } = view.current;
      const [x, y] = at(event);
      const [east, north] = [x - pan.current[0], y - pan.current[1]];
      const middle = zoom.current.at ?? robot!;
      zoom.current.at = [middle[0] - east, middle[1] - north];
      view.current = { scale, left: left + scale * east, bottom: bottom - scale * north }; // there may be more moves
      props.state.version++;
    }
    if (ghost.current && event.currentTarget.hasPointerCapture(event.pointerId)) {
      ghost.current.at = at(event);
      props.state.version++;
    }
  };
  const up = (event: React.PointerEvent) => {
    pan.current = null;
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
    if (event.key === 'Escape' && (props.dropping || ghost.current)) {
      event.preventDefault(); // the next one leaves the panel
      ghost.current = null;
      props.cancel();
    }
    if (event.ctrlKey || event.altKey || event.metaKey || !act(event)) {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  };
  /** Do the action of a key; return false if it has none. */
  const act = (event: React.KeyboardEvent): boolean => {
    const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const way = Driver.way(pressed);
    const views: { [key: string]: () => void } = { i: () => closer(1.5), u: () => closer(1 / 1.5), 0: whole };
    if (views[pressed]) {
      views[pressed]();
      return true;
    }
    if (way && !props.carrying) {
      props.drive(way);
      return true;
    }
    if (!props.controlled) {
      return false;
    }
    const robot = pose();
    const moves: { [key: string]: [number, number] } = {
      ArrowUp: [0, STEP],
      ArrowDown: [0, -STEP],
      ArrowLeft: [-STEP, 0],
      ArrowRight: [STEP, 0]
    };
    if (props.carrying && robot && moves[pressed]) {
      put(robot[0] + moves[pressed][0], robot[1] + moves[pressed][1], robot[2]);
    } else if (props.carrying && robot && (pressed === 'q' || pressed === 'e')) {
      put(robot[0], robot[1], robot[2] + (pressed === 'q' ? TURN : -TURN));
    } else if (robot && pressed === 'o') {
      props.drop(robot[0] + AHEAD * Math.cos(robot[2]), robot[1] + AHEAD * Math.sin(robot[2]));
    } else if (pressed === ' ') {
      props.pause();
    } else if (pressed === 'r' && event.shiftKey) {
      props.reset();
    } else if (pressed === '+' || pressed === '-') {
      props.faster(pressed === '+' ? 1 : -1);
    } else {
      return false;
    }
    return true;
  };
  const letGo = (event: React.KeyboardEvent) => {
    const way = Driver.way(event.key);
    if (way) {
      props.driver.release(way);
    }
  };
  const rows = [
    ...(props.carrying ? CARRY : DRIVE),
    ...(props.controlled ? KEYS : []),
    ...LOOK
  ];
  const keys = React.useId();
  return (
    <>
      <div className="ros-Robot-stage">
        <canvas
          ref={canvas}
          className={`ros-Robot-canvas${props.dropping ? ' ros-mod-dropping' : ''}`}
          role="application"
          aria-label="The robot, and what it sees around it"
          aria-describedby={keys}
          tabIndex={0}
          onPointerDown={down}
          onPointerMove={move}
          onPointerUp={up}
          onPointerCancel={() => (ghost.current = pan.current = null)}
          onKeyDown={key}
          onKeyUp={letGo}
          onBlur={() => props.driver.releaseKeys()}
        />
      </div>
      <div className="ros-Robot-under">
        <div className="ros-Robot-zoom" role="group" aria-label="Zoom">
          <button title="Zoom in (I)" aria-disabled={factor === CLOSEST} onClick={() => closer(1.5)}>
            Zoom in
          </button>
          <button title="Zoom out (U)" aria-disabled={factor === 1} onClick={() => closer(1 / 1.5)}>
            Zoom out
          </button>
          <button title="Show the whole room (0)" aria-disabled={factor === 1} onClick={whole}>
            Fit room
          </button>
        </div>
        <details className="ros-Robot-keys">
          <summary>Keys and legend</summary>
          <dl id={keys}>
            {rows.map(([name, does]) => (
              <React.Fragment key={`${name} ${does}`}>
                <dt>
                  <kbd>{name}</kbd>
                </dt>
                <dd>{does}</dd>
              </React.Fragment>
            ))}
          </dl>
          <dl>
            {DRAWN.map(([name, is]) => (
              <React.Fragment key={name}>
                <dt>{name}</dt>
                <dd>{is}</dd>
              </React.Fragment>
            ))}
          </dl>
        </details>
      </div>
    </>
  );
}

/** Zoom the picture by the wheel with Ctrl, as the page is zoomed, and by a pinch. */
function useWheel(canvas: React.RefObject<HTMLCanvasElement>, closer: (by: number) => void): void {
  const now = React.useRef(closer);
  now.current = closer;
  React.useEffect(() => {
    const node = canvas.current!;
    const turn = (event: WheelEvent) => {
      if (event.ctrlKey) {
        event.preventDefault();
        now.current(1.2 ** -Math.sign(event.deltaY));
      }
    };
    node.addEventListener('wheel', turn, { passive: false }); // React's own listener could not prevent the page's zoom
    return () => node.removeEventListener('wheel', turn);
  }, []);
}

/** Draw while something moves; for measurements, `data-frames` counts the
 * pictures, and `data-view` has the scale (px per metre) and the place of x = 0, y = 0 (px).
 */
function useDrawing(
  canvas: React.RefObject<HTMLCanvasElement>,
  state: RobotState,
  view: React.MutableRefObject<View>,
  ghost: React.MutableRefObject<Ghost | null>,
  zoom: React.MutableRefObject<Zoom>
): void {
  React.useEffect(() => {
    const node = canvas.current!;
    const context = node.getContext('2d', { alpha: false })!;
    let [frames, seen, size] = [0, -1, ''];
    let colour = colours(node);
    const theme = new MutationObserver(() => {
      colour = colours(node);
      seen = -1;
    });
    theme.observe(document.body, { attributes: true, attributeFilter: ['data-jp-theme-light', 'data-jp-theme-name'] });
    const end = drawAgain(now => {
      const [width, height] = [node.clientWidth, node.clientHeight];
      const ratio = window.devicePixelRatio || 1;
      const is = `${width} ${height} ${ratio}`;
      const changed = state.version !== seen || state.moving(now) || is !== size;
      if (!changed || !width || !height) {
        return;
      }
      if (is !== size) {
        node.width = Math.round(width * ratio);
        node.height = Math.round(height * ratio);
        size = is;
      }
      view.current = viewOf(state, width, height, zoom.current, now);
      seen = state.version;
      draw(context, state, view.current, colour, now, ghost.current, state.nodes?.sees.length === 0);
      node.dataset.frames = String(++frames);
      node.dataset.view = `${view.current.scale} ${view.current.left} ${view.current.bottom}`;
    });
    return () => {
      end();
      theme.disconnect();
    };
  }, [state]);
}
