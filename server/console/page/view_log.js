import {entries, onNote} from '/journal.js';
import {card, download, el, fill, table} from '/ui.js';

export function show(place) {
  const list = el('div', {'aria-live': 'polite'});
  const filter = el('input', {type: 'search', placeholder: 'find', 'aria-label': 'find in the log', oninput: () => draw()});
  const draw = () => {
    const wanted = filter.value.toLowerCase();
    const shown = entries.filter((one) => (one.kind + ' ' + one.text).toLowerCase().includes(wanted)).slice(-300).reverse();
    fill(list, shown.length ? table(['time', 'what', ''], shown.map((one) => [new Date(one.at).toLocaleTimeString(), one.isBad ? el('strong', {}, one.kind) : one.kind, one.text]))
      : el('p', {class: 'muted'}, 'Nothing yet.'));
  };
  place.append(card('Since this tab was opened', el('div', {class: 'row'}, filter, el('button', {type: 'button', onclick: () =>
    download('console_log.csv', 'text/csv', entries.map((one) => `${new Date(one.at).toISOString()},${one.kind},"${one.text.replaceAll('"', '""')}"\n`).join(''))}, 'Save as CSV')),
  el('p', {class: 'hint'}, 'What happened before is in the daemon’s own log and audit log, and around each fault in its incident (view Recordings).'), list));
  draw();
  return onNote(draw);
}
