// Finds out how an object, the tool or the device behaves: what to do next, what is covered, how well it fits.

import {rpc, stream} from '/api.js';
import {colour, drawCoverage, drawXY, fitCanvas} from '/plot.js';
import {action, card, duration, el, errorBox, fill, num, parameterWords, setText, short, table, unseen, word} from '/ui.js';

// What can be identified: the task of the contract, and what it asks.
const TASKS = [
  ['contact', 'an object: its contact law', 'Press the object again and again, slowly and fast, lightly and hard.'],
  ['friction', 'an object: its friction', 'Press and stroke the object.'],
  ['threshold', 'the contact threshold', 'Move the tool freely, without touching anything.'],
  ['tool', 'the tool: mass and centre', 'Hold the tool in several orientations, without touching anything.'],
  ['structural_stiffness', 'the device: its structural stiffness', 'Press on something hard.'],
  ['gains', 'the gains of the controller', 'Press the object.'],
];

export function show(place, {rig}) {
  let watching = null, id = '', gone = false, plots = [], last = null;
  const task = el('select', {'aria-label': 'what to identify', onchange: () => showTask()}, TASKS.map(([key, text]) => el('option', {value: key}, text)));
  const object = el('input', {type: 'text', placeholder: 'e.g. sponge', 'aria-label': 'name of the object'});
  const law = el('select', {'aria-label': 'law'}, el('option', {value: 'CONTACT_LAW_HUNT_CROSSLEY'}, 'Hunt-Crossley'), el('option', {value: 'CONTACT_LAW_CREEP'}, 'creep'));
  const force = el('input', {type: 'number', value: '5', min: '0.5', step: '0.5', 'aria-label': 'up to, N'});
  const adopt = el('input', {type: 'checkbox', checked: true});
  const hint = el('p', {class: 'hint'}), said = el('div');
  const lawRow = el('div', {class: 'row'}, el('label', {}, 'law ', law), el('label', {}, 'up to ', force, ' N'));
  const objectRow = el('div', {class: 'row'}, el('label', {}, 'object ', object));
  const start = action('Begin', async () => {
    const request = {adopt: adopt.checked, object: object.value.trim(), [task.value]: {}};
    if (task.value === 'contact') request.contact = {law: law.value, force_n: Number(force.value)};
    const done = await rpc('IdentificationService/StartIdentification', request);
    watch(done.identification);
    return `Identification ${done.identification} runs.`;
  }, said, {class: 'main'});
  const cancel = action('Cancel', async () => {
    await rpc('IdentificationService/CancelIdentification', {identification: id});
    return 'Cancelled.';
  }, said, {disabled: true});

  const instruction = el('p', {class: 'big', 'aria-live': 'polite'}, 'Choose what to identify, and begin.');
  const progress = el('progress', {max: '1', value: '0', 'aria-label': 'how far'});
  const state = el('div', {class: 'hint'}), missing = el('ul', {class: 'plain'}), parameters = el('div'), maps = el('div'), problem = el('div');
  const fit = el('canvas', {class: 'plot', role: 'img', 'aria-label': 'measured and model'});
  const fitCard = card('Fit', fit);
  fitCard.hidden = true;
  const hands = el('p', {class: 'hint'});
  const past = el('div');
  place.append(el('div', {class: 'two'},
    el('div', {}, card('What', el('div', {class: 'row'}, task), objectRow, lawRow, el('label', {class: 'row'}, adopt, 'use the model at once'), hint, hands,
      el('div', {class: 'row'}, start, cancel), said), card('Before', past)),
    el('div', {}, card('What to do now', instruction, progress, state, missing, problem, parameters),
      card('Coverage', el('p', {class: 'hint'}, 'green: enough; blue: some; framed: still wanted'), maps), fitCard)));

  function showTask() {
    setText(hint, TASKS.find(([key]) => key === task.value)[2]);
    lawRow.hidden = task.value !== 'contact';
    objectRow.hidden = !['contact', 'friction'].includes(task.value);
  }
  function clearPlots() {
    for (const plot of plots) plot.end();
    plots = [];
  }
  function draw() {
    if (!last) return;
    last.coverage.forEach((map, i) => { if (plots[i]) drawCoverage(plots[i].canvas, map); });
    drawXY(fit, [
      {points: last.fit.map((p) => [p.x, p.measured]), colour: colour(5), dots: true, title: 'measured'},
      {points: last.fit.map((p) => [p.x, p.model]).sort((a, b) => a[0] - b[0]), colour: colour(1), dots: true, title: 'model'}], last.fit_x, last.fit_y);
  }
  function tell(p) {
    if (gone) return;
    last = p;
    const running = p.state === 'IDENTIFICATION_STATE_RUNNING';
    cancel.disabled = !running;
    start.disabled = running;
    setText(instruction, running ? p.instruction || '…' : `${word(p.state, 'IDENTIFICATION_STATE_')}. ${p.model ? `Model ${p.model.slice(0, 12)} is kept.` : ''}`);
    const known = p.completion !== undefined; // not of an earlier run of the daemon
    progress.hidden = !known;
    progress.value = String(p.completion ?? 0);
    setText(state, !known ? `${p.kind} ${p.object}: of an earlier run of hapticd, of which no numbers are kept`
      : `${p.kind} ${p.object}: ${duration(p.duration_s)} of ${duration(p.time_limit_s)}, ${p.samples} samples, `
      + `${p.steady ? 'steady' : 'not steady yet'}, ${p.certain ? 'certain' : 'not certain yet'}${p.residual !== undefined ? `, residual ${num(100 * p.residual, '%', 1)}` : ''}`);
    fill(missing, [...p.missing.map((text) => 'missing: ' + text), ...p.remarks].map((text) => el('li', {}, text)));
    fill(problem, p.problem ? errorBox({message: p.problem.what, detail: p.problem}) : null);
    fill(parameters, p.parameters.length ? table(['parameter', 'value', '± (standard error)'], p.parameters.map((one) =>
      [parameterWords(one.name), short(one.value, one.unit), short(one.standard_error, one.unit)]), {alignRight: [1, 2]}) : null);
    if (plots.length !== p.coverage.length) {
      clearPlots();
      plots = p.coverage.map(() => {
        const canvas = el('canvas', {class: 'plot', role: 'img', 'aria-label': 'coverage'});
        return {canvas, end: fitCanvas(canvas, draw)};
      });
      fill(maps, plots.map((plot) => plot.canvas));
    }
    fitCard.hidden = !p.fit.length;
    draw();
    if (!running) readPast();
  }
  function watch(identification) {
    id = identification;
    watching?.close();
    watching = stream('IdentificationService/WatchIdentification', {identification}, {message: tell, end: (error) => { if (error && !gone) fill(problem, errorBox(error)); }, credits: 16});
  }
  async function readPast() {
    try {
      const {identifications} = await rpc('IdentificationService/ListIdentifications');
      if (gone) return;
      fill(past, identifications.length ? table(['what', 'end', unseen('actions')], identifications.slice(-12).reverse().map((one) => [`${one.kind} ${one.object}`,
        word(one.state, 'IDENTIFICATION_STATE_'), el('button', {type: 'button', onclick: () => watch(one.identification)}, 'show')])) : el('p', {class: 'muted'}, 'None yet.'));
      const running = identifications.find((one) => one.state === 'IDENTIFICATION_STATE_RUNNING');
      if (running && !id) watch(running.identification);
    } catch (error) {
      fill(past, errorBox(error));
    }
  }
  async function showHands() {
    try {
      const simulation = await rpc('SimulationService/GetSimulation');
      if (gone) return;
      object.value ||= simulation.object;
      setText(hands, 'This rig is simulated: its hand does what is asked for.');
    } catch { /* a real rig: a person does */ }
  }
  const unfit = fitCanvas(fit, draw);
  showTask();
  readPast();
  showHands();
  return () => {
    gone = true;
    watching?.close();
    clearPlots();
    unfit();
  };
}
