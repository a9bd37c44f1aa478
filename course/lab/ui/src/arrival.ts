// The news that a robot has come into the session of a notebook: see course/lab/kernel/arrival.py.

import { INotebookTracker, NotebookPanel } from '@jupyterlab/notebook';

const TARGET = 'ros2-course:robot';

/** Call `greet` when a robot has come, and the notebook that it belongs to is in front. */
export function onArrival(tracker: INotebookTracker, greet: () => void): void {
  const news = new WeakSet<NotebookPanel>();
  const look = () => {
    if (tracker.currentWidget && news.delete(tracker.currentWidget)) {
      greet();
    }
  };
  const listen = (panel: NotebookPanel) => {
    const hear = () =>
      panel.sessionContext.session?.kernel?.registerCommTarget(TARGET, () => {
        news.add(panel);
        look();
      });
    panel.sessionContext.kernelChanged.connect(hear);
    hear();
  };
  tracker.forEach(listen);
  tracker.widgetAdded.connect((_, panel) => listen(panel));
  tracker.currentChanged.connect(look);
}
