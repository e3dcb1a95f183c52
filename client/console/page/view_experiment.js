// What an experimenter may see while a session runs: whether presentations are valid and safe, and how far it is; never how stiff they are.

import {rpc, telemetry} from '/api.js';
import {card, count, el, facts, fill, setText, table, word} from '/ui.js';

const POLL_MS = 1000;
const FLAWS = ['pressed too fast', 'moved sideways', 'touched too fast', 'too many contacts', 'too short a path sideways', 'never touched', 'the guard acted', 'ticks were lost'];
const GUIDE = ['–', '', 'leads', 'arrived', 'in contact', 'resisted', 'forbidden', 'timed out', 'stopped'];
const PHASES = {WAITING: 'waits', READY: 'waits for the participant to begin', GUIDED: 'the tool is led', TOUCH: 'the participant touches', QUESTION: 'the question is asked',
  DISCARDED: 'a trial was discarded', REST: 'break', DONE: 'done', ABORTED: 'ended early'};

function sessionCard() {
  const head = el('p', {class: 'big', role: 'status'});
  const done = el('progress', {max: '1', 'aria-label': 'answered conditions'});
  const list = facts([['who', 'participant'], ['condition', 'condition'], ['trial', 'trial'], ['answered', 'trials answered'], ['presented', 'presentations'],
    ['discarded', 'trials discarded'], ['last', 'last presentation'], ['page', 'participant’s page'], ['noise', 'noise'], ['rig', 'rig']]);
  const none = el('p', {class: 'muted'}, 'Begin one with ', el('code', {}, 'hapticctl experiment run'), ' on the machine at which the participant sits.');
  const body = el('div', {}, done, list);
  const update = ({progress, is_running: runs, age_s: age, by}) => {
    body.hidden = !progress;
    none.hidden = Boolean(progress && runs);
    if (!progress) return setText(head, 'No session was begun since the daemon started.');
    const phase = (progress.phase || '').replace('EXPERIMENT_PHASE_', '');
    const over = phase === 'DONE' || phase === 'ABORTED';
    setText(head, over || runs ? (PHASES[phase] || 'begins') + (progress.ended_because ? `: ${progress.ended_because}` : '') : `not heard of for ${Math.round(age)} s`);
    head.className = `big ${phase === 'DONE' ? 'good' : phase === 'ABORTED' || phase === 'DISCARDED' || !(over || runs) ? 'warn' : ''}`;
    done.value = progress.conditions ? Math.max(0, progress.condition - (phase === 'DONE' ? 0 : 1)) / progress.conditions : 0;
    list.set('who', `${progress.participant}, ${progress.protocol} (run by ${by})`);
    list.set('condition', progress.training ? 'training' : progress.condition ? `${progress.condition} of ${progress.conditions}` : '–');
    list.set('trial', progress.trial ? `${progress.trial}${progress.attempt > 1 ? `, attempt ${progress.attempt}` : ''}` : '–');
    for (const key of ['answered', 'presented', 'discarded']) list.set(key, count(progress[key]));
    list.set('last', !progress.presented ? '–' : progress.last_flaws.length ? progress.last_flaws.join(', ').replaceAll('_', ' ') : 'valid');
    list.set('page', progress.page_is_open ? 'open' : 'closed');
    list.set('noise', progress.noise || 'none');
    list.set('rig', progress.rig_waits_for || 'ready');
  };
  return {element: card('Session', head, body, none), update};
}

export function show(place, {rig}) {
  document.body.classList.add('blind');
  let gone = false, last = 0, number = 0;
  const past = [];
  const session = sessionCard();
  const now = facts([['presentation', 'presentation'], ['contact', 'tool'], ['flaws', 'flaws so far'], ['guide', 'guide'], ['guard', 'guard'], ['recording', 'recording']]);
  const list = el('div');
  place.append(el('div', {class: 'grid'}, session.element,
    card('Now', now, el('p', {class: 'hint'}, 'Force and stiffness are hidden in this view. Which condition is presented is in the journal, and is opened by the analysis.')),
    card('Presentations seen here', list)));
  const showPast = () => fill(list, past.length ? table(['number', 'flaws'], past.map((one) => [count(one.number), one.flaws.join(', ') || 'none'])) : el('p', {class: 'muted'}, 'None yet.'));
  const names = (bits) => FLAWS.filter((_, i) => bits & (1 << i));
  const subscription = telemetry({
    columns: ['assist_presentation', 'assist_presentation_flaws', 'assist_guide_state', 'contact_in_contact'], maxRows: 32,
    rows: ({data, count: n, width}) => {
      if (!n || gone) return;
      const [presentation, bits, guide, contact] = data.subarray((n - 1) * width);
      number = presentation || 0;
      if (last && !number) {
        past.unshift({number: last, flaws: names(bits || 0)}); // some are known at its end only
        past.length = Math.min(past.length, 50);
        showPast();
      }
      last = number;
      now.set('presentation', Number.isNaN(presentation) ? 'this scene has none' : number ? `number ${number} runs` : 'none runs');
      now.set('flaws', number ? names(bits).join(', ') || 'none' : '–');
      now.set('guide', GUIDE[guide] || '–');
      now.set('contact', contact ? 'touches' : 'is free');
    },
  });
  const poll = async () => {
    try {
      const state = await rpc('ExperimentService/GetExperiment');
      if (!gone) session.update(state);
    } catch { /* the frame says that the daemon is away */ }
  };
  const update = (state) => {
    if (!state) return;
    now.set('guard', word(state.guard_state, 'GUARD_STATE_'));
    now.set('recording', state.recording || 'none runs');
  };
  rig.listeners.add(update);
  update(rig.state);
  showPast();
  poll();
  const timer = setInterval(poll, POLL_MS);
  return () => {
    gone = true;
    clearInterval(timer);
    document.body.classList.remove('blind');
    subscription.close();
    rig.listeners.delete(update);
  };
}
