// The views of the main area, robot and plot: beside the notebook, or behind it on a narrow page.

import { ILabShell, ILayoutRestorer, JupyterFrontEnd } from '@jupyterlab/application';
import { WidgetTracker } from '@jupyterlab/apputils';
import { INotebookTracker } from '@jupyterlab/notebook';
import { LabIcon } from '@jupyterlab/ui-components';
import { Widget } from '@lumino/widgets';

import { barOf, borderOf, dockOf, moveBorder, tabsWith } from './dock';
import { SidePanel } from './panel';

/** On a page narrower than this, in CSS px, notebook and view are in one tab area. */
export const NARROW = 760;
/** On a page narrower than this, in CSS px, a side panel covers notebook and view. */
const PHONE = 600;

// px beside each other, where the page has room for both, and in any case
const TEXT = { ample: 820, usual: 700, least: 560 };
const VIEW = { ample: 800, usual: 380, least: 300 };

export interface View {
  name: string; // of the command, ros2-course:NAME
  label: string;
  caption: string;
  icon: LabIcon;
  above?: string; // the id of the view below which it opens, if that is open
  below?: string; // the id of the view above which it opens, if that is open
  make: () => SidePanel;
}

/** Add the command that opens a view, once for the whole page.
 *
 * What is returned lets it appear by itself, unless it is open: beside the notebook, which keeps the focus and its
 * width, or behind it where there is no room for both.
 */
export function addView(
  app: JupyterFrontEnd,
  notebooks: INotebookTracker,
  restorer: ILayoutRestorer | null,
  shell: ILabShell | null,
  view: View
): () => void {
  const command = `ros2-course:${view.name}`;
  const tracker = new WidgetTracker<SidePanel>({ namespace: `ros2-course-${view.name}` });
  app.commands.addCommand(command, {
    label: view.label,
    caption: view.caption,
    icon: view.icon,
    execute: async args => {
      const panel = known();
      if (!panel.isAttached) {
        behind = isNarrow();
        put(panel, behind);
      }
      if (!args.restored) {
        await paletteClosed();
        app.shell.activateById(panel.id); // takes the focus, which after a reload stays with the notebook
      }
      fit();
    }
  });
  const known = () => {
    let panel = tracker.currentWidget;
    if (!panel || panel.isDisposed) {
      panel = view.make();
      void tracker.add(panel);
    }
    return panel;
  };
  const put = (panel: SidePanel, behindIt: boolean) => {
    const notebook = notebooks.currentWidget?.isAttached ? notebooks.currentWidget : null;
    const among = notebook ? tabsWith(notebook).map(({ id }) => id) : []; // behind the notebook itself
    const opened = (id?: string) => (id && document.getElementById(id) && !among.includes(id) ? id : undefined);
    const [above, below] = [opened(view.above), opened(view.below)];
    const mode = behindIt ? 'tab-after' : above ? 'split-bottom' : below ? 'split-top' : 'split-right';
    const ref = behindIt ? notebook?.id : (above ?? below ?? notebook?.id);
    app.shell.add(panel, 'main', { mode, ref, type: panel.id, activate: false });
    if (mode === 'split-right' && notebook) {
      dockOf(notebook)?.addWidget(panel, { mode }); // as high as the page, beside a terminal below the notebook, too
      keepWide(notebook, panel);
    }
  };
  let behind = false; // true if it lies behind the notebook because the page is narrow
  const fit = () => {
    const panel = tracker.currentWidget;
    const notebook = notebooks.currentWidget;
    if (!panel?.isAttached) {
      return;
    }
    const narrow = isNarrow();
    if (narrow ? panel.isVisible && notebook?.isAttached && barOf(panel) !== barOf(notebook) : behind) {
      const focused = document.activeElement;
      const within = [panel, notebook].some(each => each?.node.contains(focused));
      const front = panel.node.contains(focused) || !notebook ? panel : notebook;
      put(panel, narrow);
      behind = narrow;
      if (within || focused === document.body) {
        app.shell.activateById(front.id);
      } else {
        dockOf(front)?.selectWidget(front); // what is typed in a terminal is not to go to the notebook
      }
    }
    if (isPhone() && panel.isVisible) {
      shell?.collapseRight();
    }
  };
  window.addEventListener('resize', fit);
  void restorer?.restore(tracker, { command, name: () => view.name, args: () => ({ restored: true }) });
  return () => {
    if (!tracker.currentWidget?.isAttached && notebooks.currentWidget?.isAttached) {
      behind = isNarrow();
      const width = barOf(notebooks.currentWidget)?.node.clientWidth ?? 0;
      put(known(), behind || width < TEXT.least + VIEW.least);
    }
  };
}

/** Wait until JupyterLab's palette, if a command was chosen in it, has given the focus back to where it was. */
export function paletteClosed(): Promise<void> {
  return new Promise(resolve => window.setTimeout(resolve, 0));
}

function isNarrow(): boolean {
  return window.innerWidth < NARROW;
}

export function isPhone(): boolean {
  return window.innerWidth < PHONE;
}

/** Keep the width that a notebook's text needs when a view opens beside it; the view has what a text does not use. */
function keepWide(notebook: Widget, view: Widget): void {
  requestAnimationFrame(() => {
    const [dock, bar] = [dockOf(notebook), barOf(notebook)]; // it may lie behind another tab
    if (!dock || !bar || dockOf(view) !== dock) {
      return;
    }
    const [text, beside] = [bar.node.getBoundingClientRect(), view.node.getBoundingClientRect()];
    const both = text.width + beside.width;
    const wanted = Math.min(TEXT.usual, Math.max(both - VIEW.usual, Math.min(TEXT.least, both - VIEW.least)));
    const border = borderOf(dock, ({ left, right }) => left >= text.right - 1 && right <= beside.left + 1);
    const width = Math.max(wanted, Math.min(text.width, Math.max(TEXT.ample, both - VIEW.ample)));
    if (border && width !== text.width) {
      moveBorder(dock, border, width - text.width, 0);
    }
  });
}
