// The graph: nodes, topics, services and actions as a picture and as a list, and the flow of one call or goal.

import { graphlib, layout } from '@dagrejs/dagre';
import { LabIcon } from '@jupyterlab/ui-components';
import { Message } from '@lumino/messaging';
import * as React from 'react';

import { Current } from './current';
import { ExchangeView } from './exchange';
import { linesBeside } from './graph_column';
import { Link } from './link';
import { FirstCell, instead, SidePanel, useCurrent, useTopic } from './panel';

export const graphIcon = new LabIcon({
  name: 'ros2-course:graph',
  svgstr:
    '<svg xmlns="http://www.w3.org/2000/svg" width="16" viewBox="0 0 24 24"><g class="jp-icon3" fill="#616161">' +
    '<path d="M2 9h7v6H2zm13-6h7v6h-7zm0 12h7v6h-7z"/><path d="M9 11h3V5h3v2h-1v10h1v2h-3v-6H9z"/></g></svg>'
});

export type Kind = 'topic' | 'service' | 'action';
/** Open a node in the nodes panel, or anything else in the inspector. */
export type Open = (kind: Kind | 'node', name: string, type: string) => void;
type Role = 'publishes' | 'subscribes to' | 'calls' | 'serves' | 'sends goals to' | 'offers the actions';

interface Graph {
  nodes: string[] | null; // null: the session has ended
  things: [Kind, string, string][];
  edges: [string, Role, Kind, string][];
  left_out?: number; // if there are too many nodes, topics, services and actions
  twins?: { [name: string]: number }; // of nodes that have a name together
}

// In these roles, messages go from the node to the topic, service or action.
const OUT = new Set<Role>(['publishes', 'calls', 'sends goals to']);
const CHARACTER = 7.3; // px at most
const NARROW = 520; // px
const LONGEST = 26; // characters of a name in the picture
const SMALLEST = 0.75; // of its full size, in which a picture can be read

/** The id of the graph as a tab in JupyterLab's layout. */
const GRAPH_VIEW = 'ros2-course-graph-tab';

export class GraphPanel extends SidePanel {
  /** A panel at the side, where a button opens a tab by `asTab`, or such a tab. */
  constructor(
    current: Current,
    private _open: Open,
    private _asTab?: () => void
  ) {
    super(current, _asTab ? 'ros2-course-graph' : GRAPH_VIEW, 'Graph', graphIcon);
    this.title.closable = !_asTab;
  }

  protected draw(): JSX.Element {
    return <GraphView current={this.current} open={this._open} asTab={this._asTab} />;
  }

  protected onCloseRequest(message: Message): void {
    super.onCloseRequest(message);
    this.dispose();
  }
}

function GraphView({ current, open, asTab }: { current: Current; open: Open; asTab?: () => void }): JSX.Element {
  const { link } = useCurrent(current);
  const [graph, setGraph] = React.useState<Graph | null>(null);
  const [everything, setEverything] = React.useState(false);
  const [failed, setFailed] = React.useState('');
  const [selected, setSelected] = React.useState('');
  useTopic(
    link,
    'graph',
    { everything },
    setGraph,
    () => {
      setGraph(null);
      setFailed('');
    },
    setFailed
  );
  const message = instead(current, link);
  const nodes = (message === null && graph?.nodes) || [];
  const empty = graph?.nodes === null ? 'The session has ended: run the cell with ros = course.live() again.' : 'No node runs.';
  const choose = (id: string) => setSelected(id === selected ? '' : id);
  return (
    <div className="ros-Graph">
      <header className="ros-Panel-head">
        <h2 className={asTab ? '' : 'ros-hidden'}>Graph</h2>
        {asTab && <button onClick={asTab}>Open as a tab</button>}
      </header>
      <label className="ros-Graph-everything">
        <input type="checkbox" checked={everything} onChange={event => setEverything(event.target.checked)} />
        Show built-in topics and services
      </label>
      <div className="ros-Panel-message" role="status">
        {failed || message || (graph && nodes.length === 0 ? empty : '')}
      </div>
      <FirstCell current={current} link={link} />
      {nodes.length > 0 && (
        <>
          {graph!.left_out && (
            <p className="ros-quiet">
              {graph!.left_out} more nodes, topics, services and actions are not shown. In a cell, !ros2 node list and
              !ros2 topic list name them all.
            </p>
          )}
          <Picture graph={graph!} selected={selected} open={open} />
          <List graph={graph!} selected={selected} choose={choose} />
        </>
      )}
      {message === null && <Flows link={link!} />}
    </div>
  );
}

