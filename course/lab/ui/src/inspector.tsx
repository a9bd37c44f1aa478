// The inspector: a form made from a type to call, send a goal, publish or set a parameter; the result; the program.

import { Clipboard } from '@jupyterlab/apputils';
import { LabIcon } from '@jupyterlab/ui-components';
import * as React from 'react';

import { Current } from './current';
import { Exchange, ExchangeView } from './exchange';
import { Field, FormFields, Given, initial } from './form';
import { Link } from './link';
import { clock } from './log';
import { breakable, FirstCell, instead, SidePanel, useCurrent, useTopic } from './panel';
import { hangs } from './wrapping';

export const inspectorIcon = new LabIcon({
  name: 'ros2-course:inspector',
  svgstr:
    '<svg xmlns="http://www.w3.org/2000/svg" width="16" viewBox="0 0 24 24"><g class="jp-icon3" fill="#616161">' +
    '<path d="M2.500 20.500 22 12 2.500 3.500V10l13 2-13 2z"/></g></svg>'
});

const RATE = '(rate)'; // the kernel's names for these fields in error messages
const LIMIT = '(limit)';

/** The names with their types, by kind; and a sentence for each that several nodes have, by kind and name. */
type Offers = { [kind in Kind]: [string, string][] } & { several: { [what: string]: string } };
export type Kind = 'service' | 'action' | 'topic' | 'parameter';

const KINDS: { [kind in Kind]: { what: string; of: string; send: string } } = {
  service: { what: 'Call a service', of: 'Service', send: 'Call' },
  action: { what: 'Send a goal', of: 'Action', send: 'Send the goal' },
  topic: { what: 'Publish a message', of: 'Topic', send: 'Publish' },
  parameter: { what: 'Set a parameter', of: 'Node', send: 'Set' }
};
const NOTHING: { [kind in Kind]: string } = {
  service: 'No node offers a service of its own.',
  action: 'No node offers an action.',
  topic:
    'No node has a topic of its own yet, only /parameter_events and /rosout, which all nodes have. Run a cell that starts a node: the topics on which it publishes or listens are listed here.',
  parameter: 'No node runs.'
};
const PAUSE = 250; // ms without typing until the form is read
const AGAIN = 2000; // ms until a form is asked for again that did not come
const INSPECTOR = 'ros2-course-inspector';

export class InspectorPanel extends SidePanel {
  constructor(current: Current) {
    super(current, INSPECTOR, 'Inspector', inspectorIcon);
    window.addEventListener('pagehide', this._keep);
  }

  dispose(): void {
    window.removeEventListener('pagehide', this._keep);
    super.dispose();
  }

  /** Choose something in the panel when it is shown next, or now. */
  choose(kind: Kind, name: string, type: string): void {
    const kernel = this.current.link?.kernelId;
    this._memory.set('kind', kind);
    this._memory.set('chosen', { ...choices(this._memory.get('chosen'), kernel), [kind]: `${name} ${type}` });
    this._memory.set('focus', true);
    this._chosen += 1;
    this.update();
  }

  protected draw(): JSX.Element {
    return <Inspector key={this._chosen} current={this.current} memory={this._memory} />;
  }

  private _keep = () => keep(this._memory);
  private _chosen = 0;
  private _memory: Memory = kept(); // a hidden panel is not drawn, and must not lose its input
}

type Memory = Map<string, any>;

/** Keep the input for the time in which the page is loaded again. */
function keep(memory: Memory): void {
  try {
    sessionStorage.setItem(INSPECTOR, JSON.stringify([...memory]));
  } catch {
    sessionStorage.removeItem(INSPECTOR); // the browser allows less
  }
}

/** Return the input that was kept, or none. */
function kept(): Memory {
  try {
    return new Map(JSON.parse(sessionStorage.getItem(INSPECTOR) ?? '[]'));
  } catch {
    return new Map();
  }
}

/** What was chosen of each kind, in one kernel. */
type Choices = { [kind in Kind]?: string } & { kernel?: string };

/** Return the choices if they were made in this kernel, otherwise none. */
function choices(made: Choices | undefined, kernel: string | undefined): Choices {
  return made?.kernel === kernel ? { ...made, kernel } : { kernel };
}

