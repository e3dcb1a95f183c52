#include "hal/openhaptics/servo.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

#include "hal/geometry.h"
namespace hapticd::openhaptics {

namespace {

using namespace hal::sample_status;

/// A fault stays visible for this long after it was last reported, so that a flickering fault counts as
/// one.
constexpr std::int64_t kFaultHoldNs = 100'000'000;
constexpr double kSlowPeriodS = 0.1;
/// No device reaches farther; a position beyond this is rejected.
constexpr double kFarthestMm = 2000.0;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

bool is_function_error(hd::ErrorCode code) noexcept {
  return code >= hd::kInvalidEnum && code <= hd::kBadHandle;
}

}  // namespace

Servo::Servo(std::shared_ptr<HdLibrary> library, hd::Handle device, std::shared_ptr<DeviceErrorSlot> slot,
             const ServoSetup& setup)
    : library_(std::move(library)),
      api_(library_->api()),
      device_(device),
      slot_(std::move(slot)),
      setup_(setup),
      slow_every_(static_cast<std::uint64_t>(std::max(1.0, std::round(kSlowPeriodS * setup.rate_hz)))) {
  reported_->calibrated.store(setup.calibrated);
  reported_->motors = setup.motors;
  status_ = kDeviceNotReady;
}

void Servo::arm(hal::ServoBody& body) noexcept {
  body_ = &body;
  finishing_.store(false);
  finished_.store(false);
  command_n_ = {};
  limited_ = false;
  reported_->force_off.store(false, std::memory_order_relaxed);
  turns_ = 0;
  last_turn_ns_ = 0;
  state_.store(kIdle, std::memory_order_release);
}

bool Servo::move(int from, int to) noexcept {
  return state_.compare_exchange_strong(from, to, std::memory_order_acq_rel);
}

Servo::Leaving Servo::give_up(std::chrono::milliseconds timeout) noexcept {
  const auto until = std::chrono::steady_clock::now() + timeout;
  while (true) {
    if (move(kIdle, kOver) || state_.load(std::memory_order_acquire) == kOver) {
      status_ = kDeviceNotReady;
      return Leaving::kClean;
    }
    // A turn in our own code always returns, however long it takes; one in the vendor's code may not.
    if (std::chrono::steady_clock::now() >= until && move(kInFrame, kOver)) return Leaving::kStuck;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void Servo::write_zero_in_crash() noexcept {
  crashed_.store(true);
  const int state = state_.load();
  if (state == kOver) return;
  if (pthread_equal(turner_.load(std::memory_order_relaxed), pthread_self()) != 0) {
    if (state == kInBody) render({});
    return;
  }
  // After two more turns have begun, at least one has ended after the flag was set.
  constexpr timespec kMillisecond{0, 1'000'000};
  const std::uint64_t frames = reported_->frames.load(std::memory_order_relaxed);
  for (int waited_ms = 0; waited_ms < kCrashTimeoutMs; ++waited_ms) {
    if (reported_->frames.load(std::memory_order_relaxed) >= frames + 2) return;
    nanosleep(&kMillisecond, nullptr);
  }
}

hd::CallbackCode Servo::turn() noexcept {
  if (!move(kIdle, kInFrame)) return hd::kCallbackDone;
  turner_.store(pthread_self(), std::memory_order_relaxed);
  reported_->frames.fetch_add(1, std::memory_order_relaxed);
  if (finishing_.load(std::memory_order_acquire)) {
    last_frame();
    state_.store(kOver, std::memory_order_release);
    finished_.store(true, std::memory_order_release);
    return hd::kCallbackDone;
  }
  mark_time();
  calibrate();
  begin();
  drain();
  feel_motors();
  check_output();
  measure();
  command_n_ = {};                 // a body that writes nothing commands no force
  if (!move(kInFrame, kInBody)) {  // abandoned while we were in the library
    render({});
    api_.disable(hd::kForceOutput);
    return hd::kCallbackDone;
  }
  body_->on_servo();
  state_.store(kInFrame, std::memory_order_release);
  end();
  return move(kInFrame, kIdle) ? hd::kCallbackContinue : hd::kCallbackDone;
}

void Servo::mark_time() noexcept {
  now_ns_ = hal::monotonic_ns();
  if (last_turn_ns_ != 0) {
    const Nanoseconds gap = now_ns_ - last_turn_ns_;
    if (gap > reported_->longest_gap_ns.load(std::memory_order_relaxed)) {
      reported_->longest_gap_ns.store(gap, std::memory_order_relaxed);
    }
    if (gap > setup_.stall_ns) {
      reported_->stalls.fetch_add(1, std::memory_order_relaxed);
      reported_->last_stall_ns.store(now_ns_, std::memory_order_relaxed);
      fault_until_ns_ = now_ns_ + kFaultHoldNs;
    }
  }
  last_turn_ns_ = now_ns_;
}

void Servo::begin() noexcept {
  if (api_.make_current_device != nullptr) api_.make_current_device(device_);
  frame_ns_ = hal::monotonic_ns();
  api_.begin_frame(device_);
}

void Servo::render(const hal::Vector3& force) noexcept {
  const hal::Vector3 device_force = device_from_rig(force);
  const double force_n[3] = {device_force.x, device_force.y, device_force.z};
  api_.set_doublev(hd::kCurrentForce, force_n);
  api_.end_frame(device_);
  drain();
}

void Servo::end() noexcept {
  // A device that is unfit gives no force, whatever is asked of it; nor does a servo that has been abandoned.
  const bool fit = (status_ & (kDeviceFault | kDeviceNotReady)) == 0 &&
                   state_.load(std::memory_order_acquire) == kInFrame &&
                   !crashed_.load(std::memory_order_acquire);
  render(fit ? command_n_ : hal::Vector3{});
}

void Servo::last_frame() noexcept {
  begin();
  render({});
  api_.disable(hd::kForceOutput);
  drain();
  status_ = kDeviceNotReady;  // nothing is measured any more
}

void Servo::drain() noexcept {
  if (library_->drain(*slot_) == HdLibrary::kMaxStackDepth) {
    reported_->error_stacks_overfull.fetch_add(1, std::memory_order_relaxed);
    slot_->fresh.fetch_or(kDeviceFault, std::memory_order_relaxed);
  }
}

void Servo::calibrate() noexcept {
  ++turns_;
  if (api_.check_calibration == nullptr) return;
  if (api_.make_current_device != nullptr) api_.make_current_device(device_);
  const hd::Enum state = api_.check_calibration();
  const bool ready = reported_->calibrated.load(std::memory_order_relaxed);
  reported_->wants_calibration_update.store(ready && state == hd::kCalibrationNeedsUpdate,
                                            std::memory_order_relaxed);
  if (state == hd::kCalibrationOk) {
    reported_->calibrated.store(true, std::memory_order_relaxed);
  } else if (state == hd::kCalibrationNeedsManualInput) {
    reported_->calibrated.store(false, std::memory_order_relaxed);
  } else if (state == hd::kCalibrationNeedsUpdate && !ready && setup_.calibration_style != 0 &&
             api_.update_calibration != nullptr && turns_ % slow_every_ == 0) {
    // Never while it may render: the position jumps.
    api_.update_calibration(static_cast<hd::Enum>(setup_.calibration_style));
  }
}

void Servo::measure() noexcept {
  take_pose();
  drain();
  take_angles();
  std::uint32_t status = slot_->take();
  if (pose_fault_) status |= kDeviceFault;
  if ((status & kDeviceFault) != 0) fault_until_ns_ = now_ns_ + kFaultHoldNs;
  if (now_ns_ < fault_until_ns_) status |= kDeviceFault;
  if (!reported_->calibrated.load(std::memory_order_relaxed)) status |= kDeviceNotReady;
  if (reported_->force_off.load(std::memory_order_relaxed)) status |= kDeviceNotReady;
  if (limited_) status |= kDeviceOverForce;
  limited_ = false;
  for (std::size_t motor = 0; motor < static_cast<std::size_t>(setup_.motors); ++motor) {
    if (reported_->temperatures[motor].load(std::memory_order_relaxed) >= setup_.warm_share)
      status |= kDeviceWarm;
  }
  status_ = status;
  reported_->status.store(status, std::memory_order_relaxed);
}

void Servo::take_pose() noexcept {
  Transform transform;
  transform.fill(kNan);  // values that the library does not write must not count as measured
  double position_mm[3] = {kNan, kNan, kNan};
  api_.get_doublev(hd::kCurrentTransform, transform.data());
  api_.get_doublev(hd::kCurrentPosition, position_mm);

  const hal::Vector3 position{position_mm[0], position_mm[1], position_mm[2]};
  const bool rotation_finite = std::all_of(transform.begin(), transform.begin() + 11,
                                           [](double value) { return std::isfinite(value); });
  pose_fault_ = !rotation_finite || !(std::abs(position.x) <= kFarthestMm) ||
                !(std::abs(position.y) <= kFarthestMm) || !(std::abs(position.z) <= kFarthestMm);
  if (pose_fault_) {
    reported_->positions_rejected.fetch_add(1, std::memory_order_relaxed);
    reported_->last_rejection_ns.store(now_ns_, std::memory_order_relaxed);
    return;
  }
  if (const auto stylus = orientation_in_rig(transform)) {
    orientation_ = geometry::product(*stylus, setup_.tool_to_stylus);
  } else {
    reported_->orientations_rejected.fetch_add(1, std::memory_order_relaxed);
  }
  tip_ns_ = frame_ns_;
  tip_mm_ =
      rig_from_device(position - setup_.origin_mm) + geometry::rotated(orientation_, setup_.tip_offset_mm);
}

/// Reads the gimbal's angles with the error stack empty, as for all that a device may not have.
void Servo::take_angles() noexcept {
  angles_.known = false;
  if (!angles_known_) return;
  double joint_rad[3] = {kNan, kNan, kNan};
  double gimbal_rad[3] = {kNan, kNan, kNan};
  api_.get_doublev(hd::kCurrentJointAngles, joint_rad);
  api_.get_doublev(hd::kCurrentGimbalAngles, gimbal_rad);
  angles_known_ = knows_what_was_asked();
  if (!angles_known_) return;
  angles_.known = true;
  for (std::size_t i = 0; i < 3; ++i) {
    angles_.joint_rad[i] = joint_rad[i];
    angles_.gimbal_rad[i] = gimbal_rad[i];
    angles_.known = angles_.known && std::isfinite(joint_rad[i]) && std::isfinite(gimbal_rad[i]);
  }
}

/// True if the library supports the last query; a device without that value is not faulty. The error stack
/// was empty before.
bool Servo::knows_what_was_asked() noexcept {
  bool known = true;
  for (int taken = 0; taken < HdLibrary::kMaxStackDepth; ++taken) {
    const hd::ErrorInfo error = api_.get_error();
    if (error.code == hd::kSuccess) break;
    if (is_function_error(error.code)) {
      known = false;
    } else {
      library_->deliver(error, *slot_);
    }
  }
  return known;
}

/// Checks the output: the library may switch it off by itself. It is not switched on again without the user.
void Servo::check_output() noexcept {
  if (!output_known_ || api_.is_enabled == nullptr) return;
  const bool on = api_.is_enabled(hd::kForceOutput) != 0;
  output_known_ = knows_what_was_asked();
  reported_->force_off.store(output_known_ && !on, std::memory_order_relaxed);
}

void Servo::feel_motors() noexcept {
  if (!temperature_known_) return;
  double shares[ServoReport::kMaxMotors];
  std::fill(std::begin(shares), std::end(shares), -1.0);
  api_.get_doublev(hd::kMotorTemperature, shares);
  temperature_known_ = knows_what_was_asked();
  for (std::size_t motor = 0; motor < static_cast<std::size_t>(setup_.motors); ++motor) {
    const bool valid = temperature_known_ && std::isfinite(shares[motor]);
    reported_->temperatures[motor].store(valid ? shares[motor] : -1.0, std::memory_order_relaxed);
  }
}

void Servo::read(hal::RigSample& sample) const noexcept {
  sample.tip_position_mm = tip_mm_;
  sample.tip_orientation = orientation_;
  sample.angles = angles_;
  sample.position_age_ns = hal::monotonic_ns() - tip_ns_;
  sample.status |= status_;
}

void Servo::write(const hal::DeviceCommand& command) noexcept {
  command_n_ = {};
  if (!finite(command.force_n)) {
    reported_->commands_not_finite.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  const double magnitude_n = std::hypot(command.force_n.x, command.force_n.y, command.force_n.z);
  command_n_ = command.force_n;
  if (magnitude_n > setup_.force_limit_n * (1.0 + 1e-9)) {
    command_n_ = command.force_n * (setup_.force_limit_n / magnitude_n);
    if (!finite(command_n_)) command_n_ = {};
    reported_->commands_limited.fetch_add(1, std::memory_order_relaxed);
    limited_ = true;
  }
}

}  // namespace hapticd::openhaptics
