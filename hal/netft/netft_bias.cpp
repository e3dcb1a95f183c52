#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "hal/netft/box_expectation.h"
#include "hal/netft/netft_sensor.h"
#include "hal/shown_text.h"

namespace hapticd::netft {

namespace {

using BiasClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBiasTime{250};
constexpr std::chrono::milliseconds kBiasTimeout{2000};
constexpr std::chrono::milliseconds kBiasSettling{50};
constexpr int kBiasAttempts = 3;
/// Share of the samples that arrive in this time at the lowest allowed rate.
constexpr double kMinBiasShare = 0.5;
/// Share of the range within which readings are zero after a bias on the box.
constexpr double kBiasedShare = 0.005;

}  // namespace

std::optional<hal::Error> NetFtSensor::bias() {
  const MutexLock control(control_);
  if (!engaged_.load()) return not_engaged("the bias cannot be taken");
  // Odd while the box's own bias may change by this.
  struct UnderWay {
    explicit UnderWay(std::atomic<std::uint32_t>& commands) : count(commands) { ++count; }
    ~UnderWay() { ++count; }
    UnderWay(const UnderWay&) = delete;
    UnderWay& operator=(const UnderWay&) = delete;
    std::atomic<std::uint32_t>& count;
  };
  const UnderWay under_way(bias_commands_);
  std::optional<hal::Error> error;
  switch (config_.bias) {
    case BiasBy::kNone:
      return hal::Error{.what = "biasing is switched off",
                        .where = "[rig.netft] bias",
                        .value = "none",
                        .limit = "software, box",
                        .remedy = "choose what subtracts the reading of the unloaded sensor"};
    case BiasBy::kSoftware:
      error = bias_in_software();
      break;
    case BiasBy::kBox:
      error = bias_on_box();
      break;
  }
  if (error) return error;

  // The bias stays valid only while the box keeps these values after a restart.
  std::optional<std::array<double, 6>> box_bias;
  if (config_.read_configuration) {
    if (const auto box = read_box(BiasClock::now() + std::chrono::seconds(1))) box_bias = box->bias;
  }
  const MutexLock reported(reported_);
  box_bias_ = box_bias;
  foreign_bias_.reset();
  biased_by_other_.store(false);
  bias_lost_.store(false);
  return std::nullopt;
}

hal::Result<SixAxes<double>> NetFtSensor::measure_mean() {
  const auto fewest = static_cast<std::uint64_t>(
      std::ceil(kMinBiasShare * config_.lowest_rate_hz * std::chrono::duration<double>(kBiasTime).count()));
  const auto give_up = BiasClock::now() + kBiasTimeout;
  const RdtTotals before = stream_.totals();
  RdtTotals after = before;
  do {
    std::this_thread::sleep_for(kBiasTime);
    after = stream_.totals();
  } while (after.good - before.good < fewest && BiasClock::now() < give_up);

  const auto refusal = [this](std::string what, std::string value, std::string limit, std::string remedy) {
    return hal::Error{.what = std::move(what),
                      .where = place(),
                      .value = std::move(value),
                      .limit = std::move(limit),
                      .remedy = std::move(remedy)};
  };
  const std::uint64_t samples = after.good - before.good;
  if (samples < fewest) {
    return refusal("too few samples came for a bias", std::to_string(samples),
                   "at least " + std::to_string(fewest), "check the connection, then bias again");
  }
  if (after.saturated != before.saturated || after.faulty != before.faulty) {
    return refusal("the sensor was saturated or faulty while the bias was taken", "", "",
                   "take the tool out of contact, correct what the box reports, then bias again");
  }
  SixAxes<double> mean{};
  for (std::size_t i = 0; i < mean.size(); ++i) {
    const auto sum = static_cast<std::int64_t>(after.sum_counts[i] - before.sum_counts[i]);
    mean[i] = static_cast<double>(sum) / static_cast<double>(samples);
  }
  return mean;
}

std::optional<hal::Error> NetFtSensor::bias_in_software() {
  const auto mean = measure_mean();
  if (!mean) return mean.error();
  keep_zero(*mean);
  return std::nullopt;
}

void NetFtSensor::keep_zero(const SixAxes<double>& bias_counts) {
  zero_ = Zero{bias_counts, newtons_per_count_, newton_millimetres_per_count_};
  stream_.set_bias(bias_counts, bias_serial_.fetch_add(1) + 1);
}

bool NetFtSensor::zero_holds(const std::optional<BoxConfiguration>& box) {
  if (!zero_) return true;
  const bool same_units = zero_->newtons_per_count == newtons_per_count_ &&
                          zero_->newton_millimetres_per_count == newton_millimetres_per_count_;
  bool same_box_bias = true;  // if the page does not say
  {
    const MutexLock reported(reported_);
    if (box && box->bias && box_bias_) same_box_bias = *box->bias == *box_bias_;
  }
  if (same_units && same_box_bias) return true;
  if (!same_units) zero_->bias_counts = {};
  bias_serial_.fetch_add(1);
  return false;
}

std::optional<hal::Error> NetFtSensor::bias_on_box() {
  const SixAxes<double> ranges = ranges_of(config_.model);
  double worst = 0.0;
  // The command is one datagram, which may be lost: the readings show whether it had an effect.
  for (int attempt = 0; attempt < kBiasAttempts; ++attempt) {
    stream_.send(RdtCommand::kSetSoftwareBias);
    std::this_thread::sleep_for(kBiasSettling);
    const auto mean = measure_mean();
    if (!mean) return mean.error();
    worst = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
      const double unit = i < 3 ? newtons_per_count_ : newton_millimetres_per_count_;
      worst = std::max(worst, std::abs((*mean)[i] * unit) / ranges[i]);
    }
    if (worst < kBiasedShare) {
      keep_zero({});
      return std::nullopt;
    }
  }
  return hal::Error{.what = "the box did not apply the bias: its readings are not zero",
                    .where = place(),
                    .value = hal::number_text(100.0 * worst) + " % of the range",
                    .limit = "below " + hal::number_text(100.0 * kBiasedShare) + " %",
                    .remedy = "keep the tool out of contact and at rest, or set bias = \"software\""};
}

}  // namespace hapticd::netft
