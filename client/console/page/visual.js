// A visual AR client: the tool, the object, the contact's normal and the tumour that is felt, over a camera picture or over nothing,
// each drawn where it is when the picture is seen.
//
//   /visual?predict=30         ms ahead that the daemon predicts; the rest to the picture's instant is added here
//          &display=20         ms from drawing to light
//          &rate=120           poses a second
//          &background=clear   nothing behind, for see-through displays; camera = what a camera sees (simulated rigs), dark
//          &stereo=1           two pictures side by side, eyes 63 mm apart
//          &phantom=60         draws a half-sphere of this radius in mm; 0 = none. Without: where a simulated phantom is there
//          &frame=reference    of the calibration's tracker
//          &panel=off          the picture alone
//          &source=demo        no daemon: a hand that palpates

import { PoseClock, keepClock } from './pose_clock.js';
import { Scene3d, along, ellipsoid, minus, norm, placed, plus, posed, projected, unit } from './scene3d.js';

const params = new URLSearchParams(location.search);
const number = (name, otherwise) => (params.has(name) && Number.isFinite(Number(params.get(name))) ? Number(params.get(name)) : otherwise);
const view = {
  predictMs: number('predict', 30), displayMs: number('display', 20), rateHz: number('rate', 120), radius: number('phantom', NaN),
  stereo: params.get('stereo') === '1', background: params.get('background') || 'camera', frame: params.get('frame') || 'rig',
  demo: params.get('source') === 'demo',
};
/// Time beyond which a velocity says nothing about where the tool is.
const MAX_EXTRAPOLATION_MS = 50;
const STALE_MS = 500;
const OBJECT_EVERY_MS = 2000;
/// A smaller distance between the overlay and the tool is not seen.
const SEEN_MM = 0.1;
/// Radius of the phantoms, and of the demonstration's, mm.
const PHANTOM_RADIUS = 60;
/// Pixels drawn for each of the screen's, along one side.
const MOST_RATIO = 1.5, LEAST_RATIO = 0.4;
/// A camera's picture is so old when it is shown; the overlay has to meet the tool in it, not the tool now.
const CAMERA_AGE_MS = 40;

const $ = (id) => document.getElementById(id);
const vec = (v) => [v.x, v.y, v.z];
const clock = new PoseClock();
/// State for tests and for a person at the browser's console.
const state = { frames: 0, fps: 0, poses: 0, ageMs: NaN, missMm: NaN, problem: '', stage: 'starting', workMs: 0, object: '', drawn: [] };
window.hapticdVisual = state;

let newest = null;  // { pose, atMs: when it came }
let cameraTruth = null;  // (daemon ms) → { tip, orientation, normal, depth }, if the rig is simulated

function setStage(stage, notice = '') {
  state.stage = stage;
  state.problem = notice;
  document.body.dataset.state = stage;
  $('notice').textContent = notice;
}

function take(pose) {
  newest = { pose, atMs: performance.now() };
  state.poses++;
  const measuredMs = Number(pose.time.daemon_ns) / 1e6 - (pose.prediction ? pose.prediction.ahead_ms : 0);
  state.ageMs = clock.toDaemon(newest.atMs) - measuredMs;
}

// ---- where poses come from

async function openDaemon() {
  const api = await import('./api.js');
  const request = { rate_hz: view.rateHz, predict_ms: view.predictMs, frame: 'POSE_FRAME_' + view.frame.toUpperCase() };
  api.onLink(({ state: link }) => {
    if (link === 'signed out') setStage('refused', 'not signed in: open the link that hapticctl console prints');
    else if (link === 'lost') setStage('waiting', 'the daemon does not answer');
    else if (state.stage !== 'refused') setStage('live');
  });
  // Few credits: what this page cannot draw is skipped in the daemon, and what comes is the newest.
  api.stream('PoseService/Subscribe', request, {
    message: take, credits: 2, again: true,
    end: (error) => setStage('refused', error ? `${error.message}. ${error.remedy}` : 'the stream ended'),
  });
  followObject(api);
  keepClock(clock, () => api.rpc('ClockService/Exchange', { client_sent_ns: String(Math.round(1e6 * performance.now())) }));
  if (view.background === 'camera') followTruth(api);
}

/// Follows which object a simulated rig has under the tool. Nobody knows that of a real one.
async function followObject(api) {
  try {
    state.object = (await api.rpc('SimulationService/GetSimulation')).object;
  } catch {
    state.object = '';
    return;
  }
  setTimeout(followObject, OBJECT_EVERY_MS, api);
}

