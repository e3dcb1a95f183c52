// A recording as the daemon exports it: fetched piece by piece, read into rows, with its events.

import {stream} from '/api.js';
import {Rows} from '/plot.js';

// Fetches the bytes of an export. progress(received).
export function fetchExport(request, progress) {
  return new Promise((resolve, reject) => {
    const pieces = [];
    let size = 0;
    stream('RecordingService/ExportRecording', {format: 'EXPORT_FORMAT_CSV', ...request}, {
      message: ({data}) => {
        const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
        pieces.push(bytes);
        size += bytes.length;
        progress?.(size);
      },
      end: (error) => error ? reject(error) : resolve(pieces),
      credits: 4,
    });
  });
}

const EVENT = /^# event at (\S+) s, tick (\d+), (\w+): (.*)$/;

// {names, rows: Rows with the time since `zero` s (or the first row), events: [{time, tick, kind, text}]}
export async function readCsv(pieces) {
  const text = await new Blob(pieces).text();
  const events = [];
  let names = null, rows = null, zero = 0, at = 0;
  const lines = text.split('\n');
  for (const line of lines) {
    if (line.startsWith('#')) {
      const found = EVENT.exec(line);
      if (found) events.push({time: Number(found[1]), tick: found[2], kind: found[3], text: found[4]});
    } else if (!names) {
      if (!line) continue;
      names = line.split(',');
      at = names.indexOf('time_s');
      rows = new Rows(names.length, lines.length + 1);
    } else if (line) {
      const values = line.split(',').map((cell) => cell === '' ? NaN : Number(cell));
      if (rows.end === 0) zero = values[at];
      values[at] -= zero;
      [values[0], values[at]] = [values[at], values[0]]; // the time is column 0 of Rows
      rows.add(values, 1);
    }
  }
  if (!rows) throw new Error('the recording has no rows');
  [names[0], names[at]] = [names[at], names[0]];
  for (const event of events) event.time -= zero;
  return {names, rows, events};
}
