// The course's figures in a notebook: in a dark theme on a dark ground, and with their alternative text.

import { JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { imageRendererFactory, IRenderMimeRegistry } from '@jupyterlab/rendermime';
import { IRenderMime } from '@jupyterlab/rendermime-interfaces';

const FIGURE = '<figure: '; // what a figure is as text, see course/figures/picture.py
const RANK = 90; // as JupyterLab's own, which it takes the place of

export const figures: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:figures',
  description: 'The course’s figures follow the theme.',
  autoStart: true,
  requires: [IRenderMimeRegistry],
  activate: (_: JupyterFrontEnd, registry: IRenderMimeRegistry) =>
    registry.addFactory({ safe: true, mimeTypes: ['image/png'], createRenderer }, RANK)
};

/** JupyterLab's renderer of pictures, which marks those of the course. */
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
