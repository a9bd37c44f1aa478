// Long lines of code are wrapped; what is wrapped is indented further than its line, so that it is told from a new line.

import { RangeSetBuilder } from '@codemirror/state';
import { Decoration, DecorationSet, EditorView, ViewPlugin, ViewUpdate } from '@codemirror/view';
import { JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { EditorExtensionRegistry, IEditorExtensionRegistry } from '@jupyterlab/codemirror';

const FURTHER = 4; // columns
const MOST = 24; // columns that a line's own indentation counts: a narrow cell needs the rest

/** Return the columns that wrapped parts of a line are indented by. */
export function hangs(text: string, tab: number): number {
  const blank = /^[ \t]*/.exec(text)![0];
  return Math.min(MOST, [...blank].reduce((columns, each) => columns + (each === '\t' ? tab : 1), 0)) + FURTHER;
}

function hanging(view: EditorView): DecorationSet {
  const all = new RangeSetBuilder<Decoration>();
  if (view.lineWrapping) {
    for (const { from, to } of view.visibleRanges) {
      for (let at = from; at <= to; ) {
        const line = view.state.doc.lineAt(at);
        const style = `--ros-hangs: ${hangs(line.text, view.state.tabSize)}ch`;
        all.add(line.from, line.from, Decoration.line({ class: 'ros-hanging', attributes: { style } }));
        at = line.to + 1;
      }
    }
  }
  return all.finish();
}

class Hanging {
  constructor(view: EditorView) {
    this.decorations = hanging(view);
  }

  update(update: ViewUpdate): void {
    // Whether lines are wrapped is known once the page is laid out.
    if (update.docChanged || update.viewportChanged || update.geometryChanged) {
      this.decorations = hanging(update.view);
    }
  }

  decorations: DecorationSet;
}

export const wrapping: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:wrapping',
  description: 'Wrapped lines of code are indented further than their beginning.',
  autoStart: true,
  requires: [IEditorExtensionRegistry],
  activate: (_: JupyterFrontEnd, editors: IEditorExtensionRegistry) =>
    editors.addExtension({
      name: 'ros2-course-lab:wrapping',
      factory: () =>
        EditorExtensionRegistry.createImmutableExtension(
          ViewPlugin.fromClass(Hanging, { decorations: plugin => plugin.decorations })
        )
    })
};
