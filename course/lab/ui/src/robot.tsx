// The robot view: the room, the robot and its scan, and the controls of a world that runs in real time.

import { LabIcon } from '@jupyterlab/ui-components';
import { Message } from '@lumino/messaging';
import * as React from 'react';

import { Current } from './current';
import { Link, PAGE } from './link';
import { FirstCell, Guard, instead, SidePanel, useCurrent, useTopic } from './panel';
import { Pad, useDriver } from './robot_drive';
import { Knobs, KnobNode, valueOf } from './robot_knobs';
import { Stage } from './robot_stage';
import { RobotState, wrap } from './robot_state';

export const robotIcon = new LabIcon({
  name: 'ros2-course:robot',
  svgstr:
    '<svg xmlns="http://www.w3.org/2000/svg" width="16" viewBox="0 0 24 24"><g class="jp-icon3" fill="#616161">' +
    '<path d="M12 4a8 8 0 1 0 0 16 8 8 0 0 0 0-16zm0 2a6 6 0 1 1 0 12 6 6 0 0 1 0-12z"/>' +
    '<path d="M17.5 12 9 8.2v7.6z"/></g></svg>'
});

const SPEEDS = [0.25, 0.5, 1, 2, 4];
const SCANNERS: [string, number, number][] = [
  ['360 beams, the first one ahead', 360, 0],
  ['360 beams, the first one behind', 360, -Math.PI],
  ['720 beams, the first one behind', 720, -Math.PI],
  ['90 beams, the first one ahead', 90, 0],
  ['24 beams, the first one behind', 24, -Math.PI]
];
const FACTS = 250; // ms between two changes of the numbers: nobody reads faster
const READ = 3000; // ms that a text stays at least
const DROPPED = 'An obstacle was dropped.';
const PLACED = /^The robot (is back at its start|was put at)/;
// The world's parameters that have separate controls, and those that are read only once.
const CONTROLLED = ['paused', 'speed', 'room', 'beams', 'angle_min', 'fast', 'rate', 'seed'];
const SIDES = ['front', 'left', 'right'];

/** The id of the view in JupyterLab's layout. */
export const ROBOT_VIEW = 'ros2-course-robot';

export class RobotPanel extends SidePanel {
  constructor(current: Current) {
    super(current, ROBOT_VIEW, 'Robot', robotIcon);
    this.title.closable = true;
  }

  protected draw(): JSX.Element {
    return <Robot current={this.current} memory={this._memory} />;
  }

  protected forget(): void {
    Object.assign(this._memory.state, new RobotState());
  }

  protected onCloseRequest(message: Message): void {
    super.onCloseRequest(message);
    this.dispose();
  }

  private _memory: Memory = { state: new RobotState(), of: null };
}

/** The robot's state, and its kernel: kept so that a panel that was hidden still shows the path. */
interface Memory {
  state: RobotState;
  of: string | null;
}

