// The hand-in button: has the server do the same as `course hand-in` (course/lab/server/handing_in.py).

import { Dialog, Notification, showDialog, showErrorMessage } from '@jupyterlab/apputils';
import { ICellModel } from '@jupyterlab/cells';
import { NotebookPanel } from '@jupyterlab/notebook';
import { Contents } from '@jupyterlab/services';
import { ToolbarButton, LabIcon } from '@jupyterlab/ui-components';
import { Widget } from '@lumino/widgets';

import { post } from './server';

export interface Ask {
  name: string;
  known: boolean; // the student has logged in by this name, so it is not asked for
  files: string[];
  doubts: { [file: string]: string };
  unanswered: string; // a sentence on questions without an answer, or nothing
  checks: string[];
  failed?: { [check: string]: string }; // what checks that have failed say, if that is what is asked about
}

interface Done {
  archive: string;
  sent: boolean; // to the exchange of the class
  files: string[];
  checks: { [check: string]: string };
  said: string[];
}

const NAME = 'ros2-course:name'; // the browser's key for the student's name
const CODE = /`([^`\n]+)`/;
const PASSED = 'passed';
const AS_IT_IS = 'Hand it in as it is';
/** The event of the window after a hand-in. */
export const HANDED_IN = 'ros2-course:handed-in';

export const handInIcon = new LabIcon({
  name: 'ros2-course:hand-in',
  svgstr:
    '<svg xmlns="http://www.w3.org/2000/svg" width="16" viewBox="0 0 24 24">' +
    '<path class="jp-icon3" fill="#616161" d="M5 20h14v-2H5v2zm0-10h4v6h6v-6h4l-7-7-7 7z"/></svg>'
});

/** Return true if a notebook has a cell that writes a file to hand in. */
export function hasExercise(panel: NotebookPanel): boolean {
  return hasCell(panel, cell => fileOf(cell) !== '');
}

function hasCell(panel: NotebookPanel, wanted: (cell: ICellModel) => boolean): boolean {
  const cells = panel.context.model?.cells;
  for (let number = 0; cells && number < cells.length; number++) {
    if (wanted(cells.get(number))) {
      return true;
    }
  }
  return false;
}

/** Return the file that a cell of an exercise writes; '' for any other cell. */
export function fileOf(cell: ICellModel): string {
  const [magic, name] = cell.sharedModel.getSource().trimStart().split(/\s+/, 2);
  return cell.getMetadata('nbgrader')?.solution && magic === '%%exercise' && name ? name : '';
}

/** The button, only for notebooks with an exercise; nbgrader's "Validate" is only for those with cells of nbgrader's. */
export function handInButton(panel: NotebookPanel, contents: Contents.IManager): Widget {
  const button = new ToolbarButton({
    className: 'ros-HandIn',
    icon: handInIcon,
    label: 'Hand in',
    tooltip: 'Save the notebook, run the public checks, and write the archive to hand in',
    onClick: () => void handIn(panel, contents)
  });
  const look = () => {
    button.setHidden(!hasExercise(panel));
    panel.toggleClass(
      'ros-mod-graded',
      hasCell(panel, cell => Boolean(cell.getMetadata('nbgrader')))
    );
  };
  button.hide();
  void panel.context.ready.then(() => {
    if (!panel.isDisposed) {
      look();
      panel.context.model.contentChanged.connect(look);
      button.disposed.connect(() => panel.context.model?.contentChanged.disconnect(look));
    }
  });
  return button;
}

const busy = new Set<string>(); // paths of the notebooks that are being handed in

/** Hand in the exercise of a notebook: save it, ask about doubts, and show progress and result. */
export async function handIn(panel: NotebookPanel, contents: Contents.IManager): Promise<void> {
  const path = panel.context.path;
  if (busy.has(path)) {
    return;
  }
  busy.add(path);
  try {
    await panel.context.save();
    let agreed: Ask['doubts'] | null = null;
    let failed: Ask['failed'] | null = null;
    let name = '';
    for (;;) {
      const said: any = await deliver({ path, name: name || null, agreed, failed });
      if (said.done) {
        document.getElementById('refresh_assignments_list')?.click(); // of nbgrader's tab, if it is open
        window.dispatchEvent(new Event(HANDED_IN));
        await showDone(said.done, contents);
        return;
      }
      if (said.ask.failed) {
        if (!(await askAboutChecks(said.ask.failed))) {
          return;
        }
        failed = said.ask.failed;
        continue;
      }
      const answer = await ask(said.ask, name);
      if (answer === null) {
        return;
      }
      name = answer;
      agreed = said.ask.doubts;
    }
  } catch (error) {
    await showErrorMessage('Nothing was handed in', (error as Error).message);
  } finally {
    busy.delete(path);
  }
}

/** Return the server's final answer, {ask} or {done}; progress is shown as a notification. */
async function deliver(body: object): Promise<{ ask?: Ask; done?: Done }> {
  const response = await post('hand-in', body);
  let shown = '';
  let found: any = null;
  const reader = response.body!.pipeThrough(new TextDecoderStream()).getReader();
  try {
    for (let text = '', part = await reader.read(); !part.done || text; part = await reader.read()) {
      const lines = (text + (part.value ?? '')).split('\n');
      text = part.done ? '' : lines.pop()!;
      for (const line of lines.filter(line => line)) {
        const message = JSON.parse(line);
        if (message.error) {
          throw new Error(message.error);
        } else if (message.ran) {
          const progress = `Running the public checks: ${message.ran} of ${message.of}`;
          Notification.update({ id: shown, message: progress, progress: message.ran / message.of });
        } else if (message.began) {
          shown = Notification.emit('Running the public checks ...', 'in-progress', { autoClose: false });
        } else {
          found = message;
        }
      }
    }
  } finally {
    if (shown) {
      Notification.dismiss(shown);
    }
  }
  if (!found) {
    throw new Error('The server stopped during the hand-in: the terminal in which it runs shows why.');
  }
  return found;
}

/** Ask the student; return the student's name, or null if nothing is to be handed in. */
async function ask(question: Ask, before: string): Promise<string | null> {
  const doubts = Object.values(question.doubts);
  const body = element('div', 'ros-HandIn-body');
  if (doubts.length) {
    body.append(careful('Careful:', doubts));
  }
  body.append(element('p', '', `You hand in: ${question.files.join(', ')}.`));
  if (question.unanswered) {
    body.append(element('p', '', question.unanswered));
  }
  const input = document.createElement('input');
  input.className = 'jp-mod-styled';
  input.placeholder = question.name; // which counts for an empty field
  input.value = before || localStorage.getItem(NAME) || question.name;
  if (question.known) {
    body.append(element('p', '', `You hand in as ${question.name}.`));
  } else {
    const label = element('label', 'ros-HandIn-name', 'Your name on the course');
    label.append(input);
    body.append(label);
  }
  const result = await showDialog({
    title: 'Hand in',
    body: new Widget({ node: body }),
    buttons: [Dialog.cancelButton(), Dialog.okButton({ label: doubts.length ? AS_IT_IS : 'Hand in' })],
    defaultButton: doubts.length ? 0 : 1
  });
  if (!result.button.accept) {
    return null;
  }
  if (question.known) {
    return question.name;
  }
  const name = input.value.trim() || question.name;
  localStorage.setItem(NAME, name);
  return name;
}

/** Ask the student whether to hand in although public checks have failed. */
async function askAboutChecks(failed: { [check: string]: string }): Promise<boolean> {
  const said = Object.entries(failed).map(([name, outcome]) => `${name}: ${outcome}`);
  const body = element('div', 'ros-HandIn-body');
  body.append(careful(said.length > 1 ? 'Careful: public checks have failed:' : 'Careful: a public check has failed:', said));
  const result = await showDialog({
    title: 'Hand in',
    body: new Widget({ node: body }),
    buttons: [Dialog.cancelButton(), Dialog.okButton({ label: AS_IT_IS })],
    defaultButton: 0
  });
  return result.button.accept;
}

async function showDone(done: Done, contents: Contents.IManager): Promise<void> {
  const body = element('div', 'ros-HandIn-body');
  const link = document.createElement('a');
  link.href = await contents.getDownloadUrl(done.archive);
  link.download = done.archive.split('/').pop()!;
  link.textContent = `Download ${link.download}`;
  const first = element('p');
  first.append(link);
  body.append(first);
  const checks = Object.entries(done.checks).map(
    ([name, outcome]) => `${outcome === PASSED ? '✓' : '✗'} ${name}: ${outcome}`
  );
  if (checks.length) {
    body.append(list(checks));
  }
  done.said.forEach(text => body.append(element('p', '', text)));
  await showDialog({
    title: done.sent ? 'Handed in' : 'Packed: now give this archive to your instructor',
    body: new Widget({ node: body }),
    buttons: [Dialog.okButton({ label: 'Close' })]
  });
}

/** Make an element with a text, in which the words between back-ticks are code. */
function element(tag: string, className = '', text = ''): HTMLElement {
  const made = document.createElement(tag);
  made.className = className;
  text.split(CODE).forEach((part, number) => made.append(number % 2 ? element('code', '', part) : part));
  return made;
}

function careful(title: string, texts: string[]): HTMLElement {
  const made = element('div', 'ros-HandIn-doubts');
  made.append(element('strong', '', title), list(texts));
  return made;
}

function list(texts: string[]): HTMLElement {
  const made = element('ul');
  texts.forEach(text => made.append(element('li', '', text)));
  return made;
}
