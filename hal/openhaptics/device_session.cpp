#include "hal/openhaptics/device_session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "hal/openhaptics/device_figures.h"
#include "hal/shown_text.h"

namespace hapticd::openhaptics {

namespace {

/// Errors of force and speed show the moment and do not keep a device from being opened.
bool is_of_the_moment(hd::ErrorCode code) noexcept {
  return code >= hd::kWarmMotors && code <= hd::kForceError;
}

}  // namespace

void DeviceSession::make_current() {
  if (library_->api().make_current_device != nullptr) library_->api().make_current_device(device_);
}

/// Error that the library has to report, if any.
std::optional<hal::Error> DeviceSession::failure(const std::string& what, const std::string& value) {
  const hd::ErrorInfo error = library_->last_error(device_);
  if (error.code == hd::kSuccess || is_of_the_moment(error.code)) return std::nullopt;
  return hal::Error{what + ": " + library_->describe(error), "OpenHaptics device", value, "",
                    std::string(hd_error(error.code).remedy)};
}

std::optional<double> DeviceSession::number(hd::Enum what) {
  double values[ServoReport::kMaxMotors];  // more than any of these parameters writes
  std::fill(std::begin(values), std::end(values), std::numeric_limits<double>::quiet_NaN());
  library_->api().get_doublev(what, values);
  if (library_->last_error(device_).code != hd::kSuccess || !std::isfinite(values[0])) return std::nullopt;
  return values[0];
}

std::optional<bool> DeviceSession::enabled(hd::Enum what) {
  if (library_->api().is_enabled == nullptr) return std::nullopt;
  const bool on = library_->api().is_enabled(what) != 0;
  if (library_->last_error(device_).code != hd::kSuccess) return std::nullopt;
  return on;
}

std::optional<int> DeviceSession::integer(hd::Enum what) {
  if (library_->api().get_integerv == nullptr) return std::nullopt;
  int values[ServoReport::kMaxMotors] = {};
  library_->api().get_integerv(what, values);
  if (library_->last_error(device_).code != hd::kSuccess) return std::nullopt;
  return values[0];
}

std::string DeviceSession::text(hd::Enum what) {
  if (library_->api().get_string == nullptr) return {};
  const char* words = library_->api().get_string(what);
  if (library_->last_error(device_).code != hd::kSuccess || words == nullptr) return {};
  return words;
}

std::optional<hal::Error> DeviceSession::open() {
  auto library = HdLibrary::load(config_.libraries());
  if (!library) return library.error();
  library_ = *library;
  facts_.loaded_library = library_->name();
  facts_.lacking = hal::joined(library_->lacking());
  auto error = init();
  if (!error) error = prepare();
  if (error) close();
  return error;
}

std::optional<hal::Error> DeviceSession::init() {
  const std::string name = config_.device_name.empty() ? "the default device" : config_.device_name;
  library_->last_error(device_);  // what someone else left there
  device_ = library_->api().init_device(config_.device_name.empty() ? nullptr : config_.device_name.c_str());
  if (auto error = failure("the device cannot be opened", name)) return error;
  if (device_ == hd::kInvalidHandle) {
    return hal::Error{
        "the device cannot be opened: the library returns no handle and no reason", "OpenHaptics device",
        name, "",
        "try the vendor's diagnostic tool with the GTDD_HOME of the service; use the name set up "
        "there"};
  }
  slot_ = library_->acquire_slot(device_);
  if (slot_ == nullptr) {
    return hal::Error{"too many devices are open", "OpenHaptics device", name,
                      std::to_string(HdLibrary::kSlots), "close one"};
  }
  return std::nullopt;
}

std::optional<hal::Error> DeviceSession::prepare() {
  make_current();
  read_facts();
  const bool calibrated = calibrate();
  library_->api().set_scheduler_rate(static_cast<unsigned long>(std::lround(config_.rate_hz)));
  if (auto error = failure("the scheduler refuses its rate", std::to_string(std::lround(config_.rate_hz)))) {
    error->limit = "a rate that the device's connection supports; 500 and 1000 Hz always";
    error->remedy = "set rate_hz = 1000";
    return error;
  }
  if (auto error = try_force()) return error;

  ServoSetup setup;
  setup.rate_hz = config_.rate_hz;
  setup.force_limit_n = facts_.force_limit_n;
  setup.warm_share = config_.warm_share;
  setup.stall_ns = std::llround(1e9 * config_.stall_s);
  setup.origin_mm = config_.origin_mm;
  setup.tip_offset_mm = config_.tip_offset_mm;
  setup.tool_to_stylus = config_.tool_to_stylus;
  setup.motors =
      std::clamp(integer(hd::kOutputDof).value_or(3), 1, static_cast<int>(ServoReport::kMaxMotors));
  setup.calibrated = calibrated;
  // Encoders are reset only where the operator placed the device, never during a run.
  for (const int style : {hd::kCalibrationAuto, hd::kCalibrationInkwell}) {
    if (setup.calibration_style == 0) setup.calibration_style = facts_.calibration_styles & style;
  }
  servo_ = std::make_unique<Servo>(library_, device_, slot_, setup);
  return std::nullopt;
}

void DeviceSession::read_facts() {
  facts_.model_type = text(hd::kDeviceModelType);
  facts_.vendor = text(hd::kDeviceVendor);
  facts_.serial_number = text(hd::kDeviceSerialNumber);
  facts_.driver_version = text(hd::kDeviceDriverVersion);
  const auto plausible = [this](hd::Enum what) {
    const double value = number(what).value_or(0.0);
    return value > 0.0 && value < 1000.0 ? value : 0.0;
  };
  facts_.max_force_n = plausible(hd::kNominalMaxForce);
  facts_.max_continuous_force_n = plausible(hd::kNominalMaxContinuousForce);
  facts_.max_stiffness_n_per_mm = plausible(hd::kNominalMaxStiffness);
  facts_.force_ramping_rate_n_per_s = number(hd::kForceRampingRate).value_or(0.0);
  facts_.force_ramping = enabled(hd::kForceRamping);
  facts_.max_force_clamping = enabled(hd::kMaxForceClamping);
  facts_.software_force_limit = enabled(hd::kSoftwareForceLimit);

  facts_.force_limit_n =
      facts_.max_force_n > 0.0 ? facts_.max_force_n : device_figures(config_.model)->info.max_force_n;
  if (config_.max_force_n) facts_.force_limit_n = std::min(facts_.force_limit_n, *config_.max_force_n);
}

/// Calibrates if it can; true if the device knows its position. Steps that need the operator are not done
/// here; the report asks for them.
bool DeviceSession::calibrate() {
  const hd::Api& api = library_->api();
  if (api.check_calibration == nullptr) {
    facts_.calibration_known = false;
    return true;
  }
  facts_.calibration_styles = integer(hd::kCalibrationStyle).value_or(0);
  const bool reset =
      config_.reset_encoders && (facts_.calibration_styles & hd::kCalibrationEncoderReset) != 0;
  hd::Enum state = api.check_calibration();
  if (api.update_calibration == nullptr) return state == hd::kCalibrationOk;
  if (reset) {
    api.update_calibration(static_cast<hd::Enum>(hd::kCalibrationEncoderReset));
    state = api.check_calibration();
  }
  const int by_itself = (facts_.calibration_styles & hd::kCalibrationAuto) != 0
                            ? hd::kCalibrationAuto
                            : facts_.calibration_styles & hd::kCalibrationInkwell;
  const auto until =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(config_.calibration_wait_s);
  while (state == hd::kCalibrationNeedsUpdate && by_itself != 0) {
    api.update_calibration(static_cast<hd::Enum>(by_itself));
    state = api.check_calibration();
    if (state != hd::kCalibrationNeedsUpdate || std::chrono::steady_clock::now() >= until) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  library_->last_error(device_);  // a failed update shows in the state
  return state == hd::kCalibrationOk;
}

/// Switches force on briefly, while nothing runs that could command one.
std::optional<hal::Error> DeviceSession::try_force() {
  const hd::Api& api = library_->api();
  api.enable(hd::kForceOutput);
  auto error = failure("the device accepts no force", config_.device_name);
  facts_.output_stays_off = !enabled(hd::kForceOutput).value_or(true);
  api.disable(hd::kForceOutput);
  library_->last_error(device_);
  return error;
}

std::optional<hal::Error> DeviceSession::start() {
  const hd::Api& api = library_->api();
  make_current();
  library_->last_error(device_);
  api.enable(hd::kForceOutput);
  if (auto error = failure("the device accepts no force", config_.device_name)) return error;
  scheduled_ = api.schedule_asynchronous(&Servo::callback, servo_.get(), hd::kMaxPriority);
  if (auto error = failure("the scheduler accepts no callback", "")) {
    api.disable(hd::kForceOutput);
    return error;
  }
  is_scheduled_ = true;
  library_->start_scheduler();
  // From here on the callback reads the errors: errors of the start appear in its samples.
  return std::nullopt;
}

void DeviceSession::stop() {
  is_scheduled_ = false;
  library_->stop_scheduler();
  make_current();
  library_->api().disable(hd::kForceOutput);
}

void DeviceSession::stop_dead(bool frame_is_ours) {
  const hd::Api& api = library_->api();
  make_current();
  if (frame_is_ours) {
    const double none_n[3] = {0.0, 0.0, 0.0};
    api.begin_frame(device_);
    api.set_doublev(hd::kCurrentForce, none_n);
    api.end_frame(device_);
  }
  api.disable(hd::kForceOutput);
  if (is_scheduled_) api.unschedule(scheduled_);
  is_scheduled_ = false;
  library_->stop_scheduler();
}

void DeviceSession::close() {
  if (library_ == nullptr) return;
  if (device_ != hd::kInvalidHandle) {
    make_current();
    library_->api().disable(hd::kForceOutput);
    library_->api().disable_device(device_);
    library_->last_error(device_);
    if (slot_ != nullptr) HdLibrary::release_slot(*slot_);
    device_ = hd::kInvalidHandle;
  }
  servo_.reset();
  library_.reset();
}

}  // namespace hapticd::openhaptics
