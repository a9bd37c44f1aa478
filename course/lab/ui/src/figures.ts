// The course's figures in a notebook: on a dark background in a dark theme, and with their alternative text.

import { JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { imageRendererFactory, IRenderMimeRegistry } from '@jupyterlab/rendermime';
import { IRenderMime } from '@jupyterlab/rendermime-interfaces';

const FIGURE = '<figure: '; // the beginning of a figure's text form, see course/figures/picture.py
const RANK = 90; // that of JupyterLab's own renderer, which this one replaces

export const figures: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:figures',
  description: 'The course’s figures follow the theme.',
  autoStart: true,
  requires: [IRenderMimeRegistry],
  activate: (_: JupyterFrontEnd, registry: IRenderMimeRegistry) =>
    registry.addFactory({ safe: true, mimeTypes: ['image/png'], createRenderer }, RANK)
};

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
