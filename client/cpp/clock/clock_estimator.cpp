#include "client/cpp/clock/clock_estimator.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "client/cpp/clock/clock_error.h"

namespace hapticd::client {
namespace {

constexpr double kMinDriftPpm = 0.001;
constexpr double kMaxDriftPpm = 10'000.0;
/// Sums and differences of two stamps fit.
constexpr std::int64_t kMaxStampNs = std::int64_t{1} << 61U;
/// A stamp is the last full ns.
constexpr std::int64_t kResolutionNs = 1;
constexpr std::int64_t kHistoryPauseNs = 1'000'000'000;
constexpr std::int64_t kHistoryNs = 600'000'000'000;

std::string in_ns(std::int64_t ns) {
  return std::to_string(ns) + " ns";
}

/// `later` must not be before `earlier`.
void check_order(std::int64_t earlier, std::int64_t later, const char* whose, const char* where) {
  if (later >= earlier) return;
  throw clock_error(
      std::string("the ") + whose + " clock ran backwards by " + in_ns(earlier - later), where, in_ns(later),
      "at least " + in_ns(earlier),
      "use a monotonic clock; where it is CLOCK_MONOTONIC, the machine or its kernel is at fault");
}

double decimal(double value) {
  return std::round(value * 1000.0) / 1000.0;
}

}  // namespace

ClockEstimator::ClockEstimator(double max_drift_ppm) : max_drift_ppm_(max_drift_ppm) {
  if (max_drift_ppm >= kMinDriftPpm && max_drift_ppm <= kMaxDriftPpm) return;
  throw clock_error("the largest drift is out of range", "max_drift_ppm", std::to_string(max_drift_ppm),
                    "0.001 … 10000 ppm", "200 ppm holds for two machines with ordinary oscillators");
}

std::int64_t ClockEstimator::widened(std::int64_t age_ns) const {
  return static_cast<std::int64_t>(std::ceil(1e-6 * max_drift_ppm_ * static_cast<double>(std::abs(age_ns)))) +
         kResolutionNs;
}

void ClockEstimator::check(const ClockExchange& exchange) const {
  for (const std::int64_t stamp : {exchange.client_sent_ns, exchange.daemon_received_ns,
                                   exchange.daemon_sent_ns, exchange.client_received_ns}) {
    if (stamp <= kMaxStampNs && stamp >= -kMaxStampNs) continue;
    throw clock_error("a stamp is no time", "exchange of clocks", in_ns(stamp), "±73 years in ns",
                      "see what stamps it");
  }
  check_order(exchange.client_sent_ns, exchange.client_received_ns, "client's", "during an exchange");
  check_order(exchange.daemon_received_ns, exchange.daemon_sent_ns, "daemon's", "during an exchange");
  if (!known_) return;
  check_order(last_.client_received_ns, exchange.client_sent_ns, "client's", "between two exchanges");
  check_order(last_.daemon_sent_ns, exchange.daemon_received_ns, "daemon's", "between two exchanges");
}

void ClockEstimator::add(const ClockExchange& exchange) {
  const bool was_known = known_;
  try {
    check(exchange);
  } catch (...) {
    known_ = false;
    history_.clear();
    throw;
  }
  // Both hold already when the first message was sent, and still when the second one has arrived.
  const Bound upper{exchange.daemon_received_ns - exchange.client_sent_ns + kResolutionNs,
                    exchange.client_sent_ns};
  const Bound lower{exchange.daemon_sent_ns - exchange.client_received_ns - kResolutionNs,
                    exchange.client_received_ns};
  // All widen equally fast: the one that is narrower now stays so.
  if (!was_known || upper.offset_ns <= upper_.offset_ns + widened(upper.client_ns - upper_.client_ns)) {
    upper_ = upper;
  }
  if (!was_known || lower.offset_ns >= lower_.offset_ns - widened(lower.client_ns - lower_.client_ns)) {
    lower_ = lower;
  }
  last_ = exchange;
  known_ = true;
  const ClockBounds now = bounds(exchange.client_received_ns);
  if (now.lower_ns > now.upper_ns) {
    known_ = false;
    history_.clear();
    throw clock_error("the clocks run apart faster than stated, or one was set", "exchange of clocks",
                      in_ns(now.lower_ns - now.upper_ns) + " outside of the bounds",
                      "at most " + std::to_string(max_drift_ppm_) + " ppm",
                      "state a larger drift; a machine that slept or whose clock was set begins again");
  }
  note(now);
}

ClockBounds ClockEstimator::bounds(std::int64_t client_ns) const {
  return {client_ns, lower_.offset_ns - widened(client_ns - lower_.client_ns),
          upper_.offset_ns + widened(client_ns - upper_.client_ns)};
}

void ClockEstimator::note(const ClockBounds& now) {
  if (!history_.empty() && now.client_ns - history_.back().client_ns < kHistoryPauseNs) return;
  history_.push_back(now);
  const auto first_kept = std::find_if(history_.begin(), history_.end(), [&](const ClockBounds& one) {
    return now.client_ns - one.client_ns <= kHistoryNs;
  });
  history_.erase(history_.begin(), first_kept);
}

ClockDrift ClockEstimator::drift() const {
  ClockDrift drift{0.0, max_drift_ppm_, 0.0};
  if (!known_ || history_.empty()) return drift;
  const ClockBounds& then = history_.front();
  const ClockBounds now = bounds(last_.client_received_ns);
  const auto over_ns = static_cast<double>(now.client_ns - then.client_ns);
  if (over_ns < static_cast<double>(kHistoryPauseNs)) return drift;
  const double low =
      std::max(-max_drift_ppm_, 1e6 * static_cast<double>(now.lower_ns - then.upper_ns) / over_ns);
  const double high =
      std::min(max_drift_ppm_, 1e6 * static_cast<double>(now.upper_ns - then.lower_ns) / over_ns);
  return {decimal(0.5 * (low + high)), 0.5 * (high - low) + 1e-3, 1e-9 * over_ns};
}

}  // namespace hapticd::client
