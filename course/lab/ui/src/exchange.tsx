// The timeline of one call, goal, message or change of a parameter: the chapter’s flow diagram, and the same as a list.

import * as React from 'react';

import { Link } from './link';
import { useInSight, useTopic } from './panel';

export interface Exchange {
  number: string; // the kernel's process id, a point, and a count
  kind: 'service' | 'action' | 'topic' | 'parameter';
  name: string;
  type: string;
  by: string; // the sender
  about: string; // a remark on what the diagram does not show
  line: string; // the command that does the same, if known
  state: 'running' | 'over' | 'failed';
  events: [number, string, string][]; // ms since the first, the event, and the message as YAML
  first: number; // events before the omitted ones
  left_out: number;
  failed: string;
  note: string;
  cancellable: boolean;
}

const OUT = new Set(['request', 'goal', 'cancel', 'message', 'last message']); // from the client
const GOOD = new Set(['response', 'accepted', 'succeeded', 'received', 'cancel accepted']);
const BAD = new Set(['rejected', 'aborted', 'cancel refused', 'unknown']);
const ENDS: { [kind in Exchange['kind']]: [string, string] } = {
  service: ['client', 'server'],
  action: ['client', 'action server'],
  topic: ['publisher', 'subscriptions'],
  parameter: ['client', 'node']
};
const SHOWN = 24; // arrows at most
const FEW = 8; // messages, fewer of which are listed at once
const RESULTS = new Set(['succeeded', 'canceled', 'aborted', 'rejected']); // the events that end a goal or a change

interface View {
  link: Link;
  number: string;
  onlooker?: boolean; // true if a repeated publication ends although this shows it
  sent?: boolean; // true if the reader has just sent it, and is to see that it failed
  remark?: (exchange: Exchange) => React.ReactNode; // drawn below the buttons
}

export function ExchangeView({ link, number, onlooker = false, sent = false, remark }: View): JSX.Element {
  const [exchange, setExchange] = React.useState<Exchange | null>(null);
  const [failed, setFailed] = React.useState('');
  const [listed, setListed] = React.useState<boolean | null>(null); // the messages; null before there are any
  useTopic(
    link,
    'inspector.exchange',
    { number, onlooker },
    (found: Exchange) => {
      setExchange(found);
      // It stays as the reader has it when more come, and for the next exchange.
      setListed(before => before ?? (found.events.length ? found.events.length < FEW : null));
    },
    () => {
      setExchange(null);
      setFailed('');
    },
    setFailed
  );
  const timeline = React.useRef<HTMLElement>(null);
  const cancel = async () => {
    timeline.current?.focus(); // the button will be gone: Tab goes on from here, and Esc leads to the notebook
    try {
      await link.request('inspector.cancel', { number });
    } catch (error) {
      setFailed((error as Error).message);
    }
  };
  const why = failed || exchange?.failed;
  const events = exchange?.events ?? [];
  // The list of a call is short: there the response is read, unless the reader has folded it.
  const tells = (event: string) => RESULTS.has(event) || (event === 'response' && listed === false);
  const result = [...events].reverse().find(([, event, text]) => tells(event) && text);
  const answer = useInSight<HTMLDivElement>(sent && (why || (result?.[1] === 'rejected' && result[2])));
  return (
    <section ref={timeline} className="ros-Exchange" aria-label="Timeline" tabIndex={-1}>
      <div className="ros-Panel-head">
        <h3>Timeline{exchange ? `: ${exchange.name}` : ''}</h3>
        {exchange?.cancellable && (
          <button onClick={() => void cancel()}>{exchange.kind === 'topic' ? 'Stop' : 'Cancel the goal'}</button>
        )}
      </div>
      {exchange && remark?.(exchange)}
      {exchange && <p className="ros-quiet">{`Sent by ${exchange.by}. ${exchange.about}`}</p>}
      <div ref={answer}>
        <div role="status">
          {exchange?.state === 'running' && waits(exchange) && <p>Waiting for {awaited(exchange)} …</p>}
          {exchange?.note && <p className="ros-lines">{exchange.note}</p>}
          {why && <pre className="ros-story">{why}</pre>}
          {exchange?.state === 'over' && <p className="ros-hidden">{events[events.length - 1]?.[1]}</p>}
        </div>
        {result && (
          <div className="ros-Result" role="group" aria-label="Result">
            {result[1] === 'response' ? 'Response' : `Result, ${result[1]}`}:<pre tabIndex={0}>{result[2]}</pre>
          </div>
        )}
      </div>
      {exchange && events.length > 0 && <Flow exchange={exchange} />}
      {exchange && events.length > 0 && (
        <details open={listed ?? false} onToggle={event => setListed(event.currentTarget.open)}>
          <summary>The messages</summary>
          <ol className="ros-Events">
            {events.map(([time, event, text], index) => (
              <React.Fragment key={index}>
                {exchange.left_out > 0 && index === exchange.first && (
                  <li className="ros-quiet">{exchange.left_out} events are not shown</li>
                )}
                <li>
                  <span className="ros-quiet">{milliseconds(time)}</span> <strong>{event}</strong>
                  {text && <pre tabIndex={0}>{text}</pre>}
                </li>
              </React.Fragment>
            ))}
          </ol>
        </details>
      )}
    </section>
  );
}