/** A state that outlives the component. */
function useKept<T>(memory: Memory, key: string, initial: T): [T, (value: T) => void] {
  const [value, setValue] = React.useState<T>(memory.has(key) ? memory.get(key) : initial);
  const keep = (value: T) => {
    memory.set(key, value);
    setValue(value);
  };
  return [value, keep];
}

function Inspector({ current, memory }: { current: Current; memory: Memory }): JSX.Element {
  const { link } = useCurrent(current);
  const [offers, setOffers] = React.useState<Offers | null>(null);
  const [kind, setKind] = useKept<Kind>(memory, 'kind', 'service');
  const [chosen, setChosen] = useKept<Choices>(memory, 'chosen', {});
  const [repeated, setRepeated] = useKept<string[]>(memory, 'repeated', []); // publications, by their numbers
  const [failed, setFailed] = React.useState('');
  useTopic(
    link,
    'inspector',
    {},
    setOffers,
    () => {
      setOffers(null);
      setFailed('');
    },
    setFailed
  );
  const up = link?.state === 'up';
  React.useEffect(() => {
    const untouched = () => !memory.has('kind') && !memory.has('chosen');
    if (up && untouched()) {
      // A page that was loaded again shows what runs.
      link!.request('inspector.latest').then(
        (found: Sent | null) => {
          if (found && untouched()) {
            pick(found.kind, `${found.name} ${found.kind === 'parameter' ? '' : found.type}`);
            setKind(found.kind);
            setRepeated(found.kind === 'topic' ? [found.number] : []);
          }
        },
        () => undefined
      );
    }
  }, [link, up]);
  const select = React.useRef<HTMLSelectElement>(null);
  React.useEffect(() => {
    if (select.current && memory.get('focus')) {
      memory.delete('focus'); // the element that the reader came from is not shown any more
      select.current.focus();
    }
  });
  const message = instead(current, link);
  const found = message === null && offers ? offers[kind] : [];
  // What is shown stays when it goes, until the reader chooses; of another kernel's choice, only what is there is shown.
  const shown = React.useRef<Choices>({});
  if (shown.current.kernel !== link?.kernelId) {
    shown.current = choices(chosen, link?.kernelId);
  }
  const pick = (kind: Kind, what: string) => {
    shown.current[kind] = what;
    setChosen({ ...choices(chosen, link?.kernelId), [kind]: what });
  };
  const kept = shown.current[kind];
  const wanted = kept ?? chosen[kind];
  const there = found.find(each => each.join(' ') === wanted) ?? found.find(each => each[0] === wanted?.split(' ')[0]);
  const away = kept !== undefined && !there && message === null && offers !== null;
  const [name, type] = there ?? (away ? kept.split(' ') : found[0]) ?? ['', ''];
  const what = `${name} ${type}`;
  if (name) {
    shown.current[kind] = what;
  }
  return (
    <>
      <header className="ros-Panel-head">
        <h2>Inspector</h2>
      </header>
      <div className="ros-Panel-message" role="status">
        {failed || message || (offers && !name ? NOTHING[kind] : '')}
      </div>
      <FirstCell current={current} link={link} />
      {message === null &&
        repeated
          .filter(number => number !== memory.get(`${kind} ${what} exchange`)) // which has a timeline below
          .map(number => (
            <Repeated
              key={number}
              link={link!}
              number={number}
              ended={() => setRepeated(memory.get('repeated').filter((each: string) => each !== number))}
            />
          ))}
      {message === null && (
        <div className="ros-Form" onFocus={() => name && chosen[kind] !== what && pick(kind, what)}>
          <label>
            What to do
            <select value={kind} onChange={event => setKind(event.target.value as Kind)}>
              {(Object.keys(KINDS) as Kind[]).map(each => (
                <option key={each} value={each}>
                  {KINDS[each].what}
                </option>
              ))}
            </select>
          </label>
          {name && (
            <label>
              {KINDS[kind].of}
              <select
                ref={select}
                className={away ? 'ros-mod-away' : ''}
                value={what}
                title={name}
                onChange={event => pick(kind, event.target.value)}
              >
                {away && (
                  <option value={what} disabled>
                    {name}
                  </option>
                )}
                {found.map(each => (
                  <option key={each.join(' ')} value={each.join(' ')}>
                    {each[0]}
                  </option>
                ))}
              </select>
            </label>
          )}
          <div role="status">
            {offers?.several[`${kind} ${name}`] && <p className="ros-note">{offers.several[`${kind} ${name}`]}</p>}
          </div>
          {name && (
            <Sending
              key={`${kind} ${what}`}
              memory={memory}
              link={link!}
              kind={kind}
              name={name}
              type={type}
              away={away}
              repeats={(number, before) => setRepeated([...repeated.filter(each => each !== before), number])}
            />
          )}
        </div>
      )}
    </>
  );
}

