#include "hal/daq/daq_sensor.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "hal/axis_map.h"
#include "hal/bias_request.h"
#include "hal/daq/gauge_bias.h"
#include "hal/force_mean.h"
#include "hal/lock/mutex.h"
#include "hal/sample_clock.h"

namespace hapticd::daq {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::size_t kScansATick = 128;  // 10 kHz at 500 Hz is twenty; more means that the tick paused
constexpr std::int64_t kBeyondAnyLimitNs = std::numeric_limits<std::int64_t>::max();
constexpr milliseconds kPollInterval{1};
constexpr milliseconds kBiasTimeout{1000};
constexpr std::int64_t kSilentNs = 100'000'000;

/// "Nano17" "SI-25-0.25" → "nano17_si_25_0_25".
std::string model_name(const Calibration& calibration) {
  std::string name = calibration.body_style + "_" + calibration.part_number;
  for (char& c : name) {
    const bool upper = c >= 'A' && c <= 'Z';
    const bool plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (upper) {
      c = static_cast<char>(c - 'A' + 'a');
    } else if (!plain) {
      c = '_';
    }
  }
  return name;
}

hal::SensorInfo describe(const DaqSensorConfig& config, const Calibration& calibration,
                         const BoardInfo& board) {
  hal::SensorInfo info;
  info.model = model_name(calibration);
  info.range_n = std::max({calibration.max_load[0], calibration.max_load[1], calibration.max_load[2]});
  // One converter step of one gauge along the sensor's axis: the largest contribution of a gauge.
  const double step_v = (board.input_high_v - board.input_low_v) / std::exp2(board.input_bits);
  for (const double n_per_v : calibration.matrix[2]) {
    info.resolution_n = std::max(info.resolution_n, std::abs(n_per_v) * step_v);
  }
  info.sample_rate_hz = board.scan_rate_hz;
  info.tool_mass_g = config.tool_mass_g;
  return info;
}

}  // namespace

struct DaqSensor::State {
  State(const DaqSensorConfig& config_, Calibration calibration_, hal::AxisMap axes_,
        std::shared_ptr<Board> board_)
      : config(config_),
        calibration(std::move(calibration_)),
        axes(axes_),
        board(std::move(board_)),
        info(describe(config, calibration, board->info())),
        window(info.sample_rate_hz),
        clock(info.sample_rate_hz) {}

  const DaqSensorConfig config;
  const Calibration calibration;
  const hal::AxisMap axes;
  const std::shared_ptr<Board> board;
  const hal::SensorInfo info;

  // Used by the tick only.
  std::array<Scan, kScansATick> scans{};
  hal::ForceMean mean;
  GaugeBias window;
  GaugeBias::Volts bias_v{};
  double low_v = -10.0;
  double high_v = 10.0;
  std::uint64_t known_engagement = 0;
  hal::SampleClock clock;
  std::uint32_t scan_number = 0;
  std::uint32_t bias_serial = 0;

  // Shared between threads.
  SerialMutex engage_mutex;  ///< for engage() and disengage(); the tick never takes it
  bool wants_first_bias GUARDED_BY(engage_mutex) = true;
  std::atomic<bool> engaged{false};
  std::atomic<std::uint64_t> engagement{0};
  std::atomic<double> limit_low_v{0.0};
  std::atomic<double> limit_high_v{0.0};
  std::atomic<bool> has_first_bias{false};
  hal::BiasRequest bias_request;
  std::array<std::atomic<double>, kGauges> first_bias_v{};

  std::atomic<std::uint64_t> scans_read{0};
  std::atomic<std::uint64_t> unfit_scans{0};
  std::atomic<std::uint64_t> saturated_ticks{0};
  std::atomic<std::uint64_t> ticks_without_force{0};
  std::atomic<std::uint64_t> overruns{0};
  std::atomic<std::int64_t> newest_ns{0};
  std::atomic<std::uint32_t> status{0};

  std::optional<hal::Error> await_scans() REQUIRES(engage_mutex);
  void restart() noexcept;
  /// Adds a scan with its capture time to the mean. False: a value is not finite.
  bool use(const Scan& scan, std::int64_t instant_ns, bool& saturated) noexcept;
  hal::Vector3 row(std::size_t first, const GaugeBias::Volts& volts) const noexcept;
};

