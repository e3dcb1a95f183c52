// The table that brings objects under the tool.

import {rpc, stream} from '/api.js';
import {action, card, el, errorBox, facts, fill, num, table, unseen, word} from '/ui.js';

const POLL_MS = 400;

export function show(place) {
  let gone = false, timer = 0, motion = null;
  const state = facts([['state', 'state'], ['angle', 'angle'], ['station', 'station'], ['speed', 'speed'], ['motion', 'last motion'], ['range', 'range']]);
  const said = el('div'), stations = el('div'), interlock = el('div'), findings = el('div');
  const angle = el('input', {type: 'number', value: '0', step: '1', 'aria-label': 'angle in degrees'});
  const move = (request) => new Promise((resolve, reject) => {
    motion?.close();
    let last = null;
    motion = stream(request.method, request.body, {message: (status) => { last = status; tell(status); }, end: (error) => {
      if (error) return reject(error);
      const end = word(last?.motion?.end, 'TURNTABLE_MOTION_END_');
      resolve(`The table has ${end || 'ended its motion'}.`);
    }});
  });
  const go = (body) => move({method: 'TurntableService/MoveTo', body});
  place.append(el('div', {class: 'grid'},
    card('Table', state, interlock, el('div', {class: 'row'}, action('Stop the table', async () => { await rpc('TurntableService/StopTurntable'); return 'Stopped.'; }, said, {class: 'danger'}),
      action('Home', () => move({method: 'TurntableService/Home', body: {}}), said),
      action('Engage', async () => { await rpc('TurntableService/Engage'); return 'Engaged.'; }, said),
      action('Disengage', async () => { await rpc('TurntableService/Disengage'); return 'Disengaged.'; }, said),
      action('Clear the alarm', async () => { await rpc('TurntableService/ClearAlarm'); return 'Cleared.'; }, said)), said, findings),
    card('Move', el('p', {class: 'hint'}, 'The page must stay open: the table stops when its client leaves.'),
      el('div', {class: 'row'}, angle, '°', action('Move there', () => go({angle_deg: Number(angle.value)}), said, {class: 'main'})), stations)));

  function tell(status) {
    if (gone || !status) return;
    state.set('state', word(status.state, 'TURNTABLE_STATE_') + (status.alarm_text ? `: ${status.alarm_text}` : ''));
    state.set('angle', num(status.position_deg, '°', 2));
    state.set('station', status.station || '–');
    state.set('speed', num(status.velocity_deg_per_s, '°/s', 1));
    const m = status.motion;
    state.set('motion', m?.number > 0 ? `${word(m.kind, 'TURNTABLE_MOTION_KIND_')} to ${num(m.target_deg, '°', 1)}: ${word(m.end, 'TURNTABLE_MOTION_END_')}, ${num(100 * m.completion, '%', 0)}` : '–');
  }
  let shown = '';
  async function read() {
    try {
      const t = await rpc('TurntableService/GetTurntable');
      if (gone) return;
      tell(t.status);
      state.set('range', `${num(t.min_deg, '°', 0)} … ${num(t.max_deg, '°', 0)}, at most ${num(t.max_speed_deg_per_s, '°/s', 0)}`);
      fill(interlock, t.interlock ? el('div', {class: 'fault warn'}, el('strong', {}, 'may not move: '), t.interlock.what, el('div', {class: 'remedy'}, t.interlock.remedy)) : null);
      fill(findings, t.findings.map((text) => el('div', {class: 'fault warn'}, text)));
      const key = JSON.stringify(t.stations);
      if (key !== shown) {
        shown = key;
        fill(stations, t.stations.length ? table(['station', 'angle', 'object', unseen('actions')], t.stations.map((s) => [s.name, num(s.angle_deg, '°', 1), s.object || '–',
          action('go', () => go({station: s.name}), said)]), {alignRight: [1]}) : null);
      }
      timer = setTimeout(read, POLL_MS);
    } catch (error) {
      if (gone) return;
      fill(findings, errorBox(error));
      timer = setTimeout(read, 3000);
    }
  }
  read();
  return () => {
    gone = true;
    clearTimeout(timer);
    motion?.close();
  };
}
