// The views of the main area, robot and plot: beside the notebook, or behind it on a narrow page.

import { ILabShell, ILayoutRestorer, JupyterFrontEnd } from '@jupyterlab/application';
import { WidgetTracker } from '@jupyterlab/apputils';
import { INotebookTracker } from '@jupyterlab/notebook';
import { LabIcon } from '@jupyterlab/ui-components';
import { DockLayout, DockPanel, Widget } from '@lumino/widgets';

import { SidePanel } from './panel';

/** On a page narrower than this, in CSS px, notebook and view are in one tab area. */
export const NARROW = 760;
const PHONE = 520; // px: narrower pages have no room for a view beside a side panel either

const TEXT = 700; // px of a notebook beside a view
const LEAST = 380; // px of a view at least

export interface View {
  name: string; // of the command, ros2-course:NAME
  label: string;
  caption: string;
  icon: LabIcon;
  above?: string; // the id of the view below which it opens, if that is open
  make: () => SidePanel;
}

/** Add the command that opens a view, once for the whole page. */
export function addView(
  app: JupyterFrontEnd,
  notebooks: INotebookTracker,
  restorer: ILayoutRestorer | null,
  shell: ILabShell | null,
  view: View
): void {
  const command = `ros2-course:${view.name}`;
  const tracker = new WidgetTracker<SidePanel>({ namespace: `ros2-course-${view.name}` });
  app.commands.addCommand(command, {
    label: view.label,
    caption: view.caption,
    icon: view.icon,
    execute: () => {
      let panel = tracker.currentWidget;
      if (!panel || panel.isDisposed) {
        panel = view.make();
        void tracker.add(panel);
      }
      if (!panel.isAttached) {
        put(panel);
      }
      app.shell.activateById(panel.id);
      fit();
    }
  });
  const put = (panel: SidePanel) => {
    const notebook = notebooks.currentWidget?.isAttached ? notebooks.currentWidget.id : undefined;
    const above = view.above && document.getElementById(view.above) ? view.above : undefined;
    const mode = window.innerWidth < NARROW ? 'tab-after' : above ? 'split-bottom' : 'split-right';
    const ref = window.innerWidth < NARROW ? notebook : (above ?? notebook);
    app.shell.add(panel, 'main', { mode, ref, type: panel.id });
    if (mode === 'split-right' && notebooks.currentWidget) {
      keepWide(notebooks.currentWidget, panel);
    }
  };
  let behind = false; // true if it was beside the notebook while the page was wider
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
  void restorer?.restore(tracker, { command, name: () => view.name });
}

/** Keep the width that a notebook's text needs when a view opens beside it. */
function keepWide(notebook: Widget, view: Widget): void {
  requestAnimationFrame(() => {
    const dock = view.parent;
    if (!(dock instanceof DockPanel) || !(dock.layout instanceof DockLayout) || notebook.parent !== dock) {
      return;
    }
    const [text, beside] = [notebook.node.getBoundingClientRect(), view.node.getBoundingClientRect()];
    const more = Math.min(TEXT - text.width, beside.width - LEAST);
    for (const handle of more > 0 ? dock.layout.handles() : []) {
      const { left, right } = handle.getBoundingClientRect();
      if (left >= text.right - 1 && right <= beside.left + 1) {
        dock.layout.moveHandle(handle, left - dock.node.getBoundingClientRect().left + more, 0);
        return;
      }
    }
  });
}
