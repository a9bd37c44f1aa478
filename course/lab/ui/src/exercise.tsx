// The exercise panel: checks, points, hints by grade, what was edited since its last run, reset, hand in.

import { Dialog, showDialog, showErrorMessage } from '@jupyterlab/apputils';
import { Cell, ICellModel, ICodeCellModel } from '@jupyterlab/cells';
import { NotebookActions, NotebookPanel } from '@jupyterlab/notebook';
import { Contents } from '@jupyterlab/services';
import { checkIcon } from '@jupyterlab/ui-components';
import * as React from 'react';

import { Current } from './current';
import { fileOf, HANDED_IN, handIn } from './handing_in';
import { CONNECTING, FirstCell, instead, liveCell, SidePanel, useCurrent } from './panel';
import { post } from './server';

interface Part {
  name: string;
  state: string;
  more: string; // further lines of the message of a check that failed
  done: boolean;
  failed: boolean; // a check that was run
  points: number;
}

/** What was handed in last, or how far a hand-in is. */
interface HandedIn {
  text: string;
  archive: string; // its path in JupyterLab, '' for none
}

interface State {
  parts: Part[];
  summary: string;
  files: { [file: string]: string }; // a note on each, and below its first line the error of its cell
  handed_in: HandedIn | null;
}

interface Hint {
  title: string;
  text: string;
}

interface File {
  name: string;
  cell: string; // nbgrader's name of its cell
  hints: Hint[];
}

// The title of a foldable hint, a word and a number in any language: "Hint 1: where to look".
const HINT = /<details>\s*<summary>\s*([^\s<]+ \d+(?::[^<]*)?)\s*<\/summary>([\s\S]*?)<\/details>/g;
const SESSION = /\bros\./; // what a check uses of the session
const SETTLE = 400; // ms after a change of the notebook
const AGAIN = 2000; // ms between two looks at the files, which may change without the notebook

/** The hints of a file: how many were opened so far, and which are open. */
interface OpenHints {
  opened: number;
  open: Set<number>;
}

export class ExercisePanel extends SidePanel {
  constructor(
    current: Current,
    private _contents: Contents.IManager
  ) {
    super(current, 'ros2-course-exercise', 'Exercise', checkIcon);
  }

  protected draw(): JSX.Element {
    return <Exercise current={this.current} contents={this._contents} hints={this._hints} />;
  }

  private _hints = new Map<string, OpenHints>();
}

interface Props {
  current: Current;
  contents: Contents.IManager;
  hints: Map<string, OpenHints>; // by notebook and cell: they stay while other notebooks are in front
}

