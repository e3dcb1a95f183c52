// Plots on a bare canvas: traces over time with minimum and maximum of each pixel column, a trail of force over
// displacement, a fit, a map of coverage.

import {LABEL_ROW, placeLabels} from './mark_labels.js';

// Colours that all eyes can tell apart (Okabe and Ito), the yellow darkened for a light ground, all lighter on a dark one.
const LIGHT = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#8a7a00', '#7f7f7f'];
const DARK = ['#4ea8e0', '#ff8a3d', '#2fc49a', '#e39bc4', '#f0b52e', '#a5d8f5', '#d9c94a', '#a8a8a8'];
export const colour = (i) => look().palette[i % LIGHT.length];

let looks = null;
const readLooks = () => {
  const style = getComputedStyle(document.documentElement);
  const value = (name) => style.getPropertyValue(name).trim();
  looks = {ink: value('--ink'), muted: value('--muted'), line: value('--line'), ground: value('--card'), bad: value('--bad'), palette: style.colorScheme === 'dark' ? DARK : LIGHT};
};
const look = () => { if (!looks) readLooks(); return looks; };
addEventListener('theme', () => { looks = null; });
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { looks = null; });

// The last rows of a table: one typed array for each column. Column 0 is the time in s.
export class Rows {
  constructor(width, capacity) {
    this.capacity = capacity;
    this.columns = [new Float64Array(capacity), ...Array.from({length: width - 1}, () => new Float32Array(capacity))];
    this.end = 0; // rows ever added
  }
  get begin() { return Math.max(0, this.end - this.capacity); }
  // Rows of `width` numbers from `data`; `scale`: of column 0.
  add(data, count, scale = 1) {
    const width = this.columns.length;
    for (let row = 0, at = 0; row < count; ++row, at += width) {
      const place = this.end % this.capacity;
      this.columns[0][place] = data[at] * scale;
      for (let i = 1; i < width; ++i) this.columns[i][place] = data[at + i];
      ++this.end;
    }
  }
  time(row) { return this.columns[0][row % this.capacity]; }
  last() { return this.end ? this.time(this.end - 1) : 0; }
  // The first row not before `time`.
  find(time) {
    let low = this.begin, high = this.end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) < time) low = middle + 1; else high = middle;
    }
    return low;
  }
}

// Size of a plot's letters: on a large screen they are larger, as the page's are.
let letters = 1;
function measured(canvas, ink) {
  const ratio = (devicePixelRatio || 1) * letters;
  ink.setTransform(ratio, 0, 0, ratio, 0, 0);
  return [canvas.width / ratio, canvas.height / ratio];
}

// Makes a canvas as large as its place, sharp on every screen. draw() is called when its size changes.
export function fitCanvas(canvas, draw) {
  const observer = new ResizeObserver(() => {
    letters = parseFloat(getComputedStyle(document.documentElement).fontSize) / 15;
    const ratio = devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
      blank(canvas, canvas.getContext('2d', {alpha: false}));
    }
    draw();
  });
  observer.observe(canvas);
  return () => observer.disconnect();
}

const NICE = [1, 2, 2.5, 5, 10];
function niceStep(range, steps) {
  const raw = Math.max(range / steps, 1e-12);
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * NICE.find((n) => n * power >= raw * 0.999);
}
const label = (value, step) => {
  const decimals = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
  return value.toFixed(decimals).replace(/^-(0(\.0*)?)$/, '$1').replace('-', '−');
};

// Grows at once, shrinks when only a third is used: the axis does not jump.
export class Scale {
  constructor(least = 0) { this.low = NaN; this.high = NaN; this.least = least; }
  show(low, high) {
    if (!(low <= high)) return;
    if (high - low < this.least) {
      const middle = (high + low) / 2;
      low = middle - this.least / 2;
      high = middle + this.least / 2;
    }
    if (high === low) { // a constant lies in the middle
      const half = Math.abs(high) * 0.2 || 0.5;
      low -= half;
      high += half;
    }
    const range = high - low;
    const isFirst = !(this.low <= this.high);
    const used = range / (this.high - this.low);
    if (!isFirst && low >= this.low && high <= this.high && used > 0.33) return;
    const step = niceStep(range * 1.1, 4);
    this.low = Math.floor(low / step) * step;
    this.high = Math.ceil(high / step) * step;
    if (this.low === this.high) this.high += step;
  }
}

