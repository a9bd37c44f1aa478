// The live log: filtered in the kernel, and drawn no faster than the browser can.

import * as React from 'react';

import { Link } from './link';
import { useTopic } from './panel';

const KEPT = 1000; // lines in the page
const SEARCH = 300; // ms without a key until a search begins
const MOST = 50; // nodes that have ended in the menu
const GONE = 3000; // ms after which a node that is in the log alone has ended: one that starts logs before it is listed
const FIRST = 1000; // ms in which the first lines come, if there are any
const HIDDEN = /(^|\.)_/;
const KERNEL = 'this kernel'; // the process of the nodes of cells
const LEVELS: [string, string][] = [
  ['DEBUG', 'All levels'],
  ['INFO', 'INFO and above'],
  ['WARN', 'WARN and above'],
  ['ERROR', 'ERROR and above']
];

/** A node whose lines may come. */
interface Source {
  name: string;
  state: string;
  key: string; // its file, or ''
  pid: number; // 0 where nobody knows
  at: string; // its process, in words
}

/** What the reader can choose: a name, or, of nodes of one name, one of them. */
interface Choice {
  label: string;
  names: string[]; // as in the log
  pid: number; // 0 for all processes
  ended: boolean;
}

interface Line {
  id: number;
  level: string;
  node: string;
  text: string;
  stamp: string; // s since 1970, with nine decimals; '' where nobody knows
  process: number; // the low 16 bits of its id; 0 where nobody knows
  times: number; // how often it came in a row; the stamp is that of the last time
}

interface Shown {
  lines: Line[];
  next: number;
  lost: number; // came too fast
  older: number; // from before the page listened, and left out
  hidden: number; // do not match what the reader has chosen
}

const EMPTY: Shown = { lines: [], next: 0, lost: 0, older: 0, hidden: 0 };

