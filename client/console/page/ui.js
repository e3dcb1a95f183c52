// Small helpers of all views: elements, numbers with units, errors, tables.

// el('button', {class: 'x', onclick: f, 'aria-label': 'y'}, 'text', child, …); null children are left out.
export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith('on')) node.addEventListener(name.slice(2), value);
    else if (name in node && name !== 'list' && name !== 'form' && typeof value !== 'string') node[name] = value;
    else node.setAttribute(name, value === true ? '' : value);
  }
  node.append(...children.flat(9).filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

// Changes the text only if it differs: nothing is drawn again for nothing.
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export function fill(node, ...children) {
  node.replaceChildren(...children.flat(9).filter((child) => child !== null && child !== undefined && child !== false));
}

const isNumber = (value) => value !== null && value !== undefined && value !== '' && Number.isFinite(Number(value));

// Number with its unit, "–" if there is none. Unit "1": none.
export function num(value, unit = '', decimals = 2) {
  if (!isNumber(value)) return '–';
  const text = Number(value).toFixed(decimals).replace(/^-(0(\.0*)?)$/, '$1').replace('-', '−');
  return unit && unit !== '1' ? `${text} ${unit}` : text;
}

// Number with a few significant digits, whatever its size.
export function short(value, unit = '') {
  if (!isNumber(value)) return '–';
  const number = Number(value);
  const size = Math.abs(number);
  const decimals = size === 0 || size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : size >= 0.1 ? 3 : 4;
  return num(number, unit, size > 0 && size < 0.0001 ? 7 : decimals);
}

export const count = (value) => isNumber(value) ? Number(value).toLocaleString('en').replaceAll(',', ' ') : '–';

// GUARD_STATE_LATCHED → "latched"
/// "added_force_at_5mm_n" → "added force at 5mm": the name of a parameter without its unit, which is written with the value.
export const parameterWords = (name) => name.replace(/_(n|mm|s|ms|rad|deg|hz|g|kg|w)(_(s|per|mm|n|rad|hz|m\d?).*)?$/, '').replaceAll('_', ' ');
export const word = (name, prefix) => (name || '').replace(prefix, '').toLowerCase().replaceAll('_', ' ');

export const bytes = (value) => {
  const size = Number(value);
  return size >= 1e9 ? num(size / 1e9, 'GB', 1) : size >= 1e6 ? num(size / 1e6, 'MB', 1) : num(size / 1e3, 'kB', 0);
};

export const duration = (seconds) => {
  const s = Number(seconds);
  return s < 60 ? num(s, 's', 1) : s < 3600 ? `${Math.floor(s / 60)} min ${Math.round(s % 60)} s` : `${Math.floor(s / 3600)} h ${Math.round(s % 3600 / 60)} min`;
};

export const clockTime = (unixNs) => new Date(Number(unixNs) / 1e6).toLocaleString('sv'); // 2026-11-25 19:08:38

// contact_reaction_force_n → contact reaction force
export const columnTitle = (name) =>
  name.replace(/_(n_per_mm|mm_per_s2|mm_per_s|rad_per_s|n_s_per_mm|n|mm|ms|ns|mj|rad)$/, '').replaceAll('_', ' ');

// Box that says what went wrong, where, and what to do.
export function errorBox(error) {
  const detail = error.detail || {};
  return el('div', {class: 'error', role: 'alert'}, el('strong', {}, error.message),
    detail.where ? el('div', {}, 'where: ', detail.where) : null,
    detail.value ? el('div', {}, 'value: ', detail.value) : null,
    detail.limit ? el('div', {}, 'allowed: ', detail.limit) : null,
    detail.remedy ? el('div', {class: 'remedy'}, detail.remedy) : null);
}

export function card(title, ...children) {
  return el('section', {class: 'card'}, el('h2', {}, title), ...children);
}

// The head of a column that explains itself to the eye: a screen reader reads it.
export const unseen = (text) => el('span', {class: 'unseen'}, text);

// rows: arrays of texts or elements; alignRight: numbers of columns.
export function table(head, rows, {alignRight = [], label} = {}) {
  const cell = (tag) => (content, i) => el(tag, {class: alignRight.includes(i) ? 'right' : undefined, scope: tag === 'th' ? 'col' : undefined}, content);
  return el('div', {class: 'scroll'}, el('table', {'aria-label': label},
    el('thead', {}, el('tr', {}, head.map(cell('th')))),
    el('tbody', {}, rows.map((row) => el('tr', {}, row.map(cell('td')))))));
}

// A definition list whose values can be changed without drawing it again: facts.set('key', 'text').
export function facts(entries) {
  const places = new Map();
  const list = el('dl', {class: 'facts'}, entries.map(([key, label]) => {
    const place = el('dd', {}, '–');
    places.set(key, place);
    return [el('dt', {}, label), place];
  }));
  list.set = (key, text) => setText(places.get(key), text);
  return list;
}

// A button that runs something at the daemon: waits, and shows what went wrong in `place`.
export function action(label, run, place, attributes = {}) {
  const button = el('button', {type: 'button', ...attributes}, label);
  button.addEventListener('click', async () => {
    button.disabled = true;
    try {
      const said = await run();
      if (place) fill(place, typeof said === 'string' ? el('div', {class: 'done', role: 'status'}, said) : null);
    } catch (error) {
      if (place) fill(place, errorBox(error));
    } finally {
      button.disabled = false;
    }
  });
  return button;
}

export function download(name, type, ...parts) {
  const url = URL.createObjectURL(new Blob(parts, {type}));
  const link = el('a', {href: url, download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
