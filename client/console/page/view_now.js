// What the rig does now: state, guard, faults with remedy, parts, loop, lease.

import {rpc} from '/api.js';
import {action, card, count, el, errorBox, facts, fill, num, short, word} from '/ui.js';

const SLOW_MS = 2000;

const ACTIONS = {FAULT_ACTION_WARN: 'warns only', FAULT_ACTION_RAMP_TO_ZERO: 'force falls to zero', FAULT_ACTION_CUT: 'zero force at once'};

/// Returns whether a contact is estimated: not without a scene, nor without a usable force.
const isEstimated = (state) => Boolean(state.scene) && state.contact_reason && !state.contact_reason.endsWith('_UNSPECIFIED');

function contactWords(state) {
  if (!isEstimated(state)) return '–';
  if (state.in_contact) return 'yes';
  return state.contact_reason === 'CONTACT_REASON_AWAITING_FREE' ? 'unknown: move the tool in free air' : word(state.contact_reason, 'CONTACT_REASON_') || 'no';
}

export function show(place, {rig}) {
  const guard = facts([['state', 'guard'], ['fault', 'cause'], ['scene', 'scene'], ['target', 'target stiffness'], ['contact', 'contact'],
    ['reaction', 'force of the object'], ['hand', 'force felt by the hand'], ['displacement', 'displacement']]);
  const said = el('div');
  const clear = action('Clear: let the force return', async () => {
    const done = await rpc('SafetyService/Clear');
    return `Cleared ${word(done.cleared_fault, 'GUARD_FAULT_')}. The force returns over half a second.`;
  }, said, {class: 'main'});
  const faults = el('div', {'aria-live': 'polite'});
  const loop = facts([['ticks', 'ticks'], ['late', 'late, half of the ticks'], ['late999', 'late, 99.9 % below'], ['max', 'latest'],
    ['compute', 'computation, 99.9 % below'], ['device', 'drivers, 99.9 % below'], ['missed', 'periods missed'], ['over', 'overruns (wake-up, compute, device)']]);
  const parts = el('div');
  const sensor = facts([['age', 'age of the force'], ['zero', 'zero followed by'], ['bias', 'bias']]);
  const rest = facts([['recording', 'recording'], ['flight', 'flight recorder'], ['pages', 'telemetry streams'], ['who', 'you are']]);
  const lease = el('div'), incident = el('p');
  let lastIncident = null;
  const biasSaid = el('div');
  place.append(el('div', {class: 'grid'},
    card('Guard', guard, el('div', {class: 'row'}, clear), said),
    card('Faults', faults),
    card('Loop', loop),
    card('Force sensor', sensor, el('div', {class: 'row'},
      action('Take the present load as zero', async () => {
        await rpc('RigService/BiasForceSensor');
        return 'The sensor reads zero now. Move the tool by some millimetres in free air: until then there is no force.';
      }, biasSaid, {title: 'The tool must be free and at rest'})), biasSaid),
    card('Parts', parts),
    card('Control', lease, rest, incident)));

  let rules = null, stopped = false;
  rpc('SafetyService/ListFaults').then((answer) => {
    rules = new Map(answer.faults.map((rule) => [rule.fault, rule]));
    update(rig.state);
  }).catch(() => {});
  rpc('AccessService/GetAccess').then((who) => rest.set('who', `${who.identity}, ${word(who.role, 'ROLE_')}`)).catch(() => {});

  let lastFaults = '', lastParts = '';
  function showFaults(state) {
    const none = state.scene ? 'None. The force passes the guard.' : 'None. Without a scene there is no force.';
    const present = [...new Set([state.guard_fault, ...state.faults_present])].filter((f) => f && !/UNSPECIFIED|_NONE$/.test(f));
    const key = present.join() + state.guard_state + Boolean(rules) + none;
    if (key === lastFaults) return;
    lastFaults = key;
    fill(faults, present.length ? present.map((name) => {
      const rule = rules?.get(name);
      const isWarning = rule?.action === 'FAULT_ACTION_WARN';
      const latched = name === state.guard_fault && !state.faults_present.includes(name);
      return el('div', {class: isWarning ? 'fault warn' : 'fault'}, el('strong', {}, word(name, 'GUARD_FAULT_')),
        el('span', {class: 'muted'}, latched ? ' (over, still latched)' : isWarning ? ' (warning)' : ' (present)'),
        rule ? [el('div', {}, rule.cause), el('div', {class: 'muted'}, ACTIONS[rule.action] || '',
          rule.clearing === 'FAULT_CLEARING_ITSELF' ? '; ends by itself' : rule.clearing === 'FAULT_CLEARING_ANY_CLIENT' ? '; stays until it is cleared' : ''),
          el('div', {class: 'remedy'}, rule.remedy)] : null);
    }) : el('p', {class: 'muted'}, none));
  }
  function showParts(state) {
    const key = JSON.stringify(state.parts.map((p) => [p.part, p.state, p.connection, p.findings]));
    if (key === lastParts) return;
    lastParts = key;
    fill(parts, state.parts.length ? state.parts.map((part) => el('div', {class: part.state === 'PART_STATE_READY' && !part.findings.length ? 'part' : 'fault warn'},
      el('strong', {}, part.part), ` ${part.driver}: ${word(part.state, 'PART_STATE_')}`, el('div', {class: 'muted anywhere'}, part.connection),
      part.findings.map((text) => el('div', {class: 'remedy'}, text))))
      : el('p', {class: 'muted'}, 'Nothing with hardware behind it: this rig is simulated or replayed.'));
  }

  function update(state) {
    if (!state || stopped) return;
    const renders = state.guard_state === 'GUARD_STATE_RENDERING';
    guard.set('state', renders && !state.scene ? 'no force: no scene is loaded' : word(state.guard_state, 'GUARD_STATE_'));
    guard.set('fault', /NONE|UNSPECIFIED/.test(state.guard_fault) ? '–' : word(state.guard_fault, 'GUARD_FAULT_'));
    guard.set('scene', state.scene || 'none loaded');
    guard.set('contact', contactWords(state));
    const estimated = (value, unit, digits) => (isEstimated(state) ? num(value, unit, digits) : '–');
    guard.set('target', estimated(state.target_stiffness_n_per_mm, 'N/mm', 3));
    guard.set('reaction', estimated(state.reaction_force_n, 'N', 2));
    guard.set('hand', estimated(state.hand_force_n, 'N', 2));
    guard.set('displacement', estimated(state.displacement_mm, 'mm', 2));
    clear.disabled = state.guard_state !== 'GUARD_STATE_LATCHED';
    const l = state.loop;
    loop.set('ticks', count(l.ticks));
    loop.set('late', num(l.wakeup.median_us, 'µs', 1));
    loop.set('late999', num(l.wakeup.p999_us, 'µs', 0));
    loop.set('max', num(l.wakeup.max_us, 'µs', 0));
    loop.set('compute', num(l.compute.p999_us, 'µs', 1));
    loop.set('device', num(l.device.p999_us, 'µs', 1));
    loop.set('missed', count(l.periods_missed));
    loop.set('over', `${l.overruns_by_wakeup}, ${l.overruns_by_compute}, ${l.overruns_by_device}`);
    sensor.set('age', num(state.force_age_ms, 'ms', 2));
    const zero = state.followed_zero_n;
    sensor.set('zero', zero ? num(Math.hypot(zero.x, zero.y, zero.z), 'N', 3) + ` of ${short(state.zero_bound_n, 'N')}` : '–');
    sensor.set('bias', state.sensor_bias_lost ? 'lost: bias again' : state.sensor_bias ? state.sensor_bias.id : 'of the start');
    rest.set('recording', state.recording ? `${state.recording}: ${count(state.recording_rows)} rows, ${count(state.recording_lost_ticks)} lost` : 'none runs');
    rest.set('flight', state.flight_recorder_on ? 'keeps the last 30 s' : 'off');
    
    if (state.last_incident !== lastIncident) {
      lastIncident = state.last_incident;
      fill(incident, lastIncident ? ['last incident: ', el('a', {href: '#recordings/' + lastIncident}, state.last_incident_cause.split(/[:;]| \(/)[0]), el('span', {class: 'muted'}, ' ' + lastIncident)]
        : el('span', {class: 'muted'}, 'no incident since the recordings began'));
    }
    rest.set('pages', count(state.telemetry_subscribers));
    showFaults(state);
    showParts(state);
  }

  async function slow() {
    try {
      const answer = await rpc('LeaseService/GetLease');
      const held = answer.lease;
      if (!stopped) {
        fill(lease, el('p', {}, held ? `${held.holder} has control (${held.purpose || 'no purpose given'}), for ${num(held.age_s, 's', 0)}.`
          : 'No one has exclusive control: operators may command.'));
      }
    } catch (error) {
      if (!stopped) fill(lease, errorBox(error));
    }
  }
  rig.listeners.add(update);
  update(rig.state);
  slow();
  const timer = setInterval(slow, SLOW_MS);
  return () => {
    stopped = true;
    clearInterval(timer);
    rig.listeners.delete(update);
  };
}
