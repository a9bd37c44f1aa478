// Where the robot view lies: beside the notebook, and on a narrow page behind it.

import { ILabShell, ILayoutRestorer, JupyterFrontEnd } from '@jupyterlab/application';
import { WidgetTracker } from '@jupyterlab/apputils';
import { INotebookTracker } from '@jupyterlab/notebook';

import { Current } from './current';
import { RobotPanel, robotIcon } from './robot';

/** On a page narrower than this, in CSS px, notebook and robot lie one behind the other. */
export const NARROW = 760;
const PHONE = 520; // px: here the robot has no room beside a side panel either

/** Add the command that opens the robot view, once for the whole page. */
export function addRobot(
  app: JupyterFrontEnd,
  current: Current,
  notebooks: INotebookTracker,
  restorer: ILayoutRestorer | null,
  shell: ILabShell | null
): void {
  const command = 'ros2-course:robot';
  const tracker = new WidgetTracker<RobotPanel>({ namespace: 'ros2-course-robot' });
  app.commands.addCommand(command, {
    label: 'Robot',
    caption: 'Show the robot in its room, with what it sees and what it is told',
    icon: robotIcon,
    execute: () => {
      let panel = tracker.currentWidget;
      if (!panel || panel.isDisposed) {
        panel = new RobotPanel(current);
        void tracker.add(panel);
      }
      if (!panel.isAttached) {
        put(panel);
      }
      app.shell.activateById(panel.id);
      fit();
    }
  });
  const put = (panel: RobotPanel) => {
    const ref = notebooks.currentWidget?.isAttached ? notebooks.currentWidget.id : undefined;
    const mode = window.innerWidth < NARROW ? 'tab-after' : 'split-right';
    app.shell.add(panel, 'main', { mode, ref, type: panel.id });
  };
  let behind = false; // it was beside the notebook while the page was wider
  const fit = () => {
    const panel = tracker.currentWidget;
    const notebook = notebooks.currentWidget;
    if (!panel?.isAttached) {
      return;
    }
    const narrow = window.innerWidth < NARROW;
    if (narrow ? panel.isVisible && notebook?.isVisible : behind) {
      const front = panel.node.contains(document.activeElement) || !notebook ? panel : notebook;
      put(panel);
      behind = narrow;
      app.shell.activateById(front.id);
    }
    if (window.innerWidth < PHONE && panel.isVisible) {
      shell?.collapseRight();
    }
  };
  window.addEventListener('resize', fit);
  void restorer?.restore(tracker, { command, name: () => 'robot' });
}
