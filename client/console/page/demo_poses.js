// Poses as a daemon sends them, without one: a hand that feels for a tumour in a soft half-sphere. For tests, and to look at the
// page without a rig. `truth` is where tool and object really are, which a camera would see.

const RADIUS = 60, TUMOUR = [6, -8, -25];

function hand(s) {
  // A palpation: the tip goes along a Lissajous path over the top and presses every 1.4 s.
  const x = 22 * Math.sin(0.9 * s), y = 16 * Math.sin(1.3 * s + 0.6);
  const surface = Math.sqrt(Math.max(1, RADIUS * RADIUS - x * x - y * y)) - RADIUS;
  const press = 7 * Math.max(-1.2, Math.sin(2 * Math.PI * s / 1.4));
  const n = [x / RADIUS, y / RADIUS, (surface + RADIUS) / RADIUS];
  return { p: [x - n[0] * press, y - n[1] * press, surface - n[2] * press], n, depth: Math.max(0, press) };
}

function orientation(s) {
  const a = 0.35 * Math.sin(0.7 * s), b = 0.3 * Math.sin(0.5 * s + 1);
  const q = { w: Math.cos(a / 2) * Math.cos(b / 2), x: Math.sin(a / 2) * Math.cos(b / 2), y: Math.cos(a / 2) * Math.sin(b / 2), z: -Math.sin(a / 2) * Math.sin(b / 2) };
  return q;
}
const vector = (v) => ({ x: v[0], y: v[1], z: v[2] });

export function demoPose(s, predictMs, registrationMm, sent) {
  const at = hand(s), later = hand(s + 0.001), h = predictMs / 1000;
  const v = at.p.map((c, i) => 1000 * (later.p[i] - c));
  const p = at.p.map((c, i) => c + v[i] * h + registrationMm[i]);
  const moved = TUMOUR.map((c, i) => c - 0.4 * at.depth * at.n[i] * Math.exp(-((at.p[0] - TUMOUR[0]) ** 2 + (at.p[1] - TUMOUR[1]) ** 2) / 800));
  const ahead = 3 * h * h * 400, variance = 0.04 + ahead * ahead;
  return {
    time: { rig_ns: String(Math.round(1e9 * (s + h))), daemon_ns: String(Math.round(1e9 * (s + h))), daemon_bound_ns: '20000' },
    tick: String(Math.round(1000 * s)), frame: 'POSE_FRAME_RIG', position_mm: vector(p), orientation: orientation(s), velocity_mm_per_s: vector(v),
    position_covariance_mm2: { xx: variance * 2, xy: 0.1, xz: 0, yy: variance, yz: 0, zz: variance * 1.4 + 0.3 },
    error_sources: ['POSE_ERROR_SOURCE_RESOLUTION', 'POSE_ERROR_SOURCE_PREDICTION', 'POSE_ERROR_SOURCE_CALIBRATION'], calibration: 'demo',
    prediction: { ahead_ms: predictMs, error_mm: Math.sqrt(3 * ahead * ahead), error_bound_mm: 5000 * h * h },
    in_contact: at.depth > 0, ...(at.depth > 0 ? { normal: vector(at.n) } : {}), displacement_mm: at.depth, target_stiffness_n_per_mm: 0.45,
    reaction_force_n: 0.3 * at.depth, inclusion_mm: vector(moved), sent: String(sent), skipped: '0',
    contact: { number: Math.floor(s / 1.4) + 1, began: { rig_ns: String(Math.round(1.4e9 * Math.floor(s / 1.4))) } },
  };
}

/// Calls onPose(pose, arrived ms) at a rate, and answers exchanges of stamps by its own clock.
export function openDemo({ rateHz, predictMs, registrationMm = [1.2, -0.8, 0.5] }, onPose) {
  const offset = 5_000_000;
  let sent = 0;
  const timer = setInterval(() => {
    const now = performance.now();
    onPose(demoPose((now + offset) / 1000, predictMs, registrationMm, ++sent), now);
  }, 1000 / rateHz);
  return {
    exchange: async () => ({ daemon_received_ns: 1e6 * (performance.now() + offset), daemon_sent_ns: 1e6 * (performance.now() + offset) }),
    /// What a camera saw at a time of the daemon's clock, ms.
    truth: (daemonMs) => {
      const at = hand(daemonMs / 1000);
      return { tip: at.p, orientation: orientation(daemonMs / 1000), normal: at.n, depth: at.depth };
    },
    close: () => clearInterval(timer),
  };
}
