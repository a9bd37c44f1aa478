// The terminals: a strip below the notebook, which a click makes tall, and another click a strip again.

import { ILabShell, JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { MainAreaWidget } from '@jupyterlab/apputils';
import { PathExt } from '@jupyterlab/coreutils';
import { INotebookTracker } from '@jupyterlab/notebook';
import { ITerminal, ITerminalTracker } from '@jupyterlab/terminal';
import { caretDownEmptyThinIcon, caretUpEmptyThinIcon, terminalIcon } from '@jupyterlab/ui-components';
import { MessageLoop } from '@lumino/messaging';
import { TabBar, Widget } from '@lumino/widgets';

import { barOf, borderOf, dockOf, moveBorder } from './dock';

export const TERMINAL = 'ros2-course:terminal';

type Terminal = MainAreaWidget<ITerminal.ITerminal>;

const FOLDED = 'ros-mod-folded'; // the class of a terminal of which only the tab is shown
const ROWS = 5; // of a strip
const LINE = 1.2; // a row's height in that of its font
const AROUND = 16; // px that JupyterLab leaves above and below the rows
const TALL = 0.6; // of the main area's height
const DRAG = 4; // px that the mouse is moved by whoever selects text

export const strip: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:strip',
  description: 'The terminals lie in a strip below the notebook; a click makes it tall, another one a strip again.',
  autoStart: true,
  requires: [INotebookTracker, ITerminalTracker],
  optional: [ILabShell],
  activate: (
    app: JupyterFrontEnd,
    notebooks: INotebookTracker,
    terminals: ITerminalTracker,
    shell: ILabShell | null
  ) => {
    const all = shell && new Strip(shell, notebooks, terminals);
    app.commands.addCommand(TERMINAL, {
      label: 'ROS terminal',
      caption: 'A terminal in the folder of the notebook; it meets the nodes of the notebook in front',
      icon: terminalIcon,
      execute: async args => {
        const path = notebooks.currentWidget?.context.path;
        const made = await app.commands.execute('terminal:create-new', path ? { cwd: PathExt.dirname(path) } : {});
        all?.lay(made);
        if (args.folded) {
          all?.fold(made);
        }
        return made;
      }
    });
    void app.restored.then(() => all?.begin());
  }
};

class Strip {
  constructor(
    private _shell: ILabShell,
    private _notebooks: INotebookTracker,
    private _terminals: ITerminalTracker
  ) {}

  /** Take what is there as it is, and from now on lay each new terminal where it belongs. */
  begin(): void {
    this._terminals.forEach(each => this._follow(each));
    this._terminals.widgetAdded.connect((_, each) => this.lay(each));
    this._shell.layoutModified.connect(() => this._mark());
    this._notebooks.currentChanged.connect(() => this._unfold());
    window.addEventListener('resize', () => this._keepLow());
    this._mark();
  }

  /** Lay a new terminal beside the others, or else below the notebook; without a notebook it stays where it is. */
  lay(terminal: Terminal): void {
    if (!this._follow(terminal)) {
      return;
    }
    const notebook = this._notebooks.currentWidget;
    const other = this._terminals.find(each => each !== terminal && dockOf(each) !== null);
    if (!dockOf(terminal) || !(other ?? notebook?.isAttached)) {
      return;
    }
    const front = this._shell.currentWidget === terminal;
    const place = other ? ({ mode: 'tab-after', ref: other.id } as const) : ({ mode: 'split-bottom', ref: notebook!.id } as const);
    this._shell.add(terminal, 'main', { ...place, activate: false });
    if (front) {
      this._shell.activateById(terminal.id);
    }
    if (!other) {
      requestAnimationFrame(() => this._resize(terminal, true));
    }
  }

  /** Leave only the tab of a terminal, until it is made bigger or another notebook comes to the front. */
  fold(terminal: Terminal): void {
    this._foldedBelow = this._notebooks.currentWidget;
    requestAnimationFrame(() => {
      if (this._foldedBelow && !terminal.isDisposed) {
        this._folded = terminal;
        terminal.addClass(FOLDED);
        fit(terminal);
        this._resize(terminal, true);
      }
    });
  }

  private _unfold(): void {
    const terminal = this._folded;
    if (terminal && this._notebooks.currentWidget !== this._foldedBelow) {
      this._open();
      requestAnimationFrame(() => !terminal.isDisposed && this._resize(terminal, true));
    }
  }

  /** Let the terminal that is folded have a height again. */
  private _open(): void {
    if (this._folded && !this._folded.isDisposed) {
      this._folded.removeClass(FOLDED);
      fit(this._folded);
    }
    this._folded = this._foldedBelow = null;
  }

  /** Hear of clicks on a terminal; false when it is known. */
  private _follow(terminal: Terminal): boolean {
    if (this._known.has(terminal)) {
      return false;
    }
    this._known.add(terminal);
    let [x, y] = [0, 0];
    terminal.node.addEventListener('pointerdown', event => ([x, y] = [event.clientX, event.clientY]), true);
    terminal.node.addEventListener('click', event => {
      if (Math.hypot(event.clientX - x, event.clientY - y) < DRAG && this._isLow(terminal)) {
        this._resize(terminal, false);
      }
    });
    return true;
  }

