#include "hal/openhaptics/openhaptics_device.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>
#include <vector>

#include "hal/lock/mutex.h"
#include "hal/openhaptics/device_figures.h"
#include "hal/openhaptics/device_report.h"
#include "hal/openhaptics/device_session.h"
#include "hal/openhaptics/vendor_thread.h"
#include "hal/shown_text.h"

namespace hapticd::openhaptics {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kPoll{1};
/// Time for the last frame, and for a turn in progress to return.
constexpr milliseconds kLeave{250};
/// Time for a call that ends a run, while a caller waits for it.
constexpr milliseconds kStopTimeout{2000};
constexpr std::chrono::seconds kRateWindow{1};

milliseconds in_ms(double seconds) {
  return milliseconds(static_cast<std::int64_t>(1e3 * seconds));
}

hal::DeviceInfo described(const OpenHapticsConfig& config) {
  hal::DeviceInfo info = device_figures(config.model)->info;
  info.max_force_n = std::min(info.max_force_n, config.max_force_n.value_or(info.max_force_n));
  info.max_continuous_force_n = config.max_continuous_force_n.value_or(info.max_continuous_force_n);
  info.structural_stiffness_n_per_mm =
      config.structural_stiffness_n_per_mm.value_or(info.structural_stiffness_n_per_mm);
  info.structural_mode_hz = config.structural_mode_hz;
  info.apparent_mass_g = config.apparent_mass_g.value_or(info.apparent_mass_g);
  info.position_resolution_mm = config.position_resolution_mm.value_or(info.position_resolution_mm);
  return info;
}

/// Sessions in which a vendor thread is, or may be, still running. Kept for ever: it may return at any
/// time.
struct Graves {
  Mutex mutex;
  std::vector<std::shared_ptr<DeviceSession>> sessions GUARDED_BY(mutex);
};
void bury(std::shared_ptr<DeviceSession> session) {
  static auto* graves = new Graves;
  const MutexLock lock(graves->mutex);
  graves->sessions.push_back(std::move(session));
}

}  // namespace

struct OpenHapticsDevice::State {
  explicit State(const OpenHapticsConfig& config_) : config(config_), info(described(config_)) {}

  const OpenHapticsConfig config;
  hal::DeviceInfo info;

  SerialMutex control;                                         ///< engage, disengage, begin and end of a run
  std::shared_ptr<DeviceSession> session GUARDED_BY(control);  ///< while engaged
  std::weak_ptr<HdLibrary> library GUARDED_BY(control);        ///< the session's
  std::unique_ptr<VendorThread> vendor GUARDED_BY(control);
  Mutex run_mutex;
  Condition run_ended;
  bool running GUARDED_BY(run_mutex) = false;
  std::atomic<bool> quit{false};  ///< ends a run in progress

  std::atomic<Servo*> servo{nullptr};  ///< while engaged; for read and write
  hal::Vector3 last_tip_mm;            ///< while not engaged
  hal::Quaternion last_orientation;

  mutable Mutex view_mutex;
  DeviceView view GUARDED_BY(view_mutex);

  template <class F>
  void show(F&& change) {
    const MutexLock lock(view_mutex);
    change(view);
  }

  bool is_running() EXCLUDES(run_mutex) {
    const MutexLock lock(run_mutex);
    return running;
  }
  void set_running(bool now) EXCLUDES(run_mutex) {
    const MutexLock lock(run_mutex);
    running = now;
    run_ended.notify_all();
  }
  void await_run_end() EXCLUDES(run_mutex) {
    const MutexLock lock(run_mutex);
    while (running) run_ended.wait(run_mutex);
  }

  std::optional<hal::Error> open() REQUIRES(control);
  void close() REQUIRES(control);
  bool begin_run(hal::ServoBody& body) REQUIRES(control);
  bool watch(const Servo& turning, const std::atomic<bool>& stop) EXCLUDES(control);
  void end_run(Servo& turning) REQUIRES(control);
  void abandon(const std::string& call) REQUIRES(control);
};

/// Abandons the library, which did not return from a call.
void OpenHapticsDevice::State::abandon(const std::string& call) {
  servo = nullptr;
  if (const auto hanging = library.lock()) hanging->abandon();
  bury(std::move(session));
  session = nullptr;
  vendor = nullptr;
  show([&](DeviceView& v) {
    v.engaged = false;
    v.refusal = "the vendor's library does not return from " + call +
                ": switch the device off and on and restart the service";
  });
}