hal::Vector3 DaqSensor::State::row(std::size_t first, const GaugeBias::Volts& volts) const noexcept {
  std::array<double, 3> load{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < kGauges; ++j) load[i] += calibration.matrix[first + i][j] * volts[j];
  }
  return axes.to_tool({load[0], load[1], load[2]});
}

bool DaqSensor::State::use(const Scan& scan, std::int64_t instant_ns, bool& saturated) noexcept {
  GaugeBias::Volts volts;
  GaugeBias::Volts unbiased;
  for (std::size_t j = 0; j < kGauges; ++j) {
    volts[j] = scan.volts[j];
    if (!std::isfinite(volts[j])) return false;
    saturated = saturated || volts[j] <= low_v || volts[j] >= high_v;
    unbiased[j] = volts[j] - bias_v[j];
  }
  window.add(volts);
  mean.add(row(0, unbiased), row(3, unbiased), instant_ns);
  return true;
}

// Restarts after the board was opened again: limits and, the first time, the bias come from engage().
void DaqSensor::State::restart() noexcept {
  const std::uint64_t now = engagement.load(std::memory_order_acquire);
  if (now == known_engagement) return;
  known_engagement = now;
  window.restart();
  clock.restart();
  low_v = limit_low_v.load(std::memory_order_relaxed);
  high_v = limit_high_v.load(std::memory_order_relaxed);
  if (now == 1) {
    for (std::size_t j = 0; j < kGauges; ++j) bias_v[j] = first_bias_v[j].load(std::memory_order_relaxed);
    if (has_first_bias.load(std::memory_order_relaxed)) ++bias_serial;
  }
}