/// Follows the truth of a simulated rig in place of a camera: positions of the last second, by the rig's
/// clock.
function followTruth(api) {
  const columns = ['time_ns', 'truth_tip_position_x_mm', 'truth_tip_position_y_mm', 'truth_tip_position_z_mm', 'truth_displacement_mm',
    'truth_normal_x', 'truth_normal_y', 'truth_normal_z', 'sample_orientation_w', 'sample_orientation_x', 'sample_orientation_y', 'sample_orientation_z'];
  const kept = [];
  api.telemetry({
    columns, maxRows: 1024,
    rows: ({ data, count, width }) => {
      for (let i = 0; i < count; i++) kept.push(data.slice(i * width, (i + 1) * width));
      if (kept.length > 2000) kept.splice(0, kept.length - 1200);
    },
    // Not a simulated rig: nothing stands in for a camera.
    end: (error) => {
      view.background = 'dark';
      state.camera = error.message;
    },
  });
  cameraTruth = (daemonMs) => {
    const time = newest && newest.pose.time;
    if (!time || time.daemon_ns === undefined || kept.length === 0) return null;
    const rigNs = 1e6 * daemonMs - (Number(time.daemon_ns) - Number(time.rig_ns));
    let low = 0, high = kept.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (kept[middle][0] <= rigNs) low = middle; else high = middle - 1;
    }
    const r = kept[low];
    return { tip: [r[1], r[2], r[3]], depth: r[4], normal: [r[5], r[6], r[7]], orientation: { w: r[8], x: r[9], y: r[10], z: r[11] } };
  };
}

async function openDemo() {
  const demo = await import('./demo_poses.js');
  const source = demo.openDemo({ rateHz: view.rateHz, predictMs: view.predictMs, registrationMm: [number('off', 1.2), -0.8, 0.5] }, take);
  cameraTruth = source.truth;
  keepClock(clock, source.exchange);
  setStage('live');
}

// ---- the pose at the instant of the picture

/// Goes on from the pose by its velocity, to the instant that the picture shows. In contact not along the normal: the object holds
/// the tip.
function poseAt(daemonMs) {
  const { pose } = newest, p = vec(pose.position_mm);
  const poseMs = pose.time.daemon_ns === undefined ? NaN : Number(pose.time.daemon_ns) / 1e6;
  let lead = daemonMs - poseMs;
  if (!Number.isFinite(lead)) lead = 0;
  lead = Math.max(-MAX_EXTRAPOLATION_MS, Math.min(MAX_EXTRAPOLATION_MS, lead));
  let v = vec(pose.velocity_mm_per_s || { x: 0, y: 0, z: 0 });
  if (pose.normal) {
    const n = vec(pose.normal);
    v = plus(v, n, -(v[0] * n[0] + v[1] * n[1] + v[2] * n[2]));
  }
  return { tip: plus(p, v, lead / 1000), orientation: pose.orientation || { w: 1, x: 0, y: 0, z: 0 }, leadMs: lead };
}

// ---- what is drawn

const MATTER = [0.78, 0.62, 0.55];
/// Radius of the half-sphere; 0 if there is none.
function domeRadius() {
  if (Number.isFinite(view.radius)) return view.radius;
  return view.demo || state.object.startsWith('phantom') ? PHANTOM_RADIUS : 0;
}

/// The object: a half-sphere, or, of one whose shape is not known, the surface where it is touched.
function objectParts(touch, alpha, camera) {
  const look = { colour: [...MATTER, alpha], gloss: 0.25, rim: alpha < 1 ? 0.7 : 0, grain: camera ? 0.05 : 0 };
  const radius = domeRadius();
  if (radius > 0) return [{ mesh: 'dome', model: placed([0, 0, 0], radius), dent: touch, ...look }];
  return touch ? [{ mesh: 'sphere', model: ellipsoid(disc(touch.normal, 7), plus(touch.at, touch.normal, -1), 2), ...look }] : [];
}

/// A covariance, mm²: so wide at right angles to the normal, and flat along it.
function disc(n, deviation) {
  const v = deviation * deviation, of = (i, j) => v * ((i === j ? 1 : 0) - n[i] * n[j]);
  return { xx: of(0, 0), xy: of(0, 1), xz: of(0, 2), yy: of(1, 1), yz: of(1, 2), zz: of(2, 2) };
}

