#include "hal/daq/board_instrument.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "hal/lock/mutex.h"

namespace hapticd::daq {

namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kPart = "external instrument";
constexpr const char* kTipAxes[] = {"x", "y", "z"};
constexpr double kMaxInstrumentChannel = 255.0;
constexpr double kMaxMmPerV = 1000.0;
constexpr double kEndShare = 0.01;  // of the range, at either end
constexpr std::chrono::milliseconds kInstrumentPollInterval{1};

hal::Error refused(std::string what, std::string value, std::string limit, std::string remedy,
                   hal::ErrorCode code = hal::ErrorCode::kOther) {
  return {std::move(what), kPart, std::move(value), std::move(limit), std::move(remedy), code};
}

}  // namespace

std::optional<hal::Error> check(const BoardInstrumentConfig& config) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double channel = config.channels[axis];
    if (channel == -1.0) continue;
    const std::string name = kTipAxes[axis];
    if (!(channel >= 0.0 && channel <= kMaxInstrumentChannel) || channel != std::floor(channel)) {
      return refused("the channel along " + name + " is not valid", fmt::format("{}", channel),
                     "0 … 255, or -1 for none", "use the board's input that the instrument is wired to",
                     hal::ErrorCode::kOutOfRange);
    }
    for (std::size_t other = 0; other < axis; ++other) {
      if (config.channels[other] != channel) continue;
      return refused("one channel cannot measure two axes", fmt::format("{}", channel),
                     "a separate channel for each axis", "correct 'channels'",
                     hal::ErrorCode::kContradiction);
    }
    const double scale = config.mm_per_v[axis];
    if (!std::isfinite(scale) || scale == 0.0 || std::abs(scale) > kMaxMmPerV) {
      return refused("the scale along " + name + " is out of range", fmt::format("{} mm/V", scale),
                     "-1000 … 1000 mm/V, not 0", "take it from the instrument's calibration",
                     hal::ErrorCode::kOutOfRange);
    }
  }
  if (config.channels[2] < 0.0) {
    return refused("no channel measures the tip along z", "", "a channel along z at least",
                   "walls are pressed along z: mount the instrument along z, e.g. channels = [-1, -1, 6]",
                   hal::ErrorCode::kMissingKey);
  }
  if (!(config.engage_timeout_s >= 0.1 && config.engage_timeout_s <= 60.0)) {
    return refused("engage_timeout_s is out of range", fmt::format("{} s", config.engage_timeout_s),
                   "0.1 … 60 s", "3 suits most boards", hal::ErrorCode::kOutOfRange);
  }
  return std::nullopt;
}

std::vector<double> channels_of(const BoardInstrumentConfig& config) {
  std::vector<double> channels;
  for (const double channel : config.channels) {
    if (channel >= 0.0) channels.push_back(channel);
  }
  return channels;
}

struct BoardInstrument::State {
  BoardInstrumentConfig config;
  std::shared_ptr<Board> board;
  SerialMutex engage_mutex;  ///< never taken by the tick
  std::atomic<bool> engaged{false};
  std::atomic<double> low_v{-10.0};
  std::atomic<double> high_v{10.0};
  std::atomic<std::uint64_t> readings{0};
  std::atomic<std::uint64_t> at_end{0};
  std::atomic<bool> last_at_end{false};
};

hal::Result<std::unique_ptr<BoardInstrument>> BoardInstrument::create(const BoardInstrumentConfig& config,
                                                                      std::shared_ptr<Board> board) {
  if (auto error = check(config)) return *error;
  if (!board) return refused("no board", "", "", "configure the board that the instrument is wired to");
  const std::size_t needed = kGaugeInputs + channels_of(config).size();
  if (const BoardInfo info = board->info(); info.inputs < needed) {
    return refused("the board does not scan the instrument's channels", fmt::format("{} inputs", info.inputs),
                   fmt::format("{}", needed), "add them to the board's inputs");
  }
  auto state = std::make_unique<State>();
  state->config = config;
  state->board = std::move(board);
  return std::unique_ptr<BoardInstrument>(new BoardInstrument(std::move(state)));
}

BoardInstrument::BoardInstrument(std::unique_ptr<State> state) : state_(std::move(state)) {}
BoardInstrument::~BoardInstrument() {
  disengage();
}

std::optional<hal::Error> BoardInstrument::engage() {
  State& state = *state_;
  const MutexLock lock(state.engage_mutex);
  if (state.engaged.load()) return std::nullopt;
  if (auto error = state.board->engage(BoardUse::kInputs)) return error;
  const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(state.config.engage_timeout_s));
  std::array<double, kSpareInputs> volts{};
  while (state.board->read_spare_inputs(volts) == 0) {
    if (Clock::now() >= deadline) {
      state.board->release(BoardUse::kInputs);
      return refused("the board delivers no scans", "0", "scans within engage_timeout_s",
                     "check the board's wiring and whether another program holds its analog inputs");
    }
    std::this_thread::sleep_for(kInstrumentPollInterval);
  }
  const BoardInfo info = state.board->info();
  const double margin_v = kEndShare * (info.input_high_v - info.input_low_v);
  state.low_v.store(info.input_low_v + margin_v);
  state.high_v.store(info.input_high_v - margin_v);
  state.engaged.store(true);
  return std::nullopt;
}

void BoardInstrument::disengage() noexcept {
  State& state = *state_;
  const MutexLock lock(state.engage_mutex);
  if (!state.engaged.exchange(false)) return;
  state.board->release(BoardUse::kInputs);
}

bool BoardInstrument::read(hal::Vector3& position_mm) noexcept {
  State& state = *state_;
  if (!state.engaged.load(std::memory_order_acquire)) return false;
  std::array<double, kSpareInputs> volts{};
  if (state.board->read_spare_inputs(volts) == 0) return false;
  const double low_v = state.low_v.load(std::memory_order_relaxed);
  const double high_v = state.high_v.load(std::memory_order_relaxed);
  hal::Vector3 reading = position_mm;
  double* const axes[] = {&reading.x, &reading.y, &reading.z};
  std::size_t input = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (state.config.channels[axis] < 0.0) continue;
    const double v = volts[input++];
    if (v <= low_v || v >= high_v) {
      state.at_end.fetch_add(1, std::memory_order_relaxed);
      state.last_at_end.store(true, std::memory_order_relaxed);
      return false;
    }
    *axes[axis] = v * state.config.mm_per_v[axis];
  }
  state.last_at_end.store(false, std::memory_order_relaxed);
  state.readings.fetch_add(1, std::memory_order_relaxed);
  position_mm = reading;
  return true;
}

hal::PartReport BoardInstrument::report() const {
  const State& state = *state_;
  hal::PartReport report;
  report.part = kPart;
  report.driver = "board";
  const bool engaged = state.engaged.load();
  report.state = engaged ? hal::PartState::kReady : hal::PartState::kIdle;
  if (engaged && state.last_at_end.load()) {
    report.findings.emplace_back(
        "an input is at the end of its range: is the instrument connected, and within its stroke?");
  }
  report.figures.push_back({"readings", static_cast<double>(state.readings.load()), ""});
  report.figures.push_back({"readings_at_the_end", static_cast<double>(state.at_end.load()), ""});
  state.board->describe(report);
  return report;
}

}  // namespace hapticd::daq
