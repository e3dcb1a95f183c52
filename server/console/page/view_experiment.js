// What an experimenter may see while a session runs: whether presentations are valid and safe, never how stiff they are.

import {telemetry} from '/api.js';
import {card, count, el, facts, fill, table, word} from '/ui.js';

const FLAWS = ['pressed too fast', 'moved sideways', 'touched too fast', 'too many contacts', 'too long a way sideways', 'never touched', 'the guard acted', 'ticks were lost'];
const GUIDE = ['–', '', 'leads', 'arrived', 'in contact', 'resisted', 'forbidden', 'timed out', 'stopped'];

export function show(place, {rig}) {
  document.body.classList.add('blind');
  let gone = false, last = 0, flaws = 0, number = 0;
  const past = [];
  const now = facts([['presentation', 'presentation'], ['contact', 'tool'], ['flaws', 'flaws so far'], ['guide', 'guide'], ['guard', 'guard'], ['recording', 'recording']]);
  const list = el('div'), hint = el('p', {class: 'hint'});
  const address = el('input', {type: 'url', size: '48', placeholder: 'http://127.0.0.1:…/experimenter?key=…', 'aria-label': 'address of the session'});
  address.value = localStorage.getItem('session') || '';
  const link = el('a', {target: '_blank', rel: 'noopener noreferrer'}, 'open the session in a new tab');
  const renew = () => {
    const good = /^https?:\/\//.test(address.value);
    link.hidden = !good;
    if (good) link.href = address.value;
    localStorage.setItem('session', address.value);
  };
  address.addEventListener('input', renew);
  renew();
  place.append(el('div', {class: 'grid'},
    card('Now', now, hint),
    card('Presentations seen here', list),
    card('The session', el('p', {}, 'Procedure, answers and journal belong to ', el('code', {}, 'hapticctl experiment run'), '. It prints two addresses: the participant’s and the experimenter’s. Paste the second one:'),
      el('div', {class: 'row'}, address), link)));
  const showPast = () => fill(list, past.length ? table(['number', 'flaws'], past.map((one) => [count(one.number), one.flaws.join(', ') || 'none'])) : el('p', {class: 'muted'}, 'None yet.'));
  const names = (bits) => FLAWS.filter((_, i) => bits & (1 << i));
  const subscription = telemetry({
    columns: ['assist_presentation', 'assist_presentation_flaws', 'assist_guide_state', 'contact_in_contact'], maxRows: 32,
    rows: ({data, count: n, width}) => {
      if (!n || gone) return;
      const [presentation, bits, guide, contact] = data.subarray((n - 1) * width);
      number = presentation || 0;
      if (last && !number) {
        past.unshift({number: last, flaws: names(flaws)});
        past.length = Math.min(past.length, 50);
        showPast();
      }
      last = number;
      flaws = bits || 0;
      now.set('presentation', Number.isNaN(presentation) ? 'this scene judges none' : number ? `number ${number} runs` : 'none runs');
      now.set('flaws', names(flaws).join(', ') || 'none');
      now.set('guide', GUIDE[guide] || '–');
      now.set('contact', contact ? 'touches' : 'is free');
    },
  });
  const update = (state) => {
    if (!state) return;
    now.set('guard', word(state.guard_state, 'GUARD_STATE_'));
    now.set('recording', state.recording || 'none runs');
    hint.textContent = 'Force and stiffness are hidden in this view.';
  };
  rig.listeners.add(update);
  update(rig.state);
  showPast();
  return () => {
    gone = true;
    document.body.classList.remove('blind');
    subscription.close();
    rig.listeners.delete(update);
  };
}