/// A dent in the surface where the tip is; z of the half-sphere there, so that the tip touches it.
const dentOf = (tip, normal, depth) => (depth > 0.05 ? { at: tip, normal: unit(normal), depth, width: Math.max(6, 1.6 * depth) } : null);

/// The camera's picture: what is there, in its own colours, grainy.
function cameraParts(truth) {
  const table = { mesh: 'table', model: placed([0, 0, -Math.max(domeRadius(), 20)]), colour: [0.42, 0.43, 0.42, 1], checker: 20, grain: 0.06 };
  if (!truth) return [table, ...objectParts(null, 1, true)];
  return [table, ...objectParts(dentOf(truth.tip, truth.normal, truth.depth), 1, true),
    { mesh: 'tool', model: posed(truth.orientation, truth.tip), colour: [0.62, 0.6, 0.56, 1], gloss: 0.7, grain: 0.06 }];
}

function overlayParts(pose, shown, hasCamera) {
  const parts = [];
  const normal = pose.normal ? vec(pose.normal) : [0, 0, 1];
  if (!hasCamera) parts.push(...objectParts(dentOf(shown.tip, normal, pose.displacement_mm || 0), 0.28, false));
  if (pose.inclusion_mm) {
    parts.push({ mesh: 'sphere', model: placed(vec(pose.inclusion_mm), 9), colour: [1, 0.36, 0.45, 0.55], rim: 0.8, onTop: true });
  }
  // After the picture's depth is gone: what is tracked is seen wherever it is.
  parts.push({ mesh: 'tool', model: posed(shown.orientation, shown.tip), colour: [0.22, 0.78, 1, hasCamera ? 0.45 : 0.9], rim: 0.6, gloss: 0.4, clearsDepth: true });
  if (pose.position_covariance_mm2) {
    parts.push({ mesh: 'sphere', model: ellipsoid(pose.position_covariance_mm2, shown.tip, 2), colour: [1, 0.72, 0.3, 0.75], rim: 0.5, onTop: true });
  }
  if (pose.in_contact && pose.normal) {
    const length = 12 + 10 * Math.min(4, Math.abs(pose.reaction_force_n || 0));
    parts.push({ mesh: 'arrow', model: along(normal, shown.tip, length, 14), colour: [0.49, 1, 0.54, 1], gloss: 0.3 });
  }
  return parts;
}

function views(aspect) {
  const at = [0, 0, -14], eye = [70, -250, 150], up = [0, 0, 1];
  if (!view.stereo) return [{ x: 0, width: 1, eye, at, up, fov: 0.62 }];
  const side = unit([-(at[1] - eye[1]), at[0] - eye[0], 0]).map((c) => -c);
  return [-1, 1].map((s, i) => ({ x: 0.5 * i, width: 0.5, eye: plus(eye, side, 31.5 * s), at, up, fov: aspect < 2 ? 0.7 : 0.6 }));
}

// ---- words

const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : '–');
function deviation(c) {
  return Math.sqrt(Math.max(0, c.xx + c.yy + c.zz));
}

function showWords(nowMs) {
  if (!newest) return;
  const { pose, atMs } = newest;
  $('contact').textContent = pose.in_contact === undefined ? 'no scene is loaded'
    : pose.in_contact ? `touches, ${fixed(pose.displacement_mm, 2)} mm deep` : 'free';
  $('object').textContent = pose.target_stiffness_n_per_mm === undefined ? 'as it is' : `felt with ${fixed(pose.target_stiffness_n_per_mm, 2)} N/mm`;
  const covers = (pose.error_sources || []).includes('POSE_ERROR_SOURCE_CALIBRATION');
  $('error').textContent = `${fixed(deviation(pose.position_covariance_mm2), 2)} mm (1 σ)` + (covers ? '' : ', the arm itself not included: not calibrated')
    + (Number.isFinite(state.missMm) ? `; seen ${fixed(state.missMm, 2)} mm` : '');
  $('ahead').textContent = `${fixed(view.displayMs, 0)} ms from now, ${view.predictMs} ms predicted`;
  $('age').textContent = `${fixed(state.ageMs, 1)} ms`;
  $('clock').textContent = clock.known ? `known within ±${fixed(clock.boundMs(nowMs), 2)} ms` : 'not known yet';
  $('stream').textContent = `${pose.sent || 0} poses, ${pose.skipped || 0} skipped`;
  $('fps').textContent = `${fixed(state.fps, 0)} a second, ${fixed(state.workMs, 1)} ms work`;
  if (state.stage === 'live' && nowMs - atMs > STALE_MS) setStage('stale', 'no pose comes: does the loop run?');
  if (state.stage === 'stale' && nowMs - atMs < STALE_MS) setStage('live');
}

