// Common parts of all panels.

import { ReactWidget } from '@jupyterlab/apputils';
import { Cell } from '@jupyterlab/cells';
import { NotebookActions, NotebookPanel } from '@jupyterlab/notebook';
import { LabIcon } from '@jupyterlab/ui-components';
import { Message } from '@lumino/messaging';
import { Widget } from '@lumino/widgets';
import * as React from 'react';

import { Current, isConnecting } from './current';
import { Link, State } from './link';

export const CONNECTING = 'Connecting …';
export const OFFLINE = 'Jupyter’s server does not answer. Trying again …';
const LIVE = 'course.live()'; // in the cell that makes the session
const HIDDEN = 1000; // ms: JupyterLab hides everything for a moment when its theme changes
const AGAIN = 2000; // ms until what could not be drawn is tried again

interface Guarded {
  what: string;
  forget?: () => void; // called when it could not be drawn
  children?: React.ReactNode;
}

/** Draws what is in it, or else a sentence, and tries again: one node's values must not take the others away. */
export class Guard extends React.Component<Guarded, { failed: string }> {
  static getDerivedStateFromError(error: unknown): { failed: string } {
    return { failed: String(error) };
  }

  state = { failed: '' };

  componentDidCatch(): void {
    this.props.forget?.();
    window.clearTimeout(this._again);
    this._again = window.setTimeout(() => this.setState({ failed: '' }), AGAIN);
  }

  componentWillUnmount(): void {
    window.clearTimeout(this._again);
  }

  render(): React.ReactNode {
    const { failed } = this.state;
    return failed ? <p role="status">{`${this.props.what} cannot be drawn now (${failed}). Trying again …`}</p> : this.props.children;
  }

  private _again = 0;
}

/** A side panel that is drawn, and follows the kernel, only while it is visible. */
export abstract class SidePanel extends ReactWidget {
  constructor(
    readonly current: Current,
    id: string,
    label: string,
    icon: LabIcon
  ) {
    super();
    this.id = id;
    this.addClass('ros-Panel');
    this.title.label = label; // beside the icon
    this.title.caption = label;
    this.title.icon = icon;
    this.node.setAttribute('role', 'region');
    this.node.tabIndex = -1; // takes the focus when it is opened, so that Tab leads to what is in it
    this.node.setAttribute('aria-label', label);
  }

  protected abstract draw(): JSX.Element;

  /** Forget data that could not be drawn, if the panel keeps any. */
  protected forget(): void {
    return;
  }

  protected render(): JSX.Element | null {
    return this._seen ? (
      <>
        <button
          className="ros-Panel-back"
          onClick={() => {
            this.current.back();
            this.current.front();
          }}
        >
          Back to the notebook
        </button>
        <Guard what={this.title.label} forget={() => this.forget()}>
          {this.draw()}
        </Guard>
      </>
    ) : null;
  }

  protected onActivateRequest(message: Message): void {
    super.onActivateRequest(message);
    if (!this.node.contains(document.activeElement)) {
      this.node.focus();
    }
  }

  protected onAfterShow(message: Message): void {
    super.onAfterShow(message);
    this._see(true);
  }

  protected onAfterAttach(message: Message): void {
    super.onAfterAttach(message);
    this._see(this.isVisible);
  }

  protected onBeforeHide(message: Message): void {
    window.clearTimeout(this._hiding);
    // At once, unless it is JupyterLab that hides everything: which it is, is known after this message.
    this._hiding = window.setTimeout(() => {
      if (isPutAway(this)) {
        this._see(false);
      } else {
        this._hiding = window.setTimeout(() => this._see(false), HIDDEN);
      }
    }, 0);
    super.onBeforeHide(message);
  }

  protected onBeforeDetach(message: Message): void {
    this._see(false);
    super.onBeforeDetach(message);
  }

  private _see(seen: boolean): void {
    window.clearTimeout(this._hiding);
    if (seen !== this._seen) {
      this._seen = seen;
      if (seen) {
        this.current.open();
      } else {
        this.current.close();
      }
      this.update();
    }
  }

  private _hiding = 0;
  private _seen = false;
}

/** Return true if a widget, or a part of JupyterLab that holds it, is hidden, and not JupyterLab as a whole. */
function isPutAway(widget: Widget): boolean {
  return widget.parent !== null && (widget.isHidden || isPutAway(widget.parent));
}