interface Chosen {
  graph: Graph;
  selected: string;
  choose: (id: string) => void;
}

interface Box {
  id: string;
  kind: Kind | 'node';
  name: string;
  text: string;
  x: number;
  y: number;
  width: number;
}

interface Drawn {
  boxes: Box[];
  edges: { id: string; from: string; to: string; path: string }[];
  width: number;
  height: number;
}

const HEIGHT = 26; // px of a box

function short(name: string): string {
  return name.length > LONGEST ? `…${name.slice(1 - LONGEST)}` : name;
}

function drawn(graph: Graph, down: boolean): Drawn {
  const laid = new graphlib.Graph();
  laid.setGraph({ rankdir: down ? 'TB' : 'LR', nodesep: 14, ranksep: 34, marginx: 6, marginy: 6 });
  laid.setDefaultEdgeLabel(() => ({}));
  const kinds = new Map<string, [Kind | 'node', string, string]>();
  graph.nodes!.forEach(name => {
    const twins = graph.twins?.[name];
    kinds.set(`node ${name}`, ['node', name, `${short(name)}${twins ? ` (${twins})` : ''}`]);
  });
  graph.things.forEach(([kind, name]) => kinds.set(`${kind} ${name}`, [kind, name, short(name)]));
  kinds.forEach(([, , text], id) => laid.setNode(id, { width: CHARACTER * text.length + 26, height: HEIGHT }));
  for (const [node, role, kind, name] of graph.edges) {
    const ends = [`node ${node}`, `${kind} ${name}`];
    const [from, to] = OUT.has(role) ? ends : ends.reverse();
    laid.setEdge(from, to, {});
  }
  layout(laid);
  const boxes = [...kinds].map(([id, [kind, name, text]]) => {
    const { x, y, width } = laid.node(id) as unknown as Box;
    return { id, kind, name, text, x, y, width };
  });
  const edges = laid.edges().map(({ v, w }) => {
    const points = (laid.edge(v, w) as unknown as { points: { x: number; y: number }[] }).points;
    const path = points.map(({ x, y }, index) => `${index ? 'L' : 'M'}${x.toFixed(1)} ${y.toFixed(1)}`).join(' ');
    return { id: `${v}→${w}`, from: v, to: w, path };
  });
  const { width, height } = laid.graph() as { width: number; height: number };
  return { boxes, edges, width: Math.max(width, 60), height: Math.max(height, 40) };
}

const WAYS: { [key: string]: [number, number] } = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1]
};

/** Return the nearest box in the direction of an arrow key; boxes to the side count as farther. */
function next(boxes: Box[], from: Box, [right, down]: [number, number]): Box | undefined {
  const distance = (box: Box) => {
    const [x, y] = [box.x - from.x, box.y - from.y];
    const ahead = x * right + y * down;
    return ahead > 1 ? ahead + 2 * Math.abs(x * down) + 2 * Math.abs(y * right) : Infinity;
  };
  const nearest = boxes.reduce((one, other) => (distance(other) < distance(one) ? other : one), from);
  return distance(nearest) < Infinity ? nearest : undefined;
}

