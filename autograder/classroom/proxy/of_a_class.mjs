// Loaded before the proxy of a class (configurable-http-proxy 5).
import { readFileSync } from "node:fs";
import { Server } from "node:net";
import { dirname, join } from "node:path";
import { pathToFileURL } from "node:url";

const page = readFileSync(new URL("nothing_answers.html", import.meta.url));
const elsewhere = readFileSync(new URL("other_address.html", import.meta.url));
const proxy = await import(pathToFileURL(join(dirname(process.argv[1]), "..", "lib", "configproxy.js")));

// The page that it shows when neither a server nor the hub answers, in place of the two words "Service Unavailable".
proxy.default.prototype._handleProxyErrorDefault = function (code, kind, request, response) {
  if (response.writableEnded) return;
  if (!response.headersSent && response.writeHead) response.writeHead(code, { "Content-Type": "text/html; charset=utf-8" });
  if (response.end) response.end(page);
};

// The names at which it answers, from the query of this file's URL: `only` this one, or none that ends with `never`.
// Browsers send the cookies of a name to each of its ports, so a page at another's name would get and set theirs.
const names = new URL(import.meta.url).searchParams;
const only = names.get("only");
const never = names.get("never");
const { handleProxy } = proxy.default.prototype;

function isOwn(request) {
  const name = (request.headers.host ?? "").toLowerCase().replace(/:\d*$/, "").replace(/\.+$/, "");
  return only ? name === only : !(never && name.endsWith(never));
}

proxy.default.prototype.handleProxy = function (kind, request, response, ...others) {
  if (isOwn(request)) return handleProxy.call(this, kind, request, response, ...others);
  if (kind === "web") response.writeHead(404, { "Content-Type": "text/html; charset=utf-8" }).end(elsewhere);
  else response.on("error", () => {}).end("HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
};

// Connections of one address at a time. A request that is passed on takes two of the process's 20,000 descriptors.
const MOST = 2000;
const { listen } = Server.prototype;

Server.prototype.listen = function (...where) {
  const open = new Map();
  this.on("connection", (socket) => {
    const from = socket.remoteAddress;
    if (!from) return; // a Unix socket
    const others = open.get(from) ?? 0;
    if (others >= MOST) return socket.destroy();
    open.set(from, others + 1);
    socket.once("close", () => {
      if (open.get(from) > 1) open.set(from, open.get(from) - 1);
      else open.delete(from);
    });
  });
  return listen.apply(this, where);
};
