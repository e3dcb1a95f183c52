#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include "hal/recording/recording_file.h"
#include "rt/guard/fault_table.h"
#include "rt/loop/engine.h"
#include "server/grpc/messages/telemetry_columns.h"
#include "server/recording/event_board.h"
#include "server/recording/flight/flight_recorder.h"
#include "server/telemetry/telemetry_hub.h"
#include "tests/measure/bench/recording/parts.h"
#include "tests/support/still_rig.h"

namespace hapticd::bench {
namespace {

constexpr double kRateHz = 1000.0;
constexpr std::uint64_t kBefore = 21'000;
constexpr std::uint64_t kAfter = 3'000;
constexpr std::int64_t kGoalBefore = 20'000;
constexpr std::int64_t kGoalAfter = 2'000;

/// Waits for what the recorder's threads do.
template <class Condition>
void await(Condition condition) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until)
      throw std::runtime_error("the flight recorder does not follow");
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

/// One daemon's worth of it, in virtual time.
class Flight {
 public:
  explicit Flight(const std::string& folder) : hub_(engine_) {
    sources_.columns = server::telemetry_columns();
    sources_.channels = ~0U;
    sources_.rate_hz = kRateHz;
    sources_.scene = [] { return recording::Texts{}; };
    sources_.rig_time_ns = [this] { return engine_.last_time_ns(); };
    config_.folder = folder;
    recorder_.emplace(hub_, board_, sources_, config_);
    if (const auto error = recorder_->open()) throw std::runtime_error(error->text());
  }
  void fly(std::uint64_t ticks) {
    for (std::uint64_t done = 0; done < ticks; done += 1000) {
      const std::uint64_t goal = recorder_->rows_kept() + 1000;
      for (int i = 0; i < 1000; ++i) {
        hal::RigSample sample;
        sample.tick = tick_;
        sample.time_ns = static_cast<std::int64_t>(tick_++) * 1'000'000;
        sample.force_count = 1;
        engine_.on_tick(sample);
      }
      hub_.pump(server::Subscription::Clock::now());
      await([&] { return recorder_->rows_kept() >= goal; });
    }
  }
  /// Share missing of what the incident should have.
  double missing_after(rt::GuardFault fault) {
    fly(kBefore);
    engine_.raise(fault);
    fly(kAfter);
    await([this] { return recorder_->last().has_value(); });
    const auto list = recorder_->list();
    if (!list || list->size() != 1) throw std::runtime_error("there is not one incident");
    const server::RecordingInfo& info = list->front();
    if (info.cause != rt::rule_of(fault).name) throw std::runtime_error("its cause is " + info.cause);
    const auto file = recording::RecordingFile::open(*recorder_->path_of(info.id));
    if (!file) throw std::runtime_error(file.error().text());
    const auto cause = static_cast<std::int64_t>(info.cause_tick);
    std::int64_t there = 0;
    recording::RecordingVisitor visitor;
    visitor.row = [&](const recording::Row& row) {
      const std::int64_t tick = row.integer(recording::kTickColumn);
      there += tick >= cause - kGoalBefore && tick <= cause + kGoalAfter ? 1 : 0;
      return true;
    };
    if (const auto end = file->read(visitor); !end || !end->is_finished)
      throw std::runtime_error("it has no end");
    return static_cast<double>(kGoalBefore + kGoalAfter + 1 - there);
  }

 private:
  test::StillRig rig_;
  rt::Engine engine_{rig_};
  server::TelemetryHub hub_;
  server::EventBoard board_;
  server::RecordingSources sources_;
  server::RecordingConfig config_;
  std::optional<server::FlightRecorder> recorder_;
  std::uint64_t tick_ = 0;
};

}  // namespace

void add_incident_figures(const std::filesystem::path& folder, bool, const AddFigure& add) {
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    // The ring that an unclean end left is its incident; recording_lost_s has it.
    if (rule.action != rt::FaultAction::kCut || rule.fault == rt::GuardFault::kUncleanEnd) continue;
    report::Figure figure{.figure = "incident_ticks_missing",
                          .conditions = {{"fault", std::string(rule.name)}},
                          .goal = 0.0,
                          .source = "of 20 s before and 2 s after, virtual time"};
    try {
      Flight flight((folder / ("incident_" + std::string(rule.name))).string());
      figure.value = flight.missing_after(rule.fault);
    } catch (const std::exception& error) {
      figure.failed = error.what();
    }
    add("incident_ticks_missing, " + std::string(rule.name), figure);
  }
}

}  // namespace hapticd::bench