/** Return the text of a box for screen readers: its kind and name, and the roles of nodes. */
function said(box: Box, graph: Graph): string {
  const about = graph.edges
    .filter(([node, , kind, name]) => (box.kind === 'node' ? node === box.name : kind === box.kind && name === box.name))
    .map(([node, role, , name]) => (box.kind === 'node' ? `${role} ${name}` : `${node} ${role} it`));
  const twins = box.kind === 'node' && graph.twins?.[box.name];
  return `${box.kind} ${box.name}${twins ? `, ${twins} of this name` : ''}${about.length ? `: ${about.join(', ')}` : ''}`;
}

/** Return the picture as a column of boxes, in the order of another one from top to bottom; the lines run beside it. */
function column(graph: Graph): Drawn {
  const { boxes, edges } = drawn(graph, true);
  const sorted = [...boxes].sort((one, other) => one.y - other.y || one.x - other.x);
  const placed = sorted.map((box, index) => ({ ...box, x: 6 + box.width / 2, y: 6 + HEIGHT / 2 + index * (HEIGHT + 12) }));
  const { paths, reach } = linesBeside(edges, placed);
  const width = Math.max(reach, ...placed.map(box => 6 + box.width)) + 6;
  return {
    boxes: placed,
    edges: edges.map((edge, index) => ({ ...edge, path: paths[index] })),
    width,
    height: 12 + placed.length * (HEIGHT + 12) - 12
  };
}

/** Return a picture that can be read in a frame of this width (px): the usual one, a turned one, or else a column. */
function fitting(graph: Graph, frame: number): Drawn {
  const down = frame < NARROW;
  const wanted = drawn(graph, down);
  const readable = (each: Drawn) => each.width * SMALLEST <= Math.max(frame, 1);
  if (readable(wanted) || !frame) {
    return wanted;
  }
  const other = drawn(graph, !down);
  return readable(other) ? other : down ? column(graph) : other.width < wanted.width ? other : wanted;
}