// Traces over time, one band each. rows: Rows; series: [{name, unit}] for columns 1 ….
export class Traces {
  constructor(canvas) {
    this.canvas = canvas;
    this.ink = canvas.getContext('2d', {alpha: false});
    this.cursor = null; // x as drawn
    this.marks = []; // {time, text, bad}
    this.scales = [];
    canvas.addEventListener('pointermove', (event) => { this.cursor = event.offsetX / letters; this.onCursor?.(); });
    canvas.addEventListener('pointerleave', () => { this.cursor = null; this.onCursor?.(); });
  }
  setSeries(series, rows) {
    this.series = series;
    this.rows = rows;
    this.scales = series.map(() => new Scale());
  }
  // Draws from `from` to `to`, s.
  draw(from, to) {
    const {ink, canvas, rows, series} = this;
    if (!series || !canvas.width) return;
    const colours = look(), [width, height] = measured(canvas, ink);
    const left = 64, right = 8, bottom = 20, plotWidth = width - left - right;
    ink.fillStyle = colours.ground;
    ink.fillRect(0, 0, width, height);
    if (plotWidth < 20) return;
    ink.font = '12px system-ui, sans-serif';
    const first = rows.find(from), last = rows.find(to);
    const xOf = (time) => left + (time - from) / (to - from) * plotWidth;
    const marks = this.marks.filter((mark) => mark.time >= from && mark.time <= to).map((mark) => ({...mark, at: xOf(mark.time), x: xOf(mark.time)}));
    const labels = placeLabels(marks, (text) => ink.measureText(text).width, left + plotWidth);
    const head = labels.reduce((most, one) => Math.max(most, (one.row + 1) * LABEL_ROW), 0);
    const band = (height - bottom - head) / Math.max(series.length, 1);
    this.#timeAxis(from, to, xOf, height, bottom, colours);
    const cursorTime = this.cursor !== null && this.cursor >= left ? from + (this.cursor - left) / plotWidth * (to - from) : null;
    const cursorRow = cursorTime === null ? -1 : Math.min(rows.find(cursorTime), rows.end - 1);
    this.#divide(first, last, from, to, Math.max(1, Math.floor(plotWidth)));
    for (let i = 0; i < series.length; ++i) this.#band(i, head + i * band, band, left, plotWidth, cursorRow, colours);
    ink.lineWidth = 1;
    const colourOf = (mark) => mark.bad ? colours.bad : colours.muted;
    for (const mark of marks) {
      const row = labels.find((one) => one.at === mark.at)?.row ?? head / LABEL_ROW;
      ink.strokeStyle = colourOf(mark);
      ink.beginPath();
      ink.moveTo(mark.at, row * LABEL_ROW);
      ink.lineTo(mark.at, height - bottom);
      ink.stroke();
    }
    for (const one of labels) { // on their own background: a line may pass
      ink.fillStyle = colours.ground;
      ink.fillRect(one.x - 2, one.row * LABEL_ROW + 1, ink.measureText(one.text).width + 4, LABEL_ROW - 1);
      ink.fillStyle = colourOf(one);
      ink.fillText(one.text, one.x, one.row * LABEL_ROW + 12);
    }
    if (cursorTime !== null) {
      ink.strokeStyle = colours.muted;
      ink.beginPath();
      ink.moveTo(this.cursor, 0);
      ink.lineTo(this.cursor, height - bottom);
      ink.stroke();
    }
  }
  #timeAxis(from, to, xOf, height, bottom, colours) {
    const ink = this.ink, step = niceStep(to - from, 8);
    ink.fillStyle = colours.muted;
    ink.strokeStyle = colours.line;
    ink.textAlign = 'center';
    ink.beginPath();
    for (let time = Math.ceil(from / step) * step; time <= to; time += step) {
      const x = Math.round(xOf(time)) + 0.5;
      ink.moveTo(x, 0);
      ink.lineTo(x, height - bottom);
      ink.fillText(label(time, step) + ' s', x, height - 6);
    }
    ink.stroke();
    ink.textAlign = 'left';
  }
  // Divides the rows into pixel columns: once for all series. starts[c] is the first row of column c.
  #divide(first, last, from, to, columns) {
    if (!this.starts || this.starts.length <= columns) {
      this.starts = new Float64Array(columns + 1);
      this.low = new Float32Array(columns);
      this.high = new Float32Array(columns);
    }
    const {starts, rows} = this, times = rows.columns[0], capacity = rows.capacity, perS = columns / (to - from);
    let next = 0;
    for (let row = first, place = first % capacity; row < last; ++row) {
      const column = Math.floor((times[place] - from) * perS);
      while (next <= column && next <= columns) starts[next++] = row;
      if (++place === capacity) place = 0;
    }
    while (next <= columns) starts[next++] = last;
    this.pixels = columns;
  }
  #band(i, top, band, left, plotWidth, cursorRow, colours) {
    const ink = this.ink, {rows, series, low, high, starts, pixels: columns} = this;
    const values = rows.columns[i + 1], capacity = rows.capacity;
    let least = Infinity, most = -Infinity, place = starts[0] % capacity;
    for (let column = 0; column < columns; ++column) {
      let l = Infinity, h = -Infinity; // NaN is neither less nor more
      for (let n = starts[column + 1] - starts[column]; n > 0; --n) {
        const value = values[place];
        if (value < l) l = value;
        if (value > h) h = value;
        if (++place === capacity) place = 0;
      }
      low[column] = l;
      high[column] = h;
      if (l < least) least = l;
      if (h > most) most = h;
    }
    const scale = this.scales[i];
    if (least <= most) scale.show(least, most);
    const bottomY = top + band - 4, topY = top + 18, high0 = scale.high, low0 = scale.low;
    const yOf = (value) => bottomY - (value - low0) / (high0 - low0) * (bottomY - topY);
    ink.strokeStyle = colours.line;
    ink.lineWidth = 1;
    ink.beginPath();
    ink.moveTo(left, Math.round(top + band) - 0.5);
    ink.lineTo(left + plotWidth, Math.round(top + band) - 0.5);
    ink.stroke();
    ink.fillStyle = colours.muted;
    ink.textAlign = 'right';
    if (low0 <= high0 && band > 36) {
      const factor = series[i].factor || 1, step = niceStep((high0 - low0) * factor, 4);
      ink.fillText(label(high0 * factor, step), left - 6, topY + 4);
      ink.fillText(label(low0 * factor, step), left - 6, bottomY + 2);
    }
    ink.textAlign = 'left';
    const own = colour(i);
    ink.fillStyle = own;
    ink.fillRect(left + 6, top + 6, 10, 3);
    ink.fillStyle = colours.ink;
    const unit = series[i].unit === '1' ? '' : ' ' + series[i].unit;
    let text = series[i].title || series[i].name;
    if (cursorRow >= rows.begin) text += `   ${short4(values[cursorRow % capacity] * (series[i].factor || 1))}${unit}`;
    else if (unit) text += ` (${series[i].unit})`;
    ink.fillText(text, left + 22, top + 12);
    ink.strokeStyle = own;
    ink.lineWidth = 1.25;
    ink.beginPath();
    let isDown = false;
    for (let column = 0; column < columns; ++column) {
      if (low[column] > high[column]) continue; // no sample in this column: the line goes on
      const x = left + column + 0.5;
      const from_ = yOf(low[column]), to_ = yOf(high[column]);
      if (!isDown) ink.moveTo(x, from_); else ink.lineTo(x, from_);
      if (to_ !== from_) ink.lineTo(x, to_);
      isDown = true;
    }
    ink.stroke();
  }
}