function Robot({ current, memory }: { current: Current; memory: Memory }): JSX.Element {
  const { link } = useCurrent(current);
  const { state } = memory;
  const [knobs, setKnobs] = React.useState<KnobNode[]>([]);
  const [rooms, setRooms] = React.useState<{ [name: string]: string }>({});
  const [said, setSaid] = React.useState('');
  const [failed, setFailed] = React.useState('');
  const [dropping, setDropping] = React.useState(false);
  const [refused, setRefused] = React.useState(''); // why the last obstacle was not dropped, while another may be
  const [carrying, setCarrying] = React.useState(false);
  const driver = useDriver(
    (linear, angular) => link!.request('robot.drive', { linear, angular, page: PAGE }),
    setSaid
  );
  const redraw = useFacts(state);
  const hindrance = React.useRef('');
  React.useEffect(() => {
    // What kept the reader from driving is not said any longer than it holds.
    setSaid(before => (before === hindrance.current ? '' : before));
    hindrance.current = state.idle;
  }, [state.idle]);
  const saidAt = React.useRef(0); // ms
  React.useEffect(() => {
    saidAt.current = performance.now();
  }, [said]);
  React.useEffect(() => {
    // Where the robot was put is not said while it drives away from there.
    if (PLACED.test(said) && state.moves?.some(Boolean) && performance.now() - saidAt.current > READ) {
      setSaid('');
    }
  });
  React.useEffect(() => {
    // What is said belongs to the world that is there: it goes with it.
    setSaid('');
    setRefused('');
    // So does the tool: in the next world nothing happens that was meant for this one.
    setDropping(false);
    setCarrying(false);
  }, [state.world]);
  const drive = `${state.room.name} ${state.room.began}`;
  React.useEffect(() => {
    // What was done before a reset.
    setSaid(before => (before === DROPPED || before.startsWith('The robot was put at') ? '' : before));
  }, [drive]);
  const take = (data: any) => {
    state.take(data);
    if (data.robot?.fast) {
      redraw(); // with the picture, which shows another place the next time
    }
  };
  useTopic(link, 'robot', { page: PAGE }, take, () => begin(), setFailed);
  useTopic(link, 'robot.knobs', {}, data => setKnobs(data.nodes), () => setKnobs([]), setFailed);
  const up = link?.state === 'up';
  React.useEffect(() => {
    if (up) {
      link!.request('robot.rooms').then(setRooms, () => setRooms({}));
    }
  }, [link, up]);
  const begin = () => {
    if (link && link.kernelId === memory.of) {
      state.resume();
    } else {
      Object.assign(state, new RobotState());
    }
    memory.of = link?.kernelId ?? null;
    setFailed('');
    setSaid('');
  };
  /** Return what shows the outcome of a request that is sent now: nothing, if the world has ended meanwhile. */
  const outcome = (show: (text: string) => void) => {
    const asked = state.world;
    return (text: string) => void ((!asked || asked === state.world) && show(text));
  };
  /** Send a request to the kernel, and show the outcome. */
  const ask = async (method: string, params: object, done: string) => {
    const show = outcome(setSaid);
    try {
      await link!.request(method, params);
      show(done);
    } catch (error) {
      show((error as Error).message);
    }
  };
  const message = instead(current, link);
  React.useEffect(() => {
    if (message !== null && (link === null || link.wasUp)) {
      driver.stop();
      memory.of = null;
      begin();
    }
  }, [message]);
  const world = knobs.find(node => valueOf(node, 'paused') !== undefined) ?? null;
  const sees = state.nodes?.sees ?? [];
  const [drops, carries] = [world !== null && dropping, world !== null && carrying && !dropping];
  const drivers = [...(state.nodes?.drives ?? []), ...state.silent];
  const paused = world !== null && valueOf(world, 'paused') === true;
  const speed = world === null ? 1 : Number(valueOf(world, 'speed'));
  const claim = React.useRef<{ values: object; done: string; held: boolean } | null>(null);
  React.useEffect(() => {
    // What was set is not said once it is set otherwise.
    const holds = world !== null && Object.entries(claim.current?.values ?? {}).every(([name, value]) => same(valueOf(world, name), value));
    if (claim.current && !holds && claim.current.held) {
      const { done } = claim.current;
      setSaid(before => (before === done ? '' : before));
      claim.current = null;
    } else if (claim.current) {
      claim.current.held = holds;
    }
  }, [knobs]);
  const set = (values: object, done: string) => {
    claim.current = { values, done, held: false };
    return ask('robot.set', { node: world!.name, values }, done);
  };
  const pause = () => void (world && set({ paused: !paused }, paused ? 'The world goes on.' : 'Paused.'));
  const reset = () => void ask('robot.reset', {}, 'The robot is back at its start, and the obstacles are gone.');
  const drop = async (x: number, y: number) => {
    const [show, refuse] = [outcome(setSaid), outcome(dropping ? setRefused : setSaid)]; // the latter by a key
    try {
      await link!.request('robot.drop', { x, y });
      setDropping(false);
      show(DROPPED);
    } catch (error) {
      refuse(dropping ? `${(error as Error).message} ` : (error as Error).message);
    }
  };
  const place = (east: number, north: number, heading: number) => {
    const [x, y] = [east, north].map(each => Math.round(1000 * each) / 1000); // mm, as its position is told
    return ask('robot.place', { x, y, heading }, `The robot was put at x = ${x.toFixed(2)} m, y = ${y.toFixed(2)} m.`);
  };
  /** Take up the tool that drives the robot, or the one that moves it. */
  const choose = (carry: boolean) => {
    setDropping(false);
    setCarrying(carry);
  };
  const faster = (by: number) => {
    const next = SPEEDS.filter(each => (by > 0 ? each > speed : each < speed));
    if (world && next.length) {
      const chosen = by > 0 ? next[0] : next[next.length - 1];
      void set({ speed: chosen }, `Simulation speed: ${chosen} ×`);
    }
  };
  return (
    <>
      <header className="ros-Panel-head ros-Robot-head">
        <h2 className="ros-hidden">Robot</h2>
        {message === null && (
          <span className="ros-quiet">
            {sees.length > 0 && state.room.name && `room: ${state.room.name}`}
          </span>
        )}
        {message === null && !failed && sees.length > 0 && world && (
          <span className="ros-buttons">
            <button onClick={pause}>{paused ? 'Continue' : 'Pause'}</button>
            <button onClick={reset}>Reset</button>
          </span>
        )}
      </header>
      <div className="ros-Panel-message" role="status">
        {failed || message}
      </div>
      <FirstCell current={current} link={link} />
      {message !== null && (link ? link.state === 'waiting' : !current.isOffline) && (
        <p className="ros-quiet">The robot, its room and what it sees are drawn here while a notebook simulates them.</p>
      )}
      {message === null && !failed && state.nodes && (
        <>
          {sees.length === 0 && <NoRobot was={state.scan !== null} rooms={rooms} link={link!} drivers={drivers} />}
          {(sees.length > 0 || state.scan) && (
            <div className="ros-Robot-main">
              <Stage
                state={state}
                controlled={world !== null}
                driver={driver}
                carrying={carries}
                dropping={drops}
                pause={pause}
                reset={reset}
                place={place}
                drop={(x, y) => void drop(x, y)}
                drive={way => (state.idle ? setSaid(state.idle) : driver.press(way))}
                faster={faster}
                cancel={() => setDropping(false)}
              />
              {sees.length > 0 && (
                <div className="ros-Robot-hands">
                  <div className="ros-Robot-controls" role="group" aria-label="Arrow keys and mouse">
                    <span>Arrow keys and mouse:</span>
                    <button aria-pressed={!carries && !drops} onClick={() => choose(false)}>
                      Drive
                    </button>
                    <button
                      aria-pressed={carries}
                      disabled={!world}
                      onClick={() => choose(true)}
                    >
                      Move the robot
                    </button>
                    <button
                      aria-pressed={drops}
                      disabled={!world}
                      onClick={() => {
                        setRefused('');
                        setDropping(!dropping);
                      }}
                    >
                      Drop an obstacle
                    </button>
                  </div>
                  {carries ? (
                    <p className="ros-quiet">
                      Drag the robot, or click on the picture and use the arrow keys, Q and E.
                    </p>
                  ) : (
                    <Pad driver={driver} idle={state.idle} />
                  )}
                </div>
              )}
            </div>
          )}
          <div className="ros-Robot-said" role="status">
            {drops ? `${refused}Click in the room, where the obstacle is to be; Esc cancels.` : said}
          </div>
          {(sees.length > 0 || state.scan) && <Facts state={state} paused={paused} />}
          {knobs.filter(node => node !== world).map(node => (
            <Guard key={node.name} what={`The parameters of ${node.name}`}>
              <Knobs node={node} link={link!} without={[]} />
            </Guard>
          ))}
          {sees.length > 0 && world && (
            <Guard key={`controls ${world.name}`} what={`The controls of ${world.name}`}>
              <Controls world={world} rooms={rooms} room={state.room.name} speed={speed} set={set} />
            </Guard>
          )}
          {sees.length > 0 && !world && (
            <p className="ros-quiet">
              {sees.join(' and ')} cannot be paused or changed from here: a world in fast mode runs as its cell says, and
              a robot of your own as you have written it.
            </p>
          )}
          {world && (
            <Guard key={world.name} what={`The parameters of ${world.name}`}>
              <Knobs node={world} link={link!} without={CONTROLLED} />
            </Guard>
          )}
        </>
      )}
    </>
  );
}