/** The log of `nodes`, or, while they are not known, of whoever has logged. */
export function Log({ link, nodes: known }: { link: Link | null; nodes: Source[] | null }): JSX.Element {
  const nodes = known ?? [];
  const [chosen, setChosen] = React.useState('');
  const [level, setLevel] = React.useState('DEBUG');
  const [search, setSearch] = React.useState('');
  const text = useSettled(search, SEARCH);
  const up = link?.state === 'up';
  const listened = useSettled(up, FIRST);
  const [{ lines, lost, older, hidden }, setShown] = React.useState<Shown>(EMPTY);
  const none = `${lines.length} ${hidden}`;
  const settled = useSettled(none, FIRST) === none;
  const [failed, setFailed] = React.useState('');
  const last = React.useRef<Choice | null>(null); // it stays when its node has ended
  const loggers = React.useRef(new Map<string, number>()); // the names in the log, with their processes
  lines.forEach(({ node, process }) => loggers.current.size < MOST && loggers.current.set(node, process));
  const absent = JSON.stringify(known && [...loggers.current].filter(each => !isThere(each, known)).map(([name]) => name));
  const settledAbsent = useSettled(absent, GONE);
  const choices = [...choicesOf(nodes), ...endedOf(absent, settledAbsent)];
  const choice = chosen ? (choices.find(each => each.label === chosen) ?? last.current) : null;
  last.current = choice;
  if (choice && !choices.some(each => each.label === chosen)) {
    choices.push({ ...choice, ended: known !== null });
  }
  useTopic(
    link,
    'log',
    { nodes: choice?.names ?? null, level, text, pid: choice?.pid ?? 0 },
    data => setShown(before => added(before, data)),
    () => {
      setShown(EMPTY);
      setFailed('');
    },
    setFailed
  );
  const box = React.useRef<HTMLDivElement>(null);
  const atEnd = React.useRef(true);
  const top = React.useRef(0); // px, at the last scroll
  React.useLayoutEffect(() => {
    if (box.current && atEnd.current) {
      box.current.scrollTop = box.current.scrollHeight;
    }
  }, [lines]);
  React.useEffect(() => {
    const sized = new ResizeObserver(([{ target }]) => {
      if (atEnd.current) {
        target.scrollTop = target.scrollHeight;
      }
    });
    sized.observe(box.current!);
    return () => sized.disconnect();
  }, []);
  React.useEffect(() => {
    if (!up) {
      loggers.current.clear();
      setShown(EMPTY); // the next lines are of another session
    }
  }, [up]);
  const double = nodes.filter(node => isDouble(node, nodes)).map(node => ({ ...node, name: logged(node.name) }));
  return (
    <section className="ros-Log" aria-label="Log">
      <div className="ros-Log-head">
        <h3>Log</h3>
        <select aria-label="Node of the log" value={chosen} onChange={event => setChosen(event.target.value)}>
          <option value="">All nodes</option>
          {choices.map(({ label, ended }) => (
            <option key={label} value={label}>
              {label}
              {ended && ' (ended)'}
            </option>
          ))}
        </select>
        <select aria-label="Level of the log" value={level} onChange={event => setLevel(event.target.value)}>
          {LEVELS.map(([value, label]) => (
            <option key={value} value={value}>
              {label}
            </option>
          ))}
        </select>
        <input
          type="search"
          aria-label="Search the log"
          placeholder="Search"
          value={search}
          onChange={event => setSearch(event.target.value)}
        />
      </div>
      <div className="ros-Log-lost">
        {failed}
        {older > 0 && 'Older lines are not shown here. In a cell, ros.logs() has the newest 5,000.'}
        {older > 0 && lost > 0 && ' '}
        {lost === 1 && 'One line is not shown: lines came faster than a page can show them.'}
        {lost > 1 && `${lost.toLocaleString('en')} lines are not shown: they came faster than a page can show them.`}
      </div>
      {lines.length === 0 && !failed && up && listened && (hidden > 0 || settled) && (
        <p className="ros-quiet">{nothing(hidden)}</p>
      )}
      <div
        className="ros-Log-lines"
        ref={box}
        tabIndex={0}
        role="log"
        aria-live="off"
        aria-label="Log lines"
        onScroll={event => {
          const { scrollTop, scrollHeight, clientHeight } = event.currentTarget;
          const end = scrollTop + clientHeight > scrollHeight - 20;
          // Also scrolled is a box that has become smaller, or whose first lines are gone: only a reader scrolls back.
          if (end || scrollTop < top.current) {
            atEnd.current = end;
          }
          top.current = scrollTop;
        }}
      >
        {lines.map(line => {
          const source = sourceOf(line, double);
          const named = choice === null || (choice.pid === 0 && source !== line.node);
          return <LogLine key={line.id} line={line} source={source} named={named} />;
        })}
      </div>
    </section>
  );
}

/** A line; the node is named unless the reader has chosen it. */
const LogLine = React.memo(({ line, source, named }: { line: Line; source: string; named: boolean }) => (
  <div className={`ros-Log-line ros-mod-${line.level}`} title={source}>
    {line.stamp && <Time stamp={line.stamp} />}
    <span className="ros-level">{line.level}</span>{' '}
    {named && (
      <>
        <span className="ros-source">{source}</span>{' '}
      </>
    )}
    {line.text}
    {line.times > 1 && (
      <>
        {' '}
        <span className="ros-times" title={`${line.times} times in a row, the last one at this time`}>
          × {line.times}
        </span>
      </>
    )}
  </div>
));

