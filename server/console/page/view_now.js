import {rpc} from '/api.js';
import {action, card, count, el, facts, fill, num, setText, word} from '/ui.js';

export function show(place, {rig}) {
  const guard = facts([['state', 'state'], ['fault', 'fault'], ['scene', 'scene'], ['target', 'target stiffness'], ['contact', 'contact'],
    ['reaction', 'force of the object'], ['displacement', 'displacement'], ['hand', 'force of the hand']]);
  place.append(card('Guard', guard));
  const update = (state) => {
    if (!state) return;
    guard.set('state', word(state.guard_state, 'GUARD_STATE_'));
    guard.set('fault', word(state.guard_fault, 'GUARD_FAULT_'));
    guard.set('scene', state.scene || 'none');
    guard.set('target', num(state.target_stiffness_n_per_mm, 'N/mm', 3));
    guard.set('reaction', num(state.reaction_force_n, 'N', 2));
  };
  rig.listeners.add(update);
  update(rig.state);
  return () => rig.listeners.delete(update);
}
