// Tool, object and contact in space: the page /visual, and where the tool is in numbers.

import {telemetry} from '/api.js';
import {card, el, facts, num} from '/ui.js';

export function show(place) {
  const frame = el('iframe', {src: '/visual', title: 'tool and object in space'});
  const numbers = facts([['x', 'tip x'], ['y', 'tip y'], ['z', 'tip z'], ['tilt', 'tilt of the tool']]);
  const box = card('In space', el('p', {class: 'hint'}, el('a', {href: '/visual', target: '_blank', rel: 'noopener'}, 'open it alone'), ', e.g. for a second screen'), frame);
  place.append(el('div', {class: 'two'}, card('Tip, rig frame (z up)', numbers), box));
  fetch('/visual', {method: 'HEAD'}).then((answer) => {
    if (!answer.ok) frame.replaceWith(el('p', {class: 'muted'}, 'This daemon was built without the picture.'));
  });
  const subscription = telemetry({
    columns: ['sample_tip_position_x_mm', 'sample_tip_position_y_mm', 'sample_tip_position_z_mm', 'sample_orientation_x', 'sample_orientation_y'], maxRows: 32,
    rows: ({data, count, width}) => {
      if (!count) return;
      const [x, y, z, qx, qy] = data.subarray((count - 1) * width);
      numbers.set('x', num(x, 'mm', 1));
      numbers.set('y', num(y, 'mm', 1));
      numbers.set('z', num(z, 'mm', 1));
      numbers.set('tilt', num(2 * Math.asin(Math.min(1, Math.hypot(qx, qy))) * 180 / Math.PI, '°', 1));
    },
  });
  return () => subscription.close();
}