function Exercise({ current, contents, hints }: Props): JSX.Element {
  const { link } = useCurrent(current);
  const panel = current.panel;
  const [asked, setAsked] = React.useState(false); // true if checks were asked for that need a session
  const waits = link?.state === 'waiting';
  React.useEffect(() => setAsked(false), [panel, waits]);
  const [state, setState] = React.useState<State | null>(null);
  const [failed, setFailed] = React.useState('');
  const [running, setRunning] = React.useState<Begun>({}); // the checks that run or wait, until their result is known
  React.useEffect(() => {
    setState(null);
    setRunning({});
    if (!panel) {
      return;
    }
    let timer = 0;
    let gone = false;
    const order: ICellModel[] = []; // of the cells that were run, in which the kernel takes them
    const every = window.setInterval(() => {
      if (panel.context.isReady && !document.hidden) {
        void look();
      }
    }, AGAIN);
    const look = async () => {
      try {
        const found = await (await post('exercise', { path: panel.context.path, cells: cellsOf(panel) })).json();
        if (!gone) {
          setState(before => (JSON.stringify(before) === JSON.stringify(found) ? before : found));
          setFailed('');
          setRunning(begunIn(panel, order));
        }
      } catch (error) {
        if (!gone) {
          setFailed((error as Error).message);
        }
      }
    };
    const begun = () => setRunning(before => ({ ...before, ...begunIn(panel, order) }));
    const scheduled = (_: unknown, { cell }: { cell: Cell }) => {
      order.push(...order.splice(0).filter(each => each !== cell.model && !each.isDisposed), cell.model);
      window.setTimeout(begun, 0); // then JupyterLab has marked the cell
    };
    NotebookActions.executionScheduled.connect(scheduled);
    const later = () => {
      window.clearTimeout(timer);
      timer = window.setTimeout(() => void look(), SETTLE);
    };
    void panel.context.ready.then(() => {
      if (!gone) {
        panel.context.model.contentChanged.connect(later);
        void look();
      }
    });
    // A cell writes its file when it runs, and the kernel's status then changes.
    panel.sessionContext.statusChanged.connect(later);
    const now = () => void look();
    window.addEventListener(HANDED_IN, now);
    return () => {
      window.removeEventListener(HANDED_IN, now);
      gone = true;
      window.clearTimeout(timer);
      window.clearInterval(every);
      NotebookActions.executionScheduled.disconnect(scheduled);
      panel.context.model?.contentChanged.disconnect(later);
      panel.sessionContext.statusChanged.disconnect(later);
    };
  }, [panel]);
  const files = panel && state ? filesOf(panel).filter(file => file.name in state.files) : [];
  if (!panel || failed || !state || (!state.parts.length && !files.length)) {
    const nothing = state ? 'This notebook has no exercise.' : CONNECTING;
    return (
      <>
        <h2>Exercise</h2>
        <div className="ros-Panel-message" role="status">
          {failed || (panel ? nothing : 'Open a notebook: this panel shows its exercise.')}
        </div>
      </>
    );
  }
  const checks = new Set(cellsOf(panel).filter(isCheck).map(nameOf));
  /** Run checks; none of them in a kernel without the session that they need, which would only name `ros`. */
  const run = (names: string[]) => {
    const needed = panel.content.widgets.some(
      cell => names.includes(nameOf(cell.model)) && SESSION.test(cell.model.sharedModel.getSource())
    );
    const first = waits && needed ? liveCell(panel)?.cell : null;
    if (first && (first.model as any).executionState !== 'running') {
      setAsked(true);
    } else {
      void runAll(panel, names);
    }
  };
  return (
    <>
      <header className="ros-Panel-head">
        <h2>Exercise</h2>
        <button onClick={() => void handIn(panel, contents)}>Hand in</button>
      </header>
      <div className="ros-Panel-message" role="status">
        {state.summary}
      </div>
      <HandedInView handed={state.handed_in} contents={contents} />
      {files.map(file => {
        const key = `${panel.context.path} ${file.cell}`;
        const known = hints.get(key) ?? { opened: 0, open: new Set() };
        hints.set(key, known);
        return (
          <FileItem key={`${panel.id} ${key}`} file={file} note={state.files[file.name]} panel={panel} known={known} />
        );
      })}
      <header className="ros-Panel-head">
        <h3>Checks and questions</h3>
        <button onClick={() => run([...checks])} disabled={!checks.size}>
          Run all checks
        </button>
      </header>
      <div className="ros-Panel-message" role="status">
        {asked && waits && `No check was run. ${instead(current, link)}`}
      </div>
      {asked && waits && <FirstCell current={current} link={link} />}
      <ul className="ros-Parts" aria-label="Checks and questions">
        {state.parts.map(part => ({ ...part, runs: running[part.name] })).map(part => (
          <li key={part.name} className={part.runs ? '' : part.done ? 'ros-mod-done' : part.failed ? 'ros-mod-failed' : ''}>
            <button
              onClick={() => (checks.has(part.name) ? run([part.name]) : void show(panel, part.name))}
              aria-label={`${checks.has(part.name) ? 'Run the check' : 'Show the question'} ${part.name}`}
            >
              {checks.has(part.name) ? 'Run' : 'Show'}
            </button>
            <span className="ros-mark" aria-hidden="true">
              {part.runs ? '…' : part.done ? '✓' : part.failed ? '✗' : '○'}
            </span>
            <span className="ros-part">
              <strong>{part.name}</strong>: {part.runs || part.state}{' '}
              <span className="ros-quiet">(up to {part.points} points)</span>
            </span>
            {part.more && !part.runs && <pre className="ros-more">{part.more}</pre>}
          </li>
        ))}
      </ul>
    </>
  );
}