function Picture({ graph, selected, open }: { graph: Graph; selected: string; open: Open }): JSX.Element {
  const frame = React.useRef<HTMLDivElement>(null);
  const [room, setRoom] = React.useState(0); // px of width
  const [fit, setFit] = React.useState(true);
  const [at, setAt] = React.useState(''); // the box that the Tab key focuses
  const [focused, setFocused] = React.useState('');
  React.useEffect(() => {
    const observer = new ResizeObserver(() => setRoom(frame.current?.clientWidth ?? 0));
    observer.observe(frame.current!);
    return () => observer.disconnect();
  }, []);
  const { boxes, edges, width, height } = React.useMemo(() => fitting(graph, room), [graph, room]);
  const [arrow, keys] = [React.useId().replace(/:/g, '-'), React.useId()];
  const current = boxes.find(box => box.id === at) ?? boxes[0];
  const lit = focused || selected;
  const near = new Set(edges.flatMap(({ from, to }) => (from === lit || to === lit ? [from, to] : [])));
  const apart = boxes.some(box => box.id === lit);
  const faint = (on: boolean) => (apart && !on ? ' ros-mod-faint' : '');
  const show = (box: Box) =>
    open(box.kind, box.name, graph.things.find(([kind, name]) => kind === box.kind && name === box.name)?.[2] ?? '');
  const press = (event: React.KeyboardEvent, box: Box) => {
    const to =
      event.key in WAYS
        ? next(boxes, box, WAYS[event.key])
        : ({ Home: boxes[0], End: boxes[boxes.length - 1] } as { [key: string]: Box })[event.key];
    if (event.key === 'Enter' || event.key === ' ') {
      show(box);
    } else if (to) {
      setAt(to.id);
      const node = frame.current!.querySelector<SVGGElement>(`[data-box="${CSS.escape(to.id)}"]`);
      node?.focus();
      node?.scrollIntoView({ block: 'nearest', inline: 'nearest' });
    } else if (!(event.key in WAYS)) {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <>
      <p className="ros-quiet" id={keys}>
        Click on a box, or go there with the arrow keys and press Enter, to open it.
      </p>
      <div className="ros-Graph-frame" ref={frame} tabIndex={-1}>
        <svg
          viewBox={`0 0 ${width} ${height}`}
          style={fit ? { maxWidth: width } : { minWidth: width, maxWidth: width }}
          role="group"
          aria-label={`Nodes: ${graph.nodes!.length}. Topics, services and actions: ${graph.things.length}. The list below says the same.`}
          aria-describedby={keys}
          data-lm-suppress-shortcuts="true"
        >
          <defs>
            <marker id={arrow} viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">
              <path className="ros-Graph-tip" d="M0 0L8 4L0 8z" />
            </marker>
          </defs>
          {edges.map(edge => (
            <path
              key={edge.id}
              className={`ros-Graph-edge${faint(edge.from === lit || edge.to === lit)}`}
              d={edge.path}
              markerEnd={`url(#${arrow})`}
            />
          ))}
          {boxes.map(box => (
            <g
              key={box.id}
              data-box={box.id}
              className={`ros-Graph-box ros-mod-${box.kind}${faint(box.id === lit || near.has(box.id))}`}
              style={{ transform: `translate(${box.x}px, ${box.y}px)` }}
              role="button"
              tabIndex={box.id === current.id ? 0 : -1}
              aria-label={said(box, graph)}
              onClick={() => show(box)}
              onFocus={() => {
                setAt(box.id);
                setFocused(box.id);
              }}
              onBlur={() => setFocused('')}
              onKeyDown={event => press(event, box)}
            >
              <title>{`${box.kind} ${box.name}`}</title>
              <Shape kind={box.kind} width={box.width} />
              <text textAnchor="middle" y={4}>
                {box.text}
              </text>
            </g>
          ))}
        </svg>
      </div>
      <div className="ros-Graph-key">
        {(['node', 'topic', 'service', 'action'] as const).map(kind => (
          <span key={kind}>
            <svg width="30" height="18" viewBox="-19 -15 38 30" aria-hidden="true">
              <g className={`ros-Graph-box ros-mod-${kind}`}>
                <Shape kind={kind} width={34} />
              </g>
            </svg>{' '}
            {kind}
          </span>
        ))}
        <button onClick={() => setFit(!fit)}>{fit ? 'Full size' : 'Fit to the width'}</button>
      </div>
    </>
  );
}

/** The shape of a box: kinds differ by shape, not only by colour. */
function Shape({ kind, width }: { kind: Box['kind']; width: number }): JSX.Element {
  const [x, y] = [width / 2, HEIGHT / 2];
  if (kind === 'node') {
    return <rect x={-x} y={-y} width={width} height={HEIGHT} rx={y} />;
  }
  if (kind === 'topic') {
    return <rect x={-x} y={-y} width={width} height={HEIGHT} />;
  }
  const cut = kind === 'service' ? 8 : -8;
  return kind === 'service' ? (
    <path d={`M${-x + cut} ${-y}H${x - cut}L${x} 0L${x - cut} ${y}H${-x + cut}L${-x} 0Z`} />
  ) : (
    <path d={`M${-x} ${-y}H${x + cut}L${x} 0L${x + cut} ${y}H${-x}L${-x - cut} 0Z`} />
  );
}

/** The content of the picture as a list, node by node. */
function List({ graph, selected, choose }: Chosen): JSX.Element {
  const roles = new Map<string, Map<Role, string[]>>();
  for (const [node, role, , name] of graph.edges) {
    const of = roles.get(node) ?? new Map<Role, string[]>();
    roles.set(node, of.set(role, [...(of.get(role) ?? []), name]));
  }
  return (
    <ul className="ros-Graph-list" aria-label="The graph as a list">
      {graph.nodes!.map(node => (
        <li key={node}>
          <button
            className="ros-Node-name"
            aria-pressed={selected === `node ${node}`}
            onClick={() => choose(`node ${node}`)}
          >
            <span className="ros-name">{node}</span>
          </button>
          {graph.twins?.[node] && (
            <div>{graph.twins[node]} nodes have this name. Nodes shows where each runs: stop one, or give it another name.</div>
          )}
          {[...(roles.get(node) ?? [])].map(([role, names]) => (
            <div key={role}>
              {role} <code>{names.join(', ')}</code>
            </div>
          ))}
          {!roles.has(node) && <div className="ros-quiet">offers and uses nothing of its own</div>}
        </li>
      ))}
    </ul>
  );
}

const LISTED = 5; // calls and goals that are visible at a time

interface Summary {
  number: string; // the kernel's process id, a point, and a count
  kind: string;
  name: string;
  by: string;
  state: string;
  end: string; // how a goal has ended that has not succeeded, or ''
}

/** The flow diagram of one of the last calls and goals. */
function Flows({ link }: { link: Link }): JSX.Element {
  const [known, setAll] = React.useState<Summary[] | null>(null);
  const [number, setNumber] = React.useState<string | null>(null);
  const [failed, setFailed] = React.useState('');
  useTopic(link, 'inspector.exchanges', {}, setAll, () => setAll(null), setFailed);
  const all = known ?? [];
  const one = all.find(each => each.number === number) ?? all[0];
  return (
    <section className="ros-Flows" aria-label="Calls and goals">
      <h3>Calls and goals</h3>
      <Unseen link={link} />
      {failed && <p>{failed}</p>}
      {known && !one && <p className="ros-quiet">No calls and no goals yet. Send one with the Inspector, in a cell or in a terminal.</p>}
      {one && (
        <>
          <select
            aria-label="Which call or goal"
            size={Math.min(LISTED, Math.max(2, all.length))}
            value={one.number}
            onChange={event => setNumber(event.target.value)}
          >
            {all.map(each => (
              <option key={each.number} value={each.number}>
                {`${each.number.split('.')[1]}: ${each.kind} ${each.name} from ${each.by}${each.state !== 'over' ? `, ${each.state}` : each.end && `, ${each.end}`}`}
              </option>
            ))}
          </select>
          {all.length < Math.max(...all.map(each => Number(each.number.split('.')[1]))) && (
            <p className="ros-quiet">
              Only the last ones of each name and sender are listed: older calls and goals are left out.
            </p>
          )}
          <ExchangeView key={one.number} link={link} number={one.number} onlooker={true} />
        </>
      )}
    </section>
  );
}

interface Silent {
  service: string;
  server: string;
  restart: boolean; // true if it can be restarted in this notebook
}

const FEW = 3; // services that are named

/** Services whose calls by other programs are not recorded, and the way to change that. */
function Unseen({ link }: { link: Link }): JSX.Element {
  const [all, setAll] = React.useState<Silent[]>([]);
  const [doing, setDoing] = React.useState('');
  const [failed, setFailed] = React.useState('');
  useTopic(link, 'inspector.unseen', {}, setAll, () => setAll([]), setFailed);
  const restart = async (service: string) => {
    setDoing(service);
    setFailed('');
    try {
      await link.request('inspector.restart_server', { service });
    } catch (error) {
      setFailed((error as Error).message);
    }
    setDoing('');
  };
  return (
    <>
      {all.slice(0, FEW).map(each => (
        <p className="ros-quiet ros-Flows-unseen" key={each.service}>
          Calls of <code>{each.service}</code> by other programs are not recorded, because this notebook has not started
          its server (<span className="ros-name">{each.server}</span>).{' '}
          {each.restart && (
            <button
              disabled={doing !== ''}
              aria-label={`Restart the server of ${each.service} in this notebook`}
              onClick={() => void restart(each.service)}
            >
              {doing === each.service ? 'Restarting' : 'Restart it in this notebook'}
            </button>
          )}
        </p>
      ))}
      {all.length > FEW && <p className="ros-quiet">The same holds for {all.length - FEW} more services.</p>}
      <div role="status">{failed && <pre className="ros-story">{failed}</pre>}</div>
    </>
  );
}
