#include "tests/measure/study/precision/motion/decimation.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

namespace hapticd::study {

namespace {

/// What is reported: value and where it belongs.
struct Reported {
  double at;
  double value;
};

std::vector<Reported> reported_of(const std::vector<double>& signal, std::size_t n, std::size_t phase,
                                  Decimation how) {
  std::vector<Reported> reported;
  if (how == Decimation::kPicks) {
    for (std::size_t i = phase; i < signal.size(); i += n)
      reported.push_back({static_cast<double>(i), signal[i]});
    return reported;
  }
  for (std::size_t i = phase; i + n <= signal.size(); i += n) {
    double sum = 0.0;
    for (std::size_t j = 0; j < n; ++j) sum += signal[i + j];
    const auto length = static_cast<double>(n);
    reported.push_back({static_cast<double>(i) + 0.5 * (length - 1.0), sum / length});
  }
  return reported;
}

/// First and last index of every burst.
std::vector<std::pair<std::size_t, std::size_t>> bursts_of(const std::vector<double>& signal, double above) {
  constexpr std::size_t kGap = 50;
  std::vector<std::pair<std::size_t, std::size_t>> bursts;
  for (std::size_t i = 0; i < signal.size(); ++i) {
    if (!(signal[i] > above)) continue;
    if (!bursts.empty() && i - bursts.back().second <= kGap) {
      bursts.back().second = i;
    } else {
      bursts.emplace_back(i, i);
    }
  }
  return bursts;
}

}  // namespace

DecimationLoss decimation_loss(const std::vector<double>& signal, std::size_t n, Decimation how,
                               double burst_above) {
  const auto bursts = bursts_of(signal, burst_above);
  DecimationLoss loss;
  double error_squares = 0.0;
  double squares = 0.0;
  std::size_t peaks = 0;
  for (std::size_t phase = 0; phase < n; ++phase) {
    const std::vector<Reported> reported = reported_of(signal, n, phase, how);
    for (std::size_t k = 0; k + 1 < reported.size(); ++k) {
      const auto from = static_cast<std::size_t>(std::ceil(reported[k].at));
      for (std::size_t i = from; static_cast<double>(i) < reported[k + 1].at; ++i) {
        const double share =
            (static_cast<double>(i) - reported[k].at) / (reported[k + 1].at - reported[k].at);
        const double rebuilt = reported[k].value + share * (reported[k + 1].value - reported[k].value);
        error_squares += (rebuilt - signal[i]) * (rebuilt - signal[i]);
        squares += signal[i] * signal[i];
      }
    }
    auto next = reported.begin();
    for (const auto& [first, last] : bursts) {
      const double largest = *std::max_element(signal.begin() + static_cast<std::ptrdiff_t>(first),
                                               signal.begin() + static_cast<std::ptrdiff_t>(last) + 1);
      while (next != reported.end() && next->at < static_cast<double>(first)) ++next;
      double max_reported = 0.0;
      for (; next != reported.end() && next->at <= static_cast<double>(last); ++next) {
        max_reported = std::max(max_reported, next->value);
      }
      const double missed = 1.0 - max_reported / largest;
      loss.peak_share += missed;
      loss.worst_peak_share = std::max(loss.worst_peak_share, missed);
      ++peaks;
    }
  }
  loss.rms_share = squares > 0.0 ? std::sqrt(error_squares / squares) : 0.0;
  if (peaks > 0) loss.peak_share /= static_cast<double>(peaks);
  return loss;
}

double power_beyond(const std::vector<double>& signal, double cycles_per_value) {
  const std::size_t count = std::min<std::size_t>(signal.size(), 4096);
  const std::size_t first = (signal.size() - count) / 2;
  const auto length = static_cast<double>(count);
  double mean = 0.0;
  for (std::size_t i = 0; i < count; ++i) mean += signal[first + i] / length;
  std::vector<double> windowed(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double hann = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / length);
    windowed[i] = hann * (signal[first + i] - mean);
  }
  double all = 0.0;
  double beyond = 0.0;
  for (std::size_t k = 1; 2 * k <= count; ++k) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / length;
    const std::complex<double> turn = std::polar(1.0, -angle);
    std::complex<double> sum = 0.0;
    // Horner's scheme: the last value first.
    for (std::size_t i = count; i-- > 0;) sum = sum * turn + windowed[i];
    const double power = std::norm(sum);
    all += power;
    if (static_cast<double>(k) / length > cycles_per_value) beyond += power;
  }
  return all > 0.0 ? beyond / all : 0.0;
}

}  // namespace hapticd::study
