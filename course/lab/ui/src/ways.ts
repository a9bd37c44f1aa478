// The entry points of the lab: commands in the palette and the launcher, and the initial layout.

import { ILabShell, JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { ICommandPalette } from '@jupyterlab/apputils';
import { PageConfig, PathExt } from '@jupyterlab/coreutils';
import { ILauncher } from '@jupyterlab/launcher';
import { INotebookTracker, NotebookPanel } from '@jupyterlab/notebook';
import { IStateDB } from '@jupyterlab/statedb';
import { terminalIcon } from '@jupyterlab/ui-components';
import { DockPanel, Widget } from '@lumino/widgets';

import { ROBOT_VIEW } from './robot';
import { post } from './server';
import { NARROW } from './views';

const CATEGORY = 'ROS course';
const TERMINAL = 'ros2-course:terminal';
const ROBOT = 'ros2-course:robot';
const START_PAGE = 'index.ipynb';
const ROOMY = 1500; // px of a page with room for files, notebook and robot side by side
const ARRANGED = 'ros2-course:arranged'; // the key in JupyterLab's state that says that the layout was arranged

export const ways: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:ways',
  description: 'The course’s commands in the palette and the launcher.',
  autoStart: true,
  requires: [INotebookTracker],
  optional: [ICommandPalette, ILauncher],
  activate: (
    app: JupyterFrontEnd,
    tracker: INotebookTracker,
    palette: ICommandPalette | null,
    launcher: ILauncher | null
  ) => {
    app.commands.addCommand(TERMINAL, {
      label: 'ROS terminal',
      caption: 'A terminal in the folder of the notebook; it meets the nodes of the notebook in front',
      icon: terminalIcon,
      execute: () => {
        const path = tracker.currentWidget?.context.path;
        return app.commands.execute('terminal:create-new', path ? { cwd: PathExt.dirname(path) } : {});
      }
    });
    const panels = ['robot', 'plot', 'nodes', 'inspector', 'graph', 'exercise'].map(name => `ros2-course:${name}`);
    const commands = [TERMINAL, ...panels, 'ros2-course:hand-in'];
    commands.forEach((command, rank) => {
      palette?.addItem({ command, category: CATEGORY, rank });
      launcher?.add({ command, category: CATEGORY, rank });
    });
  }
};

export const front: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:front',
  description: 'Tells the server which notebook is in front: the terminals are in its ROS domain.',
  autoStart: true,
  requires: [INotebookTracker],
  activate: (_: JupyterFrontEnd, tracker: INotebookTracker) => {
    let panel: NotebookPanel | null = null;
    let told = '';
    const tell = () => {
      const kernel = (panel && !panel.isDisposed && panel.sessionContext.session?.kernel?.id) || '';
      if (kernel !== told) {
        told = kernel;
        post('front', { kernel }).catch(() => (told = ''));
      }
    };
    const follow = () => {
      panel?.sessionContext.kernelChanged.disconnect(tell);
      panel = tracker.currentWidget;
      panel?.sessionContext.kernelChanged.connect(tell);
      tell();
    };
    tracker.currentChanged.connect(follow);
    follow();
  }
};

export const main: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:main',
  description: 'Notebooks open beside notebooks; the one that was in front stays there when the page is loaded again.',
  autoStart: true,
  requires: [INotebookTracker],
  activate: (app: JupyterFrontEnd, tracker: INotebookTracker) => {
    void app.restored.then(() => {
      keepInFront(app, tracker);
      tracker.widgetAdded.connect((_, panel) => void panel.revealed.then(() => besideNotebooks(app, tracker, panel)));
    });
  }
};

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

/** Move a notebook opened among terminals or the robot to the other notebooks, or give it half of the page. */
function besideNotebooks(app: JupyterFrontEnd, tracker: INotebookTracker, panel: NotebookPanel): void {
  const beside = tabsWith(panel);
  if (beside.length === 0 || beside.some(widget => tracker.has(widget))) {
    return;
  }
  const other = tracker.find(each => each !== panel && each.isAttached);
  app.shell.add(panel, 'main', other ? { mode: 'tab-after', ref: other.id } : { mode: 'split-left' });
  app.shell.activateById(panel.id);
}

/** Return the other widgets in the same tab area of the main area. */
function tabsWith(widget: Widget): Widget[] {
  const dock = widget.parent;
  const bars = dock instanceof DockPanel ? [...dock.tabBars()] : [];
  const owners = bars.map(bar => bar.titles.map(title => title.owner)).find(found => found.includes(widget)) ?? [];
  return owners.filter(owner => owner !== widget);
}

export const layout: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:layout',
  description: 'Start page, robot and terminal side by side, the first time that environment/start opens JupyterLab.',
  autoStart: true,
  requires: [INotebookTracker, IStateDB],
  optional: [ILabShell],
  activate: (app: JupyterFrontEnd, tracker: INotebookTracker, state: IStateDB, shell: ILabShell | null) => {
    if (PageConfig.getOption('rosCourseArrange') !== 'true') {
      return;
    }
    let begun = false;
    const arrange = async (panel: NotebookPanel | null) => {
      if (begun || panel?.context.path !== START_PAGE) {
        return;
      }
      begun = true;
      await app.restored;
      if ((await state.fetch(ARRANGED)) === undefined) {
        await state.save(ARRANGED, true);
        if (window.innerWidth < ROOMY) {
          shell?.collapseLeft(); // the file browser, which the start page's table replaces
        }
        await app.commands.execute(ROBOT);
        const terminal = await app.commands.execute('terminal:create-new');
        const above = window.innerWidth < NARROW ? panel.id : ROBOT_VIEW;
        app.shell.add(terminal, 'main', { mode: 'split-bottom', ref: above });
        app.shell.activateById(panel.id);
      }
    };
    tracker.currentChanged.connect((_, panel) => void arrange(panel));
    void arrange(tracker.currentWidget);
  }
};
