// The plot: numbers of any topic over time, which can be paused, scrolled, and saved.

import { LabIcon } from '@jupyterlab/ui-components';
import { Message } from '@lumino/messaging';
import * as React from 'react';

import { Current } from './current';
import { drawAgain } from './drawing';
import { Link } from './link';
import { FirstCell, instead, SidePanel, useCurrent, useTopic } from './panel';
import { add, Clock, colourOf, csv, draw, Frame, freePlace, heard, nameOf, nowOf, Series, timeName, unitOf, valueAt } from './plot_series';

export const plotIcon = new LabIcon({
  name: 'ros2-course:plot',
  svgstr:
    '<svg xmlns="http://www.w3.org/2000/svg" width="16" viewBox="0 0 24 24"><g class="jp-icon3" fill="#616161">' +
    '<path d="M3 3h2v16h16v2H3z"/><path d="M6.700 16.300l4-7 4 4 4.600-7.800 1.700 1-5.800 9.900-4-4-2.800 4.900z"/></g></svg>'
});

const MOST = 8; // series
const KEPT = 6000; // values of each, when the page is loaded again
const SPANS: [number, string][] = [
  [10, '10 s'],
  [30, '30 s'],
  [120, '2 min'],
  [600, '10 min']
];
const FIRST = ['/cmd_vel', '/odom', '/scan']; // topics that are chosen before others
const USUAL = ['linear.x', 'ranges[0]']; // and the field
const STEP = 0.1; // of the frame, for an arrow key
const PICTURE: [number, number] = [1200, 600]; // px, of a saved picture
const OLD = 3; // s without a message, after which the last number is told as such
const NUMBERS = 250; // ms between two changes of the numbers: nobody reads faster

/** The state that a panel keeps while it is hidden. */
interface Memory {
  series: Series[];
  began: number; // s
  span: number; // s
  until: number | null; // s, of a paused plot
  clock: Clock | null; // null before the first message
  simulated: boolean; // true if a simulation has run since it began
}

export const PLOT_VIEW = 'ros2-course-plot';

export class PlotPanel extends SidePanel {
  constructor(current: Current) {
    super(current, PLOT_VIEW, 'Plot', plotIcon);
    this.title.closable = true;
    window.addEventListener('pagehide', this._keep);
  }

  dispose(): void {
    window.removeEventListener('pagehide', this._keep);
    super.dispose();
  }

  protected draw(): JSX.Element {
    return <Plot current={this.current} memory={this._memory} />;
  }

  protected onCloseRequest(message: Message): void {
    super.onCloseRequest(message);
    this.dispose();
    sessionStorage.removeItem(PLOT_VIEW);
  }

  private _keep = () => keep(this._memory);
  private _memory: Memory = kept() ?? { series: [], began: 0, span: 30, until: null, clock: null, simulated: false };
}

/** Keep a plot for the time in which its page is loaded again; of the values, the last ones. */
function keep(memory: Memory): void {
  const last = (values: number) =>
    memory.series.map(each => ({ ...each, times: each.times.slice(-values || Infinity), values: each.values.slice(-values || Infinity) }));
  for (const values of [KEPT, 0]) {
    try {
      sessionStorage.setItem(PLOT_VIEW, JSON.stringify({ ...memory, series: last(values) }));
      return;
    } catch {
      continue; // the browser allows less
    }
  }
}

/** Return the plot that was kept, or null. */
function kept(): Memory | null {
  try {
    const found = JSON.parse(sessionStorage.getItem(PLOT_VIEW) ?? 'null');
    if (!found || !Array.isArray(found.series)) {
      return null;
    }
    found.series.forEach((each: Series, place: number) => (each.place ??= place));
    return { clock: null, simulated: false, ...found };
  } catch {
    return null;
  }
}

