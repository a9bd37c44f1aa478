// The page's state of the robot: the newest data of everything, interpolated for each picture.

export type Pose = [number, number, number]; // x (m), y (m), heading (rad)

export interface Scan {
  first: number; // rad, of the first beam
  step: number; // rad
  beams: number; // of the scanner; `ranges` may have only a part of them
  reach: number | null; // m
  ranges: number[]; // cm; -1 is nothing in reach, -2 no measurement
  from: Pose | null;
  sectors: { [name: string]: number | null }; // m; null is free
}

/** A place of the robot's path: x (m), y (m), and time (s, on a separate clock). */
export type Place = [number, number, number];

const TRAIL = 1200; // places
const JUMP = 0.7; // m between two poses: the robot was put there instead of driving
const STALE = 1500; // ms without a message
const PAUSE = 1000; // ms without a place: the robot is drawn where it is now, and not on its way there
const REST = 0.005; // m/s, rad/s: what is shown as 0.00

export class RobotState {
  collisions: { count: number; last: string; places: [number, number][] } = { count: 0, last: '', places: [] };
  command: [number | null, number | null] | null = null;
  fast = false; // true if its world is in fast mode: what is shown is of one moment, and not interpolated
  hand = ''; // who drives the robot by hand, in words, or ''
  idle = ''; // why driving by hand is impossible, or ''
  moves: [number | null, number | null] | null = null;
  nodes: { sees: string[]; drives: string[] } | null = null;
  pose: Pose | null = null;
  room: { name: string; walls: number[]; began: number } = { name: '', walls: [], began: 0 }; // began: ms
  scan: Scan | null = null;
  says = ''; // the state that the driver logs
  movesAt = 0; // ms, on the page's clock
  scanAt = 0; // ms, on the page's clock
  silent: string[] = []; // who could drive, and sends no commands
  trail: Place[] = [];
  world = ''; // another text for each world; '' without one
  version = 0; // changes with all new data

  /** Forget all but the path in this room, and that it was driven: the view was hidden for a while. */
  resume(): void {
    const { trail, room, _drive, _driven } = this;
    Object.assign(this, new RobotState(), { trail, room, _drive, _driven });
  }

  /** Update the state with new data. */
  take(data: any): void {
    const now = performance.now();
    const sectors = this.sectors(now);
    this.version++;
    if (data.room) {
      const drive = `${data.room.name} ${data.room.began}`;
      if (data.room.name && drive !== this._drive) {
        this.trail = this._told ? this.trail : [];
        this._drive = drive;
        this._driven = this.command !== null;
      }
      this.room = data.room;
    }
    if (data.path) {
      this._told = data.path.places !== null;
      this.trail = data.path.anew ? [] : this.trail;
      this.trail.push(...(data.path.places ?? []));
      this.trail.splice(0, this.trail.length - TRAIL);
    }
    if (data.robot) {
      this.fast = data.robot.fast === true;
      if (data.robot.moves !== undefined) {
        this.moves = data.robot.moves;
        this.movesAt = now;
      }
      this._arrive(data.robot.pose, now);
    }
    if (data.scan) {
      this._sectors = sectors;
      this.scan = data.scan;
      this.scanAt = now;
    }
    if (data.command !== undefined) {
      this.command = data.command;
      this._driven = this._driven || data.command !== null;
    }
    this.hand = data.hand ?? this.hand;
    this.idle = data.idle ?? this.idle;
    this.silent = data.silent ?? this.silent;
    this.says = data.state ?? this.says;
    this.collisions = data.collisions ?? this.collisions;
    if (data.nodes?.sees.length && this.nodes?.sees.length === 0) {
      this._driven = this.command !== null; // another robot
    }
    this.nodes = data.nodes ?? this.nodes;
    this.world = data.world ?? this.world;
  }

  /** Return the effect of the last command, in words; a world in fast mode stands still in the middle of a drive. */
  get doing(): string {
    if (this.command !== null || !this._driven) {
      return doing(this.command);
    }
    const rests = this.moves?.every(speed => speed !== null && Math.abs(speed) < REST);
    return rests ? 'none any more: the robot has stopped' : 'none any more';
  }