std::optional<hal::Error> OpenHapticsDevice::State::open() {
  session = std::make_shared<DeviceSession>(config);
  vendor = std::make_unique<VendorThread>();
  const auto outcome = std::make_shared<std::optional<hal::Error>>();
  if (!vendor->call([opening = session, outcome] { *outcome = opening->open(); }, in_ms(config.timeout_s))) {
    session = nullptr;  // the hanging thread owns it alone, and closes it if it ever returns
    vendor = nullptr;
    return hal::Error{"the vendor's library does not return from opening the device", "OpenHaptics device",
                      config.device_name, "within " + hal::number_text(config.timeout_s, 5) + " s",
                      "switch the device off and on, check its connection and restart the service"};
  }
  if (*outcome) {
    session = nullptr;
    vendor = nullptr;
    return *outcome;
  }
  const DeviceFacts& facts = session->facts();
  info = described(config);
  info.max_force_n = facts.force_limit_n;
  if (facts.max_continuous_force_n > 0.0 && !config.max_continuous_force_n) {
    info.max_continuous_force_n = facts.max_continuous_force_n;
  }
  servo = &session->servo();
  library = session->library();
  show([&facts, &opened = *session](DeviceView& v) {
    v = {};
    v.engaged = true;
    v.facts = facts;
    v.servo = opened.servo().report();
    v.slot = opened.slot();
  });
  return std::nullopt;
}

void OpenHapticsDevice::State::close() {
  if (session == nullptr) return;
  hal::RigSample last;
  session->servo().read(last);
  last_tip_mm = last.tip_position_mm;
  last_orientation = last.tip_orientation;
  servo = nullptr;
  if (!vendor->call([closing = session] { closing->close(); }, in_ms(config.timeout_s))) {
    return abandon("closing the device");
  }
  session = nullptr;
  vendor = nullptr;
  show([](DeviceView& v) {
    v.engaged = false;
    v.stalled = false;
    v.lost = false;
  });
}

bool OpenHapticsDevice::State::begin_run(hal::ServoBody& body) {
  Servo& turning = session->servo();
  turning.arm(body);
  const auto outcome = std::make_shared<std::optional<hal::Error>>();
  if (!vendor->call([starting = session, outcome] { *outcome = starting->start(); }, kStopTimeout)) {
    turning.give_up(kLeave);
    abandon("starting the scheduler");
    return false;
  }
  if (*outcome) {
    turning.give_up(kLeave);
    show([&](DeviceView& v) { v.refusal = (*outcome)->text(); });
    return false;
  }
  show([](DeviceView& v) {
    v.refusal.clear();
    v.running = true;
    v.rate_hz = 0.0;
  });
  return true;
}

/// Waits until the run has to stop. False when the scheduler has died.
bool OpenHapticsDevice::State::watch(const Servo& turning, const std::atomic<bool>& stop) {
  const ServoReport& reported = *turning.report();
  std::uint64_t frames = reported.frames;
  std::uint64_t window_frames = frames;
  Clock::time_point last_frame = Clock::now();
  Clock::time_point window = last_frame;
  bool stalled = false;
  while (!stop.load(std::memory_order_relaxed) && !quit.load(std::memory_order_relaxed)) {
    std::this_thread::sleep_for(kPoll);
    const Clock::time_point now = Clock::now();
    const std::uint64_t frames_now = reported.frames;
    if (frames_now != frames) {
      frames = frames_now;
      last_frame = now;
    }
    const double silence_s = std::chrono::duration<double>(now - last_frame).count();
    if (stalled != (silence_s > config.stall_s)) {
      stalled = !stalled;
      show([&](DeviceView& v) { v.stalled = stalled; });
    }
    if (silence_s > config.death_s) return false;
    if (now - window >= kRateWindow) {
      const double rate_hz =
          static_cast<double>(frames - window_frames) / std::chrono::duration<double>(now - window).count();
      show([&](DeviceView& v) { v.rate_hz = rate_hz; });
      window = now;
      window_frames = frames;
    }
  }
  return true;
}

