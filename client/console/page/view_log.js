// What happened on the rig, from the daemon's start on: the same events as in recordings.

import {stream} from '/api.js';
import {action, card, clockTime, count, download, el, errorBox, fill, setText, table, unseen, word} from '/ui.js';

const SHOWN = 300;
const KEPT = 5000;
const KINDS = ['scene', 'target', 'fault', 'cleared', 'stop', 'lease', 'turntable', 'annotation', 'loss', 'command', 'overrun', 'end',
  'recording', 'incident', 'identification', 'sensor', 'daemon'];
const GROUPS = [['why', 'why there was no force', ['fault', 'cleared', 'stop', 'incident', 'overrun', 'daemon']], ['who', 'who did what', ['scene', 'target', 'stop', 'lease', 'command', 'sensor', 'recording', 'annotation']]];

export function show(place) {
  let events = [], gone = false, later = 0;
  const list = el('div'), hint = el('p', {class: 'hint', role: 'status'}), trouble = el('div');
  const find = el('input', {type: 'search', placeholder: 'find', 'aria-label': 'find in the log', oninput: () => draw()});
  const kind = el('select', {'aria-label': 'kind of events', onchange: () => draw()}, el('option', {value: ''}, 'all kinds'),
    GROUPS.map(([key, title]) => el('option', {value: key}, title)), KINDS.map((one) => el('option', {value: one}, one)));
  const follow = el('input', {type: 'checkbox', checked: true, onchange: () => draw()});

  function wanted() {
    const text = find.value.toLowerCase();
    const kinds = GROUPS.find(([key]) => key === kind.value)?.[2] || (kind.value ? [kind.value] : null);
    return events.filter((one) => (!kinds || kinds.includes(one.kind)) && `${one.kind} ${one.text} ${one.by}`.toLowerCase().includes(text)).sort((a, b) => b.at - a.at || b.number - a.number);
  }
  function draw() {
    later = 0;
    const found = wanted();
    setText(hint, found.length > SHOWN ? `The newest ${SHOWN} of ${count(found.length)}.` : `${count(found.length)} of ${count(events.length)} events.`);
    fill(list, found.length ? table(['time', 'what', unseen('text'), 'who'], found.slice(0, SHOWN).map((one) => [
      el('span', {class: 'time', title: `tick ${one.tick}`}, one.time), el('span', {class: `kind ${one.severity}`}, one.kind), el('span', {class: 'anywhere'}, one.text), el('span', {class: 'muted'}, one.by)]), {label: 'events, the newest first'})
      : el('p', {class: 'muted'}, 'None of these.'));
  }
  function take({events: some = []}) {
    if (gone) return;
    for (const {number, severity, event} of some) {
      // After a loss of the connection all come again; those of another run of the daemon begin at 1.
      const last = events.at(-1);
      if (last && Number(number) <= last.number) events = [];
      events.push({number: Number(number), severity: word(severity, 'EVENT_SEVERITY_'), kind: word(event.kind, 'RECORDING_EVENT_KIND_'), at: Number(event.unix_ns), time: clockTime(event.unix_ns),
        unix_ns: event.unix_ns, tick: event.tick, text: event.text, by: event.by});
    }
    events = events.slice(-KEPT);
    if (follow.checked) draw(); else setText(hint, `${count(later += some.length)} more since. Follow to see them.`);
  }
  const csv = (text) => `"${text.replaceAll('"', '""')}"`;
  const save = async () => {
    download('log.csv', 'text/csv', 'number,unix_ns,tick,kind,severity,by,text\n', wanted().reverse().map((one) =>
      [one.number, one.unix_ns, one.tick, one.kind, one.severity, csv(one.by), csv(one.text)].join() + '\n').join(''));
  };
  place.append(card('Since the daemon started', el('div', {class: 'row'}, find, kind, el('label', {}, follow, 'follow'), action('Save as CSV', save, trouble)),
    hint, trouble, list));
  const open = stream('EventService/WatchEvents', {}, {message: take, end: (error) => { if (error && !gone) fill(trouble, errorBox(error)); }, again: true});
  draw();
  return () => {
    gone = true;
    open.close();
  };
}
