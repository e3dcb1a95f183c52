#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/calibrate/pose_files.h"
#include "client/cli/commands/commands.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"
#include "client/cli/view/live_screen.h"

namespace hapticd::cli {

namespace {

constexpr std::chrono::milliseconds kWait{50};
constexpr std::size_t kShownDigits = 12;

struct CalibrateOptions {
  v1::StartCalibrationRequest request;
  std::string recording;
  std::string reference;
};

void print_calibration(const v1::Calibration& c) {
  const Terminal terminal = Terminal::detect();
  TextTable table;
  const auto row = [&](const char* name, std::string value) {
    table.add({terminal.bold(name), std::move(value)});
  };
  row("hash", c.hash() + (c.adopted() ? "  (adopted)" : ""));
  row("kind", word(c.kind()));
  row("made", c.created() + " on " + c.rig());
  row("poses", fmt::format("{}, {} of them left out", c.poses(), c.outliers()));
  if (c.has_tip_in_marker_mm()) {
    const auto& t = c.tip_in_marker_mm();
    row("tip", fmt::format("({:.2f}, {:.2f}, {:.2f}) mm from the marker, its frame", t.x(), t.y(), t.z()));
  }
  if (c.kind() != v1::CALIBRATION_KIND_TIP) {
    row("target error",
        fmt::format("{:.2f} mm in the median, {:.2f} mm over 95 % of where the tool was: predicted",
                    c.predicted_target_error_median_mm(), c.predicted_target_error_95_mm()));
    row("orientation", fmt::format("{:.2f}°: predicted", c.predicted_orientation_error_deg()));
    row("latency", fmt::format("{:.2f} ms ± {:.2f} ms", c.latency_ms(), c.latency_standard_error_ms()));
    row("noise", fmt::format("{:.2f} mm, of one coordinate of the tracker", c.tracker_noise_mm()));
    row("left out", fmt::format("{:.2f} mm rms by time, {:.2f} mm by place, with the noise", c.left_out_mm(),
                                c.left_out_place_mm()));
  }
  row("residual", fmt::format("{:.2f} mm rms at the poses themselves: says nothing about the target error",
                              c.fiducial_residual_mm()));
  for (const auto& p : c.parameters()) {
    constexpr double kRounding = 1e-9;  // what computing leaves of 0
    const double nominal = std::abs(p.nominal()) < kRounding ? 0.0 : p.nominal();
    row(p.name().c_str(), fmt::format("{:.5g} ± {:.2g} {}; nominally {:.5g}", p.value(), p.standard_error(),
                                      p.unit() == "1" ? "" : p.unit(), nominal));
  }
  for (const std::string& line : table.lines(terminal)) print_line(line);
}

std::vector<std::string> lines_of(const v1::CalibrationProgress& progress) {
  std::vector<std::string> lines{fmt::format(
      "{} {}  {:.0f} s  {} poses of the tracker, {} of the rig", word(progress.kind()),
      word(progress.state()), progress.duration_s(), progress.reference_poses(), progress.rig_poses())};
  for (const auto& item : progress.coverage()) {
    const double share = std::min(1.0, item.required() > 0.0 ? item.value() / item.required() : 1.0);
    const auto filled = static_cast<std::size_t>(20.0 * std::max(0.0, share));
    lines.push_back(fmt::format("  {:<18} {:<20} {:>7.0f} of {:.0f} {}", item.name(),
                                std::string(filled, '='), item.value(), item.required(),
                                item.unit() == "1" ? "" : item.unit()));
  }
  if (!progress.instruction().empty()) lines.push_back("> " + progress.instruction());
  return lines;
}

void conclude(Session& session, client::Client& client, const v1::CalibrationProgress& progress) {
  if (progress.has_problem()) {
    session.exit_code = ExitCode::kNotConverged;
    const v1::ErrorDetail& e = progress.problem();
    if (session.json) return print_json(to_json(progress));
    print_line("nothing was stored: {}{}{}", e.what(), e.value().empty() ? "" : " (" + e.value() + ")",
               e.limit().empty() ? "" : "; wanted: " + e.limit());
    if (!e.remedy().empty()) print_line(e.remedy());
    return;
  }
  if (progress.stored().empty()) {
    session.exit_code = ExitCode::kNotConverged;
    if (!session.json) print_line("cancelled");
    return;
  }
  const v1::Calibration found = client.calibration(progress.stored());
  if (session.json) return print_json(to_json(found));
  print_calibration(found);
  if (!found.adopted() && found.kind() != v1::CALIBRATION_KIND_TIP) {
    print_line("use it: hapticctl calibration adopt {}", found.hash().substr(0, kShownDigits));
  }
}

void calibrate(Session& session, const CalibrateOptions& options) {
  if (options.recording.empty() != options.reference.empty()) {
    throw LocalError("a recording needs both files", "hapticctl calibrate", "", "--recording and --reference",
                     "");
  }
  client::Client client = session.connect();
  v1::StartCalibrationRequest request = options.request;
  std::vector<v1::PushReferencePosesRequest> pieces;
  if (!options.recording.empty()) {
    pieces = read_rig_file(options.recording);
    for (auto& piece : read_reference_file(options.reference)) pieces.push_back(std::move(piece));
    request.set_recorded(true);
  }
  catch_interrupts();
  const std::string id = client.start_calibration(request).calibration();
  if (!pieces.empty()) {
    client.push_reference_poses(pieces);
    return conclude(session, client, client.finish_calibration());
  }
  const Terminal terminal = Terminal::detect();
  const bool live = terminal.live && !session.json;
  LiveScreen screen;
  client::CalibrationStream stream = client.watch_calibration(id);
  v1::CalibrationProgress progress;
  std::string said;
  for (;;) {
    const auto event = stream.next(progress, kWait);
    if (event == client::CalibrationStream::Event::kEnded) break;
    if (event == client::CalibrationStream::Event::kMessage) {
      if (live) screen.show(lines_of(progress), terminal);
      if (!live && !session.json && progress.instruction() != said) {
        said = progress.instruction();
        if (!said.empty()) print_line(said);
      }
    }
    if (interrupted()) {
      progress = client.finish_calibration();
      break;
    }
  }
  screen.keep();
  conclude(session, client, progress);
}

void add_kind(CLI::App& parent, Session& session, const char* name, v1::CalibrationKind kind,
              const char* help) {
  CLI::App* command = parent.add_subcommand(name, help);
  const auto options = std::make_shared<CalibrateOptions>();
  options->request.set_kind(kind);
  command
      ->add_option_function<double>(
          "--seconds", [options](const double& s) { options->request.set_time_limit_s(s); },
          "Ends it at the latest; 120 if not given")
      ->check(CLI::Range(1.0, 1800.0));
  command->add_option("--recording", options->recording,
                      "A recording of the rig by 'telemetry record' in place of the rig");
  command->add_option("--reference", options->reference,
                      "What the tracker saw meanwhile: stamp_ns, x_mm, y_mm, z_mm, qw, qx, qy, qz");
  command->add_flag_function(
      "--simulated", [options](std::int64_t) { options->request.set_simulated_tracker(true); },
      "The simulated rig's own tracker and hand");
  command->add_flag_function(
      "--own-clock", [options](std::int64_t) { options->request.set_own_clock(true); },
      "The tracker's stamps are of a clock of its own");
  if (kind != v1::CALIBRATION_KIND_TIP) {
    command->add_option_function<std::string>(
        "--tip", [options](const std::string& hash) { options->request.set_tip_calibration(hash); },
        "Hash of a tip calibration");
    command->add_flag_function(
        "--adopt", [options](std::int64_t) { options->request.set_adopt(true); }, "Adopt it when it is good");
  }
  command->footer(
      fmt::format("Examples:\n  hapticctl calibrate {0} --simulated\n"
                  "  hapticctl calibrate {0} --recording rig.csv --reference tracker.csv",
                  name));
  command->callback([&session, options] { calibrate(session, *options); });
}

void list_calibrations(Session& session) {
  client::Client client = session.connect();
  const auto all = client.calibrations();
  if (session.json) return print_json(to_json(all));
  const Terminal terminal = Terminal::detect();
  TextTable table;
  for (const v1::Calibration& c : all.calibrations()) {
    table.add({c.hash().substr(0, kShownDigits), word(c.kind()), c.created(), c.rig(),
               c.kind() == v1::CALIBRATION_KIND_TIP
                   ? std::string()
                   : fmt::format("{:.2f} mm over 95 %, predicted", c.predicted_target_error_95_mm()),
               c.adopted() ? "adopted" : ""});
  }
  for (const std::string& line : table.lines(terminal)) print_line(line);
  if (all.calibrations().empty()) print_line("none yet: see 'hapticctl calibrate --help'");
}

}  // namespace

void add_calibrate_commands(CLI::App& app, Session& session) {
  CLI::App* calibrate_app =
      app.add_subcommand("calibrate", "Where the tip is in a visual system's frame, from poses it pushes");
  calibrate_app->require_subcommand(1);
  add_kind(*calibrate_app, session, "tip", v1::CALIBRATION_KIND_TIP, "Where the tip is on the tracked body");
  add_kind(*calibrate_app, session, "registration", v1::CALIBRATION_KIND_REGISTRATION,
           "Where the rig is in the tracker's frame, and its latency");
  add_kind(*calibrate_app, session, "kinematics", v1::CALIBRATION_KIND_KINEMATICS,
           "That, and the device's joints, links and gimbal");
  CLI::App* cancel = calibrate_app->add_subcommand("cancel", "Ends the one that runs; nothing is stored");
  cancel->callback([&session] { session.connect().cancel_calibration(); });
  cancel->footer("Example:\n  hapticctl calibrate cancel");

  CLI::App* stored = app.add_subcommand("calibration", "What calibrations found");
  stored->require_subcommand(1);
  CLI::App* list = stored->add_subcommand("list", "Newest first");
  list->callback([&session] { list_calibrations(session); });
  list->footer("Example:\n  hapticctl calibration list");
  const auto with_hash = [&](const char* name, const char* help, auto run) {
    CLI::App* command = stored->add_subcommand(name, help);
    const auto hash = std::make_shared<std::string>();
    command->add_option("hash", *hash, "The hash, or its first digits")->required();
    command->callback([&session, hash, run] { run(session, *hash); });
    command->footer(fmt::format("Example:\n  hapticctl calibration {} 3f9a2c", name));
  };
  with_hash("show", "All that was found", [](Session& s, const std::string& hash) {
    const v1::Calibration found = s.connect().calibration(hash);
    if (s.json) return print_json(to_json(found));
    print_calibration(found);
  });
  with_hash("adopt", "Poses are corrected by it from now on; 'none': by none",
            [](Session& s, const std::string& hash) {
              const std::string now = s.connect().adopt_calibration(hash == "none" ? "" : hash);
              if (!s.json) print_line(now.empty() ? "none is adopted" : "adopted " + now);
            });
  with_hash("delete", "Not the adopted one",
            [](Session& s, const std::string& hash) { s.connect().delete_calibration(hash); });
}

}  // namespace hapticd::cli
