// The news that a robot has come into the session of a notebook: see course/lab/kernel/arrival.py.

import { INotebookTracker, NotebookPanel } from '@jupyterlab/notebook';
import { Kernel } from '@jupyterlab/services';

const TARGET = 'ros2-course:robot';

/** Call `greet` once for a kernel in which a robot is, when the notebook that it belongs to is in front.
 *
 * The news is a comm that the kernel has opened: also before this page was there.  Who has greeted closes it.
 */
export function onArrival(restored: Promise<unknown>, tracker: INotebookTracker, greet: () => void): void {
  let ready = false; // before, JupyterLab would lay out its main area again
  const news = new WeakMap<NotebookPanel, Kernel.IComm>();
  const look = () => {
    const panel = tracker.currentWidget;
    const comm = panel && news.get(panel);
    if (comm && ready && panel.isAttached) {
      news.delete(panel);
      comm.close();
      greet();
    }
  };
  const take = (panel: NotebookPanel, comm: Kernel.IComm) => {
    news.set(panel, comm);
    look();
  };
  const listen = (panel: NotebookPanel) => {
    let heard: Kernel.IKernelConnection | null = null;
    const hear = () => {
      const kernel = panel.sessionContext.session?.kernel ?? null;
      if (kernel === heard) {
        return;
      }
      heard = kernel;
      news.delete(panel);
      if (!kernel?.handleComms) {
        return;
      }
      kernel.registerCommTarget(TARGET, comm => take(panel, comm));
      kernel.requestCommInfo({ target_name: TARGET }).then(
        ({ content }) => {
          const [waiting] = content.status === 'ok' ? Object.keys(content.comms) : [];
          if (waiting && !kernel.isDisposed && !kernel.hasComm(waiting)) {
            take(panel, kernel.createComm(TARGET, waiting));
          }
        },
        () => undefined // the kernel has ended
      );
    };
    panel.sessionContext.kernelChanged.connect(hear);
    hear();
    void panel.revealed.then(look);
  };
  void restored.then(() => {
    ready = true;
    look();
  });
  tracker.forEach(listen);
  tracker.widgetAdded.connect((_, panel) => listen(panel));
  tracker.currentChanged.connect(look);
}