function Plot({ current, memory }: { current: Current; memory: Memory }): JSX.Element {
  const { link } = useCurrent(current);
  const [, redraw] = React.useReducer((count: number) => count + 1, 0);
  const [failed, setFailed] = React.useState('');
  const canvas = React.useRef<HTMLCanvasElement>(null);
  const message = instead(current, link);
  const paused = memory.until !== null;
  const path = current.panel?.context.path ?? '';
  useEvery(NUMBERS, redraw);
  React.useEffect(() => setFailed(''), [link, link?.state]); // what was said was of another session
  useDrawing(canvas, memory);
  const change = (changed: Partial<Memory>) => {
    Object.assign(memory, changed);
    setFailed(''); // the reader does something else now
    redraw();
  };
  const end = () => memory.series.reduce((last, { times }) => Math.max(last, times[times.length - 1] ?? 0), memory.began);
  const scroll = (until: number) => change({ until: Math.min(end(), Math.max(memory.began, until)) });
  const remove = (gone: Series) => change({ series: memory.series.filter(each => each !== gone) });
  const until = memory.until ?? end();
  const about = memory.series.map(each => `${nameOf(each)}: ${told(valueAt(each, until))}`).join('; ');
  return (
    <>
      <header className="ros-Panel-head">
        <h2 className="ros-hidden">Plot</h2>
      </header>
      <div className="ros-Panel-message" role="status">
        {message ?? failed}
      </div>
      <FirstCell current={current} link={link} />
      {message === null && (
        <Choice
          link={link!}
          full={memory.series.length >= MOST}
          changed={() => setFailed('')}
          add={(topic, field, type) => {
            setFailed('');
            if (!memory.series.some(each => each.topic === topic && each.field === field)) {
              const first = !memory.series.length && { began: nowOf(null), clock: null, simulated: false };
              const made = { topic, field, unit: unitOf(type, field), place: freePlace(memory.series), from: path, times: [], values: [] };
              change({ ...first, series: [...memory.series, made] });
            }
          }}
        />
      )}
      {memory.series.length === 0 && message === null && (
        <p className="ros-quiet">
          Choose a number of a topic: a distance, a command, an effort. It is drawn from now on, as it comes.
        </p>
      )}
      {memory.series.length > 0 && (
        <>
          <ul className="ros-Plot-series" aria-label="The numbers in the plot">
            {memory.series.map(each => (
              <Row
                key={nameOf(each)}
                link={message === null ? link : null}
                series={each}
                value={valueAt(each, until)}
                paused={paused}
                away={each.from && each.from !== path ? each.from.split('/').pop()! : ''}
                hear={clock => {
                  memory.clock = heard(memory.clock, clock);
                  memory.simulated ||= clock.simulated;
                  return memory.clock;
                }}
                remove={() => remove(each)}
                failed={why => {
                  remove(each);
                  setFailed(why);
                }}
              />
            ))}
          </ul>
          <div className="ros-Plot-stage">
            <canvas
              ref={canvas}
              role="img"
              aria-label={`Over the last ${memory.span} s: ${about}`}
              tabIndex={0}
              onKeyDown={event => {
                const by = { ArrowLeft: -STEP, ArrowRight: STEP }[event.key];
                if (by && paused) {
                  event.preventDefault();
                  event.stopPropagation();
                  scroll(until + by * memory.span);
                }
              }}
              onPointerDown={event => event.button === 0 && event.currentTarget.setPointerCapture(event.pointerId)}
              onPointerMove={event => {
                if (event.currentTarget.hasPointerCapture(event.pointerId) && event.movementX) {
                  scroll(until - (event.movementX / event.currentTarget.clientWidth) * memory.span);
                }
              }}
            />
          </div>
          <div className="ros-Robot-controls" role="group" aria-label="The plot">
            <button onClick={() => change({ until: paused ? null : end() })}>{paused ? 'Continue' : 'Pause'}</button>
            <label>
              Show
              <select value={memory.span} onChange={event => change({ span: Number(event.target.value) })}>
                {SPANS.map(([span, name]) => (
                  <option key={span} value={span}>
                    {name}
                  </option>
                ))}
              </select>
            </label>
            {paused && (
              <label>
                Scroll
                <input
                  type="range"
                  min={0}
                  max={Math.max(0.1, end() - memory.began)}
                  step={0.1}
                  value={until - memory.began}
                  aria-valuetext={`until ${(until - memory.began).toFixed(1)} s`}
                  onChange={event => scroll(memory.began + Number(event.target.value))}
                />
              </label>
            )}
            <button
              onClick={() =>
                change({
                  series: memory.series.map(each => ({ ...each, times: [], values: [] })),
                  began: nowOf(memory.clock),
                  simulated: false,
                  until: null
                })
              }
            >
              Clear
            </button>
            <button onClick={() => picture(canvas.current!, memory)}>Save as PNG</button>
            <button
              onClick={() => {
                const table = csv(memory.series, memory.began, memory.simulated);
                save(new Blob([table], { type: 'text/csv' }), 'plot.csv');
              }}
            >
              Save as CSV
            </button>
          </div>
        </>
      )}
    </>
  );
}

