#include "server/calibration/run/calibration_runner.h"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "hal/sim/simulated_rig.h"
#include "server/process/thread_start.h"

namespace hapticd::server {

namespace {

using calibration::CalibrationKind;
using calibration::ReferencePose;
using calibration::RigPose;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPollInterval{10};
constexpr std::chrono::milliseconds kReportEvery{250};
/// A call that waits looks so often whether its caller still does.
constexpr std::chrono::milliseconds kWaitSlice{100};
constexpr double kRigPosesPerS = 250.0;
constexpr double kTailS = 0.5;  ///< of the rig, after the last of the tracker's stamps is in

Refusal busy() {
  return {RefusalKind::kFailedPrecondition,
          {"a calibration runs already", "calibration", "", "",
           "finish or cancel it: 'hapticctl calibrate cancel'"},
          Reason::kBusy};
}

RigPose pose_of(const rt::TickRecord& record) {
  const auto& q = record.tip_orientation;
  const auto& p = record.tip_position_mm;
  RigPose pose;
  pose.time_s = 1e-9 * static_cast<double>(record.time_ns);
  pose.angles = record.angles;
  pose.tip_mm = {p.x, p.y, p.z};
  pose.orientation = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized();
  return pose;
}

sim::HandProgram motion_for(CalibrationKind kind) {
  sim::HandProgram program;
  program.kind = sim::HandProgram::Kind::kSway;
  program.hold_s = -1.0;
  program.speed_mm_per_s = kind == CalibrationKind::kTip ? 1.0 : 150.0;
  program.rate_hz = kind == CalibrationKind::kTip ? 0.5 : 0.27;
  program.place_mm = {0.0, -25.0, 70.0};
  program.tilt_deg = 35.0;
  program.twist_deg = 35.0;
  return program;
}

}  // namespace

CalibrationRunner::~CalibrationRunner() {
  cancel_ = true;
  if (thread_.joinable()) thread_.join();
}

std::optional<Refusal> CalibrationRunner::check_request(const CalibrationRequest& request) const {
  if (!request.tip_calibration.empty()) {
    const auto tip = store_.find(request.tip_calibration);
    if (!tip) return tip.refusal();
    if (!tip->tip_in_marker_mm || request.kind == CalibrationKind::kTip) {
      return Refusal{RefusalKind::kInvalidArgument,
                     {"this is no tip calibration, or there is no use for one",
                      "StartCalibrationRequest.tip_calibration", request.tip_calibration,
                      "the hash of a tip calibration, for registration or kinematics", ""}};
    }
  }
  sim::SimulatedRig* const simulation = session_.simulation();
  if (!request.simulated_tracker || (simulation != nullptr && simulation->tracker().there()))
    return std::nullopt;
  return Refusal{
      RefusalKind::kFailedPrecondition,
      {"the rig has no simulated tracker", "StartCalibrationRequest.simulated_tracker", "",
       "a simulated rig whose conditions have tracker_rate_hz", "start hapticd with --rig sim:arm"},
      Reason::kNotSimulated};
}

std::optional<Refusal> CalibrationRunner::move_simulated_hand(const CalibrationRequest& request) {
  if (!request.simulated_tracker) return std::nullopt;
  sim::SimulatedRig& simulation = *session_.simulation();
  if (auto error = simulation.set_program(motion_for(request.kind))) {
    return Refusal{RefusalKind::kFailedPrecondition, *error};
  }
  sim::TrackerPose old;
  while (simulation.tracker().take(old)) {
  }
  return std::nullopt;
}

Outcome<std::string> CalibrationRunner::start(const CalibrationRequest& request, std::uint64_t lease) {
  if (auto unavailable = session_.unavailable()) return *unavailable;
  {
    const MutexLock lock(mutex_);
    if (running_) return busy();
    running_ = true;  // from here on no other call begins one
    lease_ = lease;
    lost_control_.reset();
    finish_ = cancel_ = false;
  }
  auto refusal = check_request(request);
  if (!refusal) {
    if (thread_.joinable()) thread_.join();
    refusal = move_simulated_hand(request);
  }
  if (!refusal) {
    auto begun = begin(request);
    if (begun) return begun;
    refusal = begun.refusal();
    if (request.simulated_tracker) session_.simulation()->set_program({});
  }
  const MutexLock lock(mutex_);
  running_ = false;
  return *refusal;
}

Outcome<std::string> CalibrationRunner::begin(const CalibrationRequest& request) {
  const MutexLock lock(mutex_);
  if (lost_control_) {  // while it was prepared
    return Refusal{RefusalKind::kAborted, *lost_control_, Reason::kLeaseLost};
  }
  // It waits for the lock before it changes anything.
  if (auto error = start_thread(thread_, [this, request] { perform(request); })) {
    return Refusal{RefusalKind::kResourceExhausted, std::move(*error)};
  }
  takes_rig_poses_ = request.recorded;
  rig_ = {};
  reference_.clear();
  first_arrival_less_stamp_s_ = HUGE_VAL;
  report_.version = std::exchange(report_, {}).version + 1;
  report_.id = "calibration-" + std::to_string(++started_);
  report_.kind = request.kind;
  report_.time_limit_s = request.time_limit_s;
  report_.instruction = "move the tool";
  return report_.id;
}

std::optional<Refusal> CalibrationRunner::push(const std::vector<ReferencePose>& reference,
                                               const std::vector<RigPose>& rig) {
  const double now_s = 1e-9 * static_cast<double>(session_.now_ns());
  const MutexLock lock(mutex_);
  if (!running_ || report_.state != CalibrationState::kRecording) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"no calibration takes poses now", "PushReferencePoses", "", "", "start one first"}};
  }
  if (!rig.empty() && !takes_rig_poses_) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"the rig's poses come from the rig", "PushReferencePosesRequest.rig_poses", "",
                    "none, but for a recorded calibration", "start it with recorded = true"}};
  }
  const auto too_many = [](const char* where, std::size_t count, std::size_t limit) {
    return Refusal{RefusalKind::kResourceExhausted,
                   {"too many poses", std::string("PushReferencePosesRequest.") + where,
                    std::to_string(count), "at most " + std::to_string(limit), "finish the calibration"}};
  };
  if (const std::size_t count = reference_.size() + reference.size(); count > kMaxPoses)
    return too_many("poses", count, kMaxPoses);
  if (const std::size_t count = rig_.size() + rig.size(); count > kMaxRigPoses)
    return too_many("rig_poses", count, kMaxRigPoses);
  for (const RigPose& pose : rig) {
    if (rig_.add(pose)) continue;
    return Refusal{
        RefusalKind::kInvalidArgument,
        {"a pose of the rig is no number, or its time does not rise", "PushReferencePosesRequest.rig_poses",
         std::to_string(pose.time_s) + " s", "finite numbers, rising times", "see the recording"}};
  }
  for (const ReferencePose& pose : reference) {
    double sum = pose.stamp_s + pose.position_mm.sum();
    bool turned = true;
    if (pose.orientation) {
      sum += pose.orientation->coeffs().sum();
      turned = std::abs(pose.orientation->norm() - 1.0) < 1e-3;
    }
    if (!std::isfinite(sum) || !turned) {
      return Refusal{RefusalKind::kInvalidArgument,
                     {"a pose is none", "ReferencePose", std::to_string(pose.stamp_s) + " s",
                      "finite numbers, orientations of length 1", "leave out what the tracker did not see"}};
    }
    reference_.push_back(pose);
    first_arrival_less_stamp_s_ = std::min(first_arrival_less_stamp_s_, now_s - pose.stamp_s);
  }
  return std::nullopt;
}

