#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <string>

#include "client/cli/commands/commands.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"

namespace hapticd::cli {

namespace {

struct PoseOptions {
  double rate_hz = 60.0;
  double predict_ms = 0.0;
  std::string frame = "rig";
  bool uncorrected = false;
  double seconds = 0.0;  ///< 0 = no end
};

v1::SubscribePosesRequest request_of(const PoseOptions& options) {
  v1::SubscribePosesRequest request;
  request.set_rate_hz(options.rate_hz);
  request.set_predict_ms(options.predict_ms);
  request.set_uncorrected(options.uncorrected);
  if (options.frame == "device") request.set_frame(v1::POSE_FRAME_DEVICE);
  if (options.frame == "reference") request.set_frame(v1::POSE_FRAME_REFERENCE);
  return request;
}

std::string point_words(const v1::Vector3& point, const char* unit) {
  return fmt::format("{:8.3f} {:8.3f} {:8.3f} {}", point.x(), point.y(), point.z(), unit);
}

/// Standard deviation, all three axes together.
double deviation(const v1::Covariance3& covariance) {
  return std::sqrt(std::max(0.0, covariance.xx() + covariance.yy() + covariance.zz()));
}

std::string contact_words(const v1::Pose& pose) {
  if (!pose.has_in_contact()) return "not known without a scene";
  if (!pose.has_contact()) return "none so far";
  const v1::ContactEvent& event = pose.contact();
  const double early_ms = 1e-6 * static_cast<double>(event.began().rig_ns() - event.earliest_rig_ns());
  const double late_ms = 1e-6 * static_cast<double>(event.latest_rig_ns() - event.began().rig_ns());
  std::string words = fmt::format("{} contact {}: began at {:.4f} s (-{:.1f}, +{:.1f} ms)",
                                  pose.in_contact() ? "in" : "free; the last was", event.number(),
                                  1e-9 * static_cast<double>(event.began().rig_ns()), early_ms, late_ms);
  if (event.has_declared_rig_ns()) {
    words += fmt::format(", noticed {:.1f} ms later",
                         1e-6 * static_cast<double>(event.declared_rig_ns() - event.began().rig_ns()));
  }
  return words;
}

std::string error_words(const v1::Pose& pose) {
  std::string words = fmt::format("±{:.3f} mm: ", deviation(pose.position_covariance_mm2()));
  for (int i = 0; i < pose.error_sources_size(); ++i) {
    words += (i == 0 ? "" : ", ") + spaced(word(pose.error_sources(i)));
  }
  if (pose.calibration().empty()) words += "; not the arm's own errors: no calibration is adopted";
  return words;
}

void show_pose(const v1::Pose& pose, const Session& session) {
  if (session.json) return print_json(to_json(pose));
  const Terminal terminal = Terminal::detect();
  const v1::PoseTime& time = pose.time();
  TextTable table;
  const auto row = [&](const char* name, const std::string& words) {
    table.add({terminal.bold(name), words});
  };
  row("frame", word(pose.frame()) +
                   (pose.calibration().empty() ? "" : ", corrected by calibration " + pose.calibration()));
  row("time", fmt::format("{:.6f} s by the rig's clock", 1e-9 * static_cast<double>(time.rig_ns())) +
                  (time.has_daemon_ns() ? fmt::format(", {:.6f} s by the daemon's ± {:.4f} ms",
                                                      1e-9 * static_cast<double>(time.daemon_ns()),
                                                      1e-6 * static_cast<double>(time.daemon_bound_ns()))
                                        : std::string(", which is a time of its own")));
  row("position", point_words(pose.position_mm(), "mm"));
  row("", error_words(pose));
  const v1::Quaternion& q = pose.orientation();
  row("orientation", fmt::format("w {:.5f}  x {:.5f}  y {:.5f}  z {:.5f}", q.w(), q.x(), q.y(), q.z()));
  row("velocity", point_words(pose.velocity_mm_per_s(), "mm/s"));
  row("turning", point_words(pose.angular_velocity_rad_per_s(), "rad/s"));
  if (pose.prediction().ahead_ms() > 0.0) {
    row("predicted", fmt::format("{:g} ms ahead, ±{:.3f} mm; at most {:.1f} mm below {:g} m/s²",
                                 pose.prediction().ahead_ms(), pose.prediction().error_mm(),
                                 pose.prediction().error_bound_mm(),
                                 1e-3 * pose.prediction().assumed_acceleration_mm_per_s2()));
  }
  row("contact", contact_words(pose));
  if (pose.has_normal()) row("normal", point_words(pose.normal(), ""));
  if (pose.has_displacement_mm()) row("displacement", quantity(pose.displacement_mm(), 3, "mm"));
  if (pose.has_target_stiffness_n_per_mm()) {
    row("target", quantity(pose.target_stiffness_n_per_mm(), 3, "N/mm"));
  }
  if (pose.has_inclusion_mm()) row("inclusion", point_words(pose.inclusion_mm(), "mm"));
  for (const std::string& line : table.lines(terminal)) print_line(line);
}

void show_line(const v1::Pose& pose, const Session& session) {
  if (session.json) return print_json_line(to_json(pose));
  print_line(
      "{:10.4f} s  tip {}  speed {:7.1f} mm/s  {}{}", 1e-9 * static_cast<double>(pose.time().rig_ns()),
      point_words(pose.position_mm(), "mm"),
      std::hypot(pose.velocity_mm_per_s().x(), pose.velocity_mm_per_s().y(), pose.velocity_mm_per_s().z()),
      pose.in_contact() ? fmt::format("contact {}", pose.contact().number()) : "free",
      pose.skipped() > 0 ? fmt::format("  {} skipped", pose.skipped()) : "");
  std::fflush(stdout);
}

void once(const PoseOptions& options, Session& session) {
  client::Client client = session.connect();
  client::PoseStream stream = client.subscribe_poses(request_of(options));
  v1::Pose pose;
  if (stream.next(pose, std::chrono::seconds(5)) != client::PoseStream::Event::kMessage) {
    throw LocalError("no pose came within 5 s: does the loop run? See hapticctl status");
  }
  show_pose(pose, session);
}

void watch(const PoseOptions& options, Session& session) {
  catch_interrupts();
  client::Client client = session.connect();
  client::PoseStream stream = client.subscribe_poses(request_of(options));
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(options.seconds);
  v1::Pose pose;
  while (!interrupted() && (options.seconds == 0.0 || std::chrono::steady_clock::now() < end)) {
    const auto event = stream.next(pose, std::chrono::milliseconds(100));
    if (event == client::PoseStream::Event::kEnded) return;
    if (event == client::PoseStream::Event::kMessage) show_line(pose, session);
  }
}

void add_options(CLI::App& command, PoseOptions& options) {
  command.add_option("--frame", options.frame, "rig, device or reference")
      ->check(CLI::IsMember({"rig", "device", "reference"}))
      ->capture_default_str();
  command.add_option("--predict", options.predict_ms, "ms ahead of the measurement, 0 to 100")
      ->capture_default_str();
  command.add_flag("--uncorrected", options.uncorrected, "As the encoders have it");
}

}  // namespace

void add_pose_command(CLI::App& app, Session& session) {
  CLI::App* pose = app.add_subcommand("pose", "Where the tool is, for those who draw it");
  pose->require_subcommand(1);
  const auto options = std::make_shared<PoseOptions>();
  CLI::App* single = pose->add_subcommand("once", "One pose, with what is known about its error");
  single->footer("Examples:\n  hapticctl pose once\n  hapticctl pose once --frame reference --predict 66");
  add_options(*single, *options);
  single->callback([&session, options] { once(*options, session); });

  CLI::App* watching = pose->add_subcommand("watch", "A line for each pose, until Ctrl-C");
  watching->footer(
      "With --json: a whole pose on each line.\n\n"
      "Examples:\n  hapticctl pose watch --rate 10\n"
      "  hapticctl pose watch --rate 120 --predict 66 --seconds 5 --json");
  add_options(*watching, *options);
  watching->add_option("--rate", options->rate_hz, "Poses a second, 1 to 1000")->capture_default_str();
  watching->add_option("--seconds", options->seconds, "How long; 0 = until Ctrl-C")->capture_default_str();
  watching->callback([&session, options] { watch(*options, session); });
}

}  // namespace hapticd::cli
