// The entry points of the lab: commands in the palette and the launcher, and the initial layout.

import { ILabShell, JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { ICommandPalette, Notification } from '@jupyterlab/apputils';
import { PageConfig } from '@jupyterlab/coreutils';
import { ILauncher } from '@jupyterlab/launcher';
import { INotebookTracker, NotebookActions, NotebookPanel } from '@jupyterlab/notebook';
import { IStateDB } from '@jupyterlab/statedb';
import { ITerminalTracker } from '@jupyterlab/terminal';

import { isConnecting } from './current';
import { columns, tabsWith } from './dock';
import { post } from './server';
import { TERMINAL } from './strip';

const CATEGORY = 'ROS course';
const FILES = 'filebrowser'; // the id of JupyterLab's list of files
const NODES = 'ros2-course:nodes';
const START_PAGE = 'index.ipynb';
const CHECK_MACHINE = '.ros-CheckMachine'; // the button on the start page
const DOCTOR = '!course doctor --brief'; // the cell that checks the machine
const SHOWN = 10_000; // ms of a notification
const LINK = 'rendermime:handle-local-link'; // JupyterLab's command for a link to a file
const ROOMY = 1500; // px of a page that has room for files and notebook side by side
const VAST = 1700; // px of a page that has room for a panel beside notebook and robot
const PANEL = 360; // px of that panel
const ARRANGED = 'ros2-course:arranged'; // in JupyterLab's state: the start page was arranged
const ARRANGED_SECTION = 'ros2-course:arranged-section';

export const ways: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:ways',
  description: 'The course’s commands in the palette and the launcher.',
  autoStart: true,
  optional: [ICommandPalette, ILauncher],
  activate: (_: JupyterFrontEnd, palette: ICommandPalette | null, launcher: ILauncher | null) => {
    // In the order of the sidebar, then what opens beside the notebook.
    const panels = ['exercise', 'nodes', 'inspector', 'graph', 'robot', 'plot'].map(name => `ros2-course:${name}`);
    const commands = [TERMINAL, ...panels, 'ros2-course:hand-in'];
    commands.forEach((command, rank) => {
      palette?.addItem({ command, category: CATEGORY, rank });
      launcher?.add({ command, category: CATEGORY, rank });
    });
  }
};

export const front: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:front',
  description: 'Tells the server which notebook is in front: the terminals are in its ROS domain and folder.',
  autoStart: true,
  requires: [INotebookTracker],
  activate: (app: JupyterFrontEnd, tracker: INotebookTracker) => {
    let panel: NotebookPanel | null = null;
    let restored = false; // before, JupyterLab opens one notebook after the other
    let told = ' '; // a kernel and a path
    const tell = () => {
      const shown = panel && !panel.isDisposed ? panel : null;
      if (!restored || (shown && isConnecting(shown))) {
        return;
      }
      const path = shown?.context.path ?? '';
      const kernel = shown?.sessionContext.session?.kernel?.id ?? '';
      if (`${kernel} ${path}` !== told) {
        told = `${kernel} ${path}`;
        post('front', { path, kernel }).catch(() => (told = ' '));
      }
    };
    const follow = () => {
      panel?.sessionContext.kernelChanged.disconnect(tell);
      panel?.sessionContext.statusChanged.disconnect(tell);
      panel = tracker.currentWidget;
      panel?.sessionContext.kernelChanged.connect(tell);
      panel?.sessionContext.statusChanged.connect(tell);
      tell();
    };
    tracker.currentChanged.connect(follow);
    follow();
    void app.restored.then(() => {
      restored = true;
      tell();
    });
  }
};

export const absent: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:absent',
  description: 'Says that a link leads to a file that is not there; JupyterLab itself does nothing then.',
  autoStart: true,
  activate: ({ commands }: JupyterFrontEnd) => {
    commands.commandExecuted.connect((_, { id, args, result }) => {
      if (id === LINK) {
        const said = `${args.path} is not here. In a class, your instructor may not have released it yet.`;
        result.catch(() => Notification.warning(said, { autoClose: SHOWN }));
      }
    });
  }
};

export const ready: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:ready',
  description: 'The start page’s button that checks the machine: it runs the cell for it, and shows what that prints.',
  autoStart: true,
  requires: [INotebookTracker],
  activate: (_: JupyterFrontEnd, tracker: INotebookTracker) => {
    const check = async (panel: NotebookPanel) => {
      const cells = panel.content.widgets;
      const cell = cells.find(({ model }) => model.type === 'code' && model.sharedModel.source.trim() === DOCTOR);
      if (cell) {
        await panel.sessionContext.ready; // a cell that is run before is not run at all
        panel.content.activeCellIndex = cells.indexOf(cell); // a run scrolls to the active one
        void panel.content.scrollToItem(cells.indexOf(cell), 'top-center');
        await NotebookActions.runCells(panel.content, [cell], panel.sessionContext);
      }
    };
    // JupyterLab's own commands in a text ask for trust first; this one runs nothing but the check.
    document.addEventListener('click', ({ target }) => {
      const button = target instanceof Element ? target.closest<HTMLElement>(CHECK_MACHINE) : null;
      const panel = button && tracker.find(each => each.node.contains(button));
      if (panel) {
        void check(panel);
      }
    });
  }
};

