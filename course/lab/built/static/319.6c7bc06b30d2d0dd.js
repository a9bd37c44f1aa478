"use strict";(self.rspackChunkros2_course_lab=self.rspackChunkros2_course_lab||[]).push([[319],{770(o,r,e){var a=e(601),t=e.n(a),n=e(314),s=(e.n(n))()(t());s.push([o.id,`/* The inspector and the graph. */

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

.ros-Form p {
  margin: 0;
}

.ros-Form h3,
.ros-Graph h3 {
  margin-top: 8px;
}

.ros-type,
.ros-Form-field label {
  overflow-wrap: anywhere;
}

.ros-Form-value {
  display: flex;
  flex-wrap: wrap;
  gap: 4px;
}

.ros-Form-value input:not([type='checkbox']) {
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
.ros-Code .ros-mod-wrap {
  overflow-wrap: anywhere;
  white-space: pre-wrap;
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

.ros-Flows {
  display: flex;
  flex-direction: column;
  gap: 6px;
}
`,""]),e.d(r,{},{A:s})},646(o,r,e){var a=e(601),t=e.n(a),n=e(314),s=(e.n(n))()(t());s.push([o.id,`/* The course's part of JupyterLab, in the colours of its theme. */

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
  gap: 8px;
  justify-content: space-between;
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
.ros-Panel input {
  background: var(--jp-layout-color2);
  border: 1px solid var(--jp-border-color0);
  border-radius: 3px;
  color: var(--jp-ui-font-color0);
  font: inherit;
  min-height: 24px;
  padding: 1px 8px;
}

.ros-Panel button:not(:disabled) {
  cursor: pointer;
}

.ros-Panel button:disabled {
  opacity: 0.5;
}

.ros-Panel :is(button, select, input, summary, [tabindex]):focus-visible {
  outline: 2px solid var(--jp-brand-color1);
  outline-offset: 1px;
}

.ros-Nodes {
  flex: 1 1 auto;
  list-style: none;
  margin: 0;
  min-height: 120px;
  overflow: auto;
  padding: 0;
}

.ros-Node {
  border-bottom: 1px solid var(--jp-border-color2);
  padding: 4px 0;
}

.ros-Node-row {
  align-items: center;
  display: flex;
  flex-wrap: wrap;
  gap: 4px 8px;
  justify-content: space-between;
}

.ros-Node-name {
  align-items: baseline;
  background: none;
  border: 0;
  color: inherit;
  display: flex;
  flex: 1 1 130px;
  font: inherit;
  gap: 6px;
  min-height: 24px;
  min-width: 0;
  padding: 0;
  text-align: left;
}

.ros-Node-name .ros-name {
  font-family: var(--jp-code-font-family);
  overflow-wrap: anywhere;
}

.ros-state {
  font-size: var(--jp-ui-font-size0);
}

.ros-buttons {
  display: flex;
  gap: 4px;
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

.ros-Log {
  display: flex;
  flex: 1 1 50%;
  flex-direction: column;
  margin-top: 8px;
  min-height: 180px;
}

.ros-Log-head {
  align-items: center;
  display: flex;
  flex-wrap: wrap;
  gap: 4px 8px;
}

.ros-Log-head select {
  max-width: 100%;
}

.ros-Log-head input {
  flex: 1 1 80px;
  min-width: 60px;
}

.ros-Log-lost {
  font-weight: 600;
}

.ros-Log-lines {
  border: 1px solid var(--jp-border-color2);
  flex: 1 1 auto;
  font-family: var(--jp-code-font-family);
  font-size: var(--jp-code-font-size);
  margin-top: 4px;
  min-height: 80px;
  overflow: auto;
  overflow-wrap: anywhere;
  white-space: pre-wrap;
}

.ros-Log-line {
  padding: 0 4px;
}

.ros-Log-line .ros-level,
.ros-Log-line .ros-source {
  font-weight: 600;
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

.ros-Parts li {
  align-items: baseline;
  border-bottom: 1px solid var(--jp-border-color2);
  display: flex;
  gap: 6px;
  padding: 4px 0;
}

.ros-part {
  flex: 1 1 auto;
  min-width: 0;
  overflow-wrap: anywhere;
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

.ros-note {
  color: var(--ros-warn);
  font-weight: 600;
}

.ros-hint {
  overflow: auto;
  padding: 0 4px;
}
`,""]),e.d(r,{},{A:s})},314(o){o.exports=function(o){var r=[];return r.toString=function(){return this.map(function(r){var e="",a=void 0!==r[5];return r[4]&&(e+="@supports (".concat(r[4],") {")),r[2]&&(e+="@media ".concat(r[2]," {")),a&&(e+="@layer".concat(r[5].length>0?" ".concat(r[5]):""," {")),e+=o(r),a&&(e+="}"),r[2]&&(e+="}"),r[4]&&(e+="}"),e}).join("")},r.i=function(o,e,a,t,n){"string"==typeof o&&(o=[[null,o,void 0]]);var s={};if(a)for(var i=0;i<this.length;i++){var l=this[i][0];null!=l&&(s[l]=!0)}for(var p=0;p<o.length;p++){var d=[].concat(o[p]);a&&s[d[0]]||(void 0!==n&&(void 0===d[5]||(d[1]="@layer".concat(d[5].length>0?" ".concat(d[5]):""," {").concat(d[1],"}")),d[5]=n),e&&(d[2]&&(d[1]="@media ".concat(d[2]," {").concat(d[1],"}")),d[2]=e),t&&(d[4]?(d[1]="@supports (".concat(d[4],") {").concat(d[1],"}"),d[4]=t):d[4]="".concat(t)),r.push(d))}},r}},601(o){o.exports=function(o){return o[1]}},72(o){var r=[];function e(o){for(var e=-1,a=0;a<r.length;a++)if(r[a].identifier===o){e=a;break}return e}function a(o,a){for(var t={},n=[],s=0;s<o.length;s++){var i=o[s],l=a.base?i[0]+a.base:i[0],p=t[l]||0,d="".concat(l," ").concat(p);t[l]=p+1;var c=e(d),f={css:i[1],media:i[2],sourceMap:i[3],supports:i[4],layer:i[5]};if(-1!==c)r[c].references++,r[c].updater(f);else{var m=function(o,r){var e=r.domAPI(r);return e.update(o),function(r){r?(r.css!==o.css||r.media!==o.media||r.sourceMap!==o.sourceMap||r.supports!==o.supports||r.layer!==o.layer)&&e.update(o=r):e.remove()}}(f,a);a.byIndex=s,r.splice(s,0,{identifier:d,updater:m,references:1})}n.push(d)}return n}o.exports=function(o,t){var n=a(o=o||[],t=t||{});return function(o){o=o||[];for(var s=0;s<n.length;s++){var i=e(n[s]);r[i].references--}for(var l=a(o,t),p=0;p<n.length;p++){var d=e(n[p]);0===r[d].references&&(r[d].updater(),r.splice(d,1))}n=l}}},659(o){var r={};o.exports=function(o,e){var a=function(o){if(void 0===r[o]){var e=document.querySelector(o);if(window.HTMLIFrameElement&&e instanceof window.HTMLIFrameElement)try{e=e.contentDocument.head}catch(o){e=null}r[o]=e}return r[o]}(o);if(!a)throw Error("Couldn't find a style target. This probably means that the value for the 'insert' parameter is invalid.");a.appendChild(e)}},540(o){o.exports=function(o){var r=document.createElement("style");return o.setAttributes(r,o.attributes),o.insert(r,o.options),r}},56(o,r,e){o.exports=function(o){var r=e.nc;r&&o.setAttribute("nonce",r)}},825(o){o.exports=function(o){if("u"<typeof document)return{update:function(){},remove:function(){}};var r=o.insertStyleElement(o);return{update:function(e){var a,t,n;a="",e.supports&&(a+="@supports (".concat(e.supports,") {")),e.media&&(a+="@media ".concat(e.media," {")),(t=void 0!==e.layer)&&(a+="@layer".concat(e.layer.length>0?" ".concat(e.layer):""," {")),a+=e.css,t&&(a+="}"),e.media&&(a+="}"),e.supports&&(a+="}"),(n=e.sourceMap)&&"u">typeof btoa&&(a+="\n/*# sourceMappingURL=data:application/json;base64,".concat(btoa(unescape(encodeURIComponent(JSON.stringify(n))))," */")),o.styleTagTransform(a,r,o.options)},remove:function(){var o;null===(o=r).parentNode||o.parentNode.removeChild(o)}}}},113(o){o.exports=function(o,r){if(r.styleSheet)r.styleSheet.cssText=o;else{for(;r.firstChild;)r.removeChild(r.firstChild);r.appendChild(document.createTextNode(o))}}},850(o,r,e){var a=e(72),t=e.n(a),n=e(825),s=e.n(n),i=e(659),l=e.n(i),p=e(56),d=e.n(p),c=e(540),f=e.n(c),m=e(113),x=e.n(m),u=e(646),h={};h.styleTagTransform=x(),h.setAttributes=d(),h.insert=l().bind(null,"head"),h.domAPI=s(),h.insertStyleElement=f(),t()(u.A,h),u.A&&u.A.locals&&u.A.locals;var g=e(770),v={};v.styleTagTransform=x(),v.setAttributes=d(),v.insert=l().bind(null,"head"),v.domAPI=s(),v.insertStyleElement=f(),t()(g.A,v),g.A&&g.A.locals&&g.A.locals}}]);