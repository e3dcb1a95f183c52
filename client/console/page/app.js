// The frame of the console: views by the address's #, the rig's state at the top, Stop.

import {onLink, rpc, stop} from '/api.js';
import {el, errorBox, fill, num, setText, word} from '/ui.js';
import {leaseButton} from '/lease.js';

const VIEWS = [
  ['now', 'Now'], ['live', 'Live'], ['scene', 'Scene and target'], ['identify', 'Identify'], ['objects', 'Objects'],
  ['turntable', 'Turntable'], ['recordings', 'Recordings'], ['experiment', 'Experiment'], ['poses', 'Poses'], ['log', 'Log'],
];
const STATE_MS = 500;

const at = (id) => document.getElementById(id);
const main = at('main');

// What views share: the last state of the rig, and who wants to hear of it.
export const rig = {info: null, state: null, access: null, listeners: new Set()};

// ---------------------------------------------------------------- views

let leaveView = null;
let shown = '';

async function show() {
  const [name, ...rest] = (location.hash.slice(1) || 'now').split('/');
  const entry = VIEWS.find(([key]) => key === name) || VIEWS[0];
  if (shown === location.hash && leaveView) return;
  shown = location.hash;
  leaveView?.();
  leaveView = null;
  for (const link of at('nav').children) {
    if (link.dataset.view === entry[0]) link.setAttribute('aria-current', 'page'); else link.removeAttribute('aria-current');
  }
  document.title = `${entry[1]} · hapticd`;
  const place = el('div', {class: `view ${entry[0]}`}, el('h1', {}, entry[1]));
  fill(main, place);
  const here = shown;
  try {
    const view = await import(`/view_${entry[0]}.js`);
    if (here !== shown) return;
    leaveView = view.show(place, {rig, argument: decodeURIComponent(rest.join('/'))}) || (() => {});
  } catch (error) {
    place.append(errorBox(error));
  }
}

fill(at('nav'), VIEWS.map(([key, title], i) =>
  el('a', {href: '#' + key, 'data-view': key, title: `${title} (Alt+${(i + 1) % 10})`}, title)));
addEventListener('hashchange', () => { show(); main.focus({preventScroll: true}); });

// ---------------------------------------------------------------- Stop

let stoppedAt = 0;

async function stopNow() {
  const begun = performance.now();
  const button = at('stop');
  button.classList.add('pressed');
  try {
    const done = await stop();
    stoppedAt = performance.now();
    button.dataset.ms = (stoppedAt - begun).toFixed(1);
    notice(`Stopped after tick ${done.latched_after_tick} (first by the ${done.path}): no force until it is cleared in the view Now.`, 'stopped');
    await readState();
  } catch (error) {
    notice(`STOP DID NOT REACH THE DAEMON: ${error.message}. Switch the device off.`, 'bad');
  } finally {
    button.classList.remove('pressed');
  }
}

at('stop').addEventListener('click', stopNow);
addEventListener('keydown', (event) => {
  if (event.key === 'Escape' && !event.repeat) {
    event.preventDefault();
    stopNow();
  }
  if (event.altKey && /^[0-9]$/.test(event.key)) {
    location.hash = VIEWS[(Number(event.key) + 9) % 10][0];
    event.preventDefault();
  }
}, {capture: true});

let noticeUntil = 0;
function notice(text, kind) {
  const place = at('notice');
  place.hidden = !text;
  place.className = kind || '';
  setText(place, text);
  noticeUntil = kind === 'stopped' ? performance.now() + 8000 : Infinity;
}

// ---------------------------------------------------------------- state

function stateWords(state) {
  const guard = word(state.guard_state, 'GUARD_STATE_');
  if (!state.loop?.running) return ['loop is down', 'bad'];
  if (guard === 'latched') return [`no force: ${word(state.guard_fault, 'GUARD_FAULT_')}`, 'bad'];
  if (guard === 'suspended') return [`force waits: ${word(state.guard_fault, 'GUARD_FAULT_')}`, 'warn'];
  if (!state.scene) return ['no scene', 'idle'];
  if (guard === 'resuming') return ['force returns', 'warn'];
  return [state.in_contact ? 'rendering, in contact' : 'rendering', 'good'];
}

let link = 'lost';

export async function readState() {
  if (link === 'signed out') return;
  let info = rig.info; // another link may forget it while an answer is waited for
  try {
    info ??= await rpc('RigService/GetRigInfo');
    rig.info = info;
    rig.state = await rpc('RigService/GetRigState', {without_histograms: true});
  } catch (error) {
    rig.state = null;
  }
  const pill = at('state');
  if (rig.state && link !== 'lost') {
    const [text, kind] = stateWords(rig.state);
    setText(pill, text);
    pill.className = `pill ${kind}`;
    setText(at('rig'), info.name);
    setText(at('force'), 'object ' + num(rig.state.reaction_force_n, 'N', 2));
  }
  for (const call of rig.listeners) call(rig.state);
  if (noticeUntil < performance.now()) notice('');
}

function tellLink({state}) {
  link = state;
  const pill = at('state');
  document.body.classList.toggle('away', state !== 'live');
  if (state === 'live') {
    rig.info = null;
    notice('');
    readState();
    return;
  }
  setText(pill, state === 'lost' ? 'not connected' : 'signed out');
  pill.className = 'pill bad';
  setText(at('force'), '');
  notice(state === 'lost' ? 'The daemon does not answer. What is shown is old. It is tried again.'
    : 'This browser is not signed in. Run on the rig’s machine: hapticctl console', 'bad');
}

// ---------------------------------------------------------------- looks

const theme = (name) => {
  document.documentElement.dataset.theme = name;
  localStorage.setItem('theme', name);
  dispatchEvent(new Event('theme'));
};
const dark = () => matchMedia('(prefers-color-scheme: dark)').matches;
if (localStorage.getItem('theme')) theme(localStorage.getItem('theme'));
at('theme').addEventListener('click', () => {
  const now = document.documentElement.dataset.theme || (dark() ? 'dark' : 'light');
  theme(now === 'dark' ? 'light' : 'dark');
});

leaseButton(at('lease'), notice);
show();
let wasLinked = false;
onLink((change) => {
  // The first word is heard a moment after the page is shown: no alarm before.
  if (!wasLinked && change.state === 'lost') return void setTimeout(() => { if (!wasLinked) tellLink({state: link}); }, 1500);
  wasLinked = true;
  tellLink(change);
});
setInterval(() => { if (!document.hidden || performance.now() - stoppedAt < 5000) readState(); }, STATE_MS);
