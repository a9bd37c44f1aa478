// The nodes panel: running and dead nodes, what each offers and uses, the log; restart and stop.

import { LabIcon } from '@jupyterlab/ui-components';
import { Message } from '@lumino/messaging';
import * as React from 'react';

import { Current } from './current';
import { Link } from './link';
import { clock, isDouble, Log } from './log';
import { breakable, FirstCell, Guard, instead, SidePanel, useCurrent, useTopic } from './panel';

export const nodesIcon = new LabIcon({
  name: 'ros2-course:nodes',
  svgstr:
    '<svg xmlns="http://www.w3.org/2000/svg" width="16" viewBox="0 0 24 24"><g class="jp-icon3" fill="#616161">' +
    '<path d="M4 4h16a1 1 0 0 1 1 1v5a1 1 0 0 1-1 1H4a1 1 0 0 1-1-1V5a1 1 0 0 1 1-1zm1 2v3h14V6z"/>' +
    '<path d="M4 13h16a1 1 0 0 1 1 1v5a1 1 0 0 1-1 1H4a1 1 0 0 1-1-1v-5a1 1 0 0 1 1-1zm1 2v3h14v-3z"/>' +
    '<circle cx="7.5" cy="7.5" r="1.2"/><circle cx="7.5" cy="16.5" r="1.2"/></g></svg>'
});

interface Node {
  name: string;
  key: string; // for restart and stop; '' if started outside the session
  process: [number, number] | null; // of a program that was started elsewhere and may be stopped
  state: 'running' | 'dead' | 'stopped';
  line: string;
  since: number | null; // s since 1970
  over: number | null; // s since 1970; null while it runs, or where nobody knows
  where: string;
  pid: number; // 0 where nobody knows
  at: string; // its process, in words
  stories: string[];
}

interface Details {
  [what: string]: any;
  parameters: [string, string][];
  silent: boolean;
}

const DOMAIN = 'Nodes and terminals meet only if they have the same number, their ROS domain.';
const MARK = { running: '●', dead: '✖', stopped: '○' };
const BUSY = '◐';
const KINDS = ['serves', 'calls', 'publishes', 'subscribes to', 'offers the actions', 'sends goals to'];

export class NodesPanel extends SidePanel {
  constructor(current: Current) {
    super(current, 'ros2-course-nodes', 'Nodes', nodesIcon);
  }

  /** Open a node in the panel when it is shown next, or now. */
  choose(name: string): void {
    this._wanted = name;
    this._chosen += 1;
    this.update();
  }

  protected draw(): JSX.Element {
    return <Nodes key={this._chosen} current={this.current} wanted={this._wanted} />;
  }

  protected onBeforeHide(message: Message): void {
    this._wanted = '';
    super.onBeforeHide(message);
  }

  private _chosen = 0;
  private _wanted = '';
}

function Nodes({ current, wanted }: { current: Current; wanted: string }): JSX.Element {
  const { link } = useCurrent(current);
  const [nodes, setNodes] = React.useState<Node[] | null>(null);
  const [domain, setDomain] = React.useState<number | null>(null);
  const [failed, setFailed] = React.useState('');
  const order = React.useRef(new Map<string, number>());
  useTopic(
    link,
    'nodes',
    {},
    data => {
      setNodes(inOrder(data.nodes, order.current));
      setDomain(data.domain);
    },
    () => {
      setNodes(null);
      setFailed('');
      order.current.clear();
    },
    setFailed
  );
  const memory = React.useRef<Memory>({ asked: '', open: new Set() });
  const message = instead(current, link);
  const shown = message === null && nodes ? nodes : [];
  return (
    <>
      <header className="ros-Panel-head">
        <h2>Nodes</h2>
        {message === null && domain !== null && <span className="ros-quiet" title={DOMAIN}>
            ROS domain {domain}
          </span>}
      </header>
      <div className="ros-Panel-message" role="status">
        {failed || message || (nodes && domain === null ? 'The session has ended: run the cell with ros = course.live() again.' : '')}
        {!failed && message === null && domain !== null && nodes?.length === 0 ? 'No node runs.' : ''}
      </div>
      <FirstCell current={current} link={link} />
      <ul className="ros-Nodes" aria-label="Nodes">
        {shown.map((node, number) => {
          const id = `${node.name} ${node.key} ${shown.slice(0, number).filter(same(node)).length}`;
          const chosen = node.name === wanted && node.state === 'running';
          const at = isDouble(node, shown) ? node.at : '';
          return (
            <Guard key={id} what={String(node.name)}>
              <NodeItem id={id} node={node} at={at} link={link!} wanted={chosen} memory={memory.current} />
            </Guard>
          );
        })}
      </ul>
      <Guard what="The log">
        <Log link={link} nodes={message === null ? nodes : null} />
      </Guard>
    </>
  );
}

/** Return the nodes with new ones behind those that were shown before, so that no row moves under a finger. */
function inOrder(nodes: Node[], order: Map<string, number>): Node[] {
  const id = (node: Node) => node.key || `${node.name} ${node.pid}`;
  nodes.filter(node => !order.has(id(node))).forEach(node => order.set(id(node), order.size));
  return [...nodes].sort((one, other) => order.get(id(one))! - order.get(id(other))!);
}

/** Return a test for nodes of the same name that were started in the same way. */
function same(node: Node): (other: Node) => boolean {
  return other => other.name === node.name && other.key === node.key;
}

/** What outlasts the item of a node: one that is restarted has none for a moment, and one that starts gets another. */
interface Memory {
  asked: string; // the item whose button was pressed last
  open: Set<string>; // names of nodes
}

interface Item {
  id: string;
  node: Node;
  at: string; // its process, if others have a node of this name
  link: Link;
  wanted: boolean;
  memory: Memory;
}