const short4 = (value) => Number.isFinite(value) ? (Math.abs(value) >= 1000 ? value.toFixed(0) : value.toPrecision(4)).replace('-', '−') : '–';

function frame(ink, width, height, xScale, yScale, xLabel, yLabel, colours) {
  const box = {left: 56, top: 12, right: width - 12, bottom: height - 36};
  const xOf = (v) => box.left + (v - xScale.low) / (xScale.high - xScale.low) * (box.right - box.left);
  const yOf = (v) => box.bottom - (v - yScale.low) / (yScale.high - yScale.low) * (box.bottom - box.top);
  ink.font = '12px system-ui, sans-serif';
  ink.strokeStyle = colours.line;
  ink.fillStyle = colours.muted;
  ink.lineWidth = 1;
  ink.beginPath();
  const xStep = niceStep(xScale.high - xScale.low, 6), yStep = niceStep(yScale.high - yScale.low, 5);
  ink.textAlign = 'center';
  for (let v = Math.ceil(xScale.low / xStep) * xStep; v <= xScale.high + 1e-9; v += xStep) {
    ink.moveTo(xOf(v), box.top);
    ink.lineTo(xOf(v), box.bottom);
    ink.fillText(label(v, xStep), xOf(v), box.bottom + 15);
  }
  ink.textAlign = 'right';
  for (let v = Math.ceil(yScale.low / yStep) * yStep; v <= yScale.high + 1e-9; v += yStep) {
    ink.moveTo(box.left, yOf(v));
    ink.lineTo(box.right, yOf(v));
    ink.fillText(label(v, yStep), box.left - 6, yOf(v) + 4);
  }
  ink.stroke();
  ink.textAlign = 'center';
  ink.fillText(xLabel, (box.left + box.right) / 2, height - 6);
  ink.save();
  ink.translate(13, (box.top + box.bottom) / 2);
  ink.rotate(-Math.PI / 2);
  ink.fillText(yLabel, 0, 0);
  ink.restore();
  ink.textAlign = 'left';
  return {xOf, yOf, box};
}