Outcome<CalibrationReport> CalibrationRunner::wait_until_over(const Caller& caller) {
  MutexLock lock(mutex_);
  if (report_.id.empty()) {
    return Refusal{RefusalKind::kNotFound, {"there was no calibration", "calibration", "", "", "start one"}};
  }
  const auto until = caller.until(std::chrono::minutes(2));
  while (!report_.over()) {
    changed_.wait_for(mutex_, kWaitSlice);
    if (report_.over()) break;
    lock.unlock();
    if (caller.cancelled())
      return Refusal{RefusalKind::kCancelled, {"the caller left", "calibration", "", "", ""}};
    if (Clock::now() >= until) {
      return Refusal{RefusalKind::kDeadlineExceeded,
                     {"the calibration is not over yet", "calibration", "", "", "watch it"}};
    }
    lock.lock();
  }
  return report_;
}

Outcome<CalibrationReport> CalibrationRunner::finish(const Caller& caller) {
  finish_ = true;
  return wait_until_over(caller);
}

Outcome<CalibrationReport> CalibrationRunner::cancel(const Caller& caller) {
  cancel_ = true;
  return wait_until_over(caller);
}

void CalibrationRunner::end_under(std::uint64_t lease, const hal::Error& why) {
  const MutexLock lock(mutex_);
  if (!running_ || lease == 0 || lease_ != lease) return;
  lost_control_ = why;
  cancel_ = true;
}

