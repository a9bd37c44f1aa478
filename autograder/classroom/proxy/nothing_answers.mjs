// Loaded before the proxy of a class (configurable-http-proxy 5): the page that it shows when neither a server nor the
// hub answers, in place of the two words "Service Unavailable".
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { pathToFileURL } from "node:url";

const page = readFileSync(new URL("nothing_answers.html", import.meta.url));
const proxy = await import(pathToFileURL(join(dirname(process.argv[1]), "..", "lib", "configproxy.js")));

proxy.default.prototype._handleProxyErrorDefault = function (code, kind, request, response) {
  if (response.writableEnded) return;
  if (!response.headersSent && response.writeHead) response.writeHead(code, { "Content-Type": "text/html; charset=utf-8" });
  if (response.end) response.end(page);
};
