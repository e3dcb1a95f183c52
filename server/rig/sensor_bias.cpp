#include "server/rig/sensor_bias.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "hal/recording/append_file.h"
#include "proto/text/utc_text.h"
#include "rt/signal/vector.h"
#include "server/process/log.h"
#include "server/rig/stillness_monitor.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

namespace {

/// A sample with the new zero arrives within a tick or two.
constexpr std::chrono::seconds kTimeout{2};
constexpr std::chrono::milliseconds kPollInterval{1};
/// The tool is left alone for so long before the bias, and after it.
constexpr std::chrono::milliseconds kAtRestBefore{300};
constexpr std::chrono::milliseconds kAtRestAfter{100};

constexpr std::int64_t kSecondNs = 1'000'000'000;

std::int64_t unix_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Reason why the caller's bias is to take effect no longer; nothing while it may.
std::optional<Refusal> given_up(const Caller& caller) {
  if (auto lost = caller.lost()) return lost;
  if (caller.cancelled()) {
    return Refusal{RefusalKind::kCancelled,
                   {"the caller went away; the sensor was not biased", "force sensor", "", "", ""}};
  }
  if (Caller::Clock::now() < caller.deadline) return std::nullopt;
  return Refusal{RefusalKind::kDeadlineExceeded,
                 {"the caller's time is over; the sensor was not biased", "force sensor", "",
                  fmt::format("at least {} ms, in which the tool is seen at rest", kAtRestBefore.count()),
                  "allow more time"}};
}

}  // namespace

SensorBiases::SensorBiases(Session& session, const SceneHost& scenes, TelemetryHub& hub, std::string file)
    : session_(session),
      scenes_(scenes),
      hub_(hub),
      file_(std::move(file)),
      started_(text::utc_text(unix_s() * kSecondNs)) {}

std::string SensorBiases::identity_of(std::uint32_t serial) const {
  return fmt::format("{}/{}", started_, serial);
}

ZeroInForce SensorBiases::zero_in_force() const {
  ZeroInForce zero{identity_of(hub_.latest().bias_serial)};
  if (const auto bias = current()) {
    zero.gravity = rt::rotated(rt::conjugate(rt::unit(bias->orientation)), {0.0, 0.0, -1.0});
  }
  return zero;
}

std::optional<SensorBias> SensorBiases::current() const {
  const std::uint32_t serial = hub_.latest().bias_serial;
  const MutexLock lock(mutex_);
  return last_ && last_->serial == serial ? last_ : std::nullopt;
}

std::optional<std::string> SensorBiases::lost() const {
  const std::uint32_t serial = hub_.latest().bias_serial;
  const MutexLock lock(mutex_);
  if (!last_ || last_->serial == serial) return std::nullopt;
  return last_->id;
}

std::optional<Refusal> SensorBiases::pressed() const {
  const double load_n = rt::norm(hub_.latest().sensor_force_n);
  if (load_n <= kMaxZeroChangeN || !current()) return std::nullopt;
  return Refusal{RefusalKind::kFailedPrecondition,
                 {"the sensor carries a load: it is not biased while the tool is pressed", "force sensor",
                  fmt::format("{:.2f} N under the last bias", load_n), fmt::format("{} N", kMaxZeroChangeN),
                  "free the tool; if nothing touches it (another tool, or it was touched when it was biased "
                  "last): hapticctl sensor bias --tool-is-free"}};
}

Outcome<SensorBias> SensorBiases::take(const Caller& caller, bool tool_is_free) {
  if (auto refusal = scenes_.reserved()) return *refusal;
  // Kept open until a sample with the new zero has arrived.
  const auto sensor = session_.claim_sensor();
  if (!sensor) return Refusal{RefusalKind::kFailedPrecondition, sensor.error()};
  const StillnessMonitor watch(hub_);
  std::this_thread::sleep_for(kAtRestBefore);
  if (auto moved = watch.disturbance()) return Refusal{RefusalKind::kFailedPrecondition, std::move(*moved)};
  if (!tool_is_free) {
    if (auto refusal = pressed()) return *refusal;
  }
  const std::uint32_t before = hub_.latest().bias_serial;
  // Much may have changed while the tool was watched: who controls the rig, and what it is reserved for.
  const auto forbidden = [&] {
    auto refusal = given_up(caller);
    return refusal ? refusal : scenes_.reserved();
  };
  if (auto refusal = session_.bias_force_sensor(forbidden)) return *refusal;

  const auto until = caller.until(kTimeout);
  rt::TickRecord now = hub_.latest();
  while (now.bias_serial == before) {
    if (auto refusal = session_.unavailable()) return *refusal;
    if (Caller::Clock::now() >= until) {
      return Refusal{RefusalKind::kDeadlineExceeded,
                     {"the bias was taken, but no sample has come since", "force sensor", "", "",
                      "see in 'hapticctl doctor' what holds the sensor back"}};
    }
    std::this_thread::sleep_for(kPollInterval);
    now = hub_.latest();
  }
  std::this_thread::sleep_for(kAtRestAfter);
  if (auto moved = watch.disturbance()) {
    {
      const MutexLock lock(mutex_);
      last_.reset();
    }
    moved->what += ": the zero now in use is wrong";
    return Refusal{RefusalKind::kFailedPrecondition, std::move(*moved)};
  }
  SensorBias bias;
  bias.serial = now.bias_serial;
  bias.id = identity_of(bias.serial);
  bias.taken_unix_s = unix_s();
  bias.tip_mm = now.tip_position_mm;
  bias.orientation = now.tip_orientation;
  {
    const MutexLock lock(mutex_);
    last_ = bias;
  }
  keep(bias);
  log_info("force sensor biased: " + bias.id);
  return bias;
}

void SensorBiases::keep(const SensorBias& bias) const {
  if (file_.empty()) return;
  std::error_code ignored;
  std::filesystem::create_directories(std::filesystem::path(file_).parent_path(), ignored);
  auto file = recording::AppendFile::open_or_create(file_);
  if (!file) return log_warning("the bias could not be recorded: " + file.error().text());
  std::string lines;
  if (file->size() == 0)
    lines =
        "id,taken_utc,tip_x_mm,tip_y_mm,tip_z_mm,orientation_w,orientation_x,orientation_y,"
        "orientation_z\n";
  lines +=
      fmt::format("{},{},{:.4f},{:.4f},{:.4f},{:.6f},{:.6f},{:.6f},{:.6f}\n", bias.id,
                  text::utc_text(bias.taken_unix_s * kSecondNs), bias.tip_mm.x, bias.tip_mm.y, bias.tip_mm.z,
                  bias.orientation.w, bias.orientation.x, bias.orientation.y, bias.orientation.z);
  if (const auto error = file->append(lines)) log_warning("the bias could not be recorded: " + error->text());
}

}  // namespace hapticd::server