/** The advice for an empty view. */
function NoRobot({
  was,
  rooms,
  link,
  drivers
}: {
  was: boolean; // true if there has been one
  rooms: { [name: string]: string };
  link: Link;
  drivers: string[];
}): JSX.Element {
  const [room, setRoom] = React.useState('hall');
  const [doing, setDoing] = React.useState(false);
  const [failed, setFailed] = React.useState('');
  const start = async (event: React.MouseEvent) => {
    event.currentTarget.closest<HTMLElement>('.ros-Panel')?.focus(); // this button will be gone
    setDoing(true);
    setFailed('');
    try {
      await link.request('robot.start', { room });
    } catch (error) {
      setFailed((error as Error).message);
    }
    setDoing(false);
  };
  return (
    <>
      <p className="ros-Panel-message">
        No robot {was ? 'any more' : 'yet'}. Run a cell that starts a world, or start one here: the node <code>/world</code>, in real time
        {drivers.length ? `, for ${drivers.join(' and ')}` : ''}.
      </p>
      <div className="ros-Robot-controls">
        <label>
          Room
          <select value={room} onChange={event => setRoom(event.target.value)}>
            {Object.entries(rooms).map(([name, about]) => (
              <option key={name} value={name}>
                {name}: {about}
              </option>
            ))}
          </select>
        </label>
        <button disabled={doing} onClick={event => void start(event)}>
          Start a world
        </button>
      </div>
      <div role="status">{failed}</div>
    </>
  );
}