/** Return the name that a node has in the log. */
function logged(name: string): string {
  return name.replace(/^\//, '').replace(/\//g, '.');
}

/** Return true if another process has a node of this name. */
export function isDouble(node: Source, nodes: Source[]): boolean {
  return nodes.some(other => other.name === node.name && other.pid !== node.pid);
}

function choicesOf(nodes: Source[]): Choice[] {
  const found = new Map<string, Choice>();
  for (const node of nodes) {
    // A program's log lines have the name of its node, other output that of its file.
    const names = [logged(node.name), ...(node.key ? [node.key] : [])];
    const all = found.get(node.name);
    const ended = node.state !== 'running';
    const both = [...new Set([...(all?.names ?? []), ...names])];
    found.set(node.name, { label: node.name, names: both, pid: 0, ended: ended && (all?.ended ?? true) });
    if (node.at && isDouble(node, nodes)) {
      const label = `${node.name}, ${node.at}`;
      found.set(label, { label, names, pid: node.pid, ended });
    }
  }
  return [...found.values()];
}

/** Return true if a name in the log is that of a node, of its file or its logger, or if another node's program logs so. */
function isThere([name, process]: [string, number], nodes: Source[]): boolean {
  return nodes.some(
    node =>
      [logged(node.name), node.key].includes(name) ||
      name.startsWith(`${logged(node.name)}.`) ||
      (process > 0 && node.state === 'running' && node.at !== KERNEL && (node.pid & 0xffff) === process)
  );
}

/** Return what has lines in the log and is no node, now and for a while; hidden nodes are left out. */
function endedOf(absent: string, settled: string): Choice[] {
  const before: string[] = JSON.parse(settled) ?? [];
  const names: string[] = (JSON.parse(absent) ?? []).filter((name: string) => before.includes(name) && !HIDDEN.test(name));
  return names.map(name => {
    const label = name.endsWith('.py') ? name : `/${name.replace(/\./g, '/')}`;
    return { label, names: [name], pid: 0, ended: true };
  });
}

/** Return who has logged a line, with its process if its node is `double`: one of several with that name. */
function sourceOf(line: Line, double: Source[]): string {
  const alike = double.filter(node => node.name === line.node);
  if (line.process === 0 || alike.length === 0) {
    return line.node;
  }
  const found = alike.find(node => (node.pid & 0xffff) === line.process);
  return `${line.node} (${found?.at || 'another process'})`;
}

/** When a line was logged, by the reader's clock; the whole stamp, as ROS has it, is the title. */
function Time({ stamp }: { stamp: string }): JSX.Element {
  const at = new Date(1000 * Number(stamp));
  const day = `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())}`;
  const time = clock(Number(stamp));
  const decimals = stamp.slice(stamp.indexOf('.'));
  return (
    <>
      <time className="ros-time" dateTime={`${day}T${time}`} title={`${day} ${time}${decimals} (stamp ${stamp})`}>
        {time}
      </time>{' '}
    </>
  );
}

/** Return a time of day (s since 1970) by the reader's clock, in 24 hours. */
export function clock(seconds: number): string {
  const at = new Date(1000 * seconds);
  return [at.getHours(), at.getMinutes(), at.getSeconds()].map(two).join(':');
}

function two(value: number): string {
  return String(value).padStart(2, '0');
}

/** Return why no line is shown. */
function nothing(hidden: number): string {
  if (hidden < 2) {
    return hidden ? 'The log has one line, which does not match.' : 'No lines yet.';
  }
  return `None of the ${hidden.toLocaleString('en')} lines matches.`;
}

type Told = [level: string, node: string, text: string, stamp: string, process: number];

function added(before: Shown, data: { lines: Told[]; lost: number; older: number; hidden: number }): Shown {
  let next = before.next;
  const lines = [...before.lines];
  for (const [level, node, text, stamp, process] of data.lines) {
    const last = lines[lines.length - 1];
    if (last && last.level === level && last.node === node && last.text === text && last.process === process) {
      lines[lines.length - 1] = { ...last, stamp, times: last.times + 1 };
    } else {
      lines.push({ id: next++, level, node, text, stamp, process, times: 1 });
    }
  }
  const [lost, older] = [before.lost + data.lost, before.older + data.older];
  return { lines: lines.slice(-KEPT), next, lost, older, hidden: data.hidden };
}

/** Return a value once it is stable for a moment, so that not every key starts a new search. */
function useSettled<Value>(value: Value, wait: number): Value {
  const [settled, setSettled] = React.useState(value);
  React.useEffect(() => {
    const timer = window.setTimeout(() => setSettled(value), wait);
    return () => window.clearTimeout(timer);
  }, [value]);
  return settled;
}