Outcome<CalibrationReport> CalibrationRunner::report(const std::string& id, std::uint64_t newer_than,
                                                     const Caller& caller) {
  MutexLock lock(mutex_);
  if (report_.id.empty() || (!id.empty() && id != report_.id)) {
    return Refusal{
        RefusalKind::kNotFound,
        {"there is no such calibration", "calibration", id, "the one that runs, or the last one", ""}};
  }
  const auto until = caller.until(std::chrono::hours(24));
  while (report_.version <= newer_than && !report_.over()) {
    changed_.wait_for(mutex_, kWaitSlice);
    lock.unlock();
    const bool caller_waits = !caller.cancelled() && Clock::now() < until;
    lock.lock();
    if (!caller_waits) break;
  }
  return report_;
}

void CalibrationRunner::take_rig_poses(Subscription& subscription) {
  Subscription::Batch batch;
  while (subscription.take(batch, Clock::now())) {
    const MutexLock lock(mutex_);
    for (const Subscription::Entry& entry : batch.entries) {
      constexpr std::uint32_t kUnfit = hal::sample_status::kDeviceFault | hal::sample_status::kDeviceNotReady;
      if ((entry.record().sample_status & kUnfit) == 0) rig_.add(pose_of(entry.record()));
    }
  }
}

void CalibrationRunner::take_simulated_poses() {
  sim::TrackerPose seen;
  std::vector<ReferencePose> poses;
  while (session_.simulation()->tracker().take(seen)) {
    ReferencePose pose;
    pose.stamp_s = 1e-9 * static_cast<double>(seen.stamp_ns);
    pose.position_mm = {seen.position_mm.x, seen.position_mm.y, seen.position_mm.z};
    if (seen.has_orientation) {
      pose.orientation =
          Eigen::Quaterniond(seen.orientation.w, seen.orientation.x, seen.orientation.y, seen.orientation.z)
              .normalized();
    }
    poses.push_back(pose);
  }
  push(poses, {});
}

void CalibrationRunner::look_at_motion(CalibrationKind kind) {
  const MutexLock lock(mutex_);
  // Looks at some of them only: less work than to copy them all.
  auto items = calibration::coverage_of(kind, rig_, reference_);
  report_.duration_s = kind == CalibrationKind::kTip && rig_.size() < 2 && !reference_.empty()
                           ? reference_.back().stamp_s - reference_.front().stamp_s
                           : rig_.end_s() - rig_.begin_s();
  report_.rig_poses = rig_.size();
  report_.reference_poses = reference_.size();
  report_.completion = std::max(report_.completion, calibration::completion_of(items));
  const auto lacking = std::find_if(items.begin(), items.end(), [](const auto& i) { return !i.enough(); });
  report_.instruction =
      lacking != items.end() ? lacking->instruction : "enough was seen; finish when you like";
  report_.coverage = std::move(items);
  ++report_.version;
  changed_.notify_all();
}

