// The figures and diagrams in a notebook: in the colours of the theme, the course's figures with alternative text.

import { JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { IThemeManager } from '@jupyterlab/apputils';
import { Cell, MarkdownCell } from '@jupyterlab/cells';
import { INotebookTracker } from '@jupyterlab/notebook';
import { imageRendererFactory, IRenderMimeRegistry, MimeModel } from '@jupyterlab/rendermime';
import { IRenderMime } from '@jupyterlab/rendermime-interfaces';

const FIGURE = '<figure: '; // the beginning of a figure's text form, see course/figures/picture.py
const RANK = 90; // that of JupyterLab's own renderer, which this one replaces
const DIAGRAM = '```mermaid'; // the beginning of a diagram in a cell of text

export const figures: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:figures',
  description: 'The course’s figures and diagrams follow the theme.',
  autoStart: true,
  requires: [IRenderMimeRegistry, INotebookTracker],
  optional: [IThemeManager],
  activate: (
    _: JupyterFrontEnd,
    registry: IRenderMimeRegistry,
    notebooks: INotebookTracker,
    themes: IThemeManager | null
  ) => {
    registry.addFactory({ safe: true, mimeTypes: ['image/png'], createRenderer }, RANK);
    // JupyterLab forgets its diagrams at the same signal: draw them when all have received it.
    themes?.themeChanged.connect(() => queueMicrotask(() => notebooks.forEach(({ content }) => redraw(content.widgets))));
  }
};

/** Draw the diagrams of these cells again; JupyterLab leaves them in the colours of the earlier theme. */
function redraw(cells: readonly Cell[]): void {
  for (const cell of cells) {
    const text = cell.model.sharedModel.getSource();
    if (cell instanceof MarkdownCell && cell.rendered && text.includes(DIAGRAM)) {
      void cell.renderer.renderModel(new MimeModel({ data: { 'text/markdown': text } }));
    }
  }
}

/** JupyterLab's renderer of pictures, which also marks the course's figures. */
function createRenderer(options: IRenderMime.IRendererOptions): IRenderMime.IRenderer {
  const renderer = imageRendererFactory.createRenderer(options);
  const render = renderer.renderModel.bind(renderer);
  renderer.renderModel = async model => {
    await render(model);
    const image = renderer.node.querySelector('img');
    if (image && String(model.data['text/plain'] ?? '').startsWith(FIGURE)) {
      image.classList.add('ros-figure');
      const about = model.metadata['image/png'] as { alt?: string } | undefined;
      image.alt = about?.alt ?? '';
    }
  };
  return renderer;
}