function blank(canvas, ink) {
  const [width, height] = measured(canvas, ink);
  ink.fillStyle = look().ground;
  ink.fillRect(0, 0, width, height);
  return [width, height];
}

// Force over displacement: the last seconds fade. x, y, y2: columns of Rows; stiffness: of the target's line.
export class Trail {
  constructor(canvas) {
    this.canvas = canvas;
    this.ink = canvas.getContext('2d', {alpha: false});
    this.xScale = new Scale(2);
    this.yScale = new Scale(1);
  }
  draw(rows, {x, felt, object, until, spanS, stiffness}) {
    const {ink, canvas, xScale, yScale} = this;
    if (!canvas.width) return;
    const colours = look(), [width, height] = blank(canvas, ink);
    const first = rows.find(until - spanS), last = rows.find(until);
    let x1 = 0, y0 = 0, y1 = 0;
    const xs = rows.columns[x], felts = rows.columns[felt], objects = rows.columns[object], capacity = rows.capacity;
    for (let row = first; row < last; ++row) {
      const p = row % capacity;
      if (xs[p] > x1) x1 = xs[p];
      if (felts[p] > y1) y1 = felts[p];
      if (objects[p] > y1) y1 = objects[p];
      if (felts[p] < y0) y0 = felts[p];
    }
    xScale.show(0, x1);
    yScale.show(y0 < -0.4 ? Math.max(y0, -2) : 0, y1);
    const {xOf, yOf, box} = frame(ink, width, height, xScale, yScale, 'displacement (mm)', 'force (N)', colours);
    ink.save();
    ink.beginPath();
    ink.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    ink.clip();
    if (stiffness > 0) {
      ink.strokeStyle = colours.muted;
      ink.setLineDash([6, 4]);
      ink.beginPath();
      ink.moveTo(xOf(0), yOf(0));
      ink.lineTo(xOf(xScale.high), yOf(xScale.high * stiffness));
      ink.stroke();
      ink.setLineDash([]);
    }
    const pieces = 12, step = Math.max(1, Math.floor((last - first) / 1200));
    for (const [values, own, wide] of [[objects, colour(4), 1.2], [felts, colour(0), 2]]) {
      ink.strokeStyle = own;
      ink.lineWidth = wide;
      for (let piece = 0; piece < pieces; ++piece) {
        const from = first + Math.floor((last - first) * piece / pieces);
        const to = Math.min(last - 1, first + Math.floor((last - first) * (piece + 1) / pieces) + step);
        ink.globalAlpha = ((piece + 1) / pieces) ** 1.6;
        ink.beginPath();
        for (let row = from; row <= to; row += step) {
          const p = row % capacity;
          if (row === from) ink.moveTo(xOf(xs[p]), yOf(values[p])); else ink.lineTo(xOf(xs[p]), yOf(values[p]));
        }
        ink.stroke();
      }
    }
    ink.globalAlpha = 1;
    if (last > first) {
      const p = (last - 1) % capacity;
      ink.fillStyle = colour(0);
      ink.beginPath();
      ink.arc(xOf(xs[p]), yOf(felts[p]), 4, 0, 7);
      ink.fill();
    }
    ink.restore();
    ink.font = '12px system-ui, sans-serif';
    const key = [[colour(0), 'felt by the hand'], [colour(4), 'of the object'], [colours.muted, 'target: ' + (stiffness > 0 ? `${stiffness.toFixed(2)} N/mm` : 'none')]];
    key.forEach(([own, text], i) => {
      ink.fillStyle = own;
      ink.fillRect(box.left + 10, box.top + 12 + 17 * i, 14, 3);
      ink.fillStyle = colours.ink;
      ink.fillText(text, box.left + 30, box.top + 18 + 17 * i);
    });
  }
}