  /** Return who drives, in words. */
  get driver(): string {
    if (this.hand || this.nodes?.drives.length) {
      return this.hand || this.nodes!.drives.join(' and ');
    }
    const [are, send] = this.silent.length > 1 ? ['are', 'send'] : ['is', 'sends'];
    return this.silent.length ? `nobody: ${this.silent.join(' and ')} ${are} there and ${send} no commands` : 'nobody';
  }

  /** Return for how long no scan has come, in s; 0 while they come, and before the first one. */
  unseen(now: number): number {
    return this.scan === null ? 0 : silence(this.scanAt, now);
  }

  /** Return for how long no speed has been measured, in s; 0 while it is, and before the first one. */
  unmeasured(now: number): number {
    return this.moves === null ? 0 : silence(this.movesAt, now);
  }

  /** Return where to draw the robot: interpolated between the last two known places. */
  shown(now: number): Pose | null {
    if (!this.pose || !this._before) {
      return this.pose;
    }
    const share = this._share(now);
    const [from, to] = [this._before, this.pose];
    return [
      from[0] + share * (to[0] - from[0]),
      from[1] + share * (to[1] - from[1]),
      from[2] + share * wrap(to[2] - from[2])
    ];
  }

  /** Return the nearest distance in each sector (m, null is free) where the robot is shown, between its last two scans. */
  sectors(now: number): { [name: string]: number | null } {
    const share = this._before ? this._share(now) : 1;
    return Object.fromEntries(
      Object.entries(this.scan?.sectors ?? {}).map(([name, to]) => {
        const from = this._sectors[name];
        const between = typeof from === 'number' && to !== null;
        return [name, between ? from + share * (to - from) : share < 0.5 && from !== undefined ? from : to];
      })
    );
  }

  /** Return true if the picture of this moment differs from that of the last change. */
  moving(now: number): boolean {
    return this._before !== null && now - this._since <= this._gap + 50;
  }

  /** Return how far the robot is shown on its way from the place before the last to the last one, from 0 to 1. */
  private _share(now: number): number {
    return Math.max(0, Math.min(1, (now - this._since) / this._gap));
  }

  private _arrive(pose: Pose | null, now: number): void {
    if (!pose || pose.includes(null as any)) {
      return;
    }
    const before = this.pose ?? this.trail[this.trail.length - 1];
    const jumped = !before || Math.hypot(pose[0] - before[0], pose[1] - before[1]) > JUMP;
    const shown = this.shown(now);
    const stands = pose.every((each, part) => each === shown?.[part]); // each scan is one picture, and not three
    this._before = jumped || stands || this.fast || !this.pose || now - this._since > PAUSE ? null : shown;
    this._gap = Math.min(400, Math.max(30, now - this._since));
    this._since = now;
    this.pose = pose;
    if (this._told) {
      return; // the world sends its path separately, with the places between two looks
    }
    const last = this.trail[this.trail.length - 1];
    if (jumped) {
      this.trail = [];
    }
    if (!last || jumped || Math.hypot(pose[0] - last[0], pose[1] - last[1]) > 0.02) {
      this.trail.push([pose[0], pose[1], now / 1000]);
      this.trail.splice(0, this.trail.length - TRAIL);
    }
  }

  private _drive = ''; // the drive that the trail belongs to
  private _driven = false; // true if a command has come
  private _told = false; // true if the path comes from the world
  private _before: Pose | null = null;
  private _gap = 100; // ms between the last two places
  private _sectors: { [name: string]: number | null } = {}; // shown when the last scan came
  private _since = 0;
}

/** Return for how long nothing has come since `at` (ms), in s; 0 while that is no longer than usual. */
function silence(at: number, now: number): number {
  return now - at < STALE ? 0 : Math.round((now - at) / 1000);
}

export function wrap(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

function doing(speeds: [number | null, number | null] | null): string {
  if (!speeds) {
    return 'none';
  }
  const [linear, angular] = speeds;
  if (linear === null || angular === null) {
    return 'not a number: the robot does not move';
  }
  const turn = angular > 0.02 ? 'left' : angular < -0.02 ? 'right' : '';
  if (Math.abs(linear) < 0.005) {
    return turn ? `turning ${turn}` : 'standing';
  }
  const way = linear > 0 ? 'forward' : 'backward';
  return turn ? `${way}, to the ${turn}` : way;
}