/** A repeated publication that goes on while the form is another one's, or has ended without the reader's doing. */
function Repeated({ link, number, ended }: { link: Link; number: string; ended: () => void }): JSX.Element | null {
  const [exchange, setExchange] = React.useState<Exchange | null>(null);
  const take = (found: Exchange) => (found.state === 'running' || found.note ? setExchange(found) : ended());
  useTopic(link, 'inspector.exchange', { number }, take, () => setExchange(null), ended);
  const running = exchange?.state === 'running';
  const stop = (event: React.MouseEvent) => {
    event.currentTarget.closest<HTMLElement>('.ros-Panel')?.focus(); // this button will be gone
    if (running) {
      link.request('inspector.cancel', { number }).catch(() => undefined); // it has just ended
    } else {
      ended();
    }
  };
  return (
    exchange && (
      <div className="ros-Repeated" role="group" aria-label={`Published on ${exchange.name}`}>
        <span>
          <strong>{breakable(exchange.name)}</strong>: {exchange.note}
        </span>
        <button onClick={stop}>{running ? 'Stop' : 'Close'}</button>
      </div>
    )
  );
}

/** What was sent from here, as the kernel knows it. */
interface Sent {
  number: string;
  kind: Kind;
  name: string;
  type: string;
}

interface About {
  memory: Memory;
  link: Link;
  kind: Kind;
  name: string;
  type: string;
  away: boolean; // not there now
  repeats: (number: string, before: string | null) => void; // called with a repeated publication, and what it replaces
}

interface Looked {
  wrong: { [path: string]: string };
  python: string;
  ros2: string;
}