  /** Give each bar of terminals that lies below something a button, and the button its word. */
  private _mark(): void {
    const shown = new Set<TabBar<Widget>>();
    this._terminals.forEach(each => {
      const bar = barOf(each);
      if (bar && each.isVisible && borderAbove(each)) {
        shown.add(bar);
        if (!this._buttons.has(bar)) {
          this._buttons.set(bar, this._button(bar));
        }
        const low = this._isLow(each);
        this._tell(bar, low);
        this._low = low ? each : this._low === each ? null : this._low;
      }
    });
    this._buttons.forEach((button, bar) => {
      if (!shown.has(bar)) {
        button.remove();
        this._buttons.delete(bar);
      }
    });
  }

  private _button(bar: TabBar<Widget>): HTMLButtonElement {
    const button = document.createElement('button');
    button.className = 'ros-Strip-button';
    button.addEventListener('click', () => this._toggle(bar));
    bar.node.append(button);
    let front = bar.currentTitle;
    bar.node.addEventListener('pointerdown', () => (front = bar.currentTitle), true);
    bar.node.addEventListener('click', event => {
      const target = event.target as Element;
      const tab = target.closest('.lm-TabBar-tabCloseIcon') ? null : target.closest('.lm-TabBar-tab');
      // A click on another tab brings that to the front.
      if (tab && bar.currentTitle === front && [...bar.contentNode.children].indexOf(tab) === bar.currentIndex) {
        this._toggle(bar);
      }
    });
    return button;
  }

  private _tell(bar: TabBar<Widget>, low: boolean): void {
    const button = this._buttons.get(bar)!;
    const word = low ? 'Bigger' : 'Smaller';
    if (button.textContent !== word) {
      button.replaceChildren((low ? caretUpEmptyThinIcon : caretDownEmptyThinIcon).element({ width: '14px' }), word);
      button.title = low ? 'Make the terminal bigger' : 'Make the terminal small again';
    }
  }

  private _toggle(bar: TabBar<Widget>): void {
    const terminal = this._terminals.find(each => bar.currentTitle === each.title);
    if (terminal) {
      const low = this._isLow(terminal);
      this._resize(terminal, !low);
      if (low) {
        this._shell.activateById(terminal.id); // whoever makes it bigger wants to type
      }
    }
  }

  private _isLow(terminal: Terminal): boolean {
    return heightOf(terminal) < 1.5 * lowest(terminal);
  }

  private _resize(terminal: Terminal, low: boolean): void {
    const [dock, border] = [dockOf(terminal), borderAbove(terminal)];
    if (dock && border && terminal.isVisible) {
      if (!low && terminal === this._folded) {
        this._open();
      }
      const tall = Math.max(1.6 * lowest(terminal), TALL * dock.node.clientHeight);
      const only = barOf(terminal)!.node.offsetHeight; // the tab
      const wanted = terminal === this._folded ? only : low ? lowest(terminal) : tall;
      moveBorder(dock, border, 0, heightOf(terminal) - wanted);
    }
  }

  /** A strip has as many rows in a page of another height. */
  private _keepLow(): void {
    if (this._low && !this._low.isDisposed) {
      this._resize(this._low, true);
    }
  }

  private _buttons = new Map<TabBar<Widget>, HTMLButtonElement>();
  private _known = new WeakSet<Terminal>();
  private _low: Terminal | null = null;
  private _folded: Terminal | null = null;
  private _foldedBelow: Widget | null = null; // the notebook below which it is folded
}

/** Have the main area read the least height of a terminal again. */
function fit(terminal: Terminal): void {
  const dock = dockOf(terminal);
  if (dock) {
    MessageLoop.sendMessage(terminal, Widget.Msg.FitRequest);
    MessageLoop.sendMessage(dock, Widget.Msg.FitRequest);
  }
}

/** The height of a terminal with its tabs, px. */
function heightOf(terminal: Terminal): number {
  return terminal.node.getBoundingClientRect().bottom - barOf(terminal)!.node.getBoundingClientRect().top;
}

/** The height of a strip with its tabs, px. */
function lowest(terminal: Terminal): number {
  const head = terminal.content.node.getBoundingClientRect().top - barOf(terminal)!.node.getBoundingClientRect().top;
  return head + AROUND + ROWS * LINE * Number(terminal.content.getOption('fontSize'));
}

/** The border between a terminal and what lies above it. */
function borderAbove(terminal: Terminal): HTMLElement | null {
  const [dock, bar] = [dockOf(terminal), barOf(terminal)];
  if (!dock || !bar) {
    return null;
  }
  const { left, right, top } = bar.node.getBoundingClientRect();
  return borderOf(
    dock,
    border => border.width > border.height && Math.abs(border.bottom - top) < 3 && border.left < right && border.right > left
  );
}