function Controls({
  world,
  rooms,
  room,
  speed,
  set
}: {
  world: KnobNode;
  rooms: { [name: string]: string };
  room: string;
  speed: number;
  set: (values: object, done: string) => Promise<void>;
}): JSX.Element {
  const [beams, first] = [Number(valueOf(world, 'beams')), Number(valueOf(world, 'angle_min'))];
  const scanner = SCANNERS.findIndex(each => each[1] === beams && Math.abs(each[2] - first) < 1e-3);
  const speeds = SPEEDS.includes(speed) ? SPEEDS : [...SPEEDS, speed].sort((one, other) => one - other);
  return (
    <div className="ros-Robot-controls" role="group" aria-label="The world">
      <label>
        Simulation speed
        <select
          value={speed}
          onChange={event => void set({ speed: Number(event.target.value) }, `Simulation speed: ${event.target.value} ×`)}
        >
          {speeds.map(each => (
            <option key={each} value={each}>
              {Number(each.toPrecision(3))} ×
            </option>
          ))}
        </select>
      </label>
      <label>
        Room
        <select value={room} onChange={event => void set({ room: event.target.value }, `Room: ${event.target.value}`)}>
          {!(room in rooms) && <option value={room}>{room}</option>}
          {Object.keys(rooms).map(name => (
            <option key={name} value={name}>
              {name}
            </option>
          ))}
        </select>
      </label>
      <label>
        Scanner
        <select
          value={scanner}
          onChange={event => {
            const [name, beams, first] = SCANNERS[Number(event.target.value)];
            void set({ beams, angle_min: first }, `Scanner: ${name}`);
          }}
        >
          {scanner < 0 && (
            <option value={-1}>
              {beams} beams, the first one at {Math.round((first * 180) / Math.PI)}°
            </option>
          )}
          {SCANNERS.map(([name], number) => (
            <option key={name} value={number}>
              {name}
            </option>
          ))}
        </select>
      </label>
    </div>
  );
}

/** Return true if a parameter has the value to which it was set; numbers may be rounded. */
function same(value: unknown, wanted: unknown): boolean {
  return typeof value === 'number' && typeof wanted === 'number' ? Math.abs(value - wanted) < 1e-3 : value === wanted;
}

/** The numbers of the view as text. */
function Facts({ state, paused }: { state: RobotState; paused: boolean }): JSX.Element {
  const sectors = state.scan?.sectors;
  const [unseen, unmeasured] = [state.unseen(performance.now()), state.unmeasured(performance.now())];
  const speeds = state.moves && `${said(state.moves[0])} m/s, ${said(state.moves[1])} rad/s`;
  return (
    <dl className={`ros-Robot-facts${state.nodes?.sees.length ? '' : ' ros-mod-old'}`} aria-label="What the robot sees and does">
      {SIDES.map(side => (
        <div key={side}>
          <span className="ros-Robot-swatch" style={{ background: `var(--ros-robot-${side})` }} aria-hidden="true" />
          <dt>{side}</dt>
          <dd>{sectors ? (sectors[side] === null ? 'free' : `${sectors[side]!.toFixed(2)} m`) : '–'}</dd>
        </div>
      ))}
      <div className="ros-mod-line">
        <dt>command</dt>
        <dd>
          {state.command && `${said(state.command[0])} m/s, ${said(state.command[1])} rad/s: `}
          {state.doing}
        </dd>
      </div>
      {state.nodes !== null && state.nodes.sees.length > 0 && (
        <div className="ros-mod-line ros-mod-driver">
          <dt>driven by</dt> <dd>{state.driver}</dd>
        </div>
      )}
      {state.pose && (
        <div className="ros-mod-long">
          <dt>position</dt>
          <dd>
            x {said(state.pose[0])} m, y {said(state.pose[1])} m, {Math.round((wrap(state.pose[2]) * 180) / Math.PI)}°
          </dd>
        </div>
      )}
      {state.moves && (
        <div className="ros-mod-long">
          <dt>measured</dt>
          <dd>{paused ? 'paused' : unmeasured ? `nothing for ${unmeasured} s` : speeds}</dd>
        </div>
      )}
      <div>
        <dt>collisions</dt>
        <dd>{state.collisions.count || 'none'}</dd>
      </div>
      {state.says && (
        <div>
          <dt>state</dt>
          <dd>
            <code>{state.says}</code>
          </dd>
        </div>
      )}
      {unseen > 0 && (
        <div>
          <dt>no scan</dt>
          <dd>for {unseen} s</dd>
        </div>
      )}
    </dl>
  );
}

function said(value: number | null): string {
  return value === null ? 'no number' : value.toFixed(2);
}

/** Draw the numbers again from time to time, if there is new data or the last data get old, and when it is asked to. */
function useFacts(state: RobotState): () => void {
  const [, redraw] = React.useReducer((count: number) => count + 1, 0);
  React.useEffect(() => {
    let seen = -1;
    const timer = window.setInterval(() => {
      const now = performance.now();
      if (state.version !== seen || state.unseen(now) > 0 || state.unmeasured(now) > 0) {
        seen = state.version;
        redraw();
      }
    }, FACTS);
    return () => window.clearInterval(timer);
  }, [state]);
  return redraw;
}
