// A page's connection to one kernel, which works while a cell runs: see course/lab/protocol.py.

import { URLExt } from '@jupyterlab/coreutils';
import { ServerConnection } from '@jupyterlab/services';
import { IDisposable, DisposableDelegate } from '@lumino/disposable';
import { ISignal, Signal } from '@lumino/signaling';

import { answers, LONGEST } from './server';

/** The state of the kernel: `waiting` for a live session, `up`, `offline` if the server does not answer, `gone`
 * if it answers and has no such kernel (any more), or `connecting`, at first, while it is asked, and after a message
 * that was too long.
 */
export type State = 'connecting' | 'waiting' | 'up' | 'offline' | 'gone';

interface Pending {
  resolve: (result: any) => void;
  reject: (error: Error) => void;
}

interface Subscription {
  topic: string;
  options: object;
  take: (data: any) => void;
  begin: () => void; // called before the first data after a failure
  failed: (why: string) => void; // called with '' when it goes on
  hasFailed: boolean;
}

/** The page's own name in the kernel, which tells the pages apart that drive the robot. */
export const PAGE = crypto.getRandomValues(new Uint32Array(4)).join('-');

const AGAIN = 3000; // ms until a subscription that has ended with an error is begun again

export class Link implements IDisposable {
  /** Link a kernel; `missed` is called when the server no longer has it. */
  constructor(
    readonly kernelId: string,
    private _missed: () => void
  ) {
    this._connect();
  }

  get state(): State {
    return this._state;
  }

  /** True if there was a live session before: then `waiting` means that the kernel has ended. */
  get wasUp(): boolean {
    return this._wasUp;
  }

  get changed(): ISignal<this, void> {
    return this._changed;
  }

  get isDisposed(): boolean {
    return this._disposed;
  }

  /** Call a method of a panel in the kernel; rejects with a sentence for the reader. */
  request(method: string, params: object = {}): Promise<any> {
    if (this._state !== 'up') {
      return Promise.reject(new Error('The kernel has no live session: run the first cell of the notebook.'));
    }
    const id = this._next++;
    return new Promise((resolve, reject) => {
      this._pending.set(id, { resolve, reject });
      this._send({ id, method, params });
    });
  }

  /** Follow a topic until the result is disposed, even over restarts of the kernel and errors of its feed. */
  subscribe(
    topic: string,
    options: object,
    take: (data: any) => void,
    begin: () => void,
    failed: (why: string) => void
  ): IDisposable {
    const subscription = { topic, options, take, begin, failed, hasFailed: false };
    this._wanted.add(subscription);
    if (this._state === 'up') {
      this._begin(subscription);
    }
    return new DisposableDelegate(() => {
      this._wanted.delete(subscription);
      for (const [id, each] of this._running) {
        if (each === subscription) {
          this._running.delete(id);
          if (this._state === 'up') {
            this._send({ id: this._next++, method: 'unsubscribe', params: { id } });
          }
        }
      }
    });
  }

  dispose(): void {
    if (this._disposed) {
      return;
    }
    this._disposed = true;
    window.clearTimeout(this._timer);
    this._socket?.close();
    this._reject('The notebook was closed.');
    Signal.clearData(this);
  }

  private _connect(): void {
    const settings = ServerConnection.makeSettings();
    const token = settings.appendToken && settings.token ? `?token=${encodeURIComponent(settings.token)}` : '';
    const url = URLExt.join(settings.wsUrl, 'course/lab', encodeURIComponent(this.kernelId)) + token;
    const socket = new settings.WebSocket(url);
    this._socket = socket;
    socket.onopen = () => {
      this._delay = 1000;
    };
    socket.onmessage = event => this._receive(JSON.parse(event.data));
    socket.onclose = () => {
      if (!this._disposed) {
        void this._lost();
      }
    };
  }