export const main: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:main',
  description: 'Notebooks open beside notebooks; the one that was in front stays there when the page is loaded again.',
  autoStart: true,
  requires: [INotebookTracker],
  activate: (app: JupyterFrontEnd, tracker: INotebookTracker) => {
    void app.restored.then(() => {
      takeTheOneInSight(app, tracker);
      keepInFront(app, tracker);
      tracker.widgetAdded.connect((_, panel) => void panel.revealed.then(() => besideNotebooks(app, tracker, panel)));
    });
  }
};

/** With a panel in front, JupyterLab takes the notebook that it has restored last for the current one: take the one in sight. */
function takeTheOneInSight(app: JupyterFrontEnd, tracker: INotebookTracker): void {
  const seen = tracker.find(each => each.isVisible);
  if (seen && !tracker.currentWidget?.isVisible) {
    app.shell.activateById(seen.id);
  }
}

/** Bring the last notebook to the front again if the page was loaded at the address of the start page. */
function keepInFront(app: JupyterFrontEnd, tracker: INotebookTracker): void {
  const last = tracker.currentWidget;
  if (!last || last.context.path === START_PAGE || PageConfig.getOption('treePath') !== START_PAGE) {
    return;
  }
  const back = (_: INotebookTracker, panel: NotebookPanel | null) => {
    if (panel?.context.path === START_PAGE) {
      tracker.currentChanged.disconnect(back);
      app.shell.activateById(last.id);
    }
  };
  tracker.currentChanged.connect(back);
}

/** A notebook that was opened among terminals or the robot goes to the other notebooks, or above or beside these. */
function besideNotebooks(app: JupyterFrontEnd, tracker: INotebookTracker, panel: NotebookPanel): void {
  const beside = tabsWith(panel);
  if (beside.length === 0 || beside.some(widget => tracker.has(widget))) {
    return;
  }
  const other = tracker.find(each => each !== panel && each.isAttached);
  const mode = beside.some(widget => widget.node.querySelector('.jp-Terminal')) ? 'split-top' : 'split-left';
  app.shell.add(panel, 'main', other ? { mode: 'tab-after', ref: other.id } : { mode, ref: beside[0].id });
  app.shell.activateById(panel.id);
}

/** Give the panels at the right the width that a line of a log needs. */
function widenRight(shell: ILabShell): void {
  const split = columns(shell);
  if (split) {
    const sizes = split.relativeSizes(); // of the left, the main and the right area
    const right = PANEL / split.node.clientWidth;
    split.setRelativeSizes([sizes[0], 1 - sizes[0] - right, right]);
  }
}

export const layout: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:layout',
  description: 'Room for a section; and a terminal below the start page, when environment/start opens JupyterLab first.',
  autoStart: true,
  requires: [INotebookTracker, IStateDB, ITerminalTracker],
  optional: [ILabShell],
  activate: (
    app: JupyterFrontEnd,
    tracker: INotebookTracker,
    state: IStateDB,
    terminals: ITerminalTracker,
    shell: ILabShell | null
  ) => {
    const arranges = PageConfig.getOption('rosCourseArrange') === 'true';
    const begun = new Set<string>();
    /** Do something the first time ever; afterwards all is as one has left it. */
    const once = async (key: string, arrange: () => unknown) => {
      if (!begun.has(key)) {
        begun.add(key);
        await app.restored;
        if ((await state.fetch(key)) === undefined) {
          await state.save(key, true);
          await arrange();
        }
      }
    };
    const arrangeStartPage = async (panel: NotebookPanel) => {
      if (window.innerWidth < ROOMY) {
        shell?.collapseLeft(); // the list of files, which the start page's table stands for
      }
      if (terminals.size === 0) {
        await app.commands.execute(TERMINAL, { folded: true }); // a section has it as a strip
      }
      app.shell.activateById(panel.id);
    };
    const arrangeSection = async (panel: NotebookPanel) => {
      const files = [...(shell?.widgets('left') ?? [])].find(widget => widget.id === FILES);
      if (files?.isVisible) {
        shell?.collapseLeft();
      }
      if (arranges && window.innerWidth >= VAST && shell?.rightCollapsed) {
        await app.commands.execute(NODES);
        app.shell.activateById(panel.id);
        widenRight(shell);
      }
    };
    const arrange = (panel: NotebookPanel | null) => {
      if (panel && panel.context.path !== START_PAGE) {
        void once(ARRANGED_SECTION, () => arrangeSection(panel));
      } else if (panel && arranges) {
        void once(ARRANGED, () => arrangeStartPage(panel));
      }
    };
    tracker.currentChanged.connect((_, panel) => arrange(panel));
    arrange(tracker.currentWidget);
  }
};