function HandedInView({ handed, contents }: { handed: HandedIn | null; contents: Contents.IManager }): JSX.Element {
  const [url, setUrl] = React.useState('');
  const archive = handed?.archive ?? '';
  React.useEffect(() => {
    setUrl('');
    if (!archive) {
      return;
    }
    let wanted = true;
    contents.getDownloadUrl(archive).then(
      found => wanted && setUrl(found),
      () => undefined // the sentence names it
    );
    return () => {
      wanted = false;
    };
  }, [archive]);
  const name = archive.split('/').pop()!;
  return (
    <div className="ros-Panel-message" role="status">
      {handed?.text}{' '}
      {url && (
        <a href={url} download={name}>
          Download {name}
        </a>
      )}
    </div>
  );
}

interface Item {
  file: File;
  note: string;
  panel: NotebookPanel;
  known: OpenHints;
}

function FileItem({ file, note, panel, known }: Item): JSX.Element {
  const [, redraw] = React.useReducer((count: number) => count + 1, 0);
  const [said, ...more] = note.split('\n');
  const toggle = (number: number, open: boolean) => {
    open ? known.open.add(number) : known.open.delete(number);
    known.opened = open ? Math.max(known.opened, number + 1) : known.opened;
    redraw();
  };
  return (
    <section className="ros-File" aria-label={file.name}>
      <div className="ros-Panel-head">
        <h3>
          <code>{file.name}</code>
        </h3>
        <span className="ros-buttons">
          <button onClick={() => void runAll(panel, [file.cell])} aria-label={`Run the cell of ${file.name}`}>
            Run
          </button>
          <button onClick={() => void reset(panel, file)} aria-label={`Reset ${file.name}`}>
            Reset
          </button>
        </span>
      </div>
      <div role="status">
        <span className={said ? 'ros-note' : ''}>{said || 'the same as in its cell'}</span>
        {more.length > 0 && <pre className="ros-more">{more.join('\n')}</pre>}
      </div>
      {file.hints.map((hint, number) =>
        number > known.opened ? (
          <div key={hint.title} className="ros-quiet">
            {hint.title.replace(/:.*/, '')}: open the hint before it first
          </div>
        ) : (
          <details
            key={hint.title}
            open={known.open.has(number)}
            onToggle={event => toggle(number, event.currentTarget.open)}
          >
            <summary>{hint.title}</summary>
            <Markdown text={hint.text} panel={panel} />
          </details>
        )
      )}
    </section>
  );
}

/** A text rendered as in the notebook. */
function Markdown({ text, panel }: { text: string; panel: NotebookPanel }): JSX.Element {
  const place = React.useRef<HTMLDivElement>(null);
  React.useEffect(() => {
    const { rendermime } = panel.content;
    const renderer = rendermime.createRenderer('text/markdown');
    void renderer.renderModel(rendermime.createModel({ data: { 'text/markdown': text } }));
    place.current?.replaceChildren(renderer.node);
    return () => renderer.dispose();
  }, [text, panel]);
  return <div ref={place} className="ros-hint" />;
}

const INTERRUPTIONS = ['KeyboardInterrupt', 'Interrupted']; // as course/session/guards.py names them

/** Return true if a cell that did not end well was interrupted, itself or while it waited for a cell before it. */
function wasInterrupted(cell: Cell): boolean {
  const outputs: any[] = (cell.model.toJSON() as any).outputs ?? [];
  return outputs.every(each => each.output_type !== 'error' || INTERRUPTIONS.includes(each.ename));
}

/** Run the cells with these names one after the other, whatever their results, until an interruption or a restart. */
async function runAll(panel: NotebookPanel, names: string[]): Promise<void> {
  const { content: notebook, sessionContext } = panel;
  let restarted = false;
  const look = (_: unknown, status: string) => {
    restarted ||= status.endsWith('restarting'); // the new kernel knows nothing of what the cells need
  };
  sessionContext.statusChanged.connect(look);
  try {
    for (const cell of notebook.widgets.filter(widget => names.includes(nameOf(widget.model)))) {
      if (names.length === 1) {
        notebook.activeCellIndex = notebook.widgets.indexOf(cell); // JupyterLab scrolls to the active one
      }
      const well = await NotebookActions.runCells(notebook, [cell], sessionContext);
      if (restarted || (!well && wasInterrupted(cell))) {
        return;
      }
    }
  } finally {
    sessionContext.statusChanged.disconnect(look);
  }
}

async function show(panel: NotebookPanel, name: string): Promise<void> {
  const number = panel.content.widgets.findIndex(widget => nameOf(widget.model) === name);
  if (number >= 0) {
    panel.content.activeCellIndex = number;
    await panel.content.scrollToItem(number);
    panel.content.activate();
  }
}