// The tick does not read the board yet, so this thread may.
std::optional<hal::Error> DaqSensor::State::await_scans() {
  GaugeBias first(board->info().scan_rate_hz);
  const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(config.engage_timeout_s));
  const bool wants_bias = wants_first_bias && config.bias_on_engage;
  std::vector<Scan> taken(kScansATick);
  std::size_t unfit = 0;
  std::size_t fit = 0;
  while (Clock::now() < deadline) {
    const ScanReading reading = board->read_scans(taken);
    for (std::size_t k = 0; k < reading.count; ++k) {
      GaugeBias::Volts volts;
      std::copy_n(taken[k].volts.begin(), kGauges, volts.begin());
      const bool is_fit = std::all_of(volts.begin(), volts.end(), [](double v) { return std::isfinite(v); });
      if (is_fit) first.add(volts);
      ++(is_fit ? fit : unfit);
    }
    const auto resting_v = first.mean_v();
    if (wants_bias ? resting_v.has_value() : fit > 0) {
      for (std::size_t j = 0; j < kGauges; ++j) {
        first_bias_v[j].store(resting_v && wants_bias ? (*resting_v)[j] : 0.0, std::memory_order_relaxed);
      }
      wants_first_bias = false;
      has_first_bias.store(wants_bias, std::memory_order_relaxed);
      return std::nullopt;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  return hal::Error{fit + unfit == 0 ? "the board delivers no scans" : "the board delivers too few scans",
                    "force sensor",
                    fmt::format("{} good, {} bad in {} s", fit, unfit, config.engage_timeout_s),
                    fmt::format("{} a second", info.sample_rate_hz),
                    "check the board's wiring and whether another program holds its analog inputs"};
}

hal::Result<std::unique_ptr<DaqSensor>> DaqSensor::create(const DaqSensorConfig& config,
                                                          std::shared_ptr<Board> board) {
  const std::string where = "force sensor";
  if (!board) return hal::Error{"no board", where, "", "", "configure the board that the sensor is wired to"};
  if (config.calibration_file.empty()) {
    return hal::Error{"no calibration file", where, "", "the .cal file that came with the sensor",
                      "name it with calibration_file"};
  }
  const auto axes = hal::AxisMap::parse(config.axes, where);
  if (!axes) return axes.error();
  if (!(config.saturation_share > 0.5 && config.saturation_share <= 1.0)) {
    return hal::Error::of(hal::ErrorCode::kOutOfRange, "saturation_share is out of range", where,
                          fmt::format("{}", config.saturation_share), "0.5 … 1",
                          "0.98 leaves a hundredth of the range at either end");
  }
  auto calibration = load_calibration(config.calibration_file, config.part_number);
  if (!calibration) return calibration.error();
  const BoardInfo board_info = board->info();
  if (board_info.inputs < kGauges) {
    return hal::Error{"the board is not configured for six gauges", where,
                      fmt::format("{} inputs", board_info.inputs), "6", "name the channels of all six"};
  }
  return std::unique_ptr<DaqSensor>(
      new DaqSensor(std::make_unique<State>(config, std::move(*calibration), *axes, std::move(board))));
}

DaqSensor::DaqSensor(std::unique_ptr<State> state) : state_(std::move(state)) {}
DaqSensor::~DaqSensor() {
  disengage();
}

const hal::SensorInfo& DaqSensor::info() const noexcept {
  return state_->info;
}
const Calibration& DaqSensor::calibration() const noexcept {
  return state_->calibration;
}

std::optional<hal::Error> DaqSensor::engage() {
  State& state = *state_;
  const MutexLock lock(state.engage_mutex);
  if (state.engaged.load(std::memory_order_acquire)) return std::nullopt;
  if (auto error = state.board->engage(BoardUse::kInputs)) return error;
  if (auto error = state.await_scans()) {
    state.board->release(BoardUse::kInputs);
    return error;
  }
  const BoardInfo board = state.board->info();
  const double low_v = std::max(board.input_low_v, state.calibration.output_low_v);
  const double high_v = std::min(board.input_high_v, state.calibration.output_high_v);
  const double margin_v = 0.5 * (1.0 - state.config.saturation_share) * (high_v - low_v);
  // Zero volts of a unipolar gauge is an end of its range too. Even with a share of 1 the end codes count
  // as saturated.
  const double step_v = (board.input_high_v - board.input_low_v) / std::exp2(board.input_bits);
  state.limit_low_v.store(low_v + std::max(margin_v, step_v), std::memory_order_relaxed);
  state.limit_high_v.store(high_v - std::max(margin_v, step_v), std::memory_order_relaxed);
  state.engagement.fetch_add(1, std::memory_order_release);
  state.engaged.store(true, std::memory_order_release);
  return std::nullopt;
}

void DaqSensor::disengage() noexcept {
  State& state = *state_;
  const MutexLock lock(state.engage_mutex);
  if (!state.engaged.exchange(false, std::memory_order_acq_rel)) return;
  state.board->release(BoardUse::kInputs);
}

std::optional<hal::Error> DaqSensor::bias() {
  State& state = *state_;
  const std::string place = "force sensor on the board";
  if (!state.engaged.load(std::memory_order_acquire)) {
    return hal::Error{"the bias cannot be taken", place, "not engaged", "",
                      "load a scene that uses the sensor"};
  }
  const std::uint64_t number = state.bias_request.ask();
  if (number == 0) {
    return hal::Error{"the bias cannot be taken", place, "another one is being taken", "one at a time",
                      "wait for its end"};
  }
  if (state.bias_request.await(number, kBiasTimeout)) return std::nullopt;
  return hal::Error{"no bias was taken, and none will be", place, "", "a quarter of a second of scans",
                    "see whether scans arrive: hapticctl status"};
}

void DaqSensor::read(hal::RigSample& sample) noexcept {
  State& state = *state_;
  sample.bias_serial = state.bias_serial;
  if (!state.engaged.load(std::memory_order_acquire)) {
    sample.force_mean_age_ns = kBeyondAnyLimitNs;
    sample.status |= hal::sample_status::kForceMissing;
    sample.force_count = 0;
    sample.force_age_ns = kBeyondAnyLimitNs;
    return;
  }
  state.restart();
  const ScanReading reading = state.board->read_scans(state.scans);
  std::uint32_t status = 0;
  if (reading.overrun) {
    status |= hal::sample_status::kForceWarning;
    state.window.restart();
    state.clock.restart();
    state.overruns.fetch_add(1, std::memory_order_relaxed);
  }
  bool saturated = false;
  std::size_t unfit = 0;
  if (reading.count == state.scans.size()) state.clock.restart();  // older ones may have been skipped
  for (std::size_t k = 0; k < reading.count; ++k) {
    const Scan& scan = state.scans[k];
    const std::int64_t instant_ns = state.clock.instant_ns(state.scan_number++, scan.time_ns);
    if (!state.use(scan, instant_ns, saturated)) ++unfit;
  }
  if (const std::uint64_t wanted = state.bias_request.wanted(); wanted != 0) {
    if (const auto mean_v = state.window.mean_v(); mean_v && state.bias_request.claim(wanted)) {
      state.bias_v = *mean_v;
      ++state.bias_serial;
      state.bias_request.note_taken(wanted);
    }
  }
  const std::int64_t now_ns = state.board->now_ns();
  state.mean.take(sample, now_ns);
  sample.bias_serial = state.bias_serial;
  if (unfit > 0) {
    status |= unfit == reading.count ? hal::sample_status::kForceFault : hal::sample_status::kForceWarning;
  }
  if (saturated) status |= hal::sample_status::kForceSaturated;
  if (!reading.running) status |= hal::sample_status::kForceLost;
  sample.status |= status;
  sample.force_age_ns =
      reading.newest_ns == 0 ? kBeyondAnyLimitNs : std::max<std::int64_t>(0, now_ns - reading.newest_ns);

  const auto count = [](std::atomic<std::uint64_t>& counter, std::uint64_t by) {
    if (by > 0) counter.fetch_add(by, std::memory_order_relaxed);
  };
  count(state.scans_read, reading.count);
  count(state.unfit_scans, unfit);
  count(state.saturated_ticks, saturated ? 1 : 0);
  count(state.ticks_without_force, reading.count == 0 ? 1 : 0);
  state.newest_ns.store(reading.newest_ns, std::memory_order_relaxed);
  state.status.store(status, std::memory_order_relaxed);
}

hal::PartReport DaqSensor::report() const {
  const State& state = *state_;
  hal::PartReport report;
  report.part = "force sensor";
  report.driver = "daq";
  const bool engaged = state.engaged.load(std::memory_order_acquire);
  const std::uint32_t status = state.status.load(std::memory_order_relaxed);
  const std::int64_t newest_ns = state.newest_ns.load(std::memory_order_relaxed);
  const std::int64_t age_ns = state.board->now_ns() - newest_ns;
  const auto is = [&](std::uint32_t bit) { return engaged && (status & bit) != 0; };
  report.state = hal::PartState::kReady;
  if (is(hal::sample_status::kForceFault | hal::sample_status::kForceSaturated)) {
    report.state = hal::PartState::kFaulty;
  }
  if (is(hal::sample_status::kForceLost)) report.state = hal::PartState::kConnecting;
  if (!engaged) report.state = hal::PartState::kIdle;

  if (is(hal::sample_status::kForceLost)) {
    report.findings.emplace_back("no scans arrive: the acquisition is being restarted; check the board");
  }
  if (is(hal::sample_status::kForceFault)) {
    report.findings.emplace_back("the gauges' voltages are not finite; check the board's calibration file");
  }
  if (is(hal::sample_status::kForceSaturated)) {
    report.findings.emplace_back(
        "a gauge is at the end of its range; remove the load; if it stays, check the sensor's cable");
  }
  if (is(hal::sample_status::kForceWarning)) {
    report.findings.emplace_back("scans were lost; reduce the load on the machine, raise the priority");
  }
  if (state.bias_request.is_pending()) {
    report.findings.emplace_back(
        "a requested bias is not taken yet; it needs a quarter of a second of scans");
  }
  report.findings.insert(report.findings.end(), state.calibration.notes.begin(),
                         state.calibration.notes.end());
  const auto figure = [&](const char* name, const std::atomic<std::uint64_t>& counter) {
    report.figures.push_back({name, static_cast<double>(counter.load(std::memory_order_relaxed)), ""});
  };
  figure("scans_read", state.scans_read);
  figure("unfit_scans", state.unfit_scans);
  figure("saturated_ticks", state.saturated_ticks);
  figure("silent_ticks", state.ticks_without_force);
  figure("overruns", state.overruns);
  report.figures.push_back({"biases_taken", static_cast<double>(state.bias_request.count()), ""});
  if (engaged && newest_ns != 0) {
    report.figures.push_back({"age_ms", 1e-6 * static_cast<double>(age_ns), "ms"});
    if (age_ns > kSilentNs && !is(hal::sample_status::kForceLost)) {
      report.findings.emplace_back("nothing reads the sensor at present");
    }
  }
  state.board->describe(report);
  return report;
}

}  // namespace hapticd::daq
