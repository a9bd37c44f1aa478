"use strict";(self.rspackChunkros2_course_lab=self.rspackChunkros2_course_lab||[]).push([[319],{770(o,r,e){var t=e(601),a=e.n(t),i=e(314),n=(e.n(i))()(a());n.push([o.id,`/* The inspector and the graph. */

.ros-Form,
.ros-Form form,
.ros-Form > label,
.ros-Form form > label {
  display: flex;
  flex-direction: column;
  gap: 4px;
}

.ros-Form,
.ros-Form form {
  gap: 8px;
}

.ros-Form p,
.ros-Graph p {
  margin: 0;
}

.ros-Form h3,
.ros-Graph h3 {
  margin-top: 8px;
}

.ros-type,
.ros-Form :is(h3, p, legend),
.ros-Form-field label,
.ros-Repeated > span {
  min-width: 0;
  overflow-wrap: anywhere;
}

.ros-Form select {
  max-width: 100%;
  min-width: 0;
  text-overflow: ellipsis;
}

.ros-Form-value {
  display: flex;
  flex-wrap: wrap;
  gap: 4px;
}

.ros-Form-value :is(textarea, input:not([type='checkbox'])) {
  flex: 1 1 100px;
  font-family: var(--jp-code-font-family);
  min-width: 60px;
}

.ros-Form-value input[type='checkbox'] {
  height: 24px;
  width: 24px;
}

.ros-Form-field {
  display: flex;
  flex-direction: column;
  gap: 3px;
}

.ros-Graph-everything {
  align-items: center;
  display: flex;
  gap: 6px;
}

.ros-Form-message {
  border: 1px solid var(--jp-border-color1);
  border-radius: 3px;
  display: flex;
  flex-direction: column;
  gap: 6px;
  margin: 0;
  min-width: 0;
  padding: 4px 8px 8px;
}

/* Inside of the frame, which a title of two lines would cut. */
.ros-Form-message > legend {
  float: left;
  padding: 0;
}

.ros-Form-send {
  align-items: center;
  display: flex;
  flex-wrap: wrap;
  gap: 4px 8px;
}

.ros-Form-send .ros-mod-main {
  border-width: 2px;
  font-weight: 600;
}

.ros-Form-limit input {
  width: 4em;
}

.ros-wrong {
  color: var(--ros-bad);
}

.ros-Form [aria-invalid='true'] {
  border: 2px solid var(--ros-bad);
}

.ros-Exchange {
  border-top: 1px solid var(--jp-border-color1);
  padding-top: 8px;
}

.ros-Events {
  margin: 4px 0;
  padding-left: 20px;
}

.ros-Events pre,
.ros-Result pre,
.ros-Code pre {
  background: var(--jp-layout-color2);
  color: var(--jp-ui-font-color0);
  font-family: var(--jp-code-font-family);
  font-size: var(--jp-code-font-size);
  margin: 2px 0;
  max-height: 260px;
  overflow: auto;
  padding: 4px 8px;
}

.ros-Result pre {
  max-height: 150px; /* the diagram below stays in sight */
}

.ros-Code {
  align-items: flex-start;
  display: flex;
  flex-direction: column;
  gap: 4px;
}

.ros-Code pre {
  align-self: stretch;
}

.ros-Events pre,
.ros-Result pre,
.ros-Code .ros-mod-wrap {
  overflow-wrap: anywhere;
  white-space: pre-wrap;
}

/* On a small page, or at 200 % zoom, a program scrolls with the panel alone. */
@media (max-width: 760px) {
  .ros-Code pre {
    max-height: none;
    overflow-wrap: anywhere;
    white-space: pre-wrap;
  }

  .ros-Code-line {
    display: block;
    padding-left: var(--ros-hangs);
    text-indent: calc(-1 * var(--ros-hangs));
  }

  .ros-Code-begins {
    white-space: pre;
  }
}

.ros-Form-limit {
  align-items: center;
  display: flex;
  gap: 4px;
}

.ros-hidden {
  clip-path: inset(50%);
  height: 1px;
  overflow: hidden;
  position: absolute;
  white-space: nowrap;
  width: 1px;
}

.ros-Flow {
  display: block;
  max-width: 420px;
  width: 100%;
}

.ros-Flow text {
  fill: var(--jp-ui-font-color0);
  font-size: 12px;
}

.ros-Flow .ros-Flow-time {
  font-size: 11px;
}

.ros-Flow-end {
  fill: var(--jp-layout-color2);
  stroke: var(--jp-border-color0);
}

.ros-Flow-life {
  stroke: var(--jp-ui-font-color1);
}

.ros-Flow-arrow line {
  stroke: var(--ros-arrow);
  stroke-width: 2;
}

.ros-Flow-arrow path {
  fill: var(--ros-arrow);
}

.ros-Flow-arrow {
  --ros-arrow: var(--jp-ui-font-color1);
}

.ros-Flow-arrow.ros-mod-good {
  --ros-arrow: var(--ros-good);
}

.ros-Flow-arrow.ros-mod-warn {
  --ros-arrow: var(--ros-warn);
}

.ros-Flow-arrow.ros-mod-bad {
  --ros-arrow: var(--ros-bad);
}

.ros-Graph {
  display: flex;
  flex-direction: column;
  gap: 8px;
}

.ros-Graph-frame {
  border: 1px solid var(--jp-border-color1);
  max-height: 55vh;
  min-height: 60px;
  overflow: auto;
}

.ros-Graph-frame svg {
  display: block;
  margin: 0 auto;
  width: 100%;
}

.ros-Graph-frame text {
  fill: var(--jp-ui-font-color0);
  font-family: var(--jp-code-font-family);
  font-size: 12px;
}

.ros-Graph-edge {
  fill: none;
  stroke: var(--jp-ui-font-color1);
  stroke-width: 1.3;
}

.ros-Graph-tip {
  fill: var(--jp-ui-font-color1);
}

.ros-Graph-box {
  cursor: pointer;
  transition:
    transform 0.4s,
    opacity 0.2s;
}

.ros-mod-faint {
  opacity: 0.25;
}

.ros-Panel .ros-Graph-box:focus-visible {
  outline: 0;
}

.ros-Graph-box:focus-visible :is(rect, path) {
  stroke: var(--jp-ui-font-color0);
  stroke-width: 3.5;
}

.ros-Graph-box:focus-visible text {
  font-weight: 700;
}

@media (prefers-reduced-motion: reduce) {
  .ros-Graph-box {
    transition: none;
  }
}

/* The figures' palette (course/figures/palette.py), mixed with the theme's ground. */
.ros-Graph-box :is(rect, path) {
  fill: color-mix(in srgb, var(--ros-kind) 22%, var(--jp-layout-color1));
  stroke: var(--ros-kind);
  stroke-width: 1.5;
}

.ros-Graph-box.ros-mod-node {
  --ros-kind: #0072b2;
}

.ros-Graph-box.ros-mod-topic {
  --ros-kind: #009e73;
}

.ros-Graph-box.ros-mod-service {
  --ros-kind: #d55e00;
}

.ros-Graph-box.ros-mod-action {
  --ros-kind: #cc79a7;
}

.ros-Graph-key {
  align-items: center;
  display: flex;
  flex-wrap: wrap;
  gap: 4px 12px;
}

.ros-Graph-key span {
  align-items: center;
  display: inline-flex;
  gap: 4px;
}

.ros-Graph-list {
  list-style: none;
  margin: 0;
  padding: 0;
}

.ros-Graph-list li {
  border-bottom: 1px solid var(--jp-border-color2);
  overflow-wrap: anywhere;
  padding: 2px 0 4px;
}

.ros-Graph-list li > div {
  padding-left: 12px;
}

.ros-Panel .ros-Flows select {
  flex: none;
  padding: 2px;
}

.ros-Flows option {
  overflow-wrap: anywhere;
  padding: 2px 4px;
  white-space: normal;
}

.ros-Flows {
  display: flex;
  flex-direction: column;
  gap: 6px;
}
`,""]),e.d(r,{},{A:n})},646(o,r,e){var t=e(601),a=e.n(t),i=e(314),n=e.n(i),s=e(994),l=n()(a());l.i(s.A),l.push([o.id,`/* The course's part of JupyterLab, in the colours of its theme. */

.ros-HandIn-body {
  max-width: 60ch;
}

.ros-HandIn-doubts {
  border-left: 4px solid var(--jp-warn-color1);
  padding-left: 12px;
}

.ros-HandIn-name {
  display: flex;
  flex-direction: column;
  gap: 4px;
}

/* Elsewhere than in JupyterLab, as on the site, the start page's button is hidden: there it could do nothing. */
.jp-RenderedMarkdown .ros-CheckMachine {
  background: var(--jp-brand-color1);
  border: 0;
  border-radius: var(--jp-border-radius);
  color: var(--jp-ui-inverse-font-color1);
  cursor: pointer;
  display: inline-block;
  font-size: var(--jp-ui-font-size1);
  margin-right: 8px;
  padding: 6px 12px;
}

/* nbgrader shows it in every notebook. */
.jp-NotebookPanel:not(.ros-mod-graded) .jp-Toolbar-item:has(.validate-button) {
  display: none;
}

/* A toolbar moves its last items behind "...", and there the kernel's state would go before all others.  Where it is
   narrow, what is used less gives way: the debugger (in its panel, too), Validate (Hand in runs the same checks), a part
   of the kernel's name, and what the Run and Kernel menus have. */
.jp-NotebookPanel-toolbar {
  container: ros-toolbar / inline-size;
  overflow-y: clip; /* until JupyterLab has moved an item that has no room, it lies below, on the first cell */
}

@container ros-toolbar (max-width: 555px) {
  .jp-Toolbar-item[data-jp-item-name='debugger-icon'] {
    display: none;
  }
}

@container ros-toolbar (max-width: 525px) {
  .jp-Toolbar-item:has(.validate-button) {
    display: none;
  }
}

@container ros-toolbar (max-width: 470px) {
  .jp-Toolbar-item[data-jp-item-name='kernelName'] {
    max-width: max(30px, 100cqw - 320px);
    overflow: hidden;
  }
}

@container ros-toolbar (max-width: 400px) {
  .jp-Toolbar-item:is([data-jp-item-name='insert'], [data-jp-item-name='restart-and-run']) {
    display: none;
  }

  .jp-Toolbar-item[data-jp-item-name='kernelName'] {
    max-width: max(30px, 100cqw - 260px);
  }
}

/* JupyterLab's own least size is six rows, and on a phone leaves no room for a panel. */
.lm-DockPanel .jp-Terminal {
  min-height: 60px;
  min-width: 40px;
}

/* Of a folded terminal, only the tab is shown. */
.lm-DockPanel .ros-mod-folded,
.lm-DockPanel .ros-mod-folded .jp-Terminal {
  min-height: 0 !important;
}

/* A panel that was opened by keys has the focus itself. */
.ros-Panel:focus {
  outline: 0;
}

.ros-Panel:focus-visible {
  outline: 2px solid var(--jp-brand-color1);
  outline-offset: -2px;
}

/* On a phone a panel covers the notebook and the terminal, which keep their width: see PHONE in src/views.ts. */
.ros-Panel-back {
  align-self: flex-start;
  flex: none;
  margin-bottom: 6px;
}

@media (min-width: 600px) {
  .ros-Panel-back {
    display: none;
  }
}

/* A low page, as one at 200 % zoom, has no room for all tabs of a sidebar: they are nearer to each other, and scroll. */
.jp-SideBar.lm-TabBar[data-orientation='vertical'] {
  overflow: hidden auto;
  scrollbar-width: none;
}

.jp-SideBar[data-orientation='vertical'] .lm-TabBar-tab {
  flex: 0 0 auto;
}

@media (max-height: 560px) {
  .jp-SideBar[data-orientation='vertical'] .lm-TabBar-tab {
    padding: 6px 0;
  }
}

.lm-DockPanel .ros-Panel-back {
  display: none;
}

@media (max-width: 599px) {
  body {
    --jp-sidebar-min-width: 0px;
  }

  .lm-DockPanel :is(.jp-NotebookPanel, .jp-Terminal) {
    min-width: calc(100vw - 90px);
  }

  #jp-right-stack > .ros-Panel {
    min-width: 0;
  }

  .jp-SideArea:has(> #jp-right-stack:not(.lm-mod-hidden)) {
    left: 0 !important;
    width: 100% !important;
    z-index: 3;
  }

  #jp-right-stack,
  #jp-right-stack > .lm-Widget {
    width: 100% !important;
  }

  /* The tab in front shows its name; the others share what is left, and are closed when they are in front. */
  .lm-DockPanel-tabBar .lm-TabBar-tab.lm-mod-current {
    flex: 0 0 auto !important;
    width: auto !important;
    max-width: 75%;
  }

  .lm-DockPanel-tabBar .lm-TabBar-tab:not(.lm-mod-current) .lm-TabBar-tabCloseIcon {
    display: none;
  }

  /* A tab moves when it comes to the front: its cross may lie below the finger that tapped it, and must not close it. */
  .lm-DockPanel-tabBar .lm-TabBar-tab.lm-mod-current .lm-TabBar-tabCloseIcon {
    animation: ros-later 0.6s;
  }

  /* There is no room for the kernel's name beside its state. */
  .jp-NotebookPanel-toolbar [data-jp-item-name='kernelName'] {
    display: none;
  }

  /* Text, code and pictures have the width of the cells' numbers, too; a wide table scrolls. */
  .jp-Notebook :is(.jp-InputPrompt, .jp-OutputPrompt) {
    display: none;
  }

  .jp-RenderedMarkdown table {
    display: block;
    overflow-x: auto;
    scrollbar-width: thin;
    white-space: nowrap;
  }

  .jp-RenderedMarkdown table :is(td, th) {
    min-width: 8em;
    max-width: 60vw;
    white-space: normal;
  }
}

/* A long line of code goes on further to the right than it begins: src/wrapping.ts. */
.cm-lineWrapping .cm-line.ros-hanging {
  padding-left: calc(var(--ros-hangs) + 6px);
  text-indent: calc(-1 * var(--ros-hangs));
}

/* A line of text has about 90 characters at most; a table is as wide as it needs. */
.jp-RenderedMarkdown > :is(p, ul, ol, dl, blockquote, details, h1, h2, h3, h4) {
  max-width: 80ch;
}

.jp-RenderedMarkdown table {
  margin-left: 0;
}

.jp-RenderedMarkdown th {
  text-align: left;
}

/* What is folded belongs to the text above it. */
.jp-RenderedMarkdown > details:has(+ :not(details)) {
  margin-bottom: 1em;
}

/* A printed line is broken between words, unless a word is longer than a line. */
.jp-OutputArea-output pre {
  overflow-wrap: anywhere;
  word-break: normal;
}

/* At least 4.5:1 (WCAG AA), where JupyterLab's own colours have less. */
body {
  --jp-cell-prompt-not-active-font-color: var(--jp-ui-font-color2);
  --jp-cell-prompt-not-active-opacity: 1;
  --jp-mirror-editor-comment-color: #2b6b6b;
}

body[data-jp-theme-light='false'] {
  --jp-mirror-editor-comment-color: #7fb3b3;
}

/* The buttons of a cell are not in the way of what one reads. */
.jp-Cell:not(:hover) .jp-cell-toolbar:not(:focus-within) {
  opacity: 0;
}

/* Each shown tab of the main area is marked, and the one that has the focus in the theme's colour. */
.lm-DockPanel-tabBar .lm-TabBar-tab.lm-mod-current:not(.jp-mod-current)::before {
  background: var(--jp-ui-font-color2);
  content: '';
  height: var(--jp-private-horizontal-tab-active-top-border, 2px);
  left: 0;
  position: absolute;
  top: 0;
  width: 100%;
}

.lm-DockPanel-tabBar .lm-TabBar-tab.jp-mod-current:not(.lm-mod-current)::before {
  display: none;
}

/* Beside the tabs of the terminals. */
.ros-Strip-button {
  align-items: center;
  background: var(--jp-layout-color2);
  border: 1px solid var(--jp-border-color0);
  border-radius: 3px;
  color: var(--jp-ui-font-color1);
  cursor: pointer;
  display: flex;
  flex: none;
  font: inherit;
  gap: 2px;
  margin-left: auto;
  min-height: 24px;
  padding: 0 8px;
}

.ros-Strip-button:hover {
  background: var(--jp-layout-color3);
}

.ros-Strip-button:focus-visible {
  outline: 2px solid var(--jp-brand-color1);
  outline-offset: -2px;
}

/* At the lower edge of a terminal whose connection is lost. */
.ros-Terminal-notice {
  background: var(--jp-layout-color2);
  border-top: 1px solid var(--jp-border-color1);
  bottom: 0;
  box-sizing: border-box;
  color: var(--jp-ui-font-color0);
  font-size: var(--jp-ui-font-size1);
  left: 0;
  padding: 4px 12px;
  position: absolute;
  right: 0;
  z-index: 10;
}

.ros-Terminal-notice button {
  font: inherit;
  min-height: 24px;
}

.ros-Panel {
  background: var(--jp-layout-color1);
  color: var(--jp-ui-font-color0);
  display: flex;
  flex-direction: column;
  font-size: var(--jp-ui-font-size1);
  line-height: 1.4;
  min-width: 240px;
  overflow: auto;
  padding: 8px 12px;
}

.ros-Panel h2,
.ros-Panel h3 {
  font-size: var(--jp-ui-font-size2);
  font-weight: 600;
  margin: 0;
}

.ros-Panel h3 {
  font-size: var(--jp-ui-font-size1);
}

.ros-Panel-head {
  align-items: baseline;
  display: flex;
  flex-wrap: wrap;
  gap: 4px 8px;
}

.ros-Panel-head > :last-child:not(:first-child) {
  margin-left: auto;
}

.ros-Panel-message {
  margin: 4px 0;
}

.ros-quiet {
  color: var(--jp-ui-font-color1);
  opacity: 0.85;
}

.ros-Panel button:not(.ros-Node-name),
.ros-Panel select,
.ros-Panel :is(input, textarea) {
  background: var(--jp-layout-color2);
  border: 1px solid var(--jp-border-color0);
  border-radius: 3px;
  color: var(--jp-ui-font-color0);
  font: inherit;
  min-height: 24px;
  padding: 1px 8px;
}

/* A publication that goes on. */
.ros-Repeated {
  align-items: center;
  border-left: 4px solid var(--jp-warn-color1);
  display: flex;
  flex: none;
  gap: 8px;
  justify-content: space-between;
  margin-bottom: 8px;
  padding-left: 8px;
}

/* What was chosen, and is not there now. */
.ros-Panel select.ros-mod-away {
  font-style: italic;
  opacity: 0.7;
}

.ros-Panel button:not(:disabled, [aria-disabled='true']) {
  cursor: pointer;
}

.ros-Panel button:is(:disabled, [aria-disabled='true']) {
  opacity: 0.5;
}

.ros-Panel :is(button, select, input, textarea, summary, [tabindex]):focus-visible {
  outline: 2px solid var(--jp-brand-color1);
  outline-offset: 1px;
}

/* It scrolls, and so would cut off the mark around what has the focus at its edge. */
.ros-Nodes {
  flex: 0 1 auto;
  list-style: none;
  margin: 0 -3px;
  min-height: 60px;
  overflow: auto;
  padding: 0 3px;
}

.ros-Node {
  border-bottom: 1px solid var(--jp-border-color2);
  padding: 3px 0;
}

/* In one line what fits; the buttons of a long name, or of a node with a state to tell, are in the next one. */
.ros-Node-row {
  align-items: center;
  display: flex;
  flex-wrap: wrap;
  gap: 0 6px;
}

.ros-Node-name {
  align-items: center;
  background: none;
  border: 0;
  color: inherit;
  display: flex;
  flex: 1 0 auto;
  font: inherit;
  gap: 4px;
  max-width: 100%;
  min-height: 24px;
  padding: 0;
  text-align: left;
}

.ros-Node-name .ros-name {
  font-family: var(--jp-code-font-family);
  font-size: var(--jp-ui-font-size0);
  min-width: 0;
  overflow-wrap: anywhere;
}

.ros-state {
  flex: 1 0 auto;
  font-size: var(--jp-ui-font-size0);
  padding-left: 16px;
}

.ros-buttons {
  align-self: end;
  display: flex;
  gap: 4px;
}

.ros-Node-row .ros-buttons {
  margin-left: auto;
}

.ros-Panel .ros-Node-row .ros-buttons button {
  font-size: var(--jp-ui-font-size0);
  padding: 1px 5px;
}

.ros-mod-running .ros-mark {
  color: var(--ros-good);
}

.ros-mod-dead .ros-mark,
.ros-mod-trouble .ros-mark {
  color: var(--ros-bad);
}

.ros-Node-details {
  padding: 4px 0 8px 18px;
}

.ros-Node-details p,
.ros-Node-details dl {
  margin: 0 0 4px;
}

.ros-Node-details dt {
  font-weight: 600;
}

.ros-Node-details dd {
  margin: 0 0 0 12px;
  overflow-wrap: anywhere;
}

.ros-story {
  background: var(--jp-layout-color2);
  border-left: 4px solid var(--ros-bad);
  font-family: var(--jp-code-font-family);
  font-size: var(--jp-code-font-size);
  margin: 4px 0;
  overflow-wrap: anywhere;
  padding: 4px 8px;
  white-space: pre-wrap;
}

/* A long log leaves an open node its room. */
.ros-Log {
  display: flex;
  flex: 1 1 180px;
  flex-direction: column;
  margin-top: 8px;
  min-height: 180px;
}

.ros-Log-head {
  align-items: center;
  display: grid;
  gap: 4px 8px;
  grid-template-areas: 'title search' 'node level';
  grid-template-columns: minmax(0, 1fr) minmax(0, 1fr);
}

.ros-Log-head select {
  min-width: 0;
}

.ros-Log-head input {
  grid-area: search;
  min-width: 0;
}

.ros-Log-lost {
  font-weight: 600;
}

.ros-Log-lines {
  border: 1px solid var(--jp-border-color2);
  flex: 0 1 auto;
  font-family: var(--jp-code-font-family);
  font-size: var(--jp-code-font-size);
  margin-top: 4px;
  overflow: auto;
  overflow-wrap: anywhere;
  white-space: pre-wrap;
}

.ros-Log-line {
  padding: 0 4px;
}

.ros-Log-lines:empty {
  border: 0;
}

.ros-Log-line .ros-level {
  font-weight: 600;
}

.ros-Log-line :is(.ros-source, .ros-times) {
  color: var(--jp-ui-font-color1);
}

.ros-Log-line .ros-times {
  border: 1px solid var(--jp-border-color0);
  border-radius: 8px;
  padding: 0 5px;
}

.ros-Log-line .ros-time {
  color: var(--jp-ui-font-color2);
  font-size: 0.75em;
  font-variant-numeric: tabular-nums;
}

.ros-mod-INFO .ros-level {
  color: var(--ros-good);
}

.ros-mod-WARN .ros-level {
  color: var(--ros-warn);
}

:is(.ros-mod-ERROR, .ros-mod-FATAL, .ros-mod-ENDED) .ros-level {
  color: var(--ros-bad);
}

/* At least 4.5:1 on the theme's own background (WCAG AA). */
body {
  --ros-good: #1b7837;
  --ros-warn: #8a5300;
  --ros-bad: #b3261e;
}

body[data-jp-theme-light='false'] {
  --ros-good: #6fd08c;
  --ros-warn: #f0b45a;
  --ros-bad: #ff9a90;
}

.ros-Parts {
  list-style: none;
  margin: 0;
  padding: 0;
}

/* A long message goes on below the button, in the panel's whole width. */
.ros-Parts li {
  border-bottom: 1px solid var(--jp-border-color2);
  display: flow-root;
  padding: 4px 0;
}

.ros-Parts li > button {
  float: right;
  margin-left: 6px;
}

.ros-Parts .ros-mark {
  margin-right: 6px;
}

.ros-part {
  overflow-wrap: anywhere;
}

.ros-more {
  clear: both;
  font-family: var(--jp-code-font-family);
  font-size: var(--jp-code-font-size);
  margin: 2px 0 2px 20px;
  overflow-wrap: anywhere;
  white-space: pre-wrap;
}

.ros-mod-failed .ros-mark {
  color: var(--ros-bad);
  font-weight: 700;
}

.ros-mod-done .ros-mark {
  color: var(--ros-good);
  font-weight: 700;
}

.ros-File {
  border-bottom: 1px solid var(--jp-border-color2);
  margin-bottom: 8px;
  padding-bottom: 8px;
}

.ros-File h3 {
  overflow-wrap: anywhere;
}

.ros-Panel-message > a {
  color: var(--jp-content-link-color);
  display: block;
  overflow-wrap: anywhere;
  text-decoration: underline;
}

.ros-Changed {
  border-left: 4px solid var(--jp-warn-color1);
  margin: 8px 0;
  padding-left: 8px;
}

.ros-Changed > p {
  margin: 0 0 4px;
}

.ros-note {
  color: var(--ros-warn);
  font-weight: 600;
}

.ros-lines {
  white-space: pre-wrap;
}

.ros-hint {
  overflow: auto;
  padding: 0 4px;
}

/* A figure's ground becomes dark and its text light; turned by half a circle, blue stays blue. */
body[data-jp-theme-light='false'] img.ros-figure {
  filter: invert(0.92) hue-rotate(180deg);
}

@keyframes ros-later {
  from,
  to {
    visibility: hidden;
  }
}
`,""]),e.d(r,{},{A:l})},994(o,r,e){var t=e(601),a=e.n(t),i=e(314),n=(e.n(i))()(a());n.push([o.id,`/* The robot view. */

.lm-DockPanel .ros-Panel {
  container-type: size; /* the picture has no more than its part of the panel's height */
  min-width: 0;
}

.ros-Robot-stage {
  border: 1px solid var(--jp-border-color1);
  aspect-ratio: 4 / 3;
  flex: none;
  margin: 4px 0;
  max-height: max(170px, 62cqh);
  overflow: hidden;
  position: relative;
}

.ros-Robot-canvas {
  display: block;
  height: 100%;
  left: 0;
  position: absolute;
  top: 0;
  touch-action: none;
  width: 100%;
}

.ros-Robot-canvas:focus-visible {
  outline: 3px solid var(--jp-brand-color1);
  outline-offset: -3px;
}

.ros-Robot-canvas.ros-mod-dropping {
  cursor: crosshair;
}

.ros-Robot-under {
  display: flow-root;
  margin-bottom: 4px;
}

.ros-Robot-keys summary {
  float: left; /* below the buttons where it does not fit beside them */
  white-space: nowrap;
}

.ros-Robot-zoom {
  display: flex;
  flex-wrap: wrap;
  float: right;
  gap: 4px;
  justify-content: end;
  max-width: 100%;
}

.ros-Panel .ros-Robot-zoom button {
  min-width: 28px;
}

.ros-Robot-main {
  display: flex;
  flex: none;
  flex-direction: column;
}

.ros-Robot-pad {
  align-items: center;
  display: flex;
  flex-wrap: wrap;
  gap: 4px 16px;
  margin: 0 0 6px;
}

.ros-Robot-pad > div:last-child {
  flex: 1 1 160px;
  min-width: 0;
}

.ros-Robot-pad label {
  align-items: center;
  display: flex;
  flex-wrap: wrap;
  gap: 2px 8px;
}

.ros-Robot-pad input[type='range'] {
  flex: 0 1 120px;
  min-width: 60px;
  padding: 0;
}

.ros-Robot-pad p {
  margin: 2px 0;
}

.ros-Robot-arrows {
  display: grid;
  flex: none;
  gap: 3px;
  grid-template-areas: '. forward .' 'left backward right';
}

.ros-Panel .ros-Robot-arrows button {
  min-height: 32px;
  min-width: 44px;
  touch-action: none;
  user-select: none;
}

.ros-Panel .ros-Robot-arrows button:active:not([aria-disabled='true']) {
  background: var(--ros-robot-ink);
  color: var(--ros-robot-ground);
}

.ros-Panel .ros-Robot-arrows button[aria-disabled='true'] {
  border-style: dashed;
  cursor: not-allowed;
  opacity: 0.55;
}

.ros-Robot-arrows .ros-mod-forward {
  grid-area: forward;
}

.ros-Robot-arrows .ros-mod-left {
  grid-area: left;
}

.ros-Robot-arrows .ros-mod-backward {
  grid-area: backward;
}

.ros-Robot-arrows .ros-mod-right {
  grid-area: right;
}

/* Pause and Reset stay in sight, and nothing moves when they come and go. */
.ros-Panel .ros-Robot-head > .ros-quiet {
  margin: 0;
}

.ros-Robot-head {
  flex: none; /* it is as high as its two lines in a narrow view */
  min-height: 28px;
  background: var(--jp-layout-color1);
  flex-wrap: wrap;
  gap: 4px 8px;
  padding: 2px 0;
  position: sticky;
  top: -8px; /* of the panel's padding */
  z-index: 1;
}

/* In a low view, as above a plot, one drives without scrolling: the buttons lie beside the picture, or at once below. */
@container (max-height: 560px) {
  .ros-Robot-head {
    flex-wrap: nowrap;
    margin-bottom: -6px;
  }

  .ros-Robot-hands .ros-Robot-controls > span {
    display: none; /* the group's name says it, too */
  }

  .ros-Robot-hands {
    order: 1;
  }

  .ros-Robot-under {
    order: 2;
  }
}

@container (max-height: 560px) and (max-width: 419px) {
  .ros-Robot-stage {
    max-height: max(140px, 42cqh);
  }

  .ros-Robot-pad {
    align-items: start;
  }
}

@container (max-height: 560px) and (min-width: 420px) {
  .ros-Robot-main {
    display: grid;
    gap: 0 12px;
    grid-template: auto auto 1fr / minmax(0, 1fr) 170px;
    grid-template-areas: 'picture hands' 'under hands' '. hands';
  }

  .ros-Robot-stage {
    grid-area: picture;
  }

  .ros-Robot-under {
    grid-area: under;
  }

  .ros-Robot-hands {
    grid-area: hands;
    padding-top: 4px;
  }
}

.ros-Robot-facts {
  display: flex;
  flex-wrap: wrap;
  gap: 2px 16px;
  margin: 0 0 6px;
}

.ros-Robot-facts.ros-mod-old {
  color: var(--jp-ui-font-color2);
}

.ros-Robot-facts div {
  align-items: center;
  display: flex;
  gap: 5px;
}

.ros-Robot-facts dt {
  font-weight: 600;
}

.ros-Robot-facts dd {
  font-variant-numeric: tabular-nums;
  margin: 0;
  min-width: 4.5em;
}

/* What changes while the robot drives keeps its place. */
.ros-Robot-facts div.ros-mod-line {
  align-items: baseline;
  flex: 0 0 100%;
}

.ros-Robot-facts .ros-mod-long dd {
  min-width: 13.5em;
}

@container (max-width: 390px) {
  .ros-Robot-facts div.ros-mod-line:not(.ros-mod-driver) {
    min-height: 2.8em; /* a command in two lines */
  }
}

.ros-Robot-swatch {
  border-radius: 2px;
  flex: none; /* beside a long text, too */
  height: 10px;
  width: 10px;
}

.ros-Robot-controls {
  align-items: center;
  border: 0;
  display: flex;
  flex-wrap: wrap;
  gap: 4px 8px;
  margin: 0 0 6px;
  padding: 0;
}

.ros-Robot-controls label {
  align-items: center;
  display: flex;
  flex-wrap: wrap;
  gap: 4px;
  max-width: 100%;
}

.ros-Robot-controls select {
  min-width: 0;
}

.ros-Panel .ros-Robot-controls button[aria-pressed='true'] {
  border-color: var(--ros-robot-ink);
  background: var(--ros-robot-ink);
  color: var(--ros-robot-ground);
}

.ros-Robot-said {
  flex: none; /* a second line takes a line of its own */
  min-height: 1.4em;
}

.ros-Robot-knobs {
  border-top: 1px solid var(--jp-border-color2);
  padding: 4px 0;
}

.ros-Robot-knobs summary {
  cursor: pointer;
  min-height: 24px;
}

.ros-Robot-knob {
  align-items: center;
  display: flex;
  flex-wrap: wrap;
  gap: 2px 8px;
  min-height: 28px;
}

.ros-Robot-knob label {
  flex: 1 1 110px;
  font-family: var(--jp-code-font-family);
  overflow-wrap: anywhere;
}

.ros-Panel .ros-Robot-knob input {
  flex: 3 1 70px;
  min-width: 0;
}

.ros-Panel .ros-Robot-knob input[type='range'] {
  padding: 0;
}

.ros-Panel .ros-Robot-knob input[type='checkbox'] {
  flex: none;
  height: 24px;
  width: 24px;
}

.ros-Robot-knob output {
  flex: 0 0 3.5em;
  font-variant-numeric: tabular-nums;
  text-align: right;
}

.ros-Robot-keys dl {
  clear: both; /* of the zoom's buttons, which are beside the summary */
  display: grid;
  gap: 2px 12px;
  grid-template-columns: max-content 1fr;
  margin: 4px 0;
}

.ros-Robot-keys dd {
  margin: 0;
}

/* The plot. */

.ros-Plot-choice {
  align-items: end;
  display: flex;
  flex-wrap: wrap;
  gap: 4px 8px;
  margin: 4px 0;
}

.ros-Plot-choice label {
  display: flex;
  flex: 1 1 120px;
  flex-direction: column;
  min-width: 0;
}

.ros-Panel .ros-Plot-choice :is(select, input, button) {
  box-sizing: border-box;
  height: 26px;
  margin: 0;
}

.ros-Plot-choice > div {
  flex: 1 1 100%;
}

.ros-Plot-stage {
  border: 1px solid var(--jp-border-color1);
  flex: 1 1 200px;
  margin: 4px 0;
  max-height: 70cqh;
  min-height: 150px;
  overflow: hidden;
  position: relative;
}

.ros-Plot-stage canvas {
  display: block;
  height: 100%;
  left: 0;
  position: absolute;
  top: 0;
  touch-action: none;
  width: 100%;
}

.ros-Plot-stage canvas:focus-visible {
  outline: 3px solid var(--jp-brand-color1);
  outline-offset: -3px;
}

.ros-Plot-series {
  display: grid;
  gap: 2px 16px;
  grid-template-columns: repeat(auto-fill, minmax(min(100%, 280px), 1fr));
  list-style: none;
  margin: 0;
  padding: 0;
}

.ros-Plot-series li {
  align-items: baseline;
  display: flex;
  gap: 2px 8px;
}

.ros-Plot-told {
  display: flex;
  flex: 1 1 auto;
  flex-wrap: wrap;
  gap: 2px 8px;
  min-width: 0;
}

.ros-Plot-series code {
  overflow-wrap: anywhere;
}

.ros-Plot-series output {
  font-variant-numeric: tabular-nums;
  min-width: 5em;
}

/* The colours of course/figures/palette.py, where they have at least 3:1 on the ground (WCAG AA for graphics). */
body {
  --ros-robot-ground: #ffffff;
  --ros-robot-ink: #222222;
  --ros-robot-line: #e8e8e8;
  --ros-robot-front: #00835f;
  --ros-robot-left: #0072b2;
  --ros-robot-right: #a86f00;
  --ros-robot-beam: #d55e00;
  --ros-robot-hit: #b3261e;
  --ros-robot-trail: #767676;
  --ros-robot-body: #8e3f8f;
}

body[data-jp-theme-light='false'] {
  --ros-robot-ground: #161616;
  --ros-robot-ink: #ececec;
  --ros-robot-line: #2c2c2c;
  --ros-robot-front: #2fc79a;
  --ros-robot-left: #56b4e9;
  --ros-robot-right: #e69f00;
  --ros-robot-beam: #ff8b4a;
  --ros-robot-hit: #ff9a90;
  --ros-robot-trail: #9a9a9a;
  --ros-robot-body: #e08bc9;
}
`,""]),e.d(r,{},{A:n})},314(o){o.exports=function(o){var r=[];return r.toString=function(){return this.map(function(r){var e="",t=void 0!==r[5];return r[4]&&(e+="@supports (".concat(r[4],") {")),r[2]&&(e+="@media ".concat(r[2]," {")),t&&(e+="@layer".concat(r[5].length>0?" ".concat(r[5]):""," {")),e+=o(r),t&&(e+="}"),r[2]&&(e+="}"),r[4]&&(e+="}"),e}).join("")},r.i=function(o,e,t,a,i){"string"==typeof o&&(o=[[null,o,void 0]]);var n={};if(t)for(var s=0;s<this.length;s++){var l=this[s][0];null!=l&&(n[l]=!0)}for(var p=0;p<o.length;p++){var d=[].concat(o[p]);t&&n[d[0]]||(void 0!==i&&(void 0===d[5]||(d[1]="@layer".concat(d[5].length>0?" ".concat(d[5]):""," {").concat(d[1],"}")),d[5]=i),e&&(d[2]&&(d[1]="@media ".concat(d[2]," {").concat(d[1],"}")),d[2]=e),a&&(d[4]?(d[1]="@supports (".concat(d[4],") {").concat(d[1],"}"),d[4]=a):d[4]="".concat(a)),r.push(d))}},r}},601(o){o.exports=function(o){return o[1]}},72(o){var r=[];function e(o){for(var e=-1,t=0;t<r.length;t++)if(r[t].identifier===o){e=t;break}return e}function t(o,t){for(var a={},i=[],n=0;n<o.length;n++){var s=o[n],l=t.base?s[0]+t.base:s[0],p=a[l]||0,d="".concat(l," ").concat(p);a[l]=p+1;var c=e(d),h={css:s[1],media:s[2],sourceMap:s[3],supports:s[4],layer:s[5]};if(-1!==c)r[c].references++,r[c].updater(h);else{var m=function(o,r){var e=r.domAPI(r);return e.update(o),function(r){r?(r.css!==o.css||r.media!==o.media||r.sourceMap!==o.sourceMap||r.supports!==o.supports||r.layer!==o.layer)&&e.update(o=r):e.remove()}}(h,t);t.byIndex=n,r.splice(n,0,{identifier:d,updater:m,references:1})}i.push(d)}return i}o.exports=function(o,a){var i=t(o=o||[],a=a||{});return function(o){o=o||[];for(var n=0;n<i.length;n++){var s=e(i[n]);r[s].references--}for(var l=t(o,a),p=0;p<i.length;p++){var d=e(i[p]);0===r[d].references&&(r[d].updater(),r.splice(d,1))}i=l}}},659(o){var r={};o.exports=function(o,e){var t=function(o){if(void 0===r[o]){var e=document.querySelector(o);if(window.HTMLIFrameElement&&e instanceof window.HTMLIFrameElement)try{e=e.contentDocument.head}catch(o){e=null}r[o]=e}return r[o]}(o);if(!t)throw Error("Couldn't find a style target. This probably means that the value for the 'insert' parameter is invalid.");t.appendChild(e)}},540(o){o.exports=function(o){var r=document.createElement("style");return o.setAttributes(r,o.attributes),o.insert(r,o.options),r}},56(o,r,e){o.exports=function(o){var r=e.nc;r&&o.setAttribute("nonce",r)}},825(o){o.exports=function(o){if("u"<typeof document)return{update:function(){},remove:function(){}};var r=o.insertStyleElement(o);return{update:function(e){var t,a,i;t="",e.supports&&(t+="@supports (".concat(e.supports,") {")),e.media&&(t+="@media ".concat(e.media," {")),(a=void 0!==e.layer)&&(t+="@layer".concat(e.layer.length>0?" ".concat(e.layer):""," {")),t+=e.css,a&&(t+="}"),e.media&&(t+="}"),e.supports&&(t+="}"),(i=e.sourceMap)&&"u">typeof btoa&&(t+="\n/*# sourceMappingURL=data:application/json;base64,".concat(btoa(unescape(encodeURIComponent(JSON.stringify(i))))," */")),o.styleTagTransform(t,r,o.options)},remove:function(){var o;null===(o=r).parentNode||o.parentNode.removeChild(o)}}}},113(o){o.exports=function(o,r){if(r.styleSheet)r.styleSheet.cssText=o;else{for(;r.firstChild;)r.removeChild(r.firstChild);r.appendChild(document.createTextNode(o))}}},850(o,r,e){var t=e(72),a=e.n(t),i=e(825),n=e.n(i),s=e(659),l=e.n(s),p=e(56),d=e.n(p),c=e(540),h=e.n(c),m=e(113),f=e.n(m),b=e(646),x={};x.styleTagTransform=f(),x.setAttributes=d(),x.insert=l().bind(null,"head"),x.domAPI=n(),x.insertStyleElement=h(),a()(b.A,x),b.A&&b.A.locals&&b.A.locals;var u=e(770),g={};g.styleTagTransform=f(),g.setAttributes=d(),g.insert=l().bind(null,"head"),g.domAPI=n(),g.insertStyleElement=h(),a()(u.A,g),u.A&&u.A.locals&&u.A.locals}}]);