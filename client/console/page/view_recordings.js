// Recordings and incidents: start, stop, note, read. For an incident the last second before the fault.

import {rpc} from '/api.js';
import {fetchExport, readCsv} from '/csv_table.js';
import {Traces, fitCanvas} from '/plot.js';
import {action, bytes, card, clockTime, columnTitle, count, download, duration, el, errorBox, fill, num, setText, table, unseen, word} from '/ui.js';

const MAX_ROWS = 20000;
const COLUMNS = ['contact_reaction_force_n', 'control_hand_force_n', 'deformation_displacement_mm', 'target_stiffness_n_per_mm',
  'control_commanded_force_n', 'sample_force_age_ms', 'guard_authority', 'guard_state'];
const UNITS = [['_n_per_mm', 'N/mm'], ['_mm_per_s2', 'mm/s²'], ['_mm_per_s', 'mm/s'], ['_mm', 'mm'], ['_n', 'N'], ['_ms', 'ms'], ['_ns', 'ns'], ['_rad', 'rad']];
const unitOf = (name) => UNITS.find(([end]) => name.endsWith(end))?.[1] || '1';

export function show(place, {rig, argument}) {
  let gone = false, loaded = null, from = 0, to = 1, all = [], wanted = argument;
  const list = el('div'), said = el('div'), nowRuns = el('div', {class: 'hint'});
  const name = el('input', {type: 'text', placeholder: 'name, e.g. press', 'aria-label': 'name of the recording'});
  const note = el('input', {type: 'text', placeholder: 'note', 'aria-label': 'note'});
  const kind = el('select', {'aria-label': 'kind', onchange: () => read()}, el('option', {value: ''}, 'recordings and incidents'),
    el('option', {value: 'RECORDING_KIND_RECORDING'}, 'recordings'), el('option', {value: 'RECORDING_KIND_INCIDENT'}, 'incidents'));
  const headline = el('div', {}, el('p', {class: 'muted'}, 'Choose one of those above.')), canvas = el('canvas', {class: 'traces', role: 'img', 'aria-label': 'the recording over time'}), events = el('div');
  const shownPart = el('div', {hidden: true});
  const traces = new Traces(canvas);
  const draw = () => { if (loaded) traces.draw(from, to); };
  traces.onCursor = draw;
  const span = (label, f) => el('button', {type: 'button', onclick: () => { if (loaded) { f(); draw(); } }}, label);
  const zoom = (factor) => {
    const middle = (from + to) / 2, half = (to - from) / 2 * factor;
    from = middle - half;
    to = middle + half;
  };
  place.append(card('Record', el('div', {class: 'row'}, name, note,
    action('Start', async () => { const f = await rpc('RecordingService/StartRecording', {name: name.value || 'console', note: note.value}); await read(); return `${f.id} runs, whatever becomes of this page.`; }, said, {class: 'main'}),
    action('Stop recording', async () => { const f = await rpc('RecordingService/StopRecording'); await read(); return `${f.id}: ${count(f.rows)} rows.`; }, said),
    action('Add the note now', async () => { await rpc('RecordingService/Annotate', {text: note.value}); return 'Noted.'; }, said),
    action('Keep the last 20 s', async () => { await rpc('RecordingService/MakeIncident', {reason: note.value || 'asked for at the console'}); setTimeout(read, 4000); return 'An incident of this moment is being written: it is here in some seconds.'; }, said)), nowRuns, said),
  card('Kept', el('div', {class: 'row'}, kind, action('Read again', async () => { await read(); return ''; })), list),
  card('What it shows', headline, shownPart, events));
  shownPart.append(el('div', {class: 'row'}, span('all', () => { from = 0; to = loaded.rows.last(); }), span('closer', () => zoom(0.5)), span('wider', () => zoom(2)),
    span('←', () => { const d = (to - from) / 4; from -= d; to -= d; }), span('→', () => { const d = (to - from) / 4; from += d; to += d; })), canvas);

  async function open(file) {
    const isIncident = file.kind === 'RECORDING_KIND_INCIDENT';
    // Its summary is written last: one that is not there yet comes in a moment.
    for (let tries = 0; isIncident && !Number(file.cause_after_s) && tries < 5; ++tries) {
      await new Promise((done) => setTimeout(done, 1000));
      const {recordings} = await rpc('RecordingService/ListRecordings', {kind: file.kind});
      file = recordings.find((one) => one.id === file.id) || file;
    }
    const request = {id: file.id, kind: file.kind, columns: COLUMNS};
    fill(events);
    shownPart.hidden = false;
    fill(headline, el('h3', {}, file.id), isIncident ? el('div', {class: 'fault'}, el('strong', {}, file.cause || file.name), await remedy(file.cause)) : el('p', {}, file.note));
    headline.scrollIntoView({block: 'start'});
    const wait = el('p', {class: 'hint', role: 'status'}, 'reading…');
    headline.append(wait);
    if (isIncident) {
      request.from_s = Math.max(0, Number(file.cause_after_s) - 1.2);
      request.to_s = Number(file.cause_after_s) + 0.3;
    } else {
      request.decimation = Math.max(1, Math.ceil(Number(file.rows) / MAX_ROWS));
    }
    try {
      loaded = await readCsv(await fetchExport(request, (size) => setText(wait, `reading… ${bytes(size)}`)));
      if (gone) return;
      wait.remove();
      if (!isIncident && request.decimation > 1) headline.append(el('p', {class: 'hint'}, `every ${request.decimation}th row is shown; save the file for all of them`));
      const shown = loaded.names.slice(1).map((column, i) => ({name: column, title: columnTitle(column), unit: unitOf(column), at: i + 1})).filter((one) => COLUMNS.includes(one.name));
      const view = Object.create(loaded.rows, {columns: {value: [loaded.rows.columns[0], ...shown.map((one) => loaded.rows.columns[one.at])]}});
      traces.setSeries(shown, view);
      const cause = isIncident ? Number(file.cause_after_s) - request.from_s : NaN;
      traces.marks = [...(isIncident ? [{time: cause, text: file.cause.split(':')[0], bad: true}] : []),
        ...loaded.events.filter((e) => !isIncident && e.time >= 0).map((e) => ({time: e.time, text: e.kind === 'annotation' ? e.text : e.kind, bad: e.kind === 'fault' || e.kind === 'stop'}))];
      from = isIncident ? cause - 1 : 0;
      to = isIncident ? cause + 0.2 : loaded.rows.last();
      draw();
      fill(events, loaded.events.length ? table(['at', 'what', unseen('text')], loaded.events.map((e) => [num(e.time, 's', 3), e.kind, e.text]), {alignRight: [0]}) : null);
    } catch (error) {
      fill(headline, el('h3', {}, file.id), errorBox(error));
    }
  }
  async function remedy(cause) {
    rules ||= (await rpc('SafetyService/ListFaults').catch(() => null))?.faults;
    const found = rules?.find((rule) => (cause || '').startsWith(word(rule.fault, 'GUARD_FAULT_').replaceAll(' ', '_')) || (cause || '').includes(word(rule.fault, 'GUARD_FAULT_')));
    return found ? [el('div', {}, found.cause), el('div', {class: 'remedy'}, found.remedy)] : null;
  }
  let rules = null;

  async function save(file) {
    const pieces = await fetchExport({id: file.id, kind: file.kind, format: 'EXPORT_FORMAT_CSV'});
    download(`${file.id}.csv`, 'text/csv', ...pieces);
    return '';
  }
  async function read() {
    try {
      const answers = await Promise.all((kind.value ? [kind.value] : ['RECORDING_KIND_RECORDING', 'RECORDING_KIND_INCIDENT'])
        .map((one) => rpc('RecordingService/ListRecordings', {kind: one})));
      if (gone) return;
      all = answers.flatMap((answer) => answer.recordings).sort((a, b) => Number(BigInt(b.started_unix_ns) - BigInt(a.started_unix_ns)));
      fill(list, all.length ? table(['begun', 'what', 'duration', 'ticks lost', 'size', 'by', unseen('actions')], all.slice(0, 200).map((file) => [
        el('span', {class: 'time'}, clockTime(file.started_unix_ns)), [file.kind === 'RECORDING_KIND_INCIDENT' ? el('strong', {}, 'incident: ', file.cause || file.name) : file.name, file.note ? el('div', {class: 'muted'}, file.note) : null],
        duration(file.duration_s), count(file.lost_ticks), bytes(file.bytes), file.by, file.state === 'RECORDING_STATE_RUNNING' ? 'runs' : el('div', {class: 'row'},
          el('button', {type: 'button', onclick: () => { location.hash = 'recordings/' + file.id; open(file); }}, 'show'), action('save CSV', () => save(file), said))]), {alignRight: [2, 3, 4]})
        : el('p', {class: 'muted'}, 'None yet.'));
      const file = wanted && all.find((one) => one.id === wanted);
      if (file) open(file);
      wanted = '';
    } catch (error) {
      fill(list, errorBox(error));
    }
  }
  const update = (state) => { if (state) setText(nowRuns, state.recording ? `${state.recording} runs: ${count(state.recording_rows)} rows, ${count(state.recording_lost_ticks)} ticks lost` : 'No recording runs.'); };
  rig.listeners.add(update);
  update(rig.state);
  read();
  const unfit = fitCanvas(canvas, draw);
  return () => {
    gone = true;
    unfit();
    rig.listeners.delete(update);
  };
}
