// The way to the daemon: calls, streams and telemetry. Every page of the console uses this module alone.
//
//   await rpc('RigService/GetRigState', {})            one answer; throws a RpcError
//   const s = stream('PoseService/Subscribe', {}, {message, end}); s.close()
//   const t = telemetry({columns, start, rows, end}); t.close()
//   onLink(({state}) => …)                             'live', 'lost' or 'signed out'
//
// Fields have the names of the contract; 64-bit numbers come as text: Number() them.

const PACKAGE = 'hapticd.v1.';
const SILENT_MS = 1500; // the daemon says something every 500 ms
const RETRY_MS = 700;
const AT_ONCE = 3; // calls; a browser has six connections, and Stop needs one

export class RpcError extends Error {
  constructor(end) {
    super(end.detail?.what || end.message || end.code);
    this.code = end.code; // "FAILED_PRECONDITION"
    this.detail = end.detail || {}; // what, where, value, limit, remedy, reason
    this.remedy = this.detail.remedy || '';
  }
}

let leaseToken = '';
export const setLease = (token) => { leaseToken = token || ''; };
export const hasLease = () => leaseToken !== '';

let running = 0;
const waiting = [];
const enter = () => running < AT_ONCE ? (running++, Promise.resolve()) : new Promise((go) => waiting.push(go));
const leave = () => { const next = waiting.shift(); if (next) next(); else running--; };

async function post(method, request, options = {}) {
  const headers = {'Content-Type': 'application/json', 'X-Hapticd': '1'};
  if (leaseToken) headers['X-Hapticd-Lease'] = leaseToken;
  let answer;
  try {
    answer = await fetch('/rpc/' + PACKAGE + method, {method: 'POST', headers, body: JSON.stringify(request), ...options});
  } catch {
    throw new RpcError({code: 'UNAVAILABLE', message: 'the daemon does not answer'});
  }
  const json = await answer.json().catch(() => ({code: 'INTERNAL', message: answer.statusText}));
  if (answer.ok) return json;
  if (answer.status === 401) setLink('signed out');
  throw new RpcError(json);
}

// Makes one call. `request` in proto3 JSON.
export async function rpc(method, request = {}) {
  await enter();
  try {
    return await post(method, request);
  } finally {
    leave();
  }
}

// Zero force from the next tick on. Waits for no other call and needs no socket.
export const stop = () => post('SafetyService/Stop', {}, {keepalive: true, priority: 'high'});

// ---------------------------------------------------------------- the socket

let socket = null;
let nextId = 1;
let heardAt = 0;
let link = 'lost';
const open = new Map(); // id → what to do with its messages
const linkListeners = new Set();

function setLink(state) {
  if (state === link) return;
  link = state;
  for (const call of linkListeners) call({state});
}

// Adds a function that is called with the present state at once. Returns a function that ends it.
export function onLink(call) {
  linkListeners.add(call);
  call({state: link});
  connect();
  return () => linkListeners.delete(call);
}

const tell = (message) => { if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message)); };

function connect() {
  if (socket || link === 'signed out') return;
  const own = new WebSocket(location.origin.replace(/^http/, 'ws') + '/live');
  own.binaryType = 'arraybuffer';
  socket = own;
  heardAt = performance.now();
  own.onmessage = ({data}) => {
    if (own !== socket) return;
    heardAt = performance.now();
    setLink('live');
    if (data instanceof ArrayBuffer) {
      const numbers = new Float64Array(data);
      open.get(numbers[0])?.binary?.(numbers);
      return;
    }
    const message = JSON.parse(data);
    if (message.id) open.get(message.id)?.text(message);
  };
  own.onopen = () => { for (const [id, entry] of open) entry.begin(id); };
  own.onclose = () => { if (own === socket) drop(); };
}

function drop() {
  const old = socket;
  socket = null;
  if (old) {
    old.onclose = old.onmessage = null;
    old.close();
  }
  if (link !== 'signed out') setLink('lost');
  for (const entry of open.values()) entry.lost?.();
  setTimeout(async () => {
    // A socket does not say why it was refused: an answer to a plain request does.
    try {
      if ((await fetch('/console.css', {method: 'HEAD', cache: 'no-store'})).ok && link !== 'signed out') {
        await post('AccessService/GetAccess', {});
      }
    } catch { /* not there yet */ }
    connect();
  }, RETRY_MS);
}

setInterval(() => { if (socket && performance.now() - heardAt > SILENT_MS) drop(); }, 250);

// Opens now, and again whenever the daemon was away. `again: false`: ends instead.
function subscribe(entry) {
  const id = nextId++;
  open.set(id, entry);
  connect();
  if (socket?.readyState === WebSocket.OPEN) entry.begin(id);
  return {close: () => { if (open.delete(id)) tell({close: id}); }};
}

// Opens a stream of answers. message(m) for each, end(RpcError or null) once.
export function stream(method, request, {message, end, credits = 8, again = false}) {
  let handle = null;
  let pending = 0;
  const finish = (error) => { open.delete(handle.id); end?.(error); };
  const entry = {
    begin: (id) => {
      if (entry.begun && !again) return finish(new RpcError({code: 'UNAVAILABLE', message: 'the connection was lost'}));
      entry.begun = true;
      pending = 0;
      tell({open: id, method: PACKAGE + method, request, credits, ...(leaseToken ? {lease: leaseToken} : {})});
    },
    text: (m) => {
      if (m.end) {
        finish(m.end.code === 'OK' ? null : new RpcError(m.end));
        return;
      }
      message(m.message);
      if (++pending >= credits / 2) {
        tell({credit: m.id, n: pending});
        pending = 0;
      }
    },
  };
  handle = {id: nextId, ...subscribe(entry)};
  return handle;
}

// Rows of the telemetry. `columns`: names, all where it is left out.
//   start({columns: [{name, unit}], rate_hz})  first, and after each loss of the connection
//   rows({data, count, width, samples, lost, merged})  data: Float64Array row by row, valid during the call;
//     samples > 1: rows come in pairs, minima then maxima of 2 × samples ticks, as this page was too slow
//   end(RpcError)  e.g. a column that does not exist
export function telemetry({columns = [], start, rows, end, maxRows = 512, hiddenMs = 1000}) {
  let width = 0;
  let id = 0;
  const credit = () => tell({credit: id, n: 1});
  const entry = {
    begin: (own) => {
      id = own;
      tell({telemetry: own, columns, max_rows: maxRows, credits: 2});
    },
    text: (m) => {
      if (m.end) {
        open.delete(id);
        end?.(new RpcError(m.end));
        return;
      }
      width = m.columns.length;
      start?.({columns: m.columns, rate_hz: m.rate_hz});
    },
    binary: (numbers) => {
      const [, count, samples, lost, merged] = numbers;
      if (width) rows({data: numbers.subarray(5), count, width, samples, lost, merged});
      // The next one when this page draws again: what it cannot draw it need not get.
      if (document.hidden) setTimeout(credit, hiddenMs); else requestAnimationFrame(credit);
    },
  };
  return subscribe(entry);
}
