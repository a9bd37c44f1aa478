// Loaded before the proxy of a class (configurable-http-proxy 5).
import { readFileSync } from "node:fs";
import { Server } from "node:net";
import { dirname, join } from "node:path";
import { pathToFileURL } from "node:url";

const page = readFileSync(new URL("nothing_answers.html", import.meta.url));
const proxy = await import(pathToFileURL(join(dirname(process.argv[1]), "..", "lib", "configproxy.js")));

// The page that it shows when neither a server nor the hub answers, in place of the two words "Service Unavailable".
proxy.default.prototype._handleProxyErrorDefault = function (code, kind, request, response) {
  if (response.writableEnded) return;
  if (!response.headersSent && response.writeHead) response.writeHead(code, { "Content-Type": "text/html; charset=utf-8" });
  if (response.end) response.end(page);
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
