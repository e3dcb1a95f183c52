#include "hal/daq/board.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace hapticd::daq {

std::optional<hal::Error> Board::engage(BoardUse use) {
  const MutexLock lock(users_mutex_);
  int& users = users_[static_cast<std::size_t>(use)];
  if (users == 0) {
    if (auto error = open(use)) return error;
    if (use == BoardUse::kMotion) {
      const BoardInfo now = info();
      counter_bits_.store(std::clamp(now.counter_bits, 1, 64), std::memory_order_relaxed);
      output_low_v_.store(now.output_low_v, std::memory_order_relaxed);
      output_high_v_.store(now.output_high_v, std::memory_order_relaxed);
      unwrap_again_.store(true, std::memory_order_release);
    }
  }
  ++users;
  if (use == BoardUse::kInputs) input_users_.store(users);
  return std::nullopt;
}

void Board::release(BoardUse use) noexcept {
  const MutexLock lock(users_mutex_);
  int& users = users_[static_cast<std::size_t>(use)];
  if (users == 0) return;
  --users;
  if (use == BoardUse::kInputs) input_users_.store(users);
  if (users > 0) return;
  if (use == BoardUse::kMotion) {
    constexpr std::array<double, kMaxOutputs> kZero{};
    write_volts(std::span(kZero).first(std::min(kMaxOutputs, info().outputs)));
  }
  close(use);
}

std::int64_t Board::now_ns() const noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void Board::keep_spare(std::span<const Scan> scans) noexcept {
  for (const Scan& scan : scans) {
    const auto spare = std::span(scan.volts).subspan(kGaugeInputs);
    if (!std::all_of(spare.begin(), spare.end(), [](double v) noexcept { return std::isfinite(v); }))
      continue;
    for (std::size_t i = 0; i < kSpareInputs; ++i) spare_sum_v_[i] += spare[i];
    ++spare_scans_;
  }
}

ScanReading Board::read_scans(std::span<Scan> scans) noexcept {
  if (reading_.test_and_set(std::memory_order_acquire)) {
    return {.running = true, .newest_ns = newest_ns_.load(std::memory_order_relaxed)};
  }
  const ScanReading reading = take_scans(scans);
  keep_spare(scans.first(reading.count));
  newest_ns_.store(reading.newest_ns, std::memory_order_relaxed);
  reading_.clear(std::memory_order_release);
  return reading;
}

std::size_t Board::read_spare_inputs(std::array<double, kSpareInputs>& mean_v) noexcept {
  if (reading_.test_and_set(std::memory_order_acquire)) return 0;
  if (input_users_.load() == 1) {
    std::array<Scan, 32> scans;
    const ScanReading reading = take_scans(scans);
    keep_spare(std::span<const Scan>(scans).first(reading.count));
    newest_ns_.store(reading.newest_ns, std::memory_order_relaxed);
  }
  const std::size_t count = std::exchange(spare_scans_, 0);
  for (std::size_t i = 0; i < kSpareInputs; ++i) {
    mean_v[i] = count > 0 ? spare_sum_v_[i] / static_cast<double>(count) : 0.0;
    spare_sum_v_[i] = 0.0;
  }
  reading_.clear(std::memory_order_release);
  return count;
}

bool Board::read_counters(std::span<std::int64_t> counts) noexcept {
  std::array<std::uint64_t, kMaxCounters> raw{};
  const std::size_t n = std::min(counts.size(), raw.size());
  if (unwrap_again_.exchange(false, std::memory_order_acq_rel)) {
    for (CounterUnwrap& counter : unwrap_) counter.restart();
  }
  if (!read_raw_counters(std::span(raw).first(n))) return false;
  const int bits = counter_bits_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < n; ++i) counts[i] = unwrap_[i].add(raw[i], bits);
  return true;
}

bool Board::write_volts(std::span<const double> volts) noexcept {
  std::array<double, kMaxOutputs> checked{};
  const std::size_t n = std::min(volts.size(), checked.size());
  const double low_v = output_low_v_.load(std::memory_order_relaxed);
  const double high_v = output_high_v_.load(std::memory_order_relaxed);
  const bool finite =
      std::all_of(volts.begin(), volts.end(), [](double v) noexcept { return std::isfinite(v); });
  for (std::size_t i = 0; finite && i < n; ++i) checked[i] = std::clamp(volts[i], low_v, high_v);
  const bool taken = put_volts(std::span<const double>(checked).first(n)) && finite;
  if (!taken) refused_outputs_.fetch_add(1, std::memory_order_relaxed);
  return taken;
}

}  // namespace hapticd::daq
