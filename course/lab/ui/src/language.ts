// The highlighter of `.srv`, `.msg` and `.action`: https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html

import type { StreamParser, StringStream } from '@codemirror/language';
import { JupyterFrontEnd, JupyterFrontEndPlugin } from '@jupyterlab/application';
import { ICellModel } from '@jupyterlab/cells';
import { EditorLanguageRegistry, IEditorLanguageRegistry } from '@jupyterlab/codemirror';
import { INotebookTracker, Notebook } from '@jupyterlab/notebook';
import { fileIcon } from '@jupyterlab/ui-components';

const MIME = 'text/x-ros2-interface';
const KINDS = ['srv', 'msg', 'action'];
const CELL = new RegExp(`^\\s*%%exercise\\s+\\S+\\.(${KINDS.join('|')})(\\s|$)`);

interface Place {
  begun: boolean; // true if something was read before this line
  part: 'start' | 'type' | 'name' | 'value'; // of a line
  text: boolean; // true if the type is string or wstring
  array: boolean;
}

// The returned words are CodeMirror's tags for which JupyterLab's themes have a colour.
const parser: StreamParser<Place> = {
  name: 'ros2-interface',
  languageData: { commentTokens: { line: '#' } },
  startState: () => ({ begun: false, part: 'start', text: false, array: false }),
  token: (stream, place) => {
    if (stream.sol()) {
      place.part = 'start';
    }
    if (stream.eatSpace()) {
      place.part = place.part === 'type' ? 'name' : place.part;
      return null;
    }
    const first = !place.begun;
    place.begun = true;
    if (first && stream.match(/^%%/)) {
      stream.skipToEnd(); // the magic of a cell
      return 'operator';
    }
    if (stream.match(/^#.*/)) {
      return 'comment'; // even in a string
    }
    switch (place.part) {
      case 'start':
        place.part = 'type';
        place.text = place.array = false;
        return stream.match(/^---\s*$/) ? 'operator' : typeName(stream, place);
      case 'type':
        return typeEnd(stream, place);
      case 'name':
        return fieldName(stream, place);
      case 'value':
        return value(stream, place);
    }
  }
};

/** Read a primitive type of ROS, or one of a package: `geometry_msgs/Pose`. */
function typeName(stream: StringStream, place: Place): string | null {
  if (stream.match(/^(bool|byte|char|w?string|float(32|64)|u?int(8|16|32|64))(?![\w/])/)) {
    place.text = stream.current().endsWith('string');
    return 'keyword';
  }
  if (!stream.match(/^[A-Za-z][\w/]*/)) {
    stream.next();
    return null;
  }
  return 'variableName.special';
}

/** Bounds and arrays: `<=5`, `[]`, `[3]`, `[<=5]`. */
function typeEnd(stream: StringStream, place: Place): string | null {
  if (stream.match('<=')) {
    return 'operator';
  }
  if (stream.match(/^\d+/)) {
    return 'number';
  }
  place.array = place.array || stream.peek() === '[';
  return /[[\]]/.test(stream.next()!) ? 'punctuation' : null;
}

function fieldName(stream: StringStream, place: Place): string | null {
  if (stream.match(/^\w+/)) {
    place.part = 'value';
    return stream.match(/^\s*=/, false) ? 'variableName.definition' : 'propertyName';
  }
  stream.next();
  return null;
}

/** Read a field's default, or the value of a constant after its `=`. */
function value(stream: StringStream, place: Place): string | null {
  if (stream.match(/^=/)) {
    return 'operator';
  }
  if (place.array && stream.match(/^[[\],]/)) {
    return 'punctuation';
  }
  if (place.text) {
    const quoted = stream.match(/^"(\\.|[^"\\#])*"?/) || stream.match(/^'(\\.|[^'\\#])*'?/);
    if (!quoted) {
      stream.match(place.array ? /^[^,\]#]+/ : /^[^#]+/); // a string needs no quotes
    }
    return 'string';
  }
  if (stream.match(/^(true|false)\b/i)) {
    return 'bool';
  }
  if (stream.match(/^[-+]?(0[bo][0-7]+|0x[\da-f]+|(\d+\.?\d*|\.\d+)(e[-+]?\d+)?)/i)) {
    return 'number';
  }
  stream.next();
  return null;
}

/** Highlight a cell as an interface definition as long as it writes one. */
function showCells(notebook: Notebook): void {
  const seen = new WeakSet<ICellModel>();
  const show = (cell: ICellModel) => {
    const written = CELL.test(cell.sharedModel.getSource());
    if (written !== (cell.mimeType === MIME)) {
      cell.mimeType = written ? MIME : notebook.codeMimetype;
    }
  };
  const look = () => {
    for (const cell of notebook.model?.cells ?? []) {
      if (cell.type === 'code' && !seen.has(cell)) {
        seen.add(cell);
        cell.sharedModel.changed.connect((_, change) => 'sourceChange' in change && show(cell));
        cell.mimeTypeChanged.connect(() => show(cell)); // for example when the kernel has sent its language
        show(cell);
      }
    }
  };
  const follow = () => {
    notebook.model?.cells.changed.connect(look);
    look();
  };
  notebook.modelChanged.connect(follow);
  follow();
}

export const language: JupyterFrontEndPlugin<void> = {
  id: 'ros2-course-lab:language',
  description: 'The highlighter of .srv, .msg and .action, in files and in the cells that write them.',
  autoStart: true,
  requires: [IEditorLanguageRegistry],
  optional: [INotebookTracker],
  activate: (app: JupyterFrontEnd, languages: IEditorLanguageRegistry, tracker: INotebookTracker | null) => {
    languages.addLanguage({
      name: 'ros2-interface',
      displayName: 'ROS 2 interface',
      alias: KINDS,
      mime: MIME,
      extensions: KINDS,
      support: EditorLanguageRegistry.legacy(parser)
    });
    app.docRegistry.addFileType({
      name: 'ros2-interface',
      displayName: 'ROS 2 interface',
      extensions: KINDS.map(kind => `.${kind}`),
      mimeTypes: [MIME],
      contentType: 'file',
      fileFormat: 'text',
      icon: fileIcon
    });
    tracker?.widgetAdded.connect((_, panel) => showCells(panel.content));
    tracker?.forEach(panel => showCells(panel.content));
  }
};