/** The choice of the next number to draw. */
function Choice(props: {
  link: Link;
  full: boolean;
  changed: () => void;
  add: (topic: string, field: string, type: string) => void;
}): JSX.Element {
  const { link } = props;
  const [known, setTopics] = React.useState<[string, string][] | null>(null);
  const [chosen, setChosen] = React.useState('');
  const [found, setFound] = React.useState<string[] | null>(null); // null until the kernel has answered
  const fields = found ?? [];
  const [field, setField] = React.useState('');
  const [failed, setFailed] = React.useState('');
  const id = React.useId();
  useTopic(link, 'plot.topics', {}, setTopics, () => setTopics(null), setFailed);
  const topics = known ?? [];
  const usual = FIRST.map(name => topics.find(each => each[0] === name)).find(found => found);
  const [topic, type] = topics.find(each => each[0] === chosen) ?? usual ?? topics[0] ?? ['', ''];
  const before = React.useRef('');
  React.useEffect(() => {
    if (before.current) {
      props.changed();
    }
    before.current = topic;
    let wanted = true;
    setFound(null);
    setField('');
    setFailed('');
    if (type) {
      link.request('plot.fields', { type_name: type }).then(
        (found: string[]) => {
          if (wanted) {
            const usual = found.find(each => USUAL.some(name => each === name || each.endsWith(`.${name}`)));
            setFound(found);
            const first = usual ?? found.find(each => !each.startsWith('header.')) ?? found[0] ?? '';
            setField(typed => typed || first); // what the reader has typed meanwhile stays
          }
        },
        error => wanted && setFailed(error.message)
      );
    }
    return () => {
      wanted = false;
    };
  }, [link, topic, type]);
  if (!topics.length) {
    return <p className="ros-quiet">{failed || (known && 'No node publishes a topic now.')}</p>;
  }
  return (
    <form
      className="ros-Plot-choice"
      onSubmit={event => {
        event.preventDefault();
        if (field.trim()) {
          props.add(topic, field.trim(), type);
        }
      }}
    >
      <label>
        Topic
        <select value={topic} onChange={event => setChosen(event.target.value)}>
          {topics.map(([name]) => (
            <option key={name}>{name}</option>
          ))}
        </select>
      </label>
      <label>
        Field
        <input
          list={id}
          value={field}
          title="For one number of a list, put its place in brackets: ranges[90]"
          onChange={event => {
            setField(event.target.value);
            props.changed();
          }}
          onFocus={event => event.target.select()}
        />
        <datalist id={id}>
          {fields.map(each => (
            <option key={each} value={each} />
          ))}
        </datalist>
      </label>
      <button type="submit" className="ros-mod-main" disabled={!field.trim() || props.full}>
        Add to the plot
      </button>
      <div role="status">
        {failed ||
          (props.full && `At most ${MOST}: remove one first.`) ||
          (type && found?.length === 0 && !failed && `${type} has no numbers.`)}
      </div>
    </form>
  );
}

