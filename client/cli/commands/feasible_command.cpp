#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "client/cli/commands/commands.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"

namespace hapticd::cli {
namespace {

struct FeasibleOptions {
  std::optional<double> hand_force_n;
  std::optional<double> object_stiffness_n_per_mm;
  double wait_s = 3.0;
};

/// Answer of the daemon. If it needs a contact and there is none, waits up to `wait_s` for the next one: a
/// hand that presses repeatedly is off the object for a second or two.
v1::FeasibleRange feasible_range(client::Client& client, const v1::GetFeasibleRangeRequest& request,
                                 double wait_s) {
  constexpr std::chrono::milliseconds kRound{50};
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(wait_s);
  while (true) {
    try {
      return client.feasible_range(request);
    } catch (const client::Error& error) {
      const bool needs_contact = error.detail().reason() == v1::ERROR_REASON_NOT_IN_CONTACT;
      if (!needs_contact || std::chrono::steady_clock::now() + kRound > until) throw;
    }
    std::this_thread::sleep_for(kRound);
  }
}

/// The range, or why there is none: the device pulls too little to make the object as soft as it would have
/// to be.
std::string feasible_words(const v1::FeasibleRange& range) {
  if (std::isinf(range.max_n_per_mm()))
    return fmt::format("from {:.3f} N/mm, without upper limit", range.min_n_per_mm());
  if (range.min_n_per_mm() <= range.max_n_per_mm())
    return fmt::format("{:.3f} to {:.3f} N/mm", range.min_n_per_mm(), range.max_n_per_mm());
  return fmt::format(
      "nothing: the device makes this object no softer than {:.3f} N/mm, and no more than {:.3f} N/mm is "
      "allowed",
      range.min_n_per_mm(), range.max_n_per_mm());
}

void print_range(const v1::FeasibleRange& range) {
  const Terminal terminal = Terminal::detect();
  TextTable table;
  table.add({"hand force", quantity(range.hand_force_n(), 2, "N")});
  table.add({"real object", quantity(range.object_stiffness_n_per_mm(), 3, "N/mm")});
  table.add({"device", fmt::format("up to {:g} N", range.device_max_force_n())});
  table.add({"feasible", feasible_words(range)});
  if (range.max_limited_by() > v1::LIMITING_REASON_NONE)
    table.add({"bounded by", word(range.max_limited_by())});
  table.print(terminal);
}

}  // namespace

void add_feasible_command(CLI::App& app, Session& session) {
  const auto options = std::make_shared<FeasibleOptions>();
  CLI::App* command = app.add_subcommand("feasible", "The stiffnesses the device could render on an object");
  command->footer(
      "Without options: for the force and the object under the tool right now; where nothing is touched, at "
      "the\nnext contact within --wait.\n\n"
      "Examples:\n  hapticctl feasible\n  hapticctl feasible --hand-force 4 --object-stiffness 0.38");
  command->add_option("--hand-force", options->hand_force_n, "Force of the hand, in N");
  command->add_option("--object-stiffness", options->object_stiffness_n_per_mm,
                      "Stiffness of the real object, in N/mm");
  command->add_option("--wait", options->wait_s, "Seconds to wait for a contact, where one is needed")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  command->callback([&session, options] {
    v1::GetFeasibleRangeRequest request;
    if (options->hand_force_n) request.set_hand_force_n(*options->hand_force_n);
    if (options->object_stiffness_n_per_mm)
      request.set_object_stiffness_n_per_mm(*options->object_stiffness_n_per_mm);
    client::Client client = session.connect();
    const auto range = feasible_range(client, request, options->wait_s);
    if (session.json) return print_json(to_json(range));
    print_range(range);
  });
}

}  // namespace hapticd::cli
