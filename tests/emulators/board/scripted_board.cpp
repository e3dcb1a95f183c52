#include "tests/emulators/board/scripted_board.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace hapticd::emulators {

namespace {

constexpr double kEndV = 10.0;
constexpr std::size_t kBufferScans = 4096;

std::int64_t steady_ns() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// Rounds to the nearest code of a converter over ± 10 V; beyond the ends it stays there.
double digitised(double volts, int bits) {
  const double step = 2.0 * kEndV / std::pow(2.0, bits);
  const double code =
      std::clamp(std::round(volts / step), -std::pow(2.0, bits - 1), std::pow(2.0, bits - 1) - 1.0);
  return code * step;
}

}  // namespace

ScriptedBoard::ScriptedBoard(const ScriptedBoardConfig& config) : config_(config), arm_(config.arm) {}

std::int64_t ScriptedBoard::clock_ns() const {
  return frozen_time_.load() ? time_ns_.load() : steady_ns();
}
std::int64_t ScriptedBoard::now_ns() const noexcept {
  return clock_ns();
}

void ScriptedBoard::freeze_time() {
  time_ns_.store(steady_ns());
  frozen_time_.store(true);
}

void ScriptedBoard::advance_ns(std::int64_t by_ns) {
  time_ns_.fetch_add(by_ns);
  const std::lock_guard lock(mutex_);
  perform_due();
}

void ScriptedBoard::at_ns(std::int64_t time_ns, std::function<void(ScriptedBoard&)> action) {
  const std::lock_guard lock(mutex_);
  script_.emplace(time_ns, std::move(action));
}

void ScriptedBoard::perform_due() {
  const std::int64_t now = clock_ns();
  while (!script_.empty() && script_.begin()->first <= now) {
    const auto action = script_.begin()->second;
    script_.erase(script_.begin());
    action(*this);
  }
}

void ScriptedBoard::feed(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
  const std::lock_guard lock(mutex_);
  if (config_.paced) make_due_scans();  // what was due before still sees the old load
  force_n_ = force_n;
  torque_n_mm_ = torque_n_mm;
  if (config_.paced || !open_[0] || stopped_ || muted_ || gone_) return;
  newest_ns_ = clock_ns();
  scans_.push_back(scan_at(newest_ns_));
}

daq::Scan ScriptedBoard::scan_at(std::int64_t time_ns) {
  daq::Scan scan{.time_ns = time_ns};
  const std::array<double, 6> volts = gauges_.volts(force_n_, torque_n_mm_);
  for (std::size_t j = 0; j < 6; ++j) {
    noise_ ^= noise_ << 13U;
    noise_ ^= noise_ >> 7U;
    noise_ ^= noise_ << 17U;
    const double noise = 2.0 * static_cast<double>(noise_ >> 11U) / 9007199254740992.0 - 1.0;
    const double v =
        rail_v_[j].value_or(volts[j] + config_.gauge_offset_v[j] + config_.gauge_noise_v * noise);
    scan.volts[j] = nan_ ? std::numeric_limits<double>::quiet_NaN() : digitised(v, config_.input_bits);
  }
  for (std::size_t j = 0; j < daq::kSpareInputs; ++j) {
    scan.volts[daq::kGaugeInputs + j] = digitised(spare_v_[j], config_.input_bits);
  }
  return scan;
}

void ScriptedBoard::make_due_scans() {
  const std::int64_t now = clock_ns();
  const auto period_ns = static_cast<std::int64_t>(1e9 / config_.scan_rate_hz);
  if (!open_[0]) return;
  if (stopped_ || muted_ || gone_) {
    next_scan_ns_ = now + period_ns;
    return;
  }
  for (; next_scan_ns_ <= now; next_scan_ns_ += period_ns) {
    newest_ns_ = next_scan_ns_;
    scans_.push_back(scan_at(next_scan_ns_));
    if (scans_.size() > kBufferScans) {
      scans_.pop_front();
      overrun_ = true;
    }
  }
}

daq::ScanReading ScriptedBoard::take_scans(std::span<daq::Scan> into) noexcept {
  const std::lock_guard lock(mutex_);
  perform_due();
  if (config_.paced) make_due_scans();
  daq::ScanReading reading{
      .overrun = overrun_, .running = open_[0] && !stopped_ && !gone_, .newest_ns = newest_ns_};
  overrun_ = false;
  while (scans_.size() > into.size()) scans_.pop_front();
  reading.count = scans_.size();
  std::copy(scans_.begin(), scans_.end(), into.begin());
  scans_.clear();
  return reading;
}

