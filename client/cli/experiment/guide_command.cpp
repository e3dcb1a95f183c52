#include <fmt/core.h>

#include <memory>
#include <string>

#include "client/cli/commands/commands.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/view/live_screen.h"

namespace hapticd::cli {
namespace {

constexpr std::chrono::milliseconds kWait{50};

std::string line_of(const v1::GuideStatus& status) {
  const v1::Vector3& at = status.position_mm();
  const v1::Vector3& to = status.goal_mm();
  return fmt::format("{:<10} at ({:.1f}, {:.1f}, {:.1f}) mm, to ({:.1f}, {:.1f}, {:.1f}) mm",
                     word(status.state()), at.x(), at.y(), at.z(), to.x(), to.y(), to.z());
}

/// Follows a motion to its end; Ctrl-C ends it.
void follow(Session& session, const v1::MoveToolRequest& request) {
  client::Client client = session.connect();
  const Terminal terminal = Terminal::detect();
  const bool live = terminal.live && !session.json;
  LiveScreen screen;
  catch_interrupts();
  client::GuideStream stream = client.move_tool(request);
  v1::GuideStatus status;
  for (bool is_cancelled = false;;) {
    const auto event = stream.next(status, kWait);
    if (event == client::GuideStream::Event::kEnded) break;
    if (event == client::GuideStream::Event::kMessage && session.json) print_json_line(to_json(status));
    if (event == client::GuideStream::Event::kMessage && live) screen.show({line_of(status)}, terminal);
    if (interrupted() && !is_cancelled) {
      is_cancelled = true;
      session.exit_code = ExitCode::kNotConverged;
      stream.cancel();
    }
  }
  screen.keep();
  if (!session.json && !live) print_line(line_of(status));
  if (request.until_contact_mm() > 0.0 && status.state() == v1::GUIDE_STATE_ARRIVED) {
    throw LocalError("no contact within the way", "guide contact", "",
                     fmt::format("an object within {:g} mm along the press axis", request.until_contact_mm()),
                     "place the object under the tool, or go further: --within MM");
  }
}

void add_limits(CLI::App& command, const std::shared_ptr<v1::MoveToolRequest>& request) {
  const auto option = [&](const char* name, auto set, const char* help) {
    command.add_option_function<double>(
        name, [request, set](const double& v) { (*request.*set)(v); }, help);
  };
  option("--speed", &v1::MoveToolRequest::set_max_speed_mm_per_s, "At most, 1 … 100 mm/s; 15 if not given");
  option("--force", &v1::MoveToolRequest::set_max_force_n, "At most, 0.2 … 4 N; 2 if not given");
  option("--timeout", &v1::MoveToolRequest::set_timeout_s,
         "In s of the rig's time; twice what the way takes and 5 s if not given");
}

/// A command, and what it sends.
struct Motion {
  CLI::App* command;
  std::shared_ptr<v1::MoveToolRequest> request;
};

void add_coordinate(const Motion& motion, const char* name, void (v1::Vector3::*set)(double)) {
  motion.command
      ->add_option_function<double>(
          name,
          [request = motion.request, set](const double& mm) { (request->mutable_point_mm()->*set)(mm); },
          "In mm")
      ->required();
}

}  // namespace

void add_guide_command(CLI::App& app, Session& session) {
  constexpr const char* kEnds =
      "Ctrl-C ends the motion; so does the loss of the client. Exit codes: 0 arrived, or met an object; 5 "
      "ended by "
      "Ctrl-C;\n1 held back, timed out, or refused; guide contact: 2 nothing was touched.\n\n";
  CLI::App* guide = app.add_subcommand("guide", "The device leads the tool, slowly");
  guide->require_subcommand(1);
  guide->footer(
      std::string(kEnds) +
      "Examples:\n  hapticctl guide to 0 0 40\n  hapticctl guide contact\n  hapticctl guide station sponge");
  const auto add = [&](const char* name, const char* help, const char* example) {
    auto request = std::make_shared<v1::MoveToolRequest>();
    CLI::App* command = guide->add_subcommand(name, help);
    command->footer(std::string(kEnds) + "Example:\n  " + example);
    add_limits(*command, request);
    command->callback([&session, request] { follow(session, *request); });
    return Motion{command, request};
  };

  const Motion to = add("to", "To a point, in mm of the rig's frame", "hapticctl guide to 0 0 40");
  add_coordinate(to, "X", &v1::Vector3::set_x);
  add_coordinate(to, "Y", &v1::Vector3::set_y);
  add_coordinate(to, "Z", &v1::Vector3::set_z);

  const Motion contact =
      add("contact", "Along the scene's press axis until an object is touched", "hapticctl guide contact");
  contact.request->set_until_contact_mm(100.0);
  contact.command->add_option_function<double>(
      "--within", [request = contact.request](const double& mm) { request->set_until_contact_mm(mm); },
      "No further than this, in mm; 100 if not given");

  const Motion station = add("station", "Above the object of a station, where the table must stand",
                             "hapticctl guide station sponge");
  station.command
      ->add_option_function<std::string>(
          "STATION",
          [request = station.request](const std::string& name) { request->set_above_station(name); },
          "One of those that turntable stations lists")
      ->required();
}

}  // namespace hapticd::cli