/** Reset the cell of a file to its released text; the present text is kept in a file. */
async function reset(panel: NotebookPanel, file: File): Promise<void> {
  const cell = panel.content.widgets.find(widget => nameOf(widget.model) === file.cell);
  if (!cell) {
    return;
  }
  const ask = async (look: boolean) => {
    const text = cell.model.sharedModel.getSource();
    const body = { path: panel.context.path, cell: file.cell, file: file.name, text, look };
    const answer = await (await post('exercise/reset', body)).json();
    if (answer.error) {
      throw new Error(answer.error);
    }
    return answer;
  };
  try {
    if ((await ask(true)).same) {
      await showDialog({
        title: `Nothing to reset in ${file.name}`,
        body: 'The cell has its original text.',
        buttons: [Dialog.okButton({ label: 'Close' })]
      });
      return;
    }
    const sure = await showDialog({
      title: `Reset ${file.name}?`,
      body: 'The cell is restored to its original text. What you have written is kept in a file beside the notebook.',
      buttons: [Dialog.cancelButton(), Dialog.warnButton({ label: 'Reset' })],
      defaultButton: 0
    });
    if (!sure.button.accept) {
      return;
    }
    const answer = await ask(false);
    cell.model.sharedModel.setSource(answer.stub);
    (cell.model as ICodeCellModel).clearExecution(); // what came of the old text
    const kept = answer.copy ? `What you had written is in ${answer.copy}.` : 'Its cell had this text already.';
    await showDialog({
      title: `${file.name} was reset`,
      body: `${kept}${answer.written ? ' The file itself stays as it is until you run the cell.' : ''}`,
      buttons: [Dialog.okButton({ label: 'Close' })]
    });
  } catch (error) {
    await showErrorMessage(`${file.name} was not reset`, (error as Error).message);
  }
}

function cellsOf(panel: NotebookPanel): any[] {
  const model = panel.context.model;
  const found = [];
  for (let number = 0; number < model.cells.length; number++) {
    const cell: any = model.cells.get(number).toJSON();
    const of = (type: string) => cell.outputs?.filter((output: any) => output.output_type === type) ?? [];
    const errors = of('error').map(({ output_type, ename, evalue }: any) => ({ output_type, ename, evalue }));
    const printed = errors.length ? of('stream').filter((output: any) => output.name === 'stderr') : []; // with a hint
    found.push({
      cell_type: cell.cell_type,
      source: cell.source,
      metadata: { nbgrader: cell.metadata?.nbgrader ?? null },
      execution_count: cell.execution_count ?? null,
      outputs: [...errors, ...printed]
    });
  }
  return found;
}

function filesOf(panel: NotebookPanel): File[] {
  const files: File[] = [];
  let hints: Hint[] = [];
  for (const cell of panel.content.widgets) {
    const name = fileOf(cell.model);
    if (name) {
      files.push({ name, cell: nameOf(cell.model), hints });
      hints = [];
    } else if (cell.model.type === 'markdown') {
      const found = cell.model.sharedModel.getSource().matchAll(HINT);
      hints.push(...[...found].map(match => ({ title: match[1].trim(), text: match[2].trim() })));
    }
  }
  return files;
}

/** Graded cells that were run and have not ended, by name: the kernel runs the first and has the others wait. */
type Begun = { [name: string]: string };

function begunIn(panel: NotebookPanel, order: ICellModel[]): Begun {
  const runs = (model: any) => model.type === 'code' && model.executionState === 'running';
  const models = panel.isDisposed ? [] : panel.content.widgets.map(cell => cell.model).filter(runs);
  models.sort((one, other) => order.indexOf(one) - order.indexOf(other)); // one begun before this panel comes first
  return Object.fromEntries(
    models.map((model, place) => [nameOf(model), place ? 'waiting for the cell that runs' : 'running'])
  );
}

function nameOf(cell: any): string {
  return (cell.getMetadata ? cell.getMetadata('nbgrader') : cell.metadata?.nbgrader)?.grade_id ?? '';
}

function isCheck(cell: any): boolean {
  const mark = cell.metadata?.nbgrader;
  return cell.cell_type === 'code' && mark?.grade && mark?.locked;
}