void OpenHapticsDevice::State::end_run(Servo& turning) {
  turning.finish();
  const Clock::time_point until = Clock::now() + kLeave;
  while (!turning.finished() && Clock::now() < until) std::this_thread::sleep_for(kPoll);
  const bool finished = turning.finished();
  const Servo::Leaving leaving = turning.give_up(kLeave);
  const bool back_in_time = vendor->call(
      [stopping = session, finished, leaving] {
        if (finished) {
          stopping->stop();
        } else {
          stopping->stop_dead(leaving == Servo::Leaving::kClean);
        }
      },
      kStopTimeout);
  if (!back_in_time) return abandon("stopping the scheduler");
  if (leaving == Servo::Leaving::kStuck) return abandon("a frame of the scheduler");
}

hal::Result<std::unique_ptr<OpenHapticsDevice>> OpenHapticsDevice::create(const OpenHapticsConfig& config) {
  if (auto error = check(config)) return *error;
  return std::unique_ptr<OpenHapticsDevice>(new OpenHapticsDevice(std::make_unique<State>(config)));
}

OpenHapticsDevice::OpenHapticsDevice(std::unique_ptr<State> state) : state_(std::move(state)) {}

OpenHapticsDevice::~OpenHapticsDevice() {
  disengage();
}

const hal::DeviceInfo& OpenHapticsDevice::info() const noexcept {
  return state_->info;
}

std::optional<hal::Error> OpenHapticsDevice::engage() {
  State& s = *state_;
  const MutexLock lock(s.control);
  if (s.is_running()) return std::nullopt;
  if (s.session != nullptr) {
    bool unfit = false;
    {
      const MutexLock view_lock(s.view_mutex);
      const std::uint32_t status = s.view.servo->status.load();
      unfit = s.view.lost || (status & hal::sample_status::kDeviceFault) != 0 || !s.view.servo->calibrated;
    }
    if (!unfit) return std::nullopt;
    s.close();
  }
  auto error = s.open();
  if (error) s.show([&](DeviceView& v) { v.refusal = error->text(); });
  return error;
}

void OpenHapticsDevice::disengage() noexcept {
  State& s = *state_;
  s.quit = true;
  MutexLock lock(s.control);
  while (s.is_running()) {  // the end of a run needs the lock
    lock.unlock();
    s.await_run_end();
    lock.lock();
  }
  s.quit = false;
  s.close();
  s.show([](DeviceView& v) { v.refusal.clear(); });
}

hal::PartReport OpenHapticsDevice::report() const {
  DeviceView view;
  {
    const MutexLock lock(state_->view_mutex);
    view = state_->view;
  }
  return report_on(state_->config, view);
}

void OpenHapticsDevice::read(hal::RigSample& sample) noexcept {
  const State& s = *state_;
  if (const Servo* servo = s.servo.load(std::memory_order_relaxed)) {
    servo->read(sample);
  } else {
    sample.tip_position_mm = s.last_tip_mm;
    sample.tip_orientation = s.last_orientation;
    sample.status |= hal::sample_status::kDeviceNotReady;
  }
}

void OpenHapticsDevice::write(const hal::DeviceCommand& command) noexcept {
  if (Servo* servo = state_->servo.load(std::memory_order_relaxed)) servo->write(command);
}

void OpenHapticsDevice::write_zero_in_crash() noexcept {
  if (Servo* servo = state_->servo.load()) servo->write_zero_in_crash();
}

void OpenHapticsDevice::run(hal::ServoBody& body, const std::atomic<bool>& stop) noexcept {
  State& s = *state_;
  std::shared_ptr<DeviceSession> session;  // keeps the servo alive while it is watched
  {
    const MutexLock lock(s.control);
    if (s.is_running() || s.session == nullptr || s.quit) return;
    session = s.session;
    if (!s.begin_run(body)) return;
    s.set_running(true);
  }
  const bool alive = s.watch(session->servo(), stop);
  {
    const MutexLock lock(s.control);
    s.end_run(session->servo());
    s.show([&](DeviceView& v) {
      v.running = false;
      v.stalled = false;
      v.lost = !alive;
    });
    s.set_running(false);  // under the lock: the waiting thread destroys this object when it has it
  }
}

}  // namespace hapticd::openhaptics