/** A line of the legend, which follows its topic. */
function Row(props: {
  link: Link | null;
  series: Series;
  value: number | null | undefined;
  paused: boolean;
  away: string; // the notebook from which it was chosen, if another one is in front
  hear: (clock: any) => Clock; // called with the kernel's
  remove: () => void;
  failed: (why: string) => void;
}): JSX.Element {
  const { series } = props;
  const now = React.useRef(series);
  now.current = series; // a new one when the plot starts again
  const last = React.useRef(0); // ms, when a message came
  const [says, setSays] = React.useState('');
  const [came, setCame] = React.useState(false);
  useTopic(
    props.link,
    'plot',
    { name: series.topic, field: series.field },
    data => {
      add(now.current, data.points, props.hear(data.clock).shift);
      setSays(data.says);
      setCame(before => before || data.points.length > 0);
      last.current = data.points.length ? Date.now() : last.current;
    },
    () => {
      add(now.current, [null], 0); // for the time in which the panel was hidden
      setSays('');
      setCame(false);
    },
    props.failed
  );
  const value = came || props.paused ? props.value : undefined;
  const silent = came && !props.paused ? (Date.now() - last.current) / 1000 : 0; // s
  const note = (says && props.away ? `From ${props.away}, which is not in front now.` : says) || (!came && 'Nothing has come yet.') || (silent > OLD && `Nothing has come for ${Math.round(silent)} s.`);
  return (
    <li>
      <span className="ros-Robot-swatch" style={{ background: `var(${colourOf(series.place)})` }} aria-hidden="true" />
      <span className="ros-Plot-told">
        <code>{nameOf(series)}</code>
        <output>
          {told(value)}
          {typeof value === 'number' && series.unit && ` ${series.unit}`}
        </output>
        <span className="ros-quiet">{props.link && note}</span>
      </span>
      <button aria-label={`Remove ${nameOf(series)}`} title="Remove it from the plot" onClick={props.remove}>
        ×
      </button>
    </li>
  );
}

function told(value: number | null | undefined): string {
  if (value === undefined || value === null) {
    return value === null ? 'no number' : '–';
  }
  const large = Math.abs(value) >= 1e4 && Math.abs(value) < 1e15; // whose digits before the point all count
  return String(Number(large ? value.toFixed(1) : value.toPrecision(5)));
}

/** Call something repeatedly while the component is mounted. */
function useEvery(period: number, call: () => void): void {
  React.useEffect(() => {
    const timer = window.setInterval(call, period);
    return () => window.clearInterval(timer);
  }, []);
}

/** Return the frame shown: the span until now, or until the pause; at first the span that will be filled. */
function frameOf({ began, span, until, clock }: Memory): Frame {
  const end = Math.max(until ?? nowOf(clock), began + span);
  return { from: end - span, until: end };
}

/** Draw while time goes on, otherwise when something has changed. */
function useDrawing(canvas: React.RefObject<HTMLCanvasElement>, memory: Memory): void {
  React.useEffect(() => {
    let seen = '';
    return drawAgain(() => {
      const node = canvas.current;
      if (!node?.clientWidth || !node.clientHeight) {
        return;
      }
      const [width, height, ratio] = [node.clientWidth, node.clientHeight, window.devicePixelRatio || 1];
      const is = [width, height, ratio, memory.until, memory.span, memory.series.length, document.body.dataset.jpThemeName];
      if (memory.until !== null && is.join() === seen) {
        return;
      }
      seen = is.join();
      if (node.width !== Math.round(width * ratio) || node.height !== Math.round(height * ratio)) {
        [node.width, node.height] = [Math.round(width * ratio), Math.round(height * ratio)];
      }
      const context = node.getContext('2d', { alpha: false })!;
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      const name = timeName(memory.simulated);
      draw(context, memory.series, frameOf(memory), memory.began, name, memory.until, [width, height], getComputedStyle(node), false);
    });
  }, []);
}

/** Save the frame as a picture, with the names of the series. */
function picture(shown: HTMLCanvasElement, memory: Memory): void {
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [2 * PICTURE[0], 2 * PICTURE[1]];
  const context = canvas.getContext('2d', { alpha: false })!;
  context.setTransform(2, 0, 0, 2, 0, 0);
  const name = timeName(memory.simulated);
  draw(context, memory.series, frameOf(memory), memory.began, name, null, PICTURE, getComputedStyle(shown), true);
  canvas.toBlob(blob => blob && save(blob, 'plot.png'), 'image/png');
}

/** Have the browser keep a file. */
function save(blob: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
