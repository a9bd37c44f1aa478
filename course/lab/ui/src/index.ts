// The course's part of JupyterLab: each plugin does one thing.

import { ILabShell, ILayoutRestorer, JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { IToolbarWidgetRegistry } from '@jupyterlab/apputils';
import { INotebookTracker, NotebookPanel } from '@jupyterlab/notebook';
import { checkIcon } from '@jupyterlab/ui-components';
import { MessageLoop } from '@lumino/messaging';

import { onArrival } from './arrival';
import { Current } from './current';
import { columns, widened } from './dock';
import { ExercisePanel } from './exercise';
import { figures } from './figures';
import { GraphPanel, graphIcon, Open } from './graph';
import { handIn, handInButton, handInIcon, hasExercise } from './handing_in';
import { InspectorPanel, inspectorIcon } from './inspector';
import { language } from './language';
import { Links } from './link';
import { lostTerminals } from './lost_terminals';
import { NodesPanel, nodesIcon } from './nodes';
import { PLOT_VIEW, PlotPanel, plotIcon } from './plot';
import { ROBOT_VIEW, RobotPanel, robotIcon } from './robot';
import { strip } from './strip';
import { addView, isPhone, NARROW, paletteClosed } from './views';
import { absent, front, layout, main, ready, ways } from './ways';
import { wrapping } from './wrapping';

const handingIn: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:hand-in',
  description: 'The hand-in button in the toolbar of a notebook with an exercise.',
  autoStart: true,
  requires: [INotebookTracker, IToolbarWidgetRegistry],
  activate: (app: JupyterFrontEnd, tracker: INotebookTracker, toolbars: IToolbarWidgetRegistry) => {
    const contents = app.serviceManager.contents;
    toolbars.addFactory<NotebookPanel>('Notebook', 'hand-in', panel => handInButton(panel, contents));
    app.commands.addCommand('ros2-course:hand-in', {
      label: 'Hand in',
      caption: 'Hand in the exercise of the current notebook',
      icon: handInIcon,
      isEnabled: () => tracker.currentWidget !== null && hasExercise(tracker.currentWidget),
      execute: () => (tracker.currentWidget ? handIn(tracker.currentWidget, contents) : undefined)
    });
  }
};

const panels: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:panels',
  description: 'The panels beside a notebook.',
  autoStart: true,
  requires: [INotebookTracker],
  optional: [ILayoutRestorer, ILabShell],
  activate: (
    app: JupyterFrontEnd,
    tracker: INotebookTracker,
    restorer: ILayoutRestorer | null,
    shell: ILabShell | null
  ) => {
    // A narrow page has room for one side panel, and for none beside a notebook.
    const makeRoom = () => (window.innerWidth < NARROW ? shell?.collapseLeft() : undefined);
    // JupyterLab itself would see only later that the server has been started anew, and has no kernels.
    const links = new Links(() => void app.serviceManager.sessions.refreshRunning().catch(() => undefined));
    const show = (id: string) => app.shell.activateById(id);
    const current = new Current(tracker, links, makeRoom, () => shell?.collapseRight(), show);
    tracker.currentChanged.connect(makeRoom);
    window.addEventListener('resize', () => (current.isOpen ? makeRoom() : undefined));
    document.addEventListener('keydown', event => {
      const from = event.target instanceof Element ? event.target.closest('.ros-Panel') : null;
      if (from && event.key === 'Escape' && !event.defaultPrevented) {
        current.front();
      }
    });
    const nodes = new NodesPanel(current);
    const exercise = new ExercisePanel(current, app.serviceManager.contents);
    const inspector = new InspectorPanel(current);
    // On a phone the style sheet gives both other least widths, which JupyterLab is to read; and a panel covers the
    // notebook, so that what JupyterLab stores of their widths is to be what they had before.
    let phone = isPhone();
    let before: { shares: number[]; width: number } | null = null;
    shell?.layoutModified.connect(() => {
      const split = columns(shell);
      before = isPhone() ? before : split && { shares: split.relativeSizes(), width: split.node.clientWidth };
    });
    window.addEventListener('resize', () => {
      if (phone || isPhone()) {
        [tracker.currentWidget?.parent, nodes.parent].forEach(each => each?.fit());
      }
      const split = shell && columns(shell);
      if (phone !== isPhone() && before && split) {
        MessageLoop.flush(); // the least widths are read now
        const now = isPhone() ? before.width : split.node.clientWidth; // on a phone nothing is seen of them
        split.setRelativeSizes(widened(before.shares, before.width, now));
      }
      phone = isPhone();
    });
    const open: Open = (kind, name, type) => {
      if (kind === 'node') {
        nodes.choose(name);
        show(nodes.id);
      } else {
        inspector.choose(kind, name, type);
        show(inspector.id);
      }
    };
    const graph = new GraphPanel(current, open, () => void app.commands.execute('ros2-course:graph-tab'));
    const all = [
      [exercise, 'ros2-course:exercise', checkIcon],
      [nodes, 'ros2-course:nodes', nodesIcon],
      [inspector, 'ros2-course:inspector', inspectorIcon],
      [graph, 'ros2-course:graph', graphIcon]
    ] as const;
    for (const [widget, command, icon] of all) {
      // JupyterLab stores a place for each type: each panel has its own, or moving one would move the others, too.
      app.shell.add(widget, 'right', { rank: 200, type: widget.id });
      restorer?.add(widget, widget.id);
      app.commands.addCommand(command, {
        label: widget.title.caption,
        caption: `Show the panel: ${widget.title.caption}`,
        icon,
        execute: async () => {
          await paletteClosed();
          app.shell.activateById(widget.id);
        }
      });
    }
    const showRobot = addView(app, tracker, restorer, shell, {
      name: 'robot',
      label: 'Robot',
      caption: 'Show the robot in its room, with what it sees and what it is told',
      icon: robotIcon,
      below: PLOT_VIEW,
      make: () => new RobotPanel(current)
    });
    onArrival(app.restored, tracker, showRobot);
    addView(app, tracker, restorer, shell, {
      name: 'plot',
      label: 'Plot',
      caption: 'Draw numbers of any topic over time',
      icon: plotIcon,
      above: ROBOT_VIEW,
      make: () => new PlotPanel(current)
    });
    addView(app, tracker, restorer, shell, {
      name: 'graph-tab',
      label: 'Graph as a tab',
      caption: 'Show who talks to whom in a tab, where there is more room than in the panel',
      icon: graphIcon,
      above: ROBOT_VIEW,
      make: () => new GraphPanel(current, open)
    });
  }
};

export default [handingIn, panels, ways, absent, ready, front, layout, main, strip, lostTerminals, language, figures, wrapping];
