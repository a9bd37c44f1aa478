// The course's part of JupyterLab: each plugin does one thing.

import { JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { ICommandPalette, IToolbarWidgetRegistry } from '@jupyterlab/apputils';
import { INotebookTracker, NotebookPanel } from '@jupyterlab/notebook';

import { handIn, handInButton, handInIcon, hasExercise } from './handing_in';

export const CATEGORY = 'ROS course';

const handingIn: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:hand-in',
  description: 'The hand-in button in the toolbar of a notebook with an exercise.',
  autoStart: true,
  requires: [INotebookTracker, IToolbarWidgetRegistry],
  optional: [ICommandPalette],
  activate: (
    app: JupyterFrontEnd,
    tracker: INotebookTracker,
    toolbars: IToolbarWidgetRegistry,
    palette: ICommandPalette | null
  ) => {
    const contents = app.serviceManager.contents;
    toolbars.addFactory<NotebookPanel>('Notebook', 'hand-in', panel => handInButton(panel, contents));
    app.commands.addCommand('ros2-course:hand-in', {
      label: 'Hand in',
      caption: 'Hand in the exercise of the current notebook',
      icon: handInIcon,
      isEnabled: () => tracker.currentWidget !== null && hasExercise(tracker.currentWidget),
      execute: () => (tracker.currentWidget ? handIn(tracker.currentWidget, contents) : undefined)
    });
    palette?.addItem({ command: 'ros2-course:hand-in', category: CATEGORY });
  }
};

export default [handingIn];
