// Driving by hand, with the arrow keys on the picture and with buttons, for as long as one is down.

import * as React from 'react';

export type Way = 'forward' | 'backward' | 'left' | 'right';
type By = 'key' | 'pointer';

const WAYS: { [way in Way]: { name: string; sign: string; linear: number; angular: number } } = {
  forward: { name: 'Drive forward', sign: '▲', linear: 1, angular: 0 },
  left: { name: 'Turn left', sign: '◀', linear: 0, angular: 1 },
  backward: { name: 'Drive backward', sign: '▼', linear: -1, angular: 0 },
  right: { name: 'Turn right', sign: '▶', linear: 0, angular: -1 }
};
const ARROWS: { [key: string]: Way } = {
  ArrowUp: 'forward',
  ArrowDown: 'backward',
  ArrowLeft: 'left',
  ArrowRight: 'right'
};
const AGAIN = 100; // ms between two commands; the kernel stops the robot 800 ms after the last one, or when the page is gone
const TURN = 2.5; // rad/s for each m/s
const PULSE = 500; // ms of driving for a click without a press, as from a screen reader
const SPEED = { least: 0.1, usual: 0.3, most: 0.5 }; // m/s

/** The driver: the keys and buttons held down, sent to the kernel repeatedly. */
export class Driver {
  speed = SPEED.usual;

  constructor(
    private _send: (linear: number, angular: number) => Promise<unknown>,
    private _failed: (why: string) => void
  ) {}

  /** Return the direction of an arrow key. */
  static way(key: string): Way | undefined {
    return ARROWS[key];
  }

  press(way: Way, by: By = 'key'): void {
    this._held[by].add(way);
    if (!this._busy) {
      void this._drive();
    }
  }

  release(way: Way, by: By = 'key'): void {
    this._held[by].delete(way);
    this._wake();
  }

  /** Let go of the keys, whose release is not heard once the focus is elsewhere.
   *
   * A button that is pressed is not let go: pressing it takes the focus from the one before.
   */
  releaseKeys(): void {
    this._held.key.clear();
    this._wake();
  }

  /** Let go of everything, and stop the robot at once. */
  stop(): void {
    this._held.pointer.clear();
    this.releaseKeys();
  }

  private get _ways(): Set<Way> {
    return new Set([...this._held.key, ...this._held.pointer]);
  }

  private async _drive(): Promise<void> {
    this._busy = true;
    try {
      // One request at a time, or a stop could overtake the command before it.
      while (this._ways.size) {
        const ways = [...this._ways].map(way => WAYS[way]);
        const sum = (of: 'linear' | 'angular') => ways.reduce((total, way) => total + way[of], 0);
        await this._send(this.speed * sum('linear'), TURN * this.speed * sum('angular'));
        await new Promise<void>(done => {
          this._wake = done;
          window.setTimeout(done, AGAIN);
        });
      }
      await this._send(0, 0);
    } catch (error) {
      this.stop();
      this._failed((error as Error).message);
    }
    this._busy = false;
    if (this._ways.size) {
      void this._drive(); // a key was pressed while the stop was being sent
    }
  }

  private _busy = false;
  private _held = { key: new Set<Way>(), pointer: new Set<Way>() };
  private _wake = () => {};
}

/** Return a driver for as long as the component is mounted; it releases everything when the page is left. */
export function useDriver(
  send: (linear: number, angular: number) => Promise<unknown>,
  failed: (why: string) => void
): Driver {
  const now = React.useRef({ send, failed });
  now.current = { send, failed };
  const driver = React.useMemo(
    () =>
      new Driver(
        (linear, angular) => now.current.send(linear, angular),
        why => now.current.failed(why)
      ),
    []
  );
  React.useEffect(() => {
    const stop = () => driver.stop();
    window.addEventListener('blur', stop);
    document.addEventListener('visibilitychange', stop);
    return () => {
      window.removeEventListener('blur', stop);
      document.removeEventListener('visibilitychange', stop);
      stop();
    };
  }, [driver]);
  return driver;
}

/** Buttons for driving; `idle` is why driving is impossible, or "". */
export function Pad({ driver, idle }: { driver: Driver; idle: string }): JSX.Element {
  const [speed, setSpeed] = React.useState(driver.speed);
  const why = React.useId();
  React.useEffect(() => {
    if (idle) {
      driver.stop();
    }
  }, [idle]);
  const press = (way: Way, by: By = 'key') => (idle ? undefined : driver.press(way, by));
  return (
    <div
      className="ros-Robot-pad"
      role="group"
      aria-label="Drive"
      onKeyDown={event => {
        const way = Driver.way(event.key);
        if (way && !(event.target instanceof HTMLInputElement)) {
          event.preventDefault();
          event.stopPropagation();
          press(way);
        }
      }}
      onKeyUp={event => {
        const way = Driver.way(event.key);
        if (way) {
          driver.release(way);
        }
      }}
      onBlur={() => driver.releaseKeys()}
    >
      <div className="ros-Robot-arrows">
        {(Object.keys(WAYS) as Way[]).map(way => (
          <button
            key={way}
            className={`ros-mod-${way}`}
            aria-label={WAYS[way].name}
            aria-describedby={idle ? why : undefined}
            aria-disabled={idle !== ''}
            title={`${WAYS[way].name}, as long as it is pressed`}
            onPointerDown={event => {
              if (event.button === 0) {
                event.currentTarget.setPointerCapture(event.pointerId);
                press(way, 'pointer');
              }
            }}
            onLostPointerCapture={() => driver.release(way, 'pointer')}
            onContextMenu={event => event.preventDefault()}
            onKeyDown={event => {
              if (event.key === ' ' || event.key === 'Enter') {
                event.preventDefault();
                press(way);
              }
            }}
            onKeyUp={event => {
              if (event.key === ' ' || event.key === 'Enter') {
                event.preventDefault(); // in Firefox it would also be a click
                driver.release(way);
              }
            }}
            onClick={event => {
              if (event.detail === 0) {
                press(way);
                window.setTimeout(() => driver.release(way), PULSE);
              }
            }}
          >
            <span aria-hidden="true">{WAYS[way].sign}</span>
          </button>
        ))}
      </div>
      <div>
        <label>
          Driving speed: {speed.toFixed(1)} m/s
          <input
            type="range"
            min={SPEED.least}
            max={SPEED.most}
            step={0.1}
            value={speed}
            aria-valuetext={`${speed.toFixed(1)} m/s`}
            onChange={event => setSpeed((driver.speed = Number(event.target.value)))}
          />
        </label>
        <p id={why} className="ros-quiet" role="status">
          {idle || 'Hold a button, or click on the picture and hold an arrow key.'}
        </p>
      </div>
    </div>
  );
}