function Sending({ memory, link, kind, name, type, away, repeats }: About): JSX.Element {
  const [fields, setFields] = React.useState<Field[] | null>(null);
  const key = `${kind} ${name} ${type}`;
  const [given, setGiven] = useKept<Given>(memory, `${key} given`, {});
  const [parameter, setParameter] = useKept(memory, `${key} parameter`, '');
  const [timeout, setTimeout] = useKept(memory, 'timeout', '5');
  const [rate, setRate] = useKept(memory, `${key} rate`, '');
  const [looked, setLooked] = React.useState<Looked>({ wrong: {}, python: '', ros2: '' });
  const [refused, setRefused] = React.useState(false); // true if what was to be sent had an error, until it has none
  const [failed, setFailed] = React.useState('');
  const [exchange, setExchange] = useKept<string | null>(memory, `${key} exchange`, null);
  const sent = React.useRef(''); // the number of what the reader has sent last since this form is shown
  const [reading, setReading] = React.useState(0);
  const [read, setRead] = React.useState(0); // when the fields were read, s since 1970
  const typed = React.useRef(false); // since the form was asked for
  const change = (given: Given) => {
    typed.current = true;
    setGiven(given);
  };
  React.useEffect(() => {
    if (!(Number(timeout) > 0)) {
      setTimeout('5'); // an error typed into another form is none of this one's
    }
    if (exchange === null) {
      link.request('inspector.latest', { kind, name }).then(
        (found: Sent | null) => found && !memory.has(`${key} exchange`) && setExchange(found.number),
        () => undefined
      );
    }
  }, [link]);

  React.useEffect(() => {
    if (away && (fields !== null || kind === 'parameter')) {
      return;
    }
    let wanted = true;
    let again = 0;
    typed.current = false;
    link.request('inspector.form', { kind, name, type_name: type }).then(
      (found: Field[]) => {
        if (wanted) {
          setFailed('');
          setFields(found);
          setRead(Date.now() / 1000);
          // A parameter's present value may differ from the one typed before.
          const kept = kind === 'parameter' && !typed.current ? {} : memory.get(`${key} given`);
          setGiven({ ...initial(found), ...kept });
        }
      },
      error => {
        if (wanted) {
          setFailed(error.message);
          again = fields === null ? window.setTimeout(() => setReading(reading + 1), AGAIN) : 0; // it may be held up
        }
      }
    );
    return () => {
      wanted = false;
      window.clearTimeout(again);
    };
  }, [link, kind, name, type, reading, away]);

  const settable = kind === 'parameter' ? (fields ?? []).filter(field => !field.fixed) : [];
  const unsettable = kind === 'parameter' ? (fields ?? []).filter(field => field.fixed) : [];
  const one =
    settable.find(field => field.name === parameter) ?? settable.find(field => !field.read_only) ?? settable[0];
  const shown = kind === 'parameter' ? (one ? [one] : []) : (fields ?? []);
  const show = (parameter: string) => {
    setParameter(parameter);
    setGiven(initial(fields!)); // a text typed before, perhaps refused, is not the node's value
    setReading(reading + 1);
  };
  const asked = React.useMemo(
    () => ({
      kind,
      name,
      type_name: kind === 'parameter' ? one?.type : type,
      given: kind === 'parameter' ? (one ? { [one.name]: given[one.name] } : {}) : given,
      rate: kind === 'topic' ? rate : '',
      timeout: kind === 'topic' ? undefined : timeout
    }),
    [kind, name, type, one, given, rate, timeout]
  );
  const complete = fields !== null && (kind !== 'parameter' || one !== undefined);

  React.useEffect(() => {
    let wanted = complete;
    const timer = window.setTimeout(() => {
      if (wanted) {
        link.request('inspector.look', asked).then(
          found => wanted && setLooked(found),
          error => wanted && setFailed(error.message)
        );
      }
    }, PAUSE);
    return () => {
      wanted = false;
      window.clearTimeout(timer);
    };
  }, [link, asked, complete]);

  const send = async () => {
    setFailed('');
    try {
      const found: Looked = await link.request('inspector.look', asked);
      setLooked(found);
      setRefused(Object.keys(found.wrong).length > 0);
      if (Object.keys(found.wrong).length === 0) {
        const number: string = await link.request('inspector.send', asked);
        sent.current = number;
        setExchange(number);
        if (asked.rate) {
          repeats(number, exchange);
        }
      }
    } catch (error) {
      setFailed((error as Error).message);
    }
  };
  const count = Object.keys(looked.wrong).length;
  const remark = (shown: Exchange) => {
    const differs = looked.ros2 ? looked.ros2 !== shown.line : count > 0;
    if (!shown.cancellable || !shown.line || !differs) {
      return null;
    }
    const again = (event: React.MouseEvent) => {
      event.currentTarget.closest<HTMLElement>('.ros-Panel')?.focus(); // this button will be gone
      void send();
    };
    return (
      <div className="ros-Changed" role="group" aria-label="The form has other values">
        <p className="ros-note" role="status">
          What is published is still the message from before, not what the form shows now.
        </p>
        {count === 0 && <button onClick={again}>Publish the new one</button>}
      </div>
    );
  };
  const refuses = kind === 'parameter' && one?.read_only === true;
  const waiting = refuses ? '(its node refuses to set it)' : count > 0 ? '(when nothing in the form is wrong)' : '…';
  return (
    <>
      {(type || away) && (
        <p className={away ? 'ros-type' : 'ros-quiet ros-type'} role="status">
          {away ? <>{breakable(name)} is not there now.</> : breakable(type)}
        </p>
      )}
      <form
        onSubmit={event => {
          event.preventDefault();
          void send();
        }}
        noValidate
      >
        {kind === 'parameter' && one && (
          <label>
            Parameter
            <select value={one.name} title={one.name} onChange={event => show(event.target.value)}>
              {settable.map(field => (
                <option key={field.name} value={field.name}>
                  {field.name}
                  {field.read_only && ' (read-only)'}
                </option>
              ))}
            </select>
          </label>
        )}
        {fields && shown.length === 0 && (
          <p className="ros-quiet">
            {kind === 'parameter' ? 'It has no parameter that can be set.' : 'It has no fields to fill in.'}
          </p>
        )}
        {unsettable.length > 0 && (
          <p className="ros-quiet">
            Not in the list, because a form cannot set them: {unsettable.map(each => `${each.name} (${each.type})`).join(', ')}.
            In a terminal, <code>ros2 param get</code> shows their values.
          </p>
        )}
        <FormFields fields={shown} given={given} path="" wrong={looked.wrong} change={change} />
        <div className="ros-Form-send">
          <button type="submit" className="ros-mod-main" disabled={!complete || refuses}>
            {KINDS[kind].send}
          </button>
          {kind === 'parameter' && (
            <button type="button" aria-disabled={away} onClick={() => setReading(reading + 1)}>
              Read again
            </button>
          )}
          {kind === 'topic' && (
            <label className="ros-Form-limit">
              Repeat it
              <input
                inputMode="decimal"
                value={rate}
                size={4}
                placeholder="once"
                aria-label="Times a second (Hz); empty: once"
                aria-invalid={RATE in looked.wrong}
                onChange={event => setRate(event.target.value)}
              />{' '}
              times a second
            </label>
          )}
          {kind !== 'topic' && (
            <label className="ros-Form-limit">
              Wait at most
              <input
                inputMode="decimal"
                value={timeout}
                size={3}
                aria-invalid={LIMIT in looked.wrong}
                onChange={event => setTimeout(event.target.value)}
              />{' '}
              {kind === 'action' ? 's until it is accepted' : 's'}
            </label>
          )}
        </div>
        {kind === 'parameter' && one && <p className="ros-quiet">The node’s values were read at {clock(read)}.</p>}
        <div role="status">
          {count > 0 && (
            <p className="ros-wrong">
              {refused && 'Not sent. '}
              {count === 1 ? 'One field needs' : `${count} fields need`} another look.
              {refused && exchange !== null && ' The timeline below is that of the last one sent.'}
            </p>
          )}
          {looked.wrong[RATE] && <p className="ros-wrong">{looked.wrong[RATE]}</p>}
          {looked.wrong[LIMIT] && <p className="ros-wrong">Wait at most: {looked.wrong[LIMIT]}</p>}
          {failed && <pre className="ros-story">{failed}</pre>}
        </div>
      </form>
      {exchange !== null && <ExchangeView link={link} number={exchange} sent={exchange === sent.current} remark={remark} />}
      <h3>The same in a terminal</h3>
      <Code text={refuses ? '' : looked.ros2} what="The line" waiting={waiting} wrap />
      <h3>The same in Python</h3>
      <Code text={refuses ? '' : looked.python} what="The program" waiting={waiting} />
    </>
  );
}

/** Return a line of a program; where it is wrapped it goes on further to the right than it begins. */
function line(text: string, number: number): JSX.Element {
  const begins = /^ *\S?/.exec(text)![0]; // a long word is not to begin a row of its own
  return (
    <span key={number} className="ros-Code-line" style={{ '--ros-hangs': `${hangs(text, 4)}ch` } as React.CSSProperties}>
      <span className="ros-Code-begins">{begins}</span>
      {`${text.slice(begins.length)}\n`}
    </span>
  );
}

function Code({ text, what, waiting, wrap }: { text: string; what: string; waiting: string; wrap?: boolean }): JSX.Element {
  const [copied, setCopied] = React.useState('');
  return (
    <div className="ros-Code">
      <pre tabIndex={0} role="group" aria-label={what} className={wrap || !text ? 'ros-mod-wrap' : ''}>
        {text && !wrap ? text.replace(/\n$/, '').split('\n').map(line) : text || waiting}
      </pre>
      <button
        disabled={!text}
        onClick={() => {
          Clipboard.copyToSystem(text);
          setCopied(text);
        }}
        aria-label={`Copy ${what.toLowerCase()}`}
      >
        {copied === text && text ? 'Copied' : 'Copy'}
      </button>
    </div>
  );
}
