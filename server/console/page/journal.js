// What happened while this tab was open: changes of the guard, faults, scene, target, control and connection.

const KEPT = 1000;
export const entries = JSON.parse(sessionStorage.getItem('journal') || '[]');
const listeners = new Set();

export function note(kind, text, isBad = false) {
  entries.push({at: Date.now(), kind, text, isBad});
  if (entries.length > KEPT) entries.splice(0, entries.length - KEPT);
  sessionStorage.setItem('journal', JSON.stringify(entries));
  for (const call of listeners) call();
}
export function onNote(call) {
  listeners.add(call);
  return () => listeners.delete(call);
}

const words = (name) => (name || '').replace(/^GUARD_(STATE|FAULT)_/, '').toLowerCase().replaceAll('_', ' ');
let before = null;

// Compares with the last state of the rig.
export function noteState(state) {
  if (!state) return;
  const b = before;
  before = state;
  if (!b) return;
  if (Number(state.tick) < Number(b.tick)) note('daemon', 'the daemon was started again', true);
  if (state.guard_state !== b.guard_state) note('guard', `${words(b.guard_state)} → ${words(state.guard_state)}${/NONE|UNSPEC/.test(state.guard_fault) ? '' : ': ' + words(state.guard_fault)}`, state.guard_state === 'GUARD_STATE_LATCHED');
  for (const fault of state.faults_present) if (!b.faults_present.includes(fault)) note('fault', words(fault) + ' is present', true);
  for (const fault of b.faults_present) if (!state.faults_present.includes(fault)) note('fault', words(fault) + ' is over');
  if (state.scene !== b.scene) note('scene', state.scene ? `${state.scene} is loaded` : 'no scene');
  if (Math.abs(state.target_stiffness_n_per_mm - b.target_stiffness_n_per_mm) > 1e-6) note('target', `${state.target_stiffness_n_per_mm.toFixed(3)} N/mm in force`);
  if (state.recording !== b.recording) note('recording', state.recording ? `${state.recording} runs` : `${b.recording} has ended`);
  if (state.last_incident !== b.last_incident && state.last_incident) note('incident', `${state.last_incident}: ${state.last_incident_cause}`, true);
  const missed = Number(state.loop.periods_missed) - Number(b.loop.periods_missed);
  if (missed > 0) note('loop', `${missed} periods missed`);
}
