// The fields of a form made from a type; course/lab/kernel/forms.py defines and parses them.

import * as React from 'react';

export interface Field {
  name: string;
  type: string;
  kind: 'truth' | 'scalar' | 'list' | 'message' | 'messages';
  default?: string | boolean;
  choices?: { [constant: string]: string };
  fields?: Field[];
  length?: number | null; // of a list of messages with a fixed length
  about?: string; // about a parameter
  fixed?: boolean; // true for a parameter whose type is unknown, so that it cannot be set
  read_only?: boolean; // true for a parameter that its node refuses to set
}

/** The input in the fields of a message: texts as typed. */
export type Given = { [name: string]: any };

/** Return the initial input of a form. */
export function initial(fields: Field[]): Given {
  const given: Given = {};
  for (const field of fields) {
    if (field.kind === 'message') {
      given[field.name] = initial(field.fields!);
    } else if (field.kind === 'messages') {
      given[field.name] = Array.from({ length: field.length ?? 0 }, () => initial(field.fields!));
    } else {
      given[field.name] = field.default;
    }
  }
  return given;
}

interface FieldsProps {
  fields: Field[];
  given: Given;
  path: string;
  wrong: { [path: string]: string };
  change: (given: Given) => void;
}

export function FormFields({ fields, given, path, wrong, change }: FieldsProps): JSX.Element {
  return (
    <>
      {fields.map(field => (
        <OneField
          key={field.name}
          field={field}
          value={given[field.name] ?? initial([field])[field.name]}
          path={path ? `${path}.${field.name}` : field.name}
          wrong={wrong}
          change={value => change({ ...given, [field.name]: value })}
        />
      ))}
    </>
  );
}

interface FieldProps {
  field: Field;
  value: any;
  path: string;
  wrong: { [path: string]: string };
  change: (value: any) => void;
}

function OneField({ field, value, path, wrong, change }: FieldProps): JSX.Element {
  const id = React.useId();
  const why = wrong[path];
  const said = why && (
    <p className="ros-wrong" id={`${id}-why`}>
      {why}
    </p>
  );
  if (field.kind === 'message') {
    return (
      <fieldset className="ros-Form-message">
        <legend>
          {field.name} <span className="ros-quiet">{field.type}</span>
        </legend>
        <FormFields fields={field.fields!} given={value} path={path} wrong={wrong} change={change} />
      </fieldset>
    );
  }
  if (field.kind === 'messages') {
    return <Messages field={field} value={value} path={path} wrong={wrong} change={change} said={said} />;
  }
  const described = { 'aria-invalid': Boolean(why), 'aria-describedby': why ? `${id}-why` : undefined };
  const choices = Object.entries(field.choices ?? {});
  return (
    <div className="ros-Form-field">
      <label htmlFor={id}>
        {field.name} <span className="ros-quiet">{field.type}</span>
      </label>
      <div className="ros-Form-value">
        {field.kind === 'truth' ? (
          <input
            id={id}
            type="checkbox"
            checked={Boolean(value)}
            disabled={field.read_only}
            onChange={event => change(event.target.checked)}
            {...described}
          />
        ) : field.kind === 'scalar' && String(field.default).includes('\n') ? (
          <textarea
            id={id}
            value={value}
            rows={3}
            disabled={field.read_only}
            spellCheck={false}
            onChange={event => change(event.target.value)}
            {...described}
          />
        ) : (
          <input
            id={id}
            value={value}
            disabled={field.read_only}
            spellCheck={false}
            autoComplete="off"
            placeholder={field.kind === 'list' ? 'values, separated by commas' : ''}
            onChange={event => change(event.target.value)}
            {...described}
          />
        )}
        {choices.length > 0 && (
          <select
            aria-label={`Constants for ${field.name}`}
            disabled={field.read_only}
            value={choices.some(([, constant]) => constant === value) ? value : ''}
            onChange={event => (event.target.value === '' ? undefined : change(event.target.value))}
          >
            <option value="">another value</option>
            {choices.map(([name, constant]) => (
              <option key={name} value={constant}>
                {name}
              </option>
            ))}
          </select>
        )}
      </div>
      {field.about && <p className="ros-quiet ros-about">{field.about}</p>}
      {said}
    </div>
  );
}

function Messages({ field, value, path, wrong, change, said }: FieldProps & { said: React.ReactNode }): JSX.Element {
  const list = value as Given[];
  const fixed = field.length !== null && field.length !== undefined;
  return (
    <fieldset className="ros-Form-message">
      <legend>
        {field.name} <span className="ros-quiet">{field.type}</span>
      </legend>
      {list.map((each, number) => (
        <fieldset className="ros-Form-message" key={number}>
          <legend>
            {field.name}[{number}]
          </legend>
          <FormFields
            fields={field.fields!}
            given={each}
            path={`${path}.${number}`}
            wrong={wrong}
            change={changed => change(list.map((old, index) => (index === number ? changed : old)))}
          />
          {!fixed && (
            <button
              type="button"
              aria-label={`Remove ${field.name}[${number}]`}
              onClick={() => change(list.filter((_, index) => index !== number))}
            >
              Remove
            </button>
          )}
        </fieldset>
      ))}
      {!fixed && (
        <button
          type="button"
          aria-label={`Add an element to ${field.name}`}
          onClick={() => change([...list, initial(field.fields!)])}
        >
          Add an element
        </button>
      )}
      {said}
    </fieldset>
  );
}
