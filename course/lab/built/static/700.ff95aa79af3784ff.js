"use strict";(self.rspackChunkros2_course_lab=self.rspackChunkros2_course_lab||[]).push([[700],{646(o,e,r){var t=r(601),n=r.n(t),a=r(314),s=(r.n(a))()(n());s.push([o.id,`/* The course's part of JupyterLab, in the colours of its theme. */

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
`,""]),r.d(e,{},{A:s})},314(o){o.exports=function(o){var e=[];return e.toString=function(){return this.map(function(e){var r="",t=void 0!==e[5];return e[4]&&(r+="@supports (".concat(e[4],") {")),e[2]&&(r+="@media ".concat(e[2]," {")),t&&(r+="@layer".concat(e[5].length>0?" ".concat(e[5]):""," {")),r+=o(e),t&&(r+="}"),e[2]&&(r+="}"),e[4]&&(r+="}"),r}).join("")},e.i=function(o,r,t,n,a){"string"==typeof o&&(o=[[null,o,void 0]]);var s={};if(t)for(var i=0;i<this.length;i++){var l=this[i][0];null!=l&&(s[l]=!0)}for(var p=0;p<o.length;p++){var d=[].concat(o[p]);t&&s[d[0]]||(void 0!==a&&(void 0===d[5]||(d[1]="@layer".concat(d[5].length>0?" ".concat(d[5]):""," {").concat(d[1],"}")),d[5]=a),r&&(d[2]&&(d[1]="@media ".concat(d[2]," {").concat(d[1],"}")),d[2]=r),n&&(d[4]?(d[1]="@supports (".concat(d[4],") {").concat(d[1],"}"),d[4]=n):d[4]="".concat(n)),e.push(d))}},e}},601(o){o.exports=function(o){return o[1]}},72(o){var e=[];function r(o){for(var r=-1,t=0;t<e.length;t++)if(e[t].identifier===o){r=t;break}return r}function t(o,t){for(var n={},a=[],s=0;s<o.length;s++){var i=o[s],l=t.base?i[0]+t.base:i[0],p=n[l]||0,d="".concat(l," ").concat(p);n[l]=p+1;var c=r(d),f={css:i[1],media:i[2],sourceMap:i[3],supports:i[4],layer:i[5]};if(-1!==c)e[c].references++,e[c].updater(f);else{var u=function(o,e){var r=e.domAPI(e);return r.update(o),function(e){e?(e.css!==o.css||e.media!==o.media||e.sourceMap!==o.sourceMap||e.supports!==o.supports||e.layer!==o.layer)&&r.update(o=e):r.remove()}}(f,t);t.byIndex=s,e.splice(s,0,{identifier:d,updater:u,references:1})}a.push(d)}return a}o.exports=function(o,n){var a=t(o=o||[],n=n||{});return function(o){o=o||[];for(var s=0;s<a.length;s++){var i=r(a[s]);e[i].references--}for(var l=t(o,n),p=0;p<a.length;p++){var d=r(a[p]);0===e[d].references&&(e[d].updater(),e.splice(d,1))}a=l}}},659(o){var e={};o.exports=function(o,r){var t=function(o){if(void 0===e[o]){var r=document.querySelector(o);if(window.HTMLIFrameElement&&r instanceof window.HTMLIFrameElement)try{r=r.contentDocument.head}catch(o){r=null}e[o]=r}return e[o]}(o);if(!t)throw Error("Couldn't find a style target. This probably means that the value for the 'insert' parameter is invalid.");t.appendChild(r)}},540(o){o.exports=function(o){var e=document.createElement("style");return o.setAttributes(e,o.attributes),o.insert(e,o.options),e}},56(o,e,r){o.exports=function(o){var e=r.nc;e&&o.setAttribute("nonce",e)}},825(o){o.exports=function(o){if("u"<typeof document)return{update:function(){},remove:function(){}};var e=o.insertStyleElement(o);return{update:function(r){var t,n,a;t="",r.supports&&(t+="@supports (".concat(r.supports,") {")),r.media&&(t+="@media ".concat(r.media," {")),(n=void 0!==r.layer)&&(t+="@layer".concat(r.layer.length>0?" ".concat(r.layer):""," {")),t+=r.css,n&&(t+="}"),r.media&&(t+="}"),r.supports&&(t+="}"),(a=r.sourceMap)&&"u">typeof btoa&&(t+="\n/*# sourceMappingURL=data:application/json;base64,".concat(btoa(unescape(encodeURIComponent(JSON.stringify(a))))," */")),o.styleTagTransform(t,e,o.options)},remove:function(){var o;null===(o=e).parentNode||o.parentNode.removeChild(o)}}}},113(o){o.exports=function(o,e){if(e.styleSheet)e.styleSheet.cssText=o;else{for(;e.firstChild;)e.removeChild(e.firstChild);e.appendChild(document.createTextNode(o))}}},959(o,e,r){var t=r(72),n=r.n(t),a=r(825),s=r.n(a),i=r(659),l=r.n(i),p=r(56),d=r.n(p),c=r(540),f=r.n(c),u=r(113),m=r.n(u),h=r(646),g={};g.styleTagTransform=m(),g.setAttributes=d(),g.insert=l().bind(null,"head"),g.domAPI=s(),g.insertStyleElement=f(),n()(h.A,g),h.A&&h.A.locals&&h.A.locals}}]);