void CalibrationRunner::listen(const CalibrationRequest& request) {
  SubscriptionOptions options;
  options.is_own = true;
  options.decimation =
      static_cast<std::uint32_t>(std::max(1.0, std::floor(session_.rig_info().rate_hz / kRigPosesPerS)));
  const auto subscription = hub_.subscribe(options);
  auto next_look = Clock::now();
  double heard_enough_at_s = HUGE_VAL;
  while (!cancel_) {
    if (!request.recorded) take_rig_poses(*subscription);
    if (request.simulated_tracker) take_simulated_poses();
    const double now_s = 1e-9 * static_cast<double>(session_.now_ns());
    if (Clock::now() >= next_look) {
      look_at_motion(request.kind);
      next_look = Clock::now() + kReportEvery;
      const MutexLock lock(mutex_);
      const bool enough = std::all_of(report_.coverage.begin(), report_.coverage.end(),
                                      [](const auto& item) { return item.enough(); });
      // A simulated hand has no reason to go on; nor has anyone beyond the limit.
      const double useful_s = request.kind == CalibrationKind::kKinematics ? 45.0 : 20.0;
      const bool simulated_is_done = request.simulated_tracker && enough && report_.duration_s > useful_s;
      if (finish_ || simulated_is_done || report_.duration_s > request.time_limit_s) {
        heard_enough_at_s = std::min(heard_enough_at_s, now_s);
      }
    }
    const bool tail_is_in = request.recorded || now_s - heard_enough_at_s > kTailS;
    if (std::isfinite(heard_enough_at_s) && tail_is_in) break;
    if (session_.unavailable()) {
      cancel_ = true;
      break;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  hub_.unsubscribe(subscription);
  if (request.simulated_tracker) session_.simulation()->set_program({});
}

Outcome<CalibrationState> CalibrationRunner::conclude(const CalibrationRequest& request) {
  calibration::RigStream rig;
  std::vector<ReferencePose> reference;
  std::vector<calibration::CoverageItem> coverage;
  {
    const MutexLock lock(mutex_);
    report_.state = CalibrationState::kFitting;
    report_.instruction = "computing";
    ++report_.version;
    rig = std::exchange(rig_, {});
    reference = std::exchange(reference_, {});
    // Its own clock is brought to the rig's, but for what the fit finds: as if the quickest pose took no
    // time.
    if (request.own_clock && !request.recorded) {
      for (ReferencePose& pose : reference) pose.stamp_s += first_arrival_less_stamp_s_;
    }
    coverage = report_.coverage;
    changed_.notify_all();
  }
  auto made = fit(request, rig, std::move(reference));
  if (cancel_) return CalibrationState::kCancelled;  // while it was computed, which takes seconds
  if (!made) return made.refusal();
  // What is wrong with the poses is said first: it explains what is missing.
  for (const auto& item : coverage) {
    if (item.value >= 0.5 * item.required) continue;
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"there is too little variation: " + item.name, "calibration",
                    fmt::format("{:.1f} {}", item.value, item.unit),
                    fmt::format("at least {:.0f} {}", item.required, item.unit), item.instruction}};
  }
  const auto stored = store_.keep(std::move(*made));
  if (!stored) return stored.refusal();
  if (request.adopt && request.kind != CalibrationKind::kTip) {
    if (cancel_) {  // while it was written
      if (auto refusal = store_.remove(stored->hash)) return *refusal;
      return CalibrationState::kCancelled;
    }
    if (const auto adopted = store_.adopt(stored->hash); !adopted) return adopted.refusal();
  }
  const MutexLock lock(mutex_);
  report_.stored = stored->hash;
  return CalibrationState::kStored;
}

void CalibrationRunner::perform(const CalibrationRequest& request) {
  pthread_setname_np(pthread_self(), "calibration");
  listen(request);
  Outcome<CalibrationState> end = CalibrationState::kCancelled;
  if (!cancel_) {
    look_at_motion(request.kind);
    end = conclude(request);
  }
  const MutexLock lock(mutex_);
  rig_ = {};
  reference_ = std::vector<ReferencePose>();  // with its memory
  report_.state = end ? *end : CalibrationState::kFailed;
  if (!end) report_.problem = end.refusal().error;
  if (report_.state == CalibrationState::kCancelled) report_.problem = lost_control_;
  report_.instruction.clear();
  ++report_.version;
  running_ = false;
  changed_.notify_all();
}

}  // namespace hapticd::server
