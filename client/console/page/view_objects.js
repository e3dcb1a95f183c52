// What is known of objects: models by name, stored ones, and two of them side by side.

import {rpc} from '/api.js';
import {colour, drawXY, fitCanvas} from '/plot.js';
import {action, card, el, errorBox, fill, num, parameterWords, short, table, unseen} from '/ui.js';

const percent = (value) => value === undefined ? '–' : num(100 * value, '%', 1);

export function show(place) {
  let gone = false, chosen = [], curves = [];
  const models = el('div'), stored = el('div'), compared = el('div'), said = el('div');
  const plot = el('canvas', {class: 'plot', role: 'img', 'aria-label': 'force over displacement of the chosen models'});
  place.append(card('Identified models', el('p', {class: 'hint'}, 'Choose two to compare them.'), stored, said), card('Compare', compared, plot),
    card('Models by name', el('p', {class: 'hint'}, 'What a scene names as its object. Errors: of the displacement, relative, when it was identified.'), models));

  async function readModels() {
    const answer = await rpc('ModelService/ListModels');
    if (gone) return;
    fill(models, table(['name', 'Hunt-Crossley', 'creep', 'friction', 'deepest', 'largest force', 'identified on'], answer.models.map((m) => [
      m.name, m.hunt_crossley ? percent(m.hunt_crossley_relative_error) : '–', m.creep ? percent(m.creep_relative_error) : '–', m.rod_friction ? 'yes' : '–',
      num(m.max_displacement_mm, 'mm', 1), num(m.max_force_n, 'N', 1), m.problem || m.identified_on]), {alignRight: [1, 2, 4, 5]}));
  }
  async function readStored() {
    const answer = await rpc('ModelService/ListStoredModels');
    if (gone) return;
    fill(stored, answer.models.length ? table([unseen('compare'), 'object', 'kind', 'parameters', 'residual', 'stored', 'hash', unseen('actions')], answer.models.map((m) => [
      el('input', {type: 'checkbox', checked: chosen.includes(m.hash), 'aria-label': `compare ${m.object} ${m.hash.slice(0, 8)}`, onchange: (event) => choose(m.hash, event.target.checked)}),
      m.object || '–', m.kind, m.parameters.map((p) => `${parameterWords(p.name)} ${short(p.value, p.unit)}`).join(', '), num(100 * m.residual, '%', 1), new Date(Number(m.stored_at_unix_s) * 1000).toLocaleString('sv'),
      m.hash.slice(0, 8) + (m.in_use ? ' (in use)' : ''), action('tag', async () => {
        const tag = prompt('Name of the tag:');
        if (!tag) return '';
        await rpc('ModelService/TagStoredModel', {hash: m.hash, tag});
        await readStored();
        return `Tagged ${tag}.`;
      }, said)]), {alignRight: [4]}) : el('p', {class: 'muted'}, 'None yet. Identify an object: its model comes here.'));
  }
  function choose(hash, on) {
    chosen = on ? [...chosen, hash].slice(-2) : chosen.filter((one) => one !== hash);
    readStored();
    compare();
  }
  // Curve of a (3.5)-like law only: f = K x^m at rest.
  function curve(model) {
    const value = (part) => model.parameters.find((p) => p.name.includes(part))?.value;
    const k = value('stiffness'), m = value('exponent');
    const deepest = model.max_displacement_mm || 5;
    return k && m ? Array.from({length: 101}, (_, i) => [deepest * i / 100, k * (deepest * i / 100) ** m]) : [];
  }
  async function compare() {
    curves = [];
    if (chosen.length !== 2) {
      fill(compared, el('p', {class: 'muted'}, 'Two models of the table above.'));
      draw();
      return;
    }
    try {
      const diff = await rpc('ModelService/DiffStoredModels', {hash_a: chosen[0], hash_b: chosen[1]});
      if (gone) return;
      const name = (m) => `${m.object} ${m.hash.slice(0, 8)}`;
      fill(compared, table(['parameter', name(diff.a), name(diff.b), 'difference', 'in standard errors'], diff.parameters.map((p) => [
        parameterWords(p.name), short(p.value_a, p.unit), short(p.value_b, p.unit), percent(p.relative), p.deviations === undefined ? '–' : num(p.deviations, '', 1)]), {alignRight: [1, 2, 3, 4]}),
      el('ul', {class: 'plain'}, diff.remarks.map((text) => el('li', {}, text))));
      curves = [diff.a, diff.b].map((m, i) => ({points: curve(m), title: name(m), colour: colour(i)})).filter((one) => one.points.length);
      draw();
    } catch (error) {
      fill(compared, errorBox(error));
    }
  }
  const draw = () => {
    plot.hidden = !curves.length;
    drawXY(plot, curves, 'displacement (mm)', 'force at rest (N)');
  };
  const unfit = fitCanvas(plot, draw);
  readModels().catch((error) => fill(models, errorBox(error)));
  readStored().catch((error) => fill(stored, errorBox(error)));
  compare();
  return () => { gone = true; unfit(); };
}
