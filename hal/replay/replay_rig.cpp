#include "hal/replay/replay_rig.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <utility>

#include "hal/replay/recording.h"
#include "hal/shown_text.h"

namespace hapticd::replay {
namespace {

constexpr double kMinRateHz = 1.0;
constexpr double kMaxRateHz = 100'000.0;
constexpr double kPauseBetweenPassesS = 0.5;

// A recording has no device, but the guard needs a force limit: that of the best known device.
constexpr double kNominalMaxForceN = 8.5;
constexpr double kNominalContinuousForceN = 1.4;

hal::RigInfo describe(const ReplayConfig& config, const Recording& recording) {
  hal::RigInfo info;
  info.kind = hal::RigKind::kReplay;
  info.name = "replay:" + std::filesystem::path(config.path).filename().string();
  info.rate_hz = config.rate_hz;
  info.device.model = "recording";
  info.device.max_force_n = kNominalMaxForceN;
  info.device.max_continuous_force_n = kNominalContinuousForceN;
  info.device.structural_stiffness_n_per_mm = 0.0;  // rigid: the recorded position is the true displacement
  info.sensor.model = "recording";
  for (const double force_n : recording.force_n)
    info.sensor.range_n = std::max(info.sensor.range_n, std::abs(force_n));
  info.sensor.sample_rate_hz = 1.0 / recording.median_step_s;
  info.renders_force = false;
  info.uncertain.push_back({.name = "max_force_n",
                            .value = kNominalMaxForceN,
                            .unit = "N",
                            .source = "nominal, of a PHANToM 1.0: a recording has no device"});
  return info;
}

std::int64_t in_ns(double seconds) noexcept {
  return std::llround(seconds * 1e9);
}

}  // namespace

struct ReplayRig::State {
  Recording recording;
  hal::RigInfo info;
  bool owns_clock = true;
  bool loop = false;
  std::uint64_t ticks_per_pass = 0;   ///< ticks within the recording
  std::uint64_t ticks_per_pause = 0;  ///< between two passes, when looping

  std::uint64_t tick = 0;  ///< the next to be read
  std::size_t row = 0;     ///< the last row not later than the last tick

  /// Plays the recording at a tick counted from the start of the pass.
  void play(std::uint64_t pass_tick, hal::RigSample& sample) noexcept;
  /// Fills a sample between two passes: no contact, the tool moves from the last position to the first.
  void pause(double fraction, hal::RigSample& sample) const noexcept;
};

void ReplayRig::State::play(std::uint64_t pass_tick, hal::RigSample& sample) noexcept {
  const double now_s = static_cast<double>(pass_tick) / info.rate_hz;
  if (pass_tick == 0) row = 0;
  const auto& time_s = recording.time_s;
  while (row + 2 < time_s.size() && time_s[row + 1] <= now_s) ++row;

  const double step_s = time_s[row + 1] - time_s[row];
  const double since_row_s = now_s - time_s[row];
  const double fraction = std::min(since_row_s / step_s, 1.0);
  const bool after_end = pass_tick >= ticks_per_pass;
  const double silence_s = after_end ? now_s - time_s.back() : recording.silence_s(row, since_row_s);
  const bool is_silent = after_end || silence_s > 0.0;

  sample.tip_position_mm.z = -std::lerp(recording.depth_mm[row], recording.depth_mm[row + 1], fraction);
  sample.sensor_force_n.z = is_silent && !after_end
                                ? recording.force_n[row]
                                : std::lerp(recording.force_n[row], recording.force_n[row + 1], fraction);
  if (is_silent) {
    sample.status |= hal::sample_status::kForceMissing;
    sample.force_age_ns = in_ns(silence_s);
  } else {
    sample.force_count = 1;
  }
}

void ReplayRig::State::pause(double fraction, hal::RigSample& sample) const noexcept {
  sample.tip_position_mm.z = -std::lerp(recording.depth_mm.back(), recording.depth_mm.front(), fraction);
  sample.force_count = 1;
}

hal::Result<std::unique_ptr<ReplayRig>> ReplayRig::open(const ReplayConfig& config) {
  const std::string place = "recording '" + config.path + "'";
  if (!(config.rate_hz >= kMinRateHz && config.rate_hz <= kMaxRateHz)) {
    return hal::Error{.what = "the rate to resample to is out of range",
                      .where = place + ", rate_hz",
                      .value = hal::number_text(config.rate_hz, 9),
                      .limit = "1 … 100000 Hz",
                      .remedy = {},
                      .code = hal::ErrorCode::kOutOfRange};
  }
  auto recording =
      load_recording(config.path, {.time = config.time, .force = config.force, .position = config.position},
                     {.decimal_comma = config.decimal_comma});
  if (!recording) return recording.error();
  if (const auto error = remove_bias(*recording, config.bias_s, place); error) return *error;

  auto state = std::make_unique<State>();
  state->info = describe(config, *recording);
  state->owns_clock = config.as_fast_as_possible;
  state->loop = config.loop;
  // The small share keeps a last row that lies on a tick, in spite of rounding.
  state->ticks_per_pass = static_cast<std::uint64_t>(recording->duration_s() * config.rate_hz + 1e-6) + 1;
  state->ticks_per_pause = static_cast<std::uint64_t>(std::ceil(kPauseBetweenPassesS * config.rate_hz));
  state->recording = std::move(*recording);
  return std::unique_ptr<ReplayRig>(new ReplayRig(std::move(state)));
}

ReplayRig::ReplayRig(std::unique_ptr<State> state) : state_(std::move(state)) {}
ReplayRig::~ReplayRig() = default;

const hal::RigInfo& ReplayRig::info() const noexcept {
  return state_->info;
}
bool ReplayRig::owns_clock() const noexcept {
  return state_->owns_clock;
}
bool ReplayRig::exhausted() const noexcept {
  return !state_->loop && state_->tick >= state_->ticks_per_pass;
}
double ReplayRig::duration_s() const noexcept {
  return state_->recording.duration_s();
}

void ReplayRig::read(hal::RigSample& sample) noexcept {
  State& state = *state_;
  sample = hal::RigSample{};
  sample.tick = state.tick;
  sample.time_ns = in_ns(static_cast<double>(state.tick) / state.info.rate_hz);
  sample.bias_serial = 1;  // the recording's zero, as recorded or as set by bias_s

  std::uint64_t pass_tick = state.tick++;
  if (state.loop) pass_tick %= state.ticks_per_pass + state.ticks_per_pause;
  if (state.loop && pass_tick >= state.ticks_per_pass) {
    const auto since = static_cast<double>(pass_tick - state.ticks_per_pass + 1);
    state.pause(since / static_cast<double>(state.ticks_per_pause), sample);
  } else {
    state.play(pass_tick, sample);
  }
}

}  // namespace hapticd::replay