/** Return true if it waits for the other side: not a publisher that repeats, nor a client that does not take the response. */
function waits(exchange: Exchange): boolean {
  return !(exchange.kind === 'topic' && exchange.cancellable) && !(exchange.kind === 'service' && exchange.note);
}

/** Return what the exchange waits for: the other side, the answer to what was sent, or an accepted goal's end. */
function awaited(exchange: Exchange): string {
  const events = exchange.events.map(([, event]) => event);
  if (exchange.kind === 'action' && events.includes('accepted')) {
    return 'the end of the goal';
  }
  const sent = events.includes('request') || events.includes('goal');
  return `${sent ? 'the answer of ' : ''}the ${ENDS[exchange.kind][1]}`;
}

function milliseconds(time: number): string {
  return `${time < 100 ? time.toFixed(1) : time.toFixed(0)} ms`;
}

/** Return the arrows to draw: all, or those of the beginning and the end, and the number left out between. */
function arrows(exchange: Exchange): { shown: Exchange['events']; gap: number; left: number } {
  const { events } = exchange;
  if (events.length <= SHOWN && exchange.left_out === 0) {
    return { shown: events, gap: -1, left: 0 };
  }
  const head = events.slice(0, SHOWN / 2);
  const tail = events.slice(-SHOWN / 2);
  return { shown: [...head, ...tail], gap: head.length, left: events.length - SHOWN + exchange.left_out };
}

const ROW = 28; // px
const TOP = 40;
const WIDTH = 320;
const LEFT = 86;
const RIGHT = 270;

function Flow({ exchange }: { exchange: Exchange }): JSX.Element {
  const { shown, gap, left } = arrows(exchange);
  const rows = shown.length + (gap >= 0 ? 1 : 0);
  const height = TOP + (rows + 0.5) * ROW;
  const y = (index: number) => TOP + (index + (gap >= 0 && index >= gap ? 1 : 0) + 0.6) * ROW;
  const [client, server] = ENDS[exchange.kind];
  const title = `${client} and ${server} of ${exchange.name}: ${shown.map(([, event]) => event).join(', ')}`;
  return (
    <svg className="ros-Flow" viewBox={`0 0 ${WIDTH} ${height}`} role="img" aria-label={title}>
      {[
        [LEFT, client],
        [RIGHT, server]
      ].map(([x, name]) => (
        <g key={name}>
          <rect className="ros-Flow-end" x={(x as number) - 44} y={4} width={88} height={24} rx={4} />
          <text x={x} y={20} textAnchor="middle">
            {name}
          </text>
          <line className="ros-Flow-life" x1={x} x2={x} y1={28} y2={height - 4} />
        </g>
      ))}
      {shown.map(([time, event], index) => {
        const out = OUT.has(event);
        const [from, to] = out ? [LEFT, RIGHT] : [RIGHT, LEFT];
        const tip = out ? to - 7 : to + 7;
        const kind = GOOD.has(event) ? 'good' : BAD.has(event) ? 'bad' : event.startsWith('cancel') ? 'warn' : 'plain';
        return (
          <g key={index} className={`ros-Flow-arrow ros-mod-${kind}`}>
            <text className="ros-Flow-time" x={LEFT - 8} y={y(index) + 4} textAnchor="end">
              {milliseconds(time)}
            </text>
            <text x={(LEFT + RIGHT) / 2} y={y(index) - 4} textAnchor="middle">
              {event}
            </text>
            <line x1={from} x2={tip} y1={y(index)} y2={y(index)} strokeDasharray={event === 'feedback' ? '5 4' : ''} />
            <path d={`M${to} ${y(index)} L${tip} ${y(index) - 4} L${tip} ${y(index) + 4} Z`} />
          </g>
        );
      })}
      {gap >= 0 && (
        <text x={(LEFT + RIGHT) / 2} y={y(gap) - ROW + 4} textAnchor="middle">
          ⋮ {left} more ⋮
        </text>
      )}
    </svg>
  );
}
