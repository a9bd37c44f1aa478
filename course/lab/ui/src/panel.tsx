// Common parts of all panels.

import { ReactWidget } from '@jupyterlab/apputils';
import { NotebookActions } from '@jupyterlab/notebook';
import { LabIcon } from '@jupyterlab/ui-components';
import { Message } from '@lumino/messaging';
import * as React from 'react';

import { Current } from './current';
import { Link, State } from './link';

const HIDDEN = 1000; // ms: JupyterLab hides everything for a moment when its theme changes

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
    this.node.setAttribute('aria-label', label);
  }

  protected abstract draw(): JSX.Element;

  protected render(): JSX.Element | null {
    return this._seen ? (
      <>
        <button className="ros-Panel-back" onClick={this.current.back}>
          Back to the notebook
        </button>
        {this.draw()}
      </>
    ) : null;
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
    this._hiding = window.setTimeout(() => this._see(false), HIDDEN);
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

/** Follow a topic while the component is mounted: `take` gets each event, `begin` is called at each new start. */
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
    const following = link?.subscribe(topic, options, take, failed);
    return () => following?.dispose();
  }, [link, topic, JSON.stringify(options)]);
}

/** The button for the advice of `instead`: it runs the cell that makes the session, or else the first. */
export function FirstCell({ current, link }: { current: Current; link: Link | null }): JSX.Element | null {
  const panel = current.panel;
  if (!panel || link?.state !== 'waiting') {
    return null;
  }
  const run = () => {
    const cells = panel.content.widgets.filter(cell => cell.model.type === 'code');
    const first = cells.find(cell => cell.model.sharedModel.source.includes('course.live()')) ?? cells[0];
    if (first) {
      void NotebookActions.runCells(panel.content, [first], panel.sessionContext);
    }
  };
  return <button onClick={run}>Run the first cell</button>;
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

/** Return the advice that replaces a panel's content; null if the kernel has a live session. */
export function instead(current: Current, link: Link | null): string | null {
  if (!current.panel) {
    return 'Open a notebook: this panel shows what goes on in it.';
  }
  if (!link) {
    return 'The notebook has no kernel. Choose one in the Kernel menu.';
  }
  switch (link.state) {
    case 'up':
      return null;
    case 'offline':
      return 'Jupyter’s server does not answer. Trying again …';
    case 'connecting':
      return 'Connecting …';
    default:
      return link.wasUp
        ? `The kernel ${current.panel.sessionContext.session?.kernel?.status === 'dead' ? 'has ended' : 'was restarted'}, ` +
            'and its nodes have ended. Run the notebook’s first cell to begin again.'
        : 'There is no live session yet. Run the notebook’s first cell: ros = course.live()';
  }
}
