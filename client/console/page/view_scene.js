// Which scene is loaded, and how stiff the object shall feel: asked for, granted, and why not more.

import {rpc} from '/api.js';
import {action, card, el, errorBox, facts, fill, num, setText, short, word} from '/ui.js';

const BAND_MS = 500;

export function show(place, {rig}) {
  let gone = false, most = 1, simulation = null;
  const select = el('select', {'aria-label': 'scene', onchange: () => explain()});
  const about = el('div'), outline = el('div'), loadSaid = el('div');
  const slider = el('input', {type: 'range', min: '0', max: '1', step: '0.01', value: '0.5', 'aria-label': 'target stiffness in N/mm'});
  const number = el('input', {type: 'number', min: '0', step: '0.01', value: '0.5', 'aria-label': 'target stiffness in N/mm'});
  const band = el('div', {class: 'band', 'aria-hidden': 'true'}, el('i'), el('b'));
  const bandText = el('div', {class: 'hint'}, 'feasible: –');
  const result = facts([['asked', 'asked for'], ['granted', 'granted'], ['why', 'because'], ['tick', 'in force from tick'], ['now', 'now in force']]);
  const said = el('div');
  const hand = el('input', {type: 'number', value: '3', min: '0.1', step: '0.1', 'aria-label': 'hand force in N'});
  const object = el('input', {type: 'number', value: '0.4', min: '0.01', step: '0.01', 'aria-label': 'object stiffness in N/mm'});

  async function send(value) {
    try {
      const done = await rpc('RenderingService/SetTarget', {stiffness_n_per_mm: Number(value)});
      if (gone) return;
      result.set('asked', num(done.requested_n_per_mm, 'N/mm', 3));
      result.set('granted', num(done.granted_n_per_mm, 'N/mm', 3));
      result.set('why', done.limiting_reason === 'LIMITING_REASON_NONE' ? 'nothing limits it' : `${word(done.limiting_reason, 'LIMITING_REASON_')}: ${done.explanation}`);
      result.set('tick', done.effective_tick);
      fill(said);
    } catch (error) {
      fill(said, errorBox(error));
    }
  }
  slider.addEventListener('input', () => { number.value = slider.value; showBand(); });
  slider.addEventListener('change', () => send(slider.value));
  number.addEventListener('change', () => { slider.value = number.value; send(number.value); });

  let feasible = null;
  function showBand() {
    const at = (value) => `${Math.max(0, Math.min(100, 100 * value / most))}%`;
    const [range, mark] = band.children;
    range.hidden = !feasible;
    if (feasible) {
      range.style.left = at(feasible.min_n_per_mm);
      range.style.width = `calc(${at(feasible.max_n_per_mm)} - ${at(feasible.min_n_per_mm)})`;
    }
    mark.style.left = at(Number(slider.value));
  }
  async function readBand() {
    const pressed = rig.state?.in_contact;
    hand.disabled = object.disabled = Boolean(pressed);
    if (rig.state && !rig.state.scene) {
      feasible = null;
      setText(bandText, 'feasible: not known, no scene is loaded');
      return showBand();
    }
    try {
      feasible = await rpc('RenderingService/GetFeasibleRange', pressed ? {}
        : {hand_force_n: Number(hand.value), object_stiffness_n_per_mm: Number(object.value)});
      setText(bandText, `feasible: ${num(feasible.min_n_per_mm, '', 2)} … ${num(feasible.max_n_per_mm, 'N/mm', 2)} with `
        + `${num(feasible.hand_force_n, 'N', 1)} of the hand on an object of ${num(feasible.object_stiffness_n_per_mm, 'N/mm', 2)}`
        + (pressed ? ' (now)' : ' (as set below)'));
    } catch (error) {
      feasible = null;
      setText(bandText, `feasible: not known. ${error.message}`);
    }
    if (!gone) showBand();
  }

  async function explain() {
    if (!select.value) return;
    try {
      const scene = await rpc('SceneService/ExplainScene', {name: select.value});
      if (gone) return;
      fill(about, el('p', {}, scene.description));
      fill(outline, scene.obstacle ? el('div', {class: 'error'}, el('strong', {}, scene.obstacle.what), el('div', {class: 'remedy'}, scene.obstacle.remedy)) : null,
        el('h3', {}, 'what runs in each tick'), el('ul', {class: 'plain'}, scene.stages.map((text) => el('li', {}, text))),
        el('p', {class: 'hint'}, `hardware: ${scene.hardware.join(', ') || 'none'}; models: ${scene.models.join(', ') || 'none'}; `
          + `cost ${short(scene.cost?.median_ns, 'ns')} a tick`),
        el('details', {}, el('summary', {}, 'the scene as a file'), el('pre', {}, scene.resolved_toml)));
      if (scene.name === rig.state?.scene) {
        most = scene.max_target_stiffness_n_per_mm || 1;
        slider.max = number.max = String(most);
        showBand();
      }
    } catch (error) {
      fill(outline, errorBox(error));
    }
  }
  async function readScenes() {
    const {scenes} = await rpc('SceneService/ListScenes');
    const now = scenes.find((scene) => scene.loaded)?.name || rig.state?.scene;
    fill(select, scenes.map((scene) => el('option', {value: scene.name, selected: scene.name === now}, scene.name + (scene.name === now ? ' (loaded)' : ''))));
    await explain();
  }
  const load = action('Load', async () => {
    const done = await rpc('SceneService/LoadScene', {name: select.value});
    slider.value = number.value = String(done.outline.target_stiffness_n_per_mm);
    rig.state = await rpc('RigService/GetRigState', {without_histograms: true});
    await readScenes();
    return `Loaded from tick ${done.effective_tick} on.`;
  }, loadSaid, {class: 'main'});
  const unload = action('Unload', async () => {
    await rpc('SceneService/UnloadScene');
    await readScenes();
    return 'No scene: no force.';
  }, loadSaid);

  const simulated = el('div');
  place.append(el('div', {class: 'two'},
    el('div', {}, card('Scene', el('div', {class: 'row'}, select, load, unload), loadSaid, about, outline)),
    el('div', {}, card('Target stiffness', el('div', {class: 'row'}, number, 'N/mm'), slider, band, bandText, said, result,
      el('div', {class: 'row'}, el('label', {}, 'hand ', hand, ' N'), el('label', {}, 'object ', object, ' N/mm'), el('span', {class: 'hint'}, 'for the band while nothing is pressed'))),
    simulated)));

  async function showSimulation() {
    try {
      simulation = await rpc('SimulationService/GetSimulation');
    } catch {
      return; // a real rig
    }
    if (gone) return;
    object.value = simulation.object_stiffness_n_per_mm.toFixed(2);
    const objects = el('select', {'aria-label': 'simulated object'}, simulation.objects.map((name) => el('option', {selected: name === simulation.object}, name)));
    const force = el('input', {type: 'number', value: '3', min: '0.1', max: '20', step: '0.5', 'aria-label': 'force of the simulated hand in N'});
    const simSaid = el('div');
    const program = (label, kind, more = {}) => action(label, async () => {
      await rpc('SimulationService/SetHandProgram', {program: {kind: 'HAND_PROGRAM_KIND_' + kind, ...(kind === 'REST' ? {} : {force_n: Number(force.value)}), ...more}});
      return `The simulated hand: ${label.toLowerCase()}.`;
    }, simSaid);
    fill(simulated, card('Simulated hand and object',
      el('p', {class: 'hint'}, 'This rig is simulated: its hand presses as you say here.'),
      el('div', {class: 'row'}, objects, action('Put it under the tool', async () => {
        const done = await rpc('SimulationService/SetObject', {name: objects.value});
        object.value = done.simulation.object_stiffness_n_per_mm.toFixed(2);
        return `${objects.value} is under the tool.`;
      }, simSaid)),
      el('div', {class: 'row'}, el('label', {}, force, ' N'), program('Press again and again', 'PRESS', {repetitions: -1, hold_s: 0.7}), program('Tap', 'TAP'), program('Rest', 'REST')), simSaid));
  }
  const update = (state) => { if (state) result.set('now', num(state.target_stiffness_n_per_mm, 'N/mm', 3)); };
  rig.listeners.add(update);
  if (rig.state?.target_stiffness_n_per_mm) slider.value = number.value = String(rig.state.target_stiffness_n_per_mm);
  readScenes().catch((error) => fill(outline, errorBox(error)));
  showSimulation();
  update(rig.state);
  readBand();
  const timer = setInterval(() => { if (!document.hidden) readBand(); }, BAND_MS);
  return () => {
    gone = true;
    clearInterval(timer);
    rig.listeners.delete(update);
  };
}
