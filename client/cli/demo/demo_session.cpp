#include "client/cli/demo/demo_session.h"

#include <fmt/core.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "client/cli/demo/demo_view.h"
#include "client/cli/plot/svg_file.h"
#include "client/cli/session/follow.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/names.h"

namespace hapticd::cli {
namespace {

constexpr double kPause_s = 0.5;  // between two presses
constexpr double kMaxPress_s = 60.0;
constexpr std::uint32_t kQueueSamples = 60000;
constexpr const char* kGroups = "contact,deformation,target,control,guard,truth";

}  // namespace

DemoSession::DemoSession(const DemoOptions& options, Session& session)
    : options_(options),
      session_(session),
      client_(session.connect()),
      live_(Terminal::detect().live && !session.json) {}

DemoSession::~DemoSession() {
  // Whatever happened, the hand lets go.
  try {
    v1::HandProgram rest;
    rest.set_kind(v1::HAND_PROGRAM_KIND_REST);
    client_.set_hand_program(rest);
  } catch (const client::Error&) {
  }
}

void DemoSession::say(const std::string& line) const {
  if (session_.json) return;
  print_line(line);
  std::fflush(stdout);
}

void DemoSession::prepare() {
  rig_ = client_.rig_info();
  if (rig_.kind() != v1::RIG_KIND_SIMULATED || !rig_.has_truth()) {
    throw LocalError("the demonstration needs a simulated rig", client_.address(), rig_.name(), "",
                     "start hapticd with --rig sim:phantom_1_0");
  }
  if (client_.rig_state().guard_state() == v1::GUARD_STATE_LATCHED) {
    throw LocalError("the guard is latched: no force would be rendered", client_.address(),
                     word(client_.rig_state().guard_fault()), "", "hapticctl clear");
  }
  std::error_code failure;
  std::filesystem::create_directories(options_.folder, failure);
  if (failure) {
    throw LocalError("the folder of the results cannot be made", options_.folder, failure.message(), "",
                     "choose another one with --out");
  }
  client_.unload_scene();
  object_stiffness_n_per_mm_ = client_.set_object(options_.object).object_stiffness_n_per_mm();

  v1::SubscribeRequest request;
  const auto groups = parse_groups(kGroups);
  for (const auto group : groups) request.add_groups(group);
  request.set_queue_samples(kQueueSamples);
  stream_ = std::make_unique<client::TelemetryStream>(client_.subscribe(request));
  recording_ = std::make_unique<Recording>(options_.folder + "/recording.csv",
                                           origin_lines(rig_, client_.rig_state(), 1), groups);
  say(fmt::format("{}: a simulated hand presses {} ({:g} N/mm at 4 N) with {:g} N", rig_.name(),
                  options_.object, object_stiffness_n_per_mm_, options_.force_n));
}

void DemoSession::follow_until(const std::string& state, double at_most_s,
                               const std::function<bool()>& enough, PressTrace* trace) {
  const auto on_sample = [&](const v1::TelemetrySample& sample) {
    recording_->add(sample);
    if (trace != nullptr) trace->add(sample);
  };
  const auto on_idle = [&] {
    if (live_ && screen_.due())
      screen_.show(demo_frame(presses_, state, Terminal::detect()), Terminal::detect());
  };
  const auto result = follow(*stream_, 1, {.seconds = at_most_s, .enough = enough}, on_sample, on_idle);
  if (result.end == StreamEnd::kInterrupted) throw LocalError("interrupted");
  if (result.end != StreamEnd::kLimitReached) {
    throw LocalError("the daemon stopped sending telemetry", client_.address(), "", "",
                     "look at the daemon's log");
  }
}

void DemoSession::press_once(DemoPress press) {
  const std::string state =
      fmt::format("[{}/{}] {}", presses_.size() + 1, options_.targets_n_per_mm.size() + 1, press.name());
  if (press.target_n_per_mm) {
    v1::SetTargetRequest request;
    request.set_stiffness_n_per_mm(*press.target_n_per_mm);
    const auto answer = client_.set_target(request);
    press.granted_n_per_mm = answer.granted_n_per_mm();
    if (answer.limiting_reason() > v1::LIMITING_REASON_NONE) {
      say(fmt::format("granted only {:g} N/mm: {}", answer.granted_n_per_mm(), answer.explanation()));
    }
  }
  if (!live_) say(state + " ...");
  presses_.push_back(std::move(press));
  PressTrace& trace = presses_.back().trace;
  // A foam remembers the last press for a long time: each press gets a rested one.
  client_.set_object(options_.object);
  follow_until(state + ": a rested object", kPause_s, nullptr, nullptr);

  v1::HandProgram program;
  program.set_kind(v1::HAND_PROGRAM_KIND_PRESS);
  program.set_force_n(options_.force_n);
  program.set_hold_s(options_.hold_s);
  program.set_repetitions(1);
  client_.set_hand_program(program);
  follow_until(
      state + ": the hand presses", kMaxPress_s, [&trace] { return trace.over(); }, &trace);

  DemoPress& done = presses_.back();
  done.hold = settled_hold(done.trace.points());
  if (!done.trace.over() || !done.hold) {
    throw LocalError(done.trace.touched() ? "the press did not settle" : "the hand never touched the object",
                     done.name(), "", "", "look at the recording: " + options_.folder + "/recording.csv");
  }
  if (live_) return;
  say(fmt::format("      rendered at the hand {:.4f} N/mm{}", done.hold->stiffness_n_per_mm(),
                  done.error() ? fmt::format(", error {:+.2f} %", 100.0 * *done.error()) : ""));
}

void DemoSession::run() {
  catch_interrupts();
  prepare();
  press_once({});
  client_.load_scene({.name = options_.scene});
  for (const double target : options_.targets_n_per_mm) press_once({.target_n_per_mm = target});
  conclude();
}

void DemoSession::conclude() {
  const client::StreamAccount account = stream_->account();
  stream_.reset();
  recording_->finish(account);
  const Terminal terminal = Terminal::detect();
  if (live_) {
    screen_.show(demo_frame(presses_, "done", terminal), terminal);
    screen_.keep();
  }
  const std::string svg = options_.folder + "/stiffness.svg";
  const std::string csv = options_.folder + "/recording.csv";
  const std::string json = options_.folder + "/results.json";
  write_svg(demo_figure(presses_, fmt::format("{} on {}", options_.object, rig_.name())), svg);
  const Json document{{"rig", rig_.name()},
                      {"object", options_.object},
                      {"object_stiffness_n_per_mm", object_stiffness_n_per_mm_},
                      {"scene", options_.scene},
                      {"presses", result_json(presses_)},
                      {"recording", csv},
                      {"plot", svg},
                      {"samples", account.samples()},
                      {"complete", account.complete()}};
  std::ofstream file(json);
  file << document.dump(2) << '\n';
  file.close();
  if (!file) throw LocalError("cannot write the results", json);
  if (!account.complete()) session_.exit_code = ExitCode::kGaps;
  if (session_.json) return print_json(document);

  if (!live_) {
    print_line("");
    result_table(presses_).print(terminal, 2);
  }
  print_text(
      "\n  On letting go the object recovers more slowly than the hand lifts: as its reaction fades, so "
      "does\n"
      "  the force, and the tip comes free of it at depth. Where nothing is touched no force is given. A\n"
      "  second short contact may follow.\n\n");
  print_line("  recording  {} ({})", csv, account_text(account));
  print_line("  plot       {}", svg);
  print_line("  results    {}", json);
}

}  // namespace hapticd::cli