  /** Tell whether the server or only the kernel is gone, and try again. */
  private async _lost(): Promise<void> {
    if (this._state !== 'offline' && this._state !== 'gone') {
      this._set('connecting');
    }
    const state = (await answers(`api/kernels/${encodeURIComponent(this.kernelId)}`)) === 404 ? 'gone' : 'offline';
    if (!this._disposed) {
      this._set(state);
      this._timer = window.setTimeout(() => this._connect(), this._delay);
      this._delay = Math.min(2 * this._delay, LONGEST);
      if (state === 'gone') {
        this._missed();
      }
    }
  }

  private _receive(message: any): void {
    if (this._disposed) {
      return;
    }
    if (message.link !== undefined) {
      this._set(message.link);
    } else if (message.topic !== undefined) {
      this._event(message);
    } else if (this._pending.has(message.id)) {
      const { resolve, reject } = this._pending.get(message.id)!;
      this._pending.delete(message.id);
      if (message.error === undefined) {
        resolve(message.result);
      } else {
        reject(new Error(message.error));
      }
    }
  }

  private _event(message: any): void {
    const subscription = this._running.get(message.id);
    if (subscription && message.error !== undefined) {
      this._running.delete(message.id);
      subscription.hasFailed = true;
      subscription.failed(message.error);
      window.setTimeout(() => this._beginAgain(subscription), AGAIN); // what it could not tell may be gone
    } else if (subscription) {
      // Acknowledged after the page has drawn it, so that the kernel sends no faster; also if it could not take it.
      window.setTimeout(() => this._send({ ack: message.id }), 0);
      if (subscription.hasFailed) {
        subscription.hasFailed = false;
        subscription.begin();
        subscription.failed('');
      }
      subscription.take(message.data);
    }
  }

  private _beginAgain(subscription: Subscription): void {
    const runs = [...this._running.values()].includes(subscription);
    if (this._state === 'up' && this._wanted.has(subscription) && !runs) {
      this._begin(subscription);
    }
  }

  private _set(state: State): void {
    if (state !== this._state) {
      this._state = state;
      if (state === 'up') {
        this._wasUp = true;
        this._wanted.forEach(subscription => this._begin(subscription));
      } else {
        this._running.clear();
        this._reject(
          state === 'waiting' ? 'The kernel ended before it answered.' : 'The connection was lost before the kernel answered. Try again.'
        );
      }
      this._changed.emit();
    }
  }

  private _begin(subscription: Subscription): void {
    const id = this._next++;
    this._running.set(id, subscription);
    const failed = (error: Error) => {
      if (this._running.delete(id)) {
        subscription.failed(error.message);
      }
    };
    this._pending.set(id, { resolve: () => undefined, reject: failed });
    this._send({ id, method: 'subscribe', params: { topic: subscription.topic, options: subscription.options } });
  }

  private _reject(why: string): void {
    const pending = [...this._pending.values()];
    this._pending.clear();
    pending.forEach(({ reject }) => reject(new Error(why)));
  }

  private _send(message: object): void {
    if (this._socket?.readyState === WebSocket.OPEN) {
      this._socket.send(JSON.stringify(message));
    }
  }

  private _changed = new Signal<this, void>(this);
  private _delay = 1000; // ms
  private _disposed = false;
  private _next = 1;
  private _pending = new Map<number, Pending>();
  private _running = new Map<number, Subscription>();
  private _socket: WebSocket | null = null;
  private _state: State = 'connecting';
  private _timer = 0;
  private _wanted = new Set<Subscription>();
  private _wasUp = false;
}

/** The links in use: panels that show the same kernel share one. */
export class Links {
  /** Begin without a link; `missed` is called when the server no longer has a kernel. */
  constructor(private _missed: () => void) {}

  /** Return the link to a kernel; it is closed when `release` was called as often as this. */
  acquire(kernelId: string): Link {
    const known = this._links.get(kernelId);
    const used = known ?? { link: new Link(kernelId, this._missed), users: 0 };
    used.users += 1;
    this._links.set(kernelId, used);
    return used.link;
  }

  release(link: Link): void {
    const used = this._links.get(link.kernelId);
    if (used && used.link === link && --used.users === 0) {
      this._links.delete(link.kernelId);
      link.dispose();
    }
  }

  private _links = new Map<string, { link: Link; users: number }>();
}
