#include "rt/loop/periodic_loop.h"

#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <thread>
#include <utility>

#include "rt/loop/flush_denormals.h"
#include "rt/loop/loop_memory.h"
#include "rt/loop/virtual_time_runner.h"

namespace hapticd::rt {

namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

std::int64_t now_ns() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * kNanosecondsPerSecond + t.tv_nsec;
}

void sleep_until_ns(std::int64_t time_ns) noexcept {
  const timespec t{time_ns / kNanosecondsPerSecond, time_ns % kNanosecondsPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

void increment(std::atomic<std::uint64_t>& counter, std::uint64_t by = 1) noexcept {
  counter.store(counter.load(std::memory_order_relaxed) + by, std::memory_order_relaxed);
}

/// Keeps the cores out of deep sleep for as long as it lives; the kernel listens to the open file.
class CpuWakeLock {
 public:
  explicit CpuWakeLock(bool wanted) noexcept {
    if (!wanted) return;
    descriptor_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    const std::int32_t zero = 0;
    held_ = descriptor_ >= 0 && write(descriptor_, &zero, sizeof zero) == sizeof zero;
  }
  ~CpuWakeLock() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  CpuWakeLock(const CpuWakeLock&) = delete;
  CpuWakeLock& operator=(const CpuWakeLock&) = delete;
  bool held() const noexcept { return held_; }

 private:
  int descriptor_ = -1;
  bool held_ = false;
};

}  // namespace

hal::Result<LoopConfig> validate(const LoopConfig& config) {
  const auto out_of_range = [](const char* key, double value, const char* limit) {
    return hal::Error::of(hal::ErrorCode::kOutOfRange, std::string(key) + " is out of range", "[loop]",
                          std::to_string(value), limit, "");
  };
  if (!(config.rate_hz >= 500.0 && config.rate_hz <= 10000.0)) {
    return out_of_range("rate_hz", config.rate_hz, "500 … 10000 Hz");
  }
  if (config.fifo_priority < 0 || config.fifo_priority > 99) {
    return out_of_range("fifo_priority", config.fifo_priority, "0 (ordinary) … 99");
  }
  if (!(config.wake_early_share >= 0.0 && config.wake_early_share <= 0.5)) {
    return out_of_range("wake_early_share", config.wake_early_share, "0 … 0.5 of a period");
  }
  const long cpus = sysconf(_SC_NPROCESSORS_CONF);
  if (config.cpu < -1 || config.cpu >= cpus) {
    return hal::Error{"cpu does not exist", "[loop]", std::to_string(config.cpu),
                      "-1 (any) … " + std::to_string(cpus - 1), ""};
  }
  return config;
}

PeriodicLoop::PeriodicLoop(hal::Rig& rig, Engine& engine, const LoopConfig& config)
    : rig_(rig),
      engine_(engine),
      config_(config),
      period_ns_(static_cast<std::int64_t>(std::llround(1e9 / config.rate_hz))),
      early_ns_(static_cast<std::int64_t>(config.wake_early_share * static_cast<double>(period_ns_))) {}

PeriodicLoop::~PeriodicLoop() {
  stop();
}

void PeriodicLoop::start() {
  if (thread_.joinable()) return;
  stop_requested_.store(false);
  prepared_.store(false);
  thread_ = std::thread([this] { thread_main(); });
  prepared_.wait(false);
}

void PeriodicLoop::stop() {
  stop_requested_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
}

void PeriodicLoop::prepare_thread() {
  pthread_setname_np(pthread_self(), "hapticd-loop");
  // What starts a scheduler passes its own priority and CPU on to it, and to all that the vendor's library
  // starts.
  const bool ticks_here = rig_.owns_clock() || rig_.clock() == nullptr;
  if (ticks_here) prepare_to_tick();
  prefault_stack();
  if (config_.lock_memory) {
    if (const std::string why = lock_used_memory(); !why.empty()) {
      shortcomings_.push_back("memory is not locked: " + why +
                              "; LimitMEMLOCK=infinity in the service's unit, or ulimit -l unlimited");
    }
  }
}

void PeriodicLoop::prepare_to_tick() noexcept {
  const ScheduleShortfall lacking = take_schedule(config_.cpu, config_.fifo_priority);
  cpu_shortfall_.store(lacking.cpu, std::memory_order_relaxed);
  priority_shortfall_.store(lacking.priority, std::memory_order_relaxed);
  ticking_thread_.store(gettid(), std::memory_order_release);
}

std::vector<std::string> PeriodicLoop::shortcomings() const {
  std::vector<std::string> all = shortcomings_;
  const auto missing = [&all](const std::string& what, int error, const std::string& remedy) {
    if (error != 0) all.push_back(what + ": " + std::strerror(error) + "; " + remedy);
  };
  missing("not pinned to CPU " + std::to_string(config_.cpu), cpu_shortfall_.load(std::memory_order_relaxed),
          "check the CPU set of the process");
  missing("no SCHED_FIFO priority " + std::to_string(config_.fifo_priority),
          priority_shortfall_.load(std::memory_order_relaxed),
          "LimitRTPRIO=99 in the service's unit, or ulimit -r 99 for the user (/etc/security/limits.d)");
  return all;
}

void PeriodicLoop::thread_main() {
  const FlushDenormals flush;  // for what rigs compute around the tick, too
  prepare_thread();
  const CpuWakeLock awake(config_.keep_cpu_awake);
  if (config_.keep_cpu_awake && !awake.held()) {
    shortcomings_.emplace_back(
        "/dev/cpu_dma_latency is not held: idle cores may wake late; allow writing to it");
  }
  running_.store(true, std::memory_order_release);
  prepared_.store(true);
  prepared_.notify_one();

  timing_ = {};
  begun_ns_ = 0;
  if (rig_.owns_clock()) {
    VirtualTimeRunner runner(engine_);
    rig_.run(runner, stop_requested_);
  } else if (hal::ServoClock* clock = rig_.clock()) {
    run_by(*clock);
  } else {
    run_paced();
  }
  running_.store(false, std::memory_order_release);
}

std::int64_t tick_phase_ns(std::int64_t process, std::int64_t period_ns) noexcept {
  // Multiples of the golden ratio, without their whole parts, keep away from each other.
  constexpr double kGoldenRatio = 1.618033988749895;
  const double turns = kGoldenRatio * static_cast<double>(process);
  return static_cast<std::int64_t>((0.25 + 0.5 * (turns - std::floor(turns))) *
                                   static_cast<double>(period_ns));
}

std::int64_t PeriodicLoop::await(std::int64_t time_ns) noexcept {
  sleep_until_ns(time_ns - early_ns_);
  std::int64_t now = now_ns();
  timer_.record(now - (time_ns - early_ns_));
  while (now < time_ns) now = now_ns();  // for early_ns_ at most
  return now;
}

void PeriodicLoop::run_paced() noexcept {
  std::int64_t deadline_ns = (now_ns() / period_ns_ + 2) * period_ns_ + tick_phase_ns(getpid(), period_ns_);
  while (!stop_requested_.load(std::memory_order_acquire) && !rig_.exhausted()) {
    deadline_ns = tick(deadline_ns, await(deadline_ns));
  }
  rig_.write(hal::DeviceCommand{});
}

// A scheduler that died, or was never there, does not end the loop: the device may be plugged in again.
void PeriodicLoop::run_by(hal::ServoClock& clock) {
  constexpr std::chrono::milliseconds kPollInterval{10};
  constexpr int kPollsBetweenAttempts = 100;
  for (;;) {
    servo_deadline_ns_ = 0;
    is_first_servo_ = true;
    clock.run(*this, stop_requested_);
    rig_.write(hal::DeviceCommand{});
    if (stop_requested_.load(std::memory_order_acquire)) return;
    increment(clock_losses_);
    for (int i = 0; i < kPollsBetweenAttempts; ++i) {
      if (stop_requested_.load(std::memory_order_acquire)) return;
      std::this_thread::sleep_for(kPollInterval);
    }
    rig_.engage(hal::RigPartKind::kDevice);  // why it fails is in the device's report
  }
}

// A foreign scheduler keeps no grid that we know of: its next call is expected a period after this one.
void PeriodicLoop::on_servo() noexcept {
  const FlushDenormals flush;
  if (std::exchange(is_first_servo_, false)) {
    pthread_setname_np(pthread_self(), "hapticd-tick");
    prepare_to_tick();
  }
  const std::int64_t woken_ns = now_ns();
  tick(servo_deadline_ns_ == 0 ? woken_ns : servo_deadline_ns_, woken_ns);
  servo_deadline_ns_ = woken_ns + period_ns_;
}

std::int64_t PeriodicLoop::tick(std::int64_t deadline_ns, std::int64_t woken_ns) noexcept {
  TickTiming& timing = timing_;
  timing.wakeup_ns = std::max<std::int64_t>(0, woken_ns - deadline_ns);
  if (begun_ns_ != 0) jitter_.record(std::abs(woken_ns - begun_ns_ - period_ns_));
  begun_ns_ = woken_ns;

  rig_.read(sample_);
  const std::int64_t read_ns = now_ns();
  last_reading_.publish({sample_.time_ns, woken_ns, read_ns});
  timing.device_ns += read_ns - woken_ns;  // with the last tick's write
  engine_.note_timing(timing);
  const hal::DeviceCommand command = engine_.on_tick(sample_);
  const std::int64_t computed_ns = now_ns();
  rig_.write(command);
  const std::int64_t done_ns = now_ns();

  const std::int64_t compute_ns = computed_ns - read_ns;
  const std::int64_t device_ns = (read_ns - woken_ns) + (done_ns - computed_ns);
  wakeup_.record(timing.wakeup_ns);
  compute_.record(compute_ns);
  device_.record(device_ns);
  increment(ticks_);

  TickTiming next;
  next.device_ns = done_ns - computed_ns;
  next.compute_ns = compute_ns;
  deadline_ns += period_ns_;
  if (done_ns > deadline_ns) {
    // Late: skip what was missed and name what took the longest.
    const std::int64_t missed = (done_ns - deadline_ns) / period_ns_ + 1;
    deadline_ns += missed * period_ns_;
    next.periods_missed = static_cast<std::uint32_t>(std::min<std::int64_t>(missed, UINT32_MAX));
    increment(periods_missed_, static_cast<std::uint64_t>(missed));
    if (timing.wakeup_ns >= compute_ns && timing.wakeup_ns >= device_ns) {
      next.overrun = OverrunCause::kWakeUp;
      increment(overruns_by_wakeup_);
    } else if (compute_ns >= device_ns) {
      next.overrun = OverrunCause::kCompute;
      increment(overruns_by_compute_);
    } else {
      next.overrun = OverrunCause::kDevice;
      increment(overruns_by_device_);
    }
  }
  timing = next;
  return deadline_ns;
}

LoopStatistics PeriodicLoop::statistics() const noexcept {
  LoopStatistics s;
  s.jitter = jitter_.snapshot();
  s.timer = timer_.snapshot();
  s.wakeup = wakeup_.snapshot();
  s.compute = compute_.snapshot();
  s.device = device_.snapshot();
  s.ticks = ticks_.load(std::memory_order_relaxed);
  s.periods_missed = periods_missed_.load(std::memory_order_relaxed);
  s.overruns_by_wakeup = overruns_by_wakeup_.load(std::memory_order_relaxed);
  s.overruns_by_compute = overruns_by_compute_.load(std::memory_order_relaxed);
  s.clock_losses = clock_losses_.load(std::memory_order_relaxed);
  s.overruns_by_device = overruns_by_device_.load(std::memory_order_relaxed);
  return s;
}

}  // namespace hapticd::rt
