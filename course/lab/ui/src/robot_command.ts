// Where the robot view lies: beside the notebook, and on a narrow page behind it.

import { ILayoutRestorer, JupyterFrontEnd } from '@jupyterlab/application';
import { WidgetTracker } from '@jupyterlab/apputils';
import { INotebookTracker } from '@jupyterlab/notebook';

import { Current } from './current';
import { RobotPanel, robotIcon } from './robot';

const NARROW = 760; // px

/** Add the command that opens the robot view, once for the whole page. */
export function addRobot(
  app: JupyterFrontEnd,
  current: Current,
  notebooks: INotebookTracker,
  restorer: ILayoutRestorer | null
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
        const beside = notebooks.currentWidget?.isAttached ? notebooks.currentWidget.id : undefined;
        const mode = window.innerWidth < NARROW ? 'tab-after' : 'split-right';
        app.shell.add(panel, 'main', { mode, ref: beside, type: 'ROS course' });
      }
      app.shell.activateById(panel.id);
    }
  });
  void restorer?.restore(tracker, { command, name: () => 'robot' });
}
