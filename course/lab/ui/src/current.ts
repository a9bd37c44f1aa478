// The notebook that panels show, and the link to its kernel.

import { INotebookTracker, NotebookPanel } from '@jupyterlab/notebook';
import { ISignal, Signal } from '@lumino/signaling';

import { Link, Links } from './link';
import { answers, LONGEST } from './server';

/** Return true while JupyterLab still finds out which kernel a notebook has, as after a reload of the page. */
export function isConnecting(panel: NotebookPanel): boolean {
  return !panel.isDisposed && panel.sessionContext.kernelDisplayStatus === 'initializing';
}

/** Follows the current notebook; its kernel is linked only while a panel is open. */
export class Current {
  constructor(
    private _tracker: INotebookTracker,
    private _links: Links,
    private _makeRoom: () => void,
    readonly back: () => void, // from a panel that covers the notebook, on a phone, to the notebook
    private _show: (id: string) => void
  ) {
    _tracker.currentChanged.connect(this._follow, this);
    this._follow();
  }

  /** Bring the notebook in front of what lies in its place, such as the robot, and give it the focus. */
  front(): void {
    if (this._panel) {
      this._show(this._panel.id);
    }
  }

  get panel(): NotebookPanel | null {
    return this._panel;
  }

  /** The link to the notebook's kernel; null when no panel is open, or the notebook has no kernel. */
  get link(): Link | null {
    return this._link;
  }

  /** True while a panel is shown. */
  get isOpen(): boolean {
    return this._open > 0;
  }

  /** True if the server does not answer, while a panel is shown for a notebook without a kernel. */
  get isOffline(): boolean {
    return this._offline;
  }

  get changed(): ISignal<this, void> {
    return this._changed;
  }

  /** Note that a panel is shown: the kernel stays linked until it calls `close`. */
  open(): void {
    this._open += 1;
    this._makeRoom();
    this._look();
  }

  close(): void {
    this._open -= 1;
    this._look();
  }

  private _follow(): void {
    const panel = this._tracker.currentWidget;
    if (panel !== this._panel) {
      this._panel?.sessionContext.kernelChanged.disconnect(this._look, this);
      this._panel?.sessionContext.statusChanged.disconnect(this._tell, this);
      this._panel = panel;
      this._panel?.sessionContext.kernelChanged.connect(this._look, this);
      this._panel?.sessionContext.statusChanged.connect(this._tell, this);
      this._look();
      this._changed.emit();
    }
  }

  private _look(): void {
    const session = this._panel && !this._panel.isDisposed ? this._panel.sessionContext.session : null;
    const id = (this._open > 0 && session?.kernel?.id) || null;
    if (id !== (this._link?.kernelId ?? null)) {
      if (this._link) {
        this._links.release(this._link);
      }
      this._link = id ? this._links.acquire(id) : null;
      this._changed.emit();
    }
    if (!this._asks) {
      void this._ask();
    }
  }

  /** Ask the server whether it is there, as long as a panel is shown for a notebook without a kernel: no link tells. */
  private async _ask(): Promise<void> {
    this._asks = true;
    while (this._open > 0 && this._panel && !this._link) {
      const offline = (await answers('api')) === 0;
      if (offline !== this._offline) {
        this._offline = offline;
        this._changed.emit();
      }
      await new Promise(done => window.setTimeout(done, LONGEST));
    }
    this._asks = this._offline = false;
  }

  private _tell(): void {
    this._changed.emit();
  }

  private _asks = false;
  private _changed = new Signal<this, void>(this);
  private _link: Link | null = null;
  private _offline = false;
  private _open = 0;
  private _panel: NotebookPanel | null = null;
}