function NodeItem({ id: key, node, at, link, wanted, memory }: Item): JSX.Element {
  const [open, setOpen] = React.useState(wanted || memory.open.has(node.name));
  const button = React.useRef<HTMLButtonElement>(null);
  React.useLayoutEffect(() => {
    const [row, panel] = [item.current!, item.current!.closest<HTMLElement>('.ros-Panel')];
    if (wanted || (memory.asked === key && document.activeElement === panel)) {
      button.current?.focus();
    }
    return () => {
      if (row.contains(document.activeElement)) {
        panel?.focus(); // the row goes, and would leave the focus nowhere
      }
    };
  }, []);
  const toggle = () => {
    open ? memory.open.delete(node.name) : memory.open.add(node.name);
    setOpen(!open);
  };
  const [doing, setDoing] = React.useState('');
  const [failed, setFailed] = React.useState('');
  const id = React.useId();
  const item = React.useRef<HTMLLIElement>(null);
  /** Bring what has been opened into sight, and its node at least. */
  const reveal = () => {
    const list = item.current?.parentElement;
    if (!item.current || !list) return; // a node that is open from the start: React has not drawn it yet
    const [{ top, bottom }, seen] = [item.current.getBoundingClientRect(), list.getBoundingClientRect()];
    list.scrollTop += Math.max(0, Math.min(bottom - seen.bottom, top - seen.top));
  };
  const ask = async (method: string, what: string, params: object = { name: node.key }) => {
    if (doing) {
      return;
    }
    memory.asked = key;
    setDoing(what);
    setFailed('');
    try {
      await link.request(method, params);
    } catch (error) {
      setFailed((error as Error).message);
    }
    setDoing('');
  };
  const trouble = node.stories.length > 0;
  const settled = node.state + (node.state === 'running' && trouble ? ', with an error' : '');
  const state = doing || settled;
  // What is only being done has no text, for which the row might need another line, and move those below it.
  const text = [at, settled !== 'running' ? settled : ''].filter(Boolean).join(', ');
  const mark = doing ? BUSY : node.state === 'running' && trouble ? '▲' : MARK[node.state];
  return (
    <li ref={item} className={`ros-Node ros-mod-${node.state}${trouble ? ' ros-mod-trouble' : ''}`}>
      <div className="ros-Node-row">
        <button
          ref={button}
          className="ros-Node-name"
          aria-label={`${node.name} ${state}${at ? `, ${at}` : ''}`}
          aria-expanded={open}
          aria-controls={id}
          onClick={toggle}
        >
          <span className="ros-mark" aria-hidden="true">
            {mark}
          </span>
          <span className="ros-name">{breakable(node.name)}</span>
        </button>
        {text && (
          <span className="ros-state" aria-hidden="true">
            {text}
          </span>
        )}
        {node.key && (
          <span className="ros-buttons">
            <button
              aria-disabled={doing !== ''}
              onClick={() => void ask('nodes.restart', 'starting')}
              aria-label={`${node.state === 'running' ? 'Restart' : 'Start'} ${node.key}`}
            >
              {node.state === 'running' ? 'Restart' : 'Start'}
            </button>
            <button
              aria-disabled={doing !== '' || node.state !== 'running'}
              onClick={() => node.state === 'running' && void ask('nodes.stop', 'stopping')}
              aria-label={`Stop ${node.key}`}
            >
              Stop
            </button>
          </span>
        )}
        {node.process && (
          <span className="ros-buttons">
            <button
              aria-disabled={doing !== ''}
              onClick={() => void ask('nodes.end', 'stopping', { process: node.process![0], born: node.process![1] })}
              aria-label={`Stop ${node.name}, process ${node.process[0]}`}
              title="Ends the program that has this node, as Ctrl-C in its terminal does"
            >
              Stop
            </button>
          </span>
        )}
      </div>
      <div role="status">{failed && <pre className="ros-story">{failed}</pre>}</div>
      <div id={id} hidden={!open}>
        {open && <NodeDetails node={node} link={link} reveal={reveal} />}
      </div>
    </li>
  );
}

function NodeDetails({ node, link, reveal }: { node: Node; link: Link; reveal: () => void }): JSX.Element {
  const [details, setDetails] = React.useState<Details | null>(null);
  const [failed, setFailed] = React.useState('');
  const running = node.state === 'running';
  useTopic(running ? link : null, 'nodes.node', { name: node.name }, setDetails, () => setDetails(null), setFailed);
  React.useLayoutEffect(reveal, [details !== null]);
  const kinds = details ? KINDS.filter(kind => details[kind].length > 0) : [];
  return (
    <div className="ros-Node-details">
      <p>
        {node.where}
        {node.since !== null &&
          (node.over === null ? `, since ${clock(node.since)}` : `, from ${clock(node.since)} to ${clock(node.over)}`)}
      </p>
      {node.stories.slice(-1).map(story => (
        <pre className="ros-story" key={story}>
          {story}
        </pre>
      ))}
      {failed && <p>{failed}</p>}
      {details && (
        <dl>
          <dt>parameters</dt>
          {details.silent ? (
            <dd>The node does not answer: it is busy, blocked, or offers no parameters.</dd>
          ) : (
            details.parameters.map(([name, value]) => (
              <dd key={name}>
                <code>
                  {breakable(name)} = {value}
                </code>
              </dd>
            ))
          )}
          {kinds.map(kind => (
            <React.Fragment key={kind}>
              <dt>{kind}</dt>
              {details[kind].map(([name, type]: [string, string]) => (
                <dd key={name}>
                  <code>{name}</code> <span className="ros-quiet">{type}</span>
                </dd>
              ))}
            </React.Fragment>
          ))}
        </dl>
      )}
    </div>
  );
}
