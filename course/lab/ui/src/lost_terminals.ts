// A terminal whose connection is lost says so, and once its server has ended it, leads to a new one.

import { JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { MainAreaWidget } from '@jupyterlab/apputils';
import { ITerminal, ITerminalTracker } from '@jupyterlab/terminal';

import { OFFLINE } from './panel';
import { answers } from './server';
import { TERMINAL } from './strip';

const AGAIN = 2000; // ms between two looks whether the server answers
const ENDED = 'Jupyter’s server has ended this terminal: what is typed here is lost.';

export const lostTerminals: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:lost-terminals',
  description: 'A terminal says that Jupyter’s server does not answer or has ended it, and then leads to a new one.',
  autoStart: true,
  requires: [ITerminalTracker],
  activate: (app: JupyterFrontEnd, terminals: ITerminalTracker) => {
    const follow = (each: MainAreaWidget<ITerminal.ITerminal>) => new Connection(app, each);
    terminals.forEach(follow);
    terminals.widgetAdded.connect((_, each) => follow(each));
  }
};

/** The connection of a terminal, which says in the terminal that it is lost. */
class Connection {
  constructor(
    private _app: JupyterFrontEnd,
    private _terminal: MainAreaWidget<ITerminal.ITerminal>
  ) {
    this._notice.className = 'ros-Terminal-notice';
    this._notice.setAttribute('role', 'status');
    this._closes = _terminal.content.getOption('closeOnExit') ?? true;
    const { session } = _terminal.content;
    this._was = session.connectionStatus === 'connected';
    session.connectionStatusChanged.connect((_, status) => {
      if (_terminal.isDisposed) {
        return; // the reader has closed it, or ended its shell
      }
      if (status === 'connected') {
        this._was = true;
        this._found();
      } else if (this._was && !this._notice.isConnected) {
        this._lost();
      }
    });
  }

  private _lost(): void {
    const { content } = this._terminal;
    content.setOption('closeOnExit', false); // it would vanish without a word when it is not found again
    this._answered = false;
    this._notice.replaceChildren(OFFLINE);
    content.node.append(this._notice);
    void this._look();
  }

  private _found(): void {
    window.clearTimeout(this._timer);
    this._notice.remove();
    this._terminal.content.setOption('closeOnExit', this._closes);
  }

  /** Look whether the server answers; JupyterLab itself tries less and less often, and gives up at last. */
  private async _look(): Promise<void> {
    const { session } = this._terminal.content;
    const status = await answers(`api/terminals/${encodeURIComponent(session.name)}`);
    if (this._terminal.isDisposed || !this._notice.isConnected) {
      return;
    }
    if (status === 404) {
      session.dispose();
      this._end();
      return;
    }
    if (status && (!this._answered || session.connectionStatus === 'disconnected')) {
      session.reconnect().catch(() => undefined); // it is tried again
    }
    this._answered = status > 0;
    this._timer = window.setTimeout(() => void this._look(), AGAIN);
  }

  private _end(): void {
    const button = document.createElement('button');
    button.textContent = 'Open a new terminal';
    button.addEventListener('click', () => {
      void this._app.commands.execute(TERMINAL).then(() => this._terminal.dispose());
    });
    this._notice.replaceChildren(ENDED, ' ', button);
  }

  private _answered = false; // at the last look
  private _closes: boolean; // as the reader has set it
  private _notice = document.createElement('div');
  private _timer = 0;
  private _was: boolean; // connected, once
}
