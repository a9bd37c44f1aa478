// The main area: which tabs lie together, the borders between its parts, and those to the areas beside it.

import { ILabShell } from '@jupyterlab/application';
import { ConflatableMessage, MessageLoop } from '@lumino/messaging';
import { DockLayout, DockPanel, SplitPanel, TabBar, Widget } from '@lumino/widgets';

/** The main area that a widget lies in; null when it lies elsewhere. */
export function dockOf(widget: Widget): DockPanel | null {
  return widget.parent instanceof DockPanel ? widget.parent : null;
}

/** The bar in which a widget of the main area has its tab. */
export function barOf(widget: Widget): TabBar<Widget> | null {
  return [...(dockOf(widget)?.tabBars() ?? [])].find(bar => bar.titles.includes(widget.title)) ?? null;
}

/** The other widgets that have their tabs where a widget of the main area has its own. */
export function tabsWith(widget: Widget): Widget[] {
  return (barOf(widget)?.titles ?? []).map(title => title.owner).filter(owner => owner !== widget);
}

/** The border that is found between two parts of the main area, as one can drag it. */
export function borderOf(dock: DockPanel, found: (border: DOMRect) => boolean): HTMLElement | null {
  const borders = dock.layout instanceof DockLayout ? [...dock.layout.handles()] : [];
  return borders.find(each => !each.classList.contains('lm-mod-hidden') && found(each.getBoundingClientRect())) ?? null;
}

/** Move a border by so many px; JupyterLab keeps it where it is then. */
export function moveBorder(dock: DockPanel, border: HTMLElement, right: number, down: number): void {
  (dock.layout as DockLayout).moveHandle(border as HTMLDivElement, border.offsetLeft + right, border.offsetTop + down);
  MessageLoop.postMessage(dock, new ConflatableMessage('layout-modified'));
}

/** The left, the main and the right area, if a panel is open in the right one; otherwise null. */
export function columns(shell: ILabShell): SplitPanel | null {
  let split = [...shell.widgets('right')].find(widget => widget.isVisible)?.parent ?? null;
  while (split && !(split instanceof SplitPanel)) {
    split = split.parent;
  }
  return split;
}

/** Return the widths (px) of the three areas, whose shares of `width` are known, at `now`: the main one has the rest. */
export function widened(shares: number[], width: number, now: number): number[] {
  return shares.map((share, number) => share * width + (number === 1 ? now - width : 0));
}
