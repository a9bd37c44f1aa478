// Sliders that set a node's parameters, and follow them when they are set elsewhere.

import * as React from 'react';

import { Link } from './link';
import { useInSight } from './panel';

interface Knob {
  name: string;
  kind: 'bool' | 'integer' | 'double' | 'string';
  value: any; // null for a number that is not finite
  from: number | null;
  to: number | null;
  step: number | null;
  fixed: boolean;
  about: string;
}

export interface KnobNode {
  name: string;
  parameters: Knob[] | null; // null if the node does not answer
}

const NONE = { name: '', why: '', value: null as any }; // no change was refused; `value` is the one that has stayed
const NOTCHES = 200; // of a slider
const WIDE = 100; // from this ratio of its ends on, a slider is logarithmic
const WIDEST = 1e6; // a wider range gets no slider

/** Return the value of a parameter; undefined if the node has none of this name. */
export function valueOf(node: KnobNode, name: string): any {
  return node.parameters?.find(knob => knob.name === name)?.value;
}

export function Knobs({ node, link, without }: { node: KnobNode; link: Link; without: string[] }): JSX.Element | null {
  const [failed, setFailed] = React.useState(NONE);
  if (node.parameters === null) {
    return <p>{node.name} does not tell its parameters: it is busy, blocked, or offers none.</p>;
  }
  const knobs = node.parameters.filter(knob => !without.includes(knob.name));
  if (!knobs.length) {
    return null;
  }
  const set = async (name: string, value: any) => {
    try {
      await link.request('robot.set', { node: node.name, values: { [name]: value } });
      setFailed(NONE);
    } catch (error) {
      setFailed({ name, why: (error as Error).message, value: valueOf(node, name) });
    }
  };
  return (
    <details className="ros-Robot-knobs" open onFocus={() => setFailed(NONE)}>
      <summary>Parameters of {node.name}</summary>
      {knobs.map(knob => (
        <React.Fragment key={`${knob.kind} ${knob.name}`}>
          <KnobItem knob={knob} set={set} />
          {failed.name === knob.name && failed.value === knob.value && <Refusal why={failed.why} />}
        </React.Fragment>
      ))}
    </details>
  );
}

function Refusal({ why }: { why: string }): JSX.Element {
  return (
    <div role="alert" ref={useInSight<HTMLDivElement>(why)}>
      {why}
    </div>
  );
}

function KnobItem({ knob, set }: { knob: Knob; set: (name: string, value: any) => Promise<void> }): JSX.Element {
  const id = React.useId();
  const { value, change } = useSetting(knob, set);
  const isNumber = knob.kind === 'double' || knob.kind === 'integer';
  const isSlider =
    knob.from !== null && knob.to !== null && knob.to > knob.from && knob.to - knob.from <= WIDEST && typeof value === 'number';
  const text = isNumber ? (typeof value === 'number' ? shown(value) : 'no number') : '';
  return (
    <div className="ros-Robot-knob" title={knob.about || undefined}>
      <label htmlFor={id}>{knob.name}</label>
      {knob.kind === 'bool' ? (
        <input
          id={id}
          type="checkbox"
          checked={Boolean(value)}
          disabled={knob.fixed}
          onChange={event => change(event.target.checked)}
        />
      ) : isNumber && isSlider ? (
        <input
          id={id}
          type="range"
          min={0}
          max={NOTCHES}
          value={notchOf(knob, value)}
          aria-valuetext={text}
          disabled={knob.fixed}
          onChange={event => change(valueAt(knob, Number(event.target.value)))}
        />
      ) : (
        <Field id={id} knob={knob} value={value} change={change} isNumber={isNumber} />
      )}
      {isNumber && isSlider && <output htmlFor={id}>{text}</output>}
    </div>
  );
}

/** A text field whose value is set at Enter, or when it loses the focus. */
function Field(props: {
  id: string;
  knob: Knob;
  value: any;
  change: (value: any) => void;
  isNumber: boolean;
}): JSX.Element {
  const [typed, setTyped] = React.useState<string | null>(null);
  const commit = () => {
    if (typed !== null && (!props.isNumber || (typed.trim() !== '' && Number.isFinite(Number(typed))))) {
      props.change(props.isNumber ? Number(typed) : typed);
    }
    setTyped(null);
  };
  return (
    <input
      id={props.id}
      type={props.isNumber ? 'number' : 'text'}
      step={props.knob.kind === 'integer' ? 1 : 'any'}
      value={typed ?? props.value ?? ''}
      disabled={props.knob.fixed}
      onChange={event => setTyped(event.target.value)}
      onBlur={commit}
      onKeyDown={event => (event.key === 'Enter' ? commit() : undefined)}
    />
  );
}

/** The reader's value until the node has accepted or refused it; then the node's.  One request at a time. */
function useSetting(
  knob: Knob,
  set: (name: string, value: any) => Promise<void>
): { value: any; change: (value: any) => void } {
  const [own, setOwn] = React.useState<{ value: any } | null>(null);
  const next = React.useRef<{ value: any } | null>(null);
  const busy = React.useRef(false);
  const change = (value: any) => {
    setOwn({ value });
    next.current = { value };
    if (!busy.current) {
      void send();
    }
  };
  const send = async () => {
    busy.current = true;
    while (next.current) {
      const { value } = next.current;
      next.current = null;
      await set(knob.name, value);
    }
    busy.current = false;
    // Shows the node's last known value; an event that is still on its way comes soon.
    window.setTimeout(() => (busy.current ? undefined : setOwn(null)), 300);
  };
  return { value: own ? own.value : knob.value, change };
}

function isWide(knob: Knob): boolean {
  return knob.from! > 0 && knob.to! / knob.from! >= WIDE;
}

function notchOf(knob: Knob, value: number): number {
  const [from, to] = [knob.from!, knob.to!];
  const share = isWide(knob) ? Math.log(value / from) / Math.log(to / from) : (value - from) / (to - from);
  return Math.round(NOTCHES * Math.min(1, Math.max(0, share)));
}

function valueAt(knob: Knob, notch: number): number {
  const [from, to, share] = [knob.from!, knob.to!, notch / NOTCHES];
  const value = isWide(knob) ? from * (to / from) ** share : from + share * (to - from);
  const step = knob.step ?? (knob.kind === 'integer' ? 1 : 0);
  const even = step ? from + step * Math.round((value - from) / step) : Number(value.toPrecision(3));
  return Math.min(to, Math.max(from, Number(even.toPrecision(12))));
}

function shown(value: number): string {
  return String(Number(value.toPrecision(4)));
}