/** Draw again whenever the notebook, its kernel or the link changes. */
export function useCurrent(current: Current): { link: Link | null; state: State | null } {
  const [, redraw] = React.useReducer((count: number) => count + 1, 0);
  const link = current.link;
  React.useEffect(() => {
    current.changed.connect(redraw);
    return () => {
      current.changed.disconnect(redraw);
    };
  }, [current]);
  React.useEffect(() => {
    link?.changed.connect(redraw);
    redraw();
    return () => {
      link?.changed.disconnect(redraw);
    };
  }, [link]);
  return { link, state: link?.state ?? null };
}

/** Follow a topic while the component is mounted: `take` gets each event, `begin` is called at each new start, `failed`
 * with the reason when there are no events for a while, and with '' when they come again.
 */
export function useTopic(
  link: Link | null,
  topic: string,
  options: object,
  take: (data: any) => void,
  begin: () => void,
  failed: (why: string) => void
): void {
  React.useEffect(() => {
    begin();
    const following = link?.subscribe(topic, options, take, begin, failed);
    return () => following?.dispose();
  }, [link, topic, JSON.stringify(options)]);
}

/** Return a reference to what is scrolled into view when `shown` becomes true, or something else that counts as true. */
export function useInSight<T extends Element>(shown: unknown): React.RefObject<T> {
  const place = React.useRef<T>(null);
  React.useEffect(() => {
    if (shown) {
      place.current?.scrollIntoView({ block: 'nearest' });
    }
  }, [shown]);
  return place;
}

/** The cell that makes the session, and whether it is the notebook's first one with code; null if there is none. */
export function liveCell(panel: NotebookPanel): { cell: Cell; first: boolean } | null {
  const cells = panel.content.widgets.filter(cell => cell.model.type === 'code');
  const cell = cells.find(each => each.model.sharedModel.source.includes(LIVE));
  return cell ? { cell, first: cell === cells[0] } : null;
}

/** The button for the advice of `instead`: it runs the cell that makes the session. */
export function FirstCell({ current, link }: { current: Current; link: Link | null }): JSX.Element | null {
  const panel = current.panel;
  if (!panel || link?.state !== 'waiting' || isEnding(panel)) {
    return null;
  }
  const found = liveCell(panel);
  if (!found) {
    return null;
  }
  const run = (event: React.MouseEvent) => {
    event.currentTarget.closest<HTMLElement>('.ros-Panel')?.focus(); // this button will be gone
    if (!found.first) {
      void panel.content.scrollToItem(panel.content.widgets.indexOf(found.cell)); // the reader sees what is run
    }
    void NotebookActions.runCells(panel.content, [found.cell], panel.sessionContext);
  };
  return <button onClick={run}>{found.first ? 'Run the first cell' : `Run the cell with ${LIVE}`}</button>;
}

/** Return a name that a narrow panel breaks after `/` and `_` only, and from which nothing else is copied. */
export function breakable(name: string): React.ReactNode {
  return name.split(/(?<=[/_])/).map((part, index) => (
    <React.Fragment key={index}>
      {index > 0 && <wbr />}
      {part}
    </React.Fragment>
  ));
}

function isEnding(panel: NotebookPanel): boolean {
  return panel.sessionContext.kernelDisplayStatus === 'terminating';
}

function howToBegin(panel: NotebookPanel): string {
  const found = liveCell(panel);
  if (!found) {
    return `Write and run a cell with ros = ${LIVE}`;
  }
  return found.first ? `Run the notebook’s first cell: ros = ${LIVE}` : `Run the notebook’s cell with ros = ${LIVE}`;
}

/** Return the advice that replaces a panel's content; null if the kernel has a live session. */
export function instead(current: Current, link: Link | null): string | null {
  if (!current.panel) {
    return 'Open a notebook: this panel shows what goes on in it.';
  }
  if (!link && current.isOffline) {
    return OFFLINE;
  }
  if (!link) {
    return isConnecting(current.panel) ? CONNECTING : 'The notebook has no kernel. Choose one in the Kernel menu.';
  }
  switch (link.state) {
    case 'up':
      return null;
    case 'offline':
      return OFFLINE;
    case 'gone':
      return 'Jupyter’s server has ended the kernel, and its nodes have ended. Choose a kernel in the Kernel menu.';
    case 'connecting':
      return CONNECTING;
    default:
      if (isEnding(current.panel)) {
        return 'The kernel is being shut down, and its nodes have ended.';
      }
      return link.wasUp
        ? `The kernel ${current.panel.sessionContext.session?.kernel?.status === 'dead' ? 'has ended' : 'was restarted'}, ` +
            `and its nodes have ended. ${howToBegin(current.panel)}`
        : `There is no live session yet. ${howToBegin(current.panel)}`;
  }
}
