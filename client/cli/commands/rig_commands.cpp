
#include <algorithm>
#include <memory>

#include "client/cli/commands/commands.h"
#include "client/cli/fleet/on_rigs.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"

namespace hapticd::cli {

namespace {

std::string mark(v1::FindingSeverity severity, const Terminal& terminal) {
  switch (severity) {
    case v1::FINDING_SEVERITY_GOOD:
      return terminal.paint(Color::kGreen, "good");
    case v1::FINDING_SEVERITY_WARNING:
      return terminal.paint(Color::kYellow, "warning");
    case v1::FINDING_SEVERITY_PROBLEM:
      return terminal.paint(Color::kRed, "problem");
    default:
      return terminal.paint(Color::kGrey, "note");
  }
}

void print_diagnosis(const v1::Diagnosis& diagnosis) {
  const Terminal terminal = Terminal::detect();
  TextTable table;
  for (const v1::Finding& finding : diagnosis.findings()) {
    table.add({mark(finding.severity(), terminal), finding.topic(), finding.text()});
    if (!finding.remedy().empty()) table.add({"", "", "→ " + finding.remedy()});
  }
  table.print(terminal);
}

void add_doctor(CLI::App& app, Session& session) {
  const auto no_probe = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand(
      "doctor",
      "Kernel, rights, loop, devices and force under a press: what is wrong, and what to do about it");
  command->add_flag("--no-probe", *no_probe, "Leave hardware that no scene uses closed");
  command->footer(
      "Examples:\n  hapticctl doctor\n  hapticctl doctor --json | jq '.findings[] | select(.severity == "
      "\"problem\")'");
  command->callback([&session, no_probe] {
    std::vector<std::string> on_rigs{"doctor"};
    if (*no_probe) on_rigs.emplace_back("--no-probe");
    if (run_on_named_rigs(on_rigs, session)) return;
    const v1::Diagnosis diagnosis = session.connect().diagnose(!*no_probe);
    const auto is_problem = [](const v1::Finding& f) { return f.severity() == v1::FINDING_SEVERITY_PROBLEM; };
    if (std::any_of(diagnosis.findings().begin(), diagnosis.findings().end(), is_problem)) {
      session.exit_code = ExitCode::kRefused;
    }
    if (session.json) return print_json(to_json(diagnosis));
    print_diagnosis(diagnosis);
  });
}

void add_sensor(CLI::App& app, Session& session) {
  CLI::App* sensor = app.add_subcommand("sensor", "The force sensor");
  sensor->require_subcommand(1);
  CLI::App* bias = sensor->add_subcommand(
      "bias",
      "Takes the present load as zero: with the tool free and at rest, upright unless the scene explores");
  bias->footer("Example:\n  hapticctl sensor bias");
  const auto tool_is_free = std::make_shared<bool>(false);
  bias->add_flag("--tool-is-free", *tool_is_free,
                 "You have looked: although the sensor reads more than 0.4 N under its last bias, nothing "
                 "touches the tool");
  bias->callback([&session, tool_is_free] {
    const v1::SensorBias taken = session.connect().bias_force_sensor(*tool_is_free);
    if (session.json) return print_json(to_json(taken));
    print_line("the present load counts as zero, until the next bias or until the sensor loses it");
    print_line("move the tool by some millimetres in free air: until then there is no force");
  });
}

void add_device(CLI::App& app, Session& session) {
  CLI::App* device = app.add_subcommand("device", "The haptic device");
  device->require_subcommand(1);
  CLI::App* home = device->add_subcommand("home", "Takes the present pose as the device's reset pose");
  home->footer("Example:\n  hapticctl device home");
  home->callback([&session] {
    session.connect().home_device();
    if (session.json) return print_json(Json::object());
    print_line(
        "homing: keep the arm still in its reset pose; when hapticctl status calls it ready, hapticctl clear "
        "brings the force back");
  });
}

std::string clearing_words(v1::FaultClearing clearing) {
  return clearing == v1::FAULT_CLEARING_ANY_CLIENT ? "an operator: clear" : spaced(word(clearing));
}

void add_faults(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("faults", "What each fault does to the force, and who ends it");
  command->footer("Example:\n  hapticctl faults");
  command->callback([&session] {
    client::Client client = session.connect();
    const v1::ListFaultsResponse answer = client.faults();
    if (session.json) return print_json(to_json(answer));
    const v1::RigState state = client.rig_state();
    const Terminal terminal = Terminal::detect();
    TextTable table({"now", "fault", "action", "ended by", "noticed by"});
    for (const v1::FaultRule& rule : answer.faults()) {
      const auto& present = state.faults_present();
      const bool now =
          std::find(present.begin(), present.end(), static_cast<int>(rule.fault())) != present.end();
      table.add({now ? terminal.paint(Color::kRed, "*") : "", word(rule.fault()), spaced(word(rule.action())),
                 clearing_words(rule.clearing()), rule.cause()});
    }
    table.print(terminal);
  });
}

}  // namespace

void add_rig_commands(CLI::App& app, Session& session) {
  add_doctor(app, session);
  add_sensor(app, session);
  add_device(app, session);
  add_faults(app, session);
}

}  // namespace hapticd::cli