/// A line of text at a place of the scene, in each view.
function label(index, projections, place, text, kind = '') {
  projections.forEach(({ matrix, x, width }, i) => {
    const key = `label-${index}-${i}`;
    let element = $(key);
    if (!element) {
      element = Object.assign(document.createElement('div'), { id: key });
      $('labels').append(element);
    }
    const at = place && projected(matrix, place);
    element.hidden = !at || !text;
    if (!at || !text) return;
    element.className = `label ${kind}`;
    element.textContent = text;
    element.style.left = `${100 * (x + width * at[0])}%`;
    element.style.top = `${100 * at[1]}%`;
  });
}

function start() {
  document.body.dataset.background = view.background;
  document.body.dataset.panel = params.get('panel') || 'on';
  $('panel').open = innerWidth >= 900 && !view.stereo; // else it would hide what it describes, in stereo from one eye
  let scene;
  try {
    scene = new Scene3d($('scene'));
  } catch (error) {
    return setStage('refused', `this page cannot draw: ${error.message}`);
  }
  (view.demo ? openDemo() : openDaemon()).catch((error) => setStage('refused', String(error.message || error)));

  let countedFrom = performance.now(), counted = 0, wordsAt = 0, pixelRatio = scene.byProcessor ? 0.6 : 1;
  const frame = () => {
    requestAnimationFrame(frame);
    const nowMs = performance.now();
    scene.resize(pixelRatio);
    const hasCamera = view.background === 'camera' && cameraTruth !== null;
    // A camera's picture is old: what is laid over it belongs to its instant.
    const seenMs = clock.toDaemon(nowMs) + (hasCamera ? -CAMERA_AGE_MS : view.displayMs);
    const parts = [];
    let shown = null, truth = null;
    if (hasCamera) {
      truth = Number.isFinite(seenMs) ? cameraTruth(seenMs) : null;
      parts.push(...cameraParts(truth));
    }
    if (newest && newest.pose.position_mm) {
      shown = poseAt(seenMs);
      parts.push(...overlayParts(newest.pose, shown, hasCamera));
    }
    state.drawn = [...new Set(parts.map((part) => part.mesh))];
    const chosen = views(scene.canvas.width / scene.canvas.height);
    const behind = view.background === 'clear' ? [0, 0, 0, 0] : hasCamera ? [0.2, 0.21, 0.22, 1] : [0.06, 0.08, 0.1, 1];
    const matrices = scene.draw(chosen, parts, behind);
    if (state.onDrawn) {
      // For tests: after this callback the picture is gone from the canvas.
      state.onDrawn(scene.canvas);
      state.onDrawn = null;
    }
    const projections = matrices.map((matrix, i) => ({ matrix, x: chosen[i].x, width: chosen[i].width }));
    state.missMm = truth && shown ? norm(minus(shown.tip, truth.tip)) : NaN;
    label(0, projections, shown && shown.tip, state.missMm >= SEEN_MM ? `off by ${fixed(state.missMm, 1)} mm` : '', 'error');
    label(1, projections, newest && newest.pose.inclusion_mm && vec(newest.pose.inclusion_mm), 'tumour');
    state.frames++;
    counted++;
    state.workMs += 0.1 * (performance.now() - nowMs - state.workMs);
    if (nowMs - countedFrom >= 1000) {
      state.fps = 1000 * counted / (nowMs - countedFrom);
      // Where no graphics card draws: fewer pixels rather than fewer pictures.
      if (state.fps < 52) pixelRatio = Math.max(LEAST_RATIO, pixelRatio * 0.8);
      else if (state.fps > 58) pixelRatio = Math.min(MOST_RATIO, pixelRatio * 1.05);
      state.pixelRatio = pixelRatio;
      countedFrom = nowMs;
      counted = 0;
    }
    if (nowMs - wordsAt > 200) {
      wordsAt = nowMs;
      showWords(nowMs);
    }
  };
  frame();
}

start();
