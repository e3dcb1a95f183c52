// Places of the words of a plot's marks: in rows above the traces, none over another.

export const LABEL_ROW = 15;
const MAX_ROWS = 3, GAP = 10, MAX_LETTERS = 32;
const cut = (text) => text.length > MAX_LETTERS ? text.slice(0, MAX_LETTERS - 1) + '…' : text;

// marks: [{x, text}]; measure(text): its width; right: where the plot ends. Returns [{x, row, text}] of those that find room, what
// matters most (bad) first. The others have their line, and their words in the table below the plot.
export function placeLabels(marks, measure, right) {
  const rows = Array.from({length: MAX_ROWS}, () => []);
  const placed = [];
  for (const mark of [...marks].sort((a, b) => (b.bad ? 1 : 0) - (a.bad ? 1 : 0) || a.x - b.x)) {
    const text = cut(mark.text), wide = measure(text);
    const x = Math.max(0, Math.min(mark.x + 4, right - wide));
    const row = rows.findIndex((taken) => taken.every(([from, to]) => x > to + GAP || x + wide < from - GAP));
    if (row < 0) continue;
    rows[row].push([x, x + wide]);
    placed.push({...mark, x, row, text});
  }
  return placed;
}
