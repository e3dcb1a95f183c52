// The rig's telemetry as it comes: force over displacement, and chosen columns over time.

import {telemetry} from '/api.js';
import {Rows, Traces, Trail, fitCanvas} from '/plot.js';
import {card, columnTitle as title, count, download, el, errorBox, fill, setText} from '/ui.js';

const KEPT_S = 32;
const BEHIND_S = 0.06; // drawn so late that rows are there: the picture moves evenly
const MAX_TRACES = 8;
const FIXED = ['time_ns', 'deformation_displacement_mm', 'control_hand_force_n', 'contact_reaction_force_n', 'target_stiffness_n_per_mm'];
const DEFAULT = ['contact_reaction_force_n', 'control_hand_force_n', 'deformation_displacement_mm', 'target_stiffness_n_per_mm',
  'control_commanded_force_n', 'motion_velocity_mm_per_s', 'guard_authority', 'timing_wakeup_ns'];

export function show(place, {}) {
  let chosen = JSON.parse(localStorage.getItem('traces') || 'null') || DEFAULT;
  let all = [], rows = null, series = [], subscription = null, rate = 1000;
  let spanS = 10, paused = null, newest = 0, newestAt = 0, gone = false;
  const stats = {frames: 0, scriptMs: 0, begun: performance.now(), rows: 0, worstMs: 0};
  globalThis.liveStats = stats;

  const trailCanvas = el('canvas', {class: 'trail', role: 'img', 'aria-label': 'force over displacement of the last seconds'});
  const traceCanvas = el('canvas', {class: 'traces', role: 'img', 'aria-label': 'chosen columns over time'});
  const traces = new Traces(traceCanvas), trail = new Trail(trailCanvas);
  const state = el('div', {class: 'hint', role: 'status'}, 'waiting for rows');
  const problem = el('div');
  const list = el('div', {class: 'columns', role: 'group', 'aria-label': 'columns'});
  const search = el('input', {type: 'search', placeholder: 'find a column', 'aria-label': 'find a column', oninput: () => showList()});
  const pause = el('button', {type: 'button', 'aria-pressed': 'false', onclick: () => {
    paused = paused === null ? end() : null;
    pause.setAttribute('aria-pressed', String(paused !== null));
    setText(pause, paused === null ? 'Pause' : 'Go on');
  }}, 'Pause');
  const span = el('select', {'aria-label': 'time shown', onchange: () => { spanS = Number(span.value); }},
    [2, 5, 10, 30].map((s) => el('option', {value: String(s), selected: s === 10}, `${s} s`)));
  place.append(el('div', {class: 'two'},
    el('div', {}, card('Force over displacement', trailCanvas),
      card('Columns', el('div', {class: 'row'}, search), list, el('div', {class: 'hint'}, `at most ${MAX_TRACES}`))),
    card('Over time', el('div', {class: 'row'}, pause, span,
      el('button', {type: 'button', onclick: save}, 'Save as CSV')), state, problem, traceCanvas)));

  const end = () => newest + Math.min((performance.now() - newestAt) / 1000, 0.2) - BEHIND_S;

  function subscribe() {
    subscription?.close();
    const names = [...FIXED, ...chosen.filter((name) => !FIXED.includes(name))];
    subscription = telemetry({
      columns: names,
      start: ({columns, rate_hz}) => {
        rate = rate_hz;
        rows = new Rows(columns.length, Math.ceil(KEPT_S * rate));
        const at = (name) => names.indexOf(name);
        series = chosen.map((name) => {
          const unit = columns[at(name)].unit;
          return {name, title: title(name), unit: unit === 'ns' ? 'µs' : unit, factor: unit === 'ns' ? 1e-3 : 1, column: at(name)};
        });
        // Traces draw columns 1 …: a view of the same arrays in the chosen order.
        const view = Object.create(rows, {columns: {value: [rows.columns[0], ...series.map((one) => rows.columns[one.column])]}});
        traces.setSeries(series, view);
        fill(problem);
      },
      rows: ({data, count: n, samples, lost, merged}) => {
        rows.add(data, n, 1e-9);
        stats.rows += n;
        if (n) {
          const last = rows.last();
          // The clock of the picture follows that of the rig gently: it does not jump when rows come late.
          const shown = newest + (performance.now() - newestAt) / 1000;
          newest = Math.abs(shown - last) > 0.15 ? last : shown + (last - shown) * 0.1;
          newestAt = performance.now();
        }
        setText(state, samples > 1 ? `this page is slow: it sees minima and maxima of ${2 * samples} ticks (${count(merged)} so far)`
          : lost > 0 ? `${count(lost)} ticks never came here` : `every tick, ${rate} Hz`);
      },
      end: (error) => {
        fill(problem, errorBox(error));
        if (chosen !== DEFAULT) {
          chosen = DEFAULT;
          subscribe();
        }
      },
    });
  }
  function showList() {
    const wanted = search.value.trim().toLowerCase().split(/\s+/);
    const first = (one) => chosen.includes(one.name) ? 0 : 1; // a sort keeps the order of equals
    fill(list, all.filter(({name}) => name !== 'time_ns' && wanted.every((part) => name.includes(part))).sort((a, b) => first(a) - first(b)).map(({name, unit}) =>
      el('label', {}, el('input', {type: 'checkbox', checked: chosen.includes(name), onchange: (event) => choose(name, event.target)}),
        el('span', {}, title(name), el('span', {class: 'muted'}, unit === '1' ? '' : ` (${unit})`)))));
  }
  function choose(name, box) {
    if (box.checked && chosen.length >= MAX_TRACES) {
      box.checked = false;
      return;
    }
    chosen = box.checked ? [...chosen, name] : chosen.filter((one) => one !== name);
    localStorage.setItem('traces', JSON.stringify(chosen));
    if (chosen.length) subscribe();
  }
  function save() {
    if (!rows) return;
    const until = paused ?? rows.last(), lines = [['time_s', ...series.map((one) => one.name)].join(',')];
    for (let row = rows.find(until - spanS); row < rows.find(until); ++row) {
      const p = row % rows.capacity;
      lines.push([rows.columns[0][p].toFixed(6), ...series.map((one) => rows.columns[one.column][p])].join(','));
    }
    download('telemetry.csv', 'text/csv', lines.join('\n') + '\n');
  }
  // Which columns there are: the first row of all of them.
  const names = telemetry({start: ({columns}) => { all = columns; names.close(); showList(); }, rows: () => {}});

  const unfit = [fitCanvas(trailCanvas, () => {}), fitCanvas(traceCanvas, () => {})];
  function frame() {
    if (gone) return;
    requestAnimationFrame(frame);
    if (!rows || !rows.end) return;
    const begun = performance.now();
    const until = paused ?? end();
    traces.draw(until - spanS, until);
    const p = (rows.end - 1) % rows.capacity;
    trail.draw(rows, {x: 1, felt: 2, object: 3, until, spanS: Math.min(spanS, 6), stiffness: rows.columns[4][p]});
    const took = performance.now() - begun;
    stats.frames += 1;
    stats.scriptMs += took;
    stats.worstMs = Math.max(stats.worstMs, took);
  }
  subscribe();
  requestAnimationFrame(frame);
  return () => {
    gone = true;
    subscription?.close();
    names.close();
    unfit.forEach((end_) => end_());
  };
}
