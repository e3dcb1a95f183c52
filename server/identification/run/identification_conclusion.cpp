#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "hal/sim/simulated_rig.h"
#include "server/identification/run/identification_run.h"
#include "server/model/store/model_store.h"
#include "server/process/log.h"
#include "server/rig/sensor_bias.h"

namespace hapticd::server {

namespace {

using Clock = std::chrono::steady_clock;

/// Time to wait for another process that keeps the store locked: the result is worth it.
constexpr std::chrono::seconds kStoreTimeout{10};

}  // namespace

std::string text_of(IdentificationState state) {
  switch (state) {
    case IdentificationState::kRunning:
      return "running";
    case IdentificationState::kConverged:
      return "converged";
    case IdentificationState::kPartial:
      return "partial";
    case IdentificationState::kCancelled:
      return "cancelled";
    case IdentificationState::kFailed:
      return "failed";
  }
  return "";
}

void IdentificationRunner::conclude(Run& run, const Ended& ended) {
  identification::IdentificationProgress progress = run.identification->progress();
  std::optional<hal::Error> problem = ended.problem;
  std::string hash;
  bool converged = false;
  if (auto model = run.identification->finish()) {
    progress.parameters = model->parameters;  // what the end refined
    progress.residual = model->residual;
    converged = model->converged && ended.ending != Ending::kFault;
    model->converged = converged;
    // Covers an end that found that what was missing is not needed.
    if (converged) {
      progress.steady = progress.certain = progress.converged = true;
      progress.missing.clear();
      progress.completion = 1.0;
    }
    model->object = run.request.object;
    if (run.recording) {
      model->data_reference = run.recording->description.name + ", sha256 " + run.recording->sha256;
      const bool about_rig = !is_about_object(run.request.task);
      if (about_rig && run.request.adopt) {
        // A recording does not say of which rig it is; to adopt its model is to say that it is of this one.
        model->device = session_.rig_info().device.model;
        model->sensor = session_.rig_info().sensor.model;
      } else if (about_rig) {
        progress.remarks.push_back(
            "the model belongs to no device, and scenes do not use it: adopt it where the recording is of "
            "this "
            "rig");
      }
    } else {
      const hal::RigInfo& rig = session_.rig_info();
      if (auto* tool = std::get_if<rt::ToolModel>(&model->content)) {
        tool->found_under_bias = biases_.zero_in_force().identity;
      }
      if (!run.view->remark().empty()) model->procedure += "; " + run.view->remark();
      model->device = rig.device.model;
      model->sensor = rig.sensor.model;
      model->data_reference = fmt::format("{:.1f} s on rig '{}'", progress.duration_s, rig.name);
      if (run.kept) {
        if (auto kept = run.kept->finish()) {
          model->data_reference += ": " + *kept;
        } else {
          log_warning(kept.error().text());
        }
      }
    }
    if (auto error = rt::check(*model)) {
      if (!problem) problem = std::move(error);
    } else if (auto stored = store_.add(*model, Clock::now() + kStoreTimeout)) {
      hash = stored->hash;
      if (converged && run.request.adopt) {
        if (auto tagged = store_.tag(hash, kCurrentTag, Clock::now() + kStoreTimeout); !tagged && !problem)
          problem = tagged.refusal().error;
      }
    } else if (!problem) {
      problem = stored.refusal().error;
    }
  } else if (!problem) {
    problem = model.error();
  }

  if (run.kept && hash.empty()) run.kept->discard();
  if (run.reservation) {
    // The state from before comes back, afresh.
    if (sim::SimulatedRig* simulation = session_.simulation()) {
      const sim::HandProgram rest;
      (void)simulation->set_program(rest);
    }
    const auto restored = run.reservation->restore(Caller{});
    if (!restored && !problem && !session_.stopping()) problem = restored.refusal().error;
    if (restored && restored->scene) {
      progress.remarks.push_back(fmt::format("scene '{}' was loaded again, with the target that was in force",
                                             restored->scene->spec.name));
    }
    run.reservation.reset();
    run.sensor.reset();
    run.instrument.close();
  }

  IdentificationState state = IdentificationState::kFailed;
  if (ended.ending == Ending::kCancelled) {
    state = IdentificationState::kCancelled;
  } else if (ended.ending != Ending::kFault && !hash.empty()) {
    state = converged ? IdentificationState::kConverged : IdentificationState::kPartial;
  }
  IdentificationReport report;
  {
    const MutexLock lock(mutex_);
    IdentificationReport& last = reports_.front();
    last.progress = std::move(progress);
    last.instruction.clear();
    last.model = hash;
    if (lost_control_ && state == IdentificationState::kCancelled) problem = lost_control_;
    last.problem = problem;
    last.state = state;
    ++last.version;
    report = last;
  }
  changed_.notify_all();
  const std::int64_t now_s =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  const auto recorded = store_.record_identification({report.id, report.kind, report.object, text_of(state),
                                                      now_s, hash, problem ? problem->text() : std::string()},
                                                     Clock::now() + kStoreTimeout);
  if (!recorded) log_warning(recorded.refusal().error.text());
  const std::string words = "identification '" + report.id + "' is over: " + text_of(state) +
                            (hash.empty() ? "" : ", model " + hash.substr(0, 12)) +
                            (problem ? "; " + problem->text() : std::string());
  log_info(words);
  on_end_(words);
}

}  // namespace hapticd::server
