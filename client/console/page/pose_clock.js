// Relation of the daemon's clock to performance.now(): bounds that hold for any delay of the network, from
// exchanges of stamps (ClockService.Exchange). All times are in ms.

/// Rate at which two quartz clocks run apart, at most.
const MAX_DRIFT = 200e-6;
/// The converted time approaches a better estimate by no more than this share.
const MAX_SLEW = 500e-6;

export class PoseClock {
  constructor() {
    this.known = false;
    this.exchanges = 0;
  }

  /// Adds an exchange: sent and received by performance.now(), the two stamps between by the daemon's clock.
  add(sentMs, receivedMs, daemonReceivedMs, daemonSentMs) {
    // A message does not arrive before it was sent.
    let lower = daemonSentMs - receivedMs, upper = daemonReceivedMs - sentMs;
    if (!(lower <= upper)) return;
    this.exchanges++;
    if (this.known) {
      const wider = (receivedMs - this.atMs) * MAX_DRIFT;
      const oldLower = this.lower - wider, oldUpper = this.upper + wider;
      if (lower <= oldUpper && upper >= oldLower) {
        lower = Math.max(lower, oldLower);
        upper = Math.min(upper, oldUpper);
      } else {
        this.shown = this.shownMs = undefined;  // another machine, or a clock that was set
      }
    }
    Object.assign(this, { lower, upper, atMs: receivedMs, known: true });
  }

  /// Bound of the error of a converted time, ±.
  boundMs(nowMs = performance.now()) {
    return this.known ? (this.upper - this.lower) / 2 + Math.max(0, nowMs - this.atMs) * MAX_DRIFT : Infinity;
  }

  /// The daemon's time at a time of this page; later never becomes earlier.
  toDaemon(localMs) {
    if (!this.known) return NaN;
    const best = (this.lower + this.upper) / 2;
    if (this.shown === undefined) {
      this.shown = best;
    } else {
      const most = Math.max(0, localMs - this.shownAtMs) * MAX_SLEW;
      this.shown += Math.max(-most, Math.min(most, best - this.shown));
      // What is out of bounds is wrong for certain.
      if (this.shown < this.lower - 1 || this.shown > this.upper + 1) this.shown = best;
    }
    // Later never becomes earlier, even if the first estimate was far off.
    const shownMs = this.shownMs === undefined ? localMs + this.shown : Math.max(this.shownMs, localMs + this.shown);
    this.shownAtMs = localMs;
    this.shownMs = shownMs;
    return shownMs;
  }
}

/// Exchanges stamps from now on: five times fast, then twice a second. `exchange()` resolves to an ExchangeResponse.
export function keepClock(clock, exchange) {
  let count = 0, stopped = false;
  const round = async () => {
    if (stopped) return;
    const sent = performance.now();
    try {
      const answer = await exchange();
      clock.add(sent, performance.now(), Number(answer.daemon_received_ns) / 1e6, Number(answer.daemon_sent_ns) / 1e6);
    } catch (error) {
      clock.problem = error;
    }
    setTimeout(round, ++count < 20 ? 50 : 500);
  };
  round();
  return () => { stopped = true; };
}