// Points and curves. series: [{points: [[x, y], …], colour, dots, title}]
export function drawXY(canvas, series, xLabel, yLabel) {
  const ink = canvas.getContext('2d', {alpha: false});
  if (!canvas.width) return;
  const colours = look(), [width, height] = blank(canvas, ink);
  const all = series.flatMap((one) => one.points);
  const xScale = new Scale(), yScale = new Scale();
  if (!all.length) return;
  const of = (i, f) => all.reduce((best, point) => f(best, point[i]), all[0][i]);
  xScale.show(Math.min(0, of(0, Math.min)), of(0, Math.max));
  yScale.show(Math.min(0, of(1, Math.min)), of(1, Math.max));
  const {xOf, yOf, box} = frame(ink, width, height, xScale, yScale, xLabel, yLabel, colours);
  series.forEach((one, i) => {
    ink.fillStyle = ink.strokeStyle = one.colour || colour(i);
    ink.lineWidth = 2;
    if (one.dots) {
      for (const [x, y] of one.points) ink.fillRect(xOf(x) - 1.5, yOf(y) - 1.5, 3, 3);
    } else {
      ink.beginPath();
      one.points.forEach(([x, y], n) => { if (n) ink.lineTo(xOf(x), yOf(y)); else ink.moveTo(xOf(x), yOf(y)); });
      ink.stroke();
    }
    ink.fillRect(box.left + 10, box.top + 12 + 17 * i, 14, 3);
    ink.fillStyle = colours.ink;
    ink.fillText(one.title || '', box.left + 30, box.top + 18 + 17 * i);
  });
}

// Draws a CoverageMap of the contract: full cells are enough, framed ones are still wanted.
export function drawCoverage(canvas, map) {
  const ink = canvas.getContext('2d', {alpha: false});
  if (!canvas.width || !map.x?.bins) return;
  const colours = look(), [width, height] = blank(canvas, ink);
  const range = (axis) => ({low: axis.from, high: axis.to > axis.from ? axis.to : axis.from + 1});
  const y = map.y?.bins ? map.y : {quantity: '', unit: '', from: 0, to: 1, bins: 1};
  const {xOf, yOf} = frame(ink, width, height, range(map.x), range(y), `${map.x.quantity} (${map.x.unit})`,
    y.quantity ? `${y.quantity} (${y.unit})` : '', colours);
  const xAt = (i) => xOf(map.x.from + (map.x.to - map.x.from) * i / map.x.bins);
  const yAt = (j) => yOf(y.from + (y.to - y.from) * j / y.bins);
  for (let j = 0; j < y.bins; ++j) {
    for (let i = 0; i < map.x.bins; ++i) {
      const n = j * map.x.bins + i;
      const box = [xAt(i) + 1, yAt(j + 1) + 1, xAt(i + 1) - xAt(i) - 2, yAt(j) - yAt(j + 1) - 2];
      const has = map.enough?.length ? map.enough[n] : map.counts[n] > 0;
      if (has || map.counts[n] > 0) {
        ink.fillStyle = has ? '#009e73' : '#56b4e9';
        ink.globalAlpha = has ? 0.85 : 0.5;
        ink.fillRect(...box);
        ink.globalAlpha = 1;
      }
      if (map.required?.[n] && !has) {
        ink.strokeStyle = '#d55e00';
        ink.lineWidth = 2;
        ink.strokeRect(...box);
      }
    }
  }
}