void ScriptedBoard::move_tip(const hal::Vector3& position_mm) {
  move_joints(arm_.joints(position_mm));
}
void ScriptedBoard::move_joints(const std::array<double, 3>& joints_rad) {
  const std::lock_guard lock(mutex_);
  joints_rad_ = joints_rad;
}
void ScriptedBoard::turn_gimbal(const std::array<double, 3>& angles_rad) {
  const std::lock_guard lock(mutex_);
  gimbal_rad_ = angles_rad;
}
void ScriptedBoard::orient(const hal::Quaternion& orientation) {
  const std::lock_guard lock(mutex_);
  gimbal_rad_ = arm_.gimbal(joints_rad_, orientation);
}
void ScriptedBoard::put_spare(const std::array<double, daq::kSpareInputs>& volts) {
  const std::lock_guard lock(mutex_);
  if (config_.paced) make_due_scans();
  spare_v_ = volts;
}
hal::Vector3 ScriptedBoard::tip_force_n() const {
  const std::lock_guard lock(mutex_);
  return arm_.tip_force_n(joints_rad_, output_v_);
}
std::array<double, 3> ScriptedBoard::output_volts() const {
  const std::lock_guard lock(mutex_);
  return output_v_;
}
std::uint64_t ScriptedBoard::output_writes() const {
  const std::lock_guard lock(mutex_);
  return output_writes_;
}

bool ScriptedBoard::read_raw_counters(std::span<std::uint64_t> raw) noexcept {
  const std::lock_guard lock(mutex_);
  perform_due();
  if (!open_[1] || counters_fail_ || gone_) return false;
  const std::array<std::int64_t, 3> arm = arm_.counts(joints_rad_);
  const std::uint64_t mask =
      config_.counter_bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << config_.counter_bits) - 1U;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    std::int64_t count = 0;
    if (i < 3) {
      count = arm[i];
    } else {
      count =
          std::llround(gimbal_rad_[i - 3] / 6.28318530717958647692 * config_.gimbal_counts_per_turn[i - 3]);
    }
    count += config_.counter_start[i] + shift_[i];
    if (frozen_[i]) {
      if (*frozen_[i] == std::numeric_limits<std::int64_t>::min()) frozen_[i] = count;
      count = *frozen_[i];
    }
    raw[i] = static_cast<std::uint64_t>(count) & mask;
  }
  return true;
}

bool ScriptedBoard::put_volts(std::span<const double> volts) noexcept {
  const std::lock_guard lock(mutex_);
  perform_due();
  if (!open_[1] || outputs_fail_ || gone_) return false;
  for (std::size_t i = 0; i < std::min(volts.size(), output_v_.size()); ++i) {
    output_v_[i] = digitised(volts[i], config_.output_bits);
  }
  ++output_writes_;
  return true;
}

std::optional<hal::Error> ScriptedBoard::open(daq::BoardUse use) {
  const std::lock_guard lock(mutex_);
  perform_due();
  if (gone_) return hal::Error{"there is no such board", "scripted board", "", "", "plug it in"};
  open_[static_cast<std::size_t>(use)] = true;
  if (use == daq::BoardUse::kInputs) {
    scans_.clear();
    next_scan_ns_ = clock_ns();
    newest_ns_ = 0;
  }
  return std::nullopt;
}

void ScriptedBoard::close(daq::BoardUse use) noexcept {
  const std::lock_guard lock(mutex_);
  open_[static_cast<std::size_t>(use)] = false;
}

bool ScriptedBoard::engaged(daq::BoardUse use) const {
  const std::lock_guard lock(mutex_);
  return open_[static_cast<std::size_t>(use)];
}

daq::BoardInfo ScriptedBoard::info() const {
  return {.driver = "scripted",
          .model = "emulated board",
          .inputs = daq::kMaxInputs,
          .input_low_v = -kEndV,
          .input_high_v = kEndV,
          .input_bits = config_.input_bits,
          .scan_rate_hz = config_.scan_rate_hz,
          .outputs = 3,
          .output_low_v = -kEndV,
          .output_high_v = kEndV,
          .output_bits = config_.output_bits,
          .counters = 6,
          .counter_bits = config_.counter_bits};
}

void ScriptedBoard::describe(hal::PartReport& report) const {
  report.connection = "scripted board";
}

void ScriptedBoard::lose_scans(std::size_t scans) {
  const std::lock_guard lock(mutex_);
  if (config_.paced) make_due_scans();
  scans_.erase(scans_.begin(), scans_.begin() + static_cast<std::ptrdiff_t>(std::min(scans, scans_.size())));
  overrun_ = true;
}
void ScriptedBoard::repair_gauges() {
  const std::lock_guard lock(mutex_);
  rail_v_ = {};
  nan_ = false;
}
void ScriptedBoard::freeze_encoder(std::size_t joint, bool frozen) {
  const std::lock_guard lock(mutex_);
  frozen_[joint].reset();
  // Filled with what it reads next.
  if (frozen) frozen_[joint] = std::numeric_limits<std::int64_t>::min();
}

}  // namespace hapticd::emulators
