#include <fmt/core.h>

#include <functional>
#include <memory>
#include <string>

#include "client/cli/commands/commands.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"
#include "client/cli/view/live_screen.h"
#include "client/cli/view/turntable_view.h"

namespace hapticd::cli {
namespace {

constexpr std::chrono::milliseconds kWait{50};

/// Follows a motion to its end; Ctrl-C stops the table and waits until it is at rest.
class MotionFollower {
 public:
  explicit MotionFollower(Session& session)
      : session_(session), client_(session.connect()), live_(Terminal::detect().live && !session.json) {
    catch_interrupts();
  }

  void follow(const std::function<client::TurntableStream(client::Client&)>& begin) {
    client::TurntableStream stream = begin(client_);
    v1::TurntableStatus status;
    try {
      for (;;) {
        const auto event = stream.next(status, kWait);
        if (event == client::TurntableStream::Event::kEnded) break;
        if (event == client::TurntableStream::Event::kMessage) show(status);
        if (interrupted() && !stopped_) {
          stopped_ = true;
          client_.stop_turntable();
        }
      }
    } catch (const client::Error& error) {
      screen_.keep();
      // It ended as the user asked; any other end is reported.
      if (!stopped_ || error.code() != "ABORTED") throw;
      session_.exit_code = ExitCode::kNotConverged;
    }
    screen_.keep();
    if (!session_.json) print_line(turntable_line(client_.turntable().status()));
  }

 private:
  void show(const v1::TurntableStatus& status) {
    if (session_.json) {
      print_json_line(to_json(status));
      std::fflush(stdout);
    } else if (live_) {
      const Terminal terminal = Terminal::detect();
      screen_.show({turntable_progress(status, terminal)}, terminal);
    }
  }

  Session& session_;
  client::Client client_;
  bool live_;
  bool stopped_ = false;
  LiveScreen screen_;
};

void print_status(const Session& session, const v1::TurntableStatus& status) {
  if (session.json) return print_json(to_json(status));
  print_line(turntable_line(status));
}

void add_motion_options(CLI::App& command, const std::shared_ptr<v1::MoveToRequest>& request) {
  command
      .add_option_function<double>(
          "--speed", [request](const double& value) { request->set_speed_deg_per_s(value); },
          "At most, in deg/s; without it the turntable's own limit")
      ->check(CLI::PositiveNumber);
  command
      .add_option_function<double>(
          "--acceleration", [request](const double& value) { request->set_acceleration_deg_per_s2(value); },
          "At most, in deg/s²; without it the turntable's own limit")
      ->check(CLI::PositiveNumber);
}

void add_motions(CLI::App& turntable, Session& session) {
  constexpr const char* kEnds =
      "Ctrl-C stops the table; so does the loss of the client. Exit codes: 0 arrived, 5 stopped by Ctrl-C, 1 "
      "ended "
      "anywhere\nelse or refused.\n\n";
  CLI::App* home = turntable.add_subcommand("home", "Finds the table's zero");
  home->footer(std::string(kEnds) + "Example:\n  hapticctl turntable home");
  home->callback([&session] {
    MotionFollower(session).follow([](client::Client& client) { return client.home_turntable(); });
  });

  const auto move_on = [&session](const std::shared_ptr<v1::MoveToRequest>& request) {
    return [&session, request] {
      MotionFollower(session).follow([&](client::Client& client) { return client.move_turntable(*request); });
    };
  };
  const auto to_station = std::make_shared<v1::MoveToRequest>();
  CLI::App* station = turntable.add_subcommand("goto", "Brings a station under the tool");
  station->footer(
      std::string(kEnds) +
      "Examples:\n  hapticctl turntable goto sponge\n  hapticctl turntable goto sponge --speed 30");
  station
      ->add_option_function<std::string>(
          "STATION", [to_station](const std::string& name) { to_station->set_station(name); },
          "One of those that turntable stations lists")
      ->required();
  add_motion_options(*station, to_station);
  station->callback(move_on(to_station));

  const auto to_angle = std::make_shared<v1::MoveToRequest>();
  CLI::App* move = turntable.add_subcommand("move", "Turns the table to an angle");
  move->footer(std::string(kEnds) +
               "Examples:\n  hapticctl turntable move 45\n  hapticctl turntable move -90 --speed 20");
  move->add_option_function<double>(
          "ANGLE", [to_angle](const double& angle) { to_angle->set_angle_deg(angle); },
          "In degrees, from home")
      ->required();
  add_motion_options(*move, to_angle);
  move->callback(move_on(to_angle));
}

}  // namespace

void add_turntable_command(CLI::App& app, Session& session) {
  CLI::App* turntable = app.add_subcommand("turntable", "The table that brings objects under the tool");
  turntable->require_subcommand(1);
  turntable->footer(
      "It turns only while the tool is free: no contact, no force of the device, no latched guard.\n\n"
      "Examples:\n  hapticctl turntable home\n  hapticctl turntable goto sponge\n  hapticctl turntable "
      "status");

  turntable->add_subcommand("status", "What there is, where it is, and why it may not turn")
      ->footer("Opens no port.\n\nExample:\n  hapticctl turntable status --json")
      ->callback([&session] {
        const auto table = session.connect().turntable();
        if (session.json) return print_json(to_json(table));
        for (const auto& line : turntable_report(table, Terminal::detect())) print_line(line);
      });
  turntable->add_subcommand("stations", "The stations and their angles")
      ->footer("Example:\n  hapticctl turntable stations")
      ->callback([&session] {
        const auto table = session.connect().turntable();
        if (session.json) {
          Json list = Json::array();
          for (const auto& station : table.stations()) list.push_back(to_json(station));
          return print_json({{"stations", list}});
        }
        using Align = TextTable::Align;
        TextTable rows({"station", "deg", "object", ""}, {Align::kLeft, Align::kRight});
        for (const auto& station : table.stations()) {
          rows.add({station.name(), fmt::format("{:g}", station.angle_deg()), station.object(),
                    station.name() == table.status().station() ? "under the tool" : ""});
        }
        rows.print(Terminal::detect());
      });
  add_motions(*turntable, session);

  struct Simple {
    const char* name;
    const char* description;
    v1::TurntableStatus (client::Client::*call)();
  };
  for (const Simple& one :
       {Simple{"stop", "Stops the table, whichever client moves it", &client::Client::stop_turntable},
        Simple{"clear", "Leaves a stall or an alarm whose cause is gone", &client::Client::clear_turntable},
        Simple{"engage", "Opens the drive's port; the first motion does so too",
               &client::Client::engage_turntable},
        Simple{"disengage", "Stops the table and closes the port", &client::Client::disengage_turntable}}) {
    turntable->add_subcommand(one.name, one.description)
        ->footer(std::string("Example:\n  hapticctl turntable ") + one.name)
        ->callback([&session, call = one.call] {
          client::Client client = session.connect();
          print_status(session, (client.*call)());
        });
  }
}

}  // namespace hapticd::cli
