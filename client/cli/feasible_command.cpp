#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <optional>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/names.h"
#include "client/cli/text_table.h"

namespace hapticd::cli {
namespace {

struct FeasibleOptions {
  std::optional<double> hand_force_n;
  std::optional<double> object_stiffness_n_per_mm;
};

void print_range(const v1::FeasibleRange& range) {
  const Terminal terminal = Terminal::detect();
  TextTable table;
  table.add({"hand force", quantity(range.hand_force_n(), 2, "N")});
  table.add({"real object", quantity(range.object_stiffness_n_per_mm(), 3, "N/mm")});
  table.add({"device", fmt::format("up to {:g} N", range.device_max_force_n())});
  const bool unlimited = std::isinf(range.max_n_per_mm());
  table.add({"feasible",
             unlimited ? fmt::format("from {:.3f} N/mm, without upper limit", range.min_n_per_mm())
                       : fmt::format("{:.3f} to {:.3f} N/mm", range.min_n_per_mm(), range.max_n_per_mm())});
  if (range.max_limited_by() > v1::LIMITING_REASON_NONE)
    table.add({"bounded by", word(range.max_limited_by())});
  table.print(terminal);
}

}  // namespace

void add_feasible_command(CLI::App& app, Session& session) {
  const auto options = std::make_shared<FeasibleOptions>();
  CLI::App* command = app.add_subcommand("feasible", "The stiffnesses the device could render on an object");
  command->footer(
      "Without options: for the force and the object under the tool right now.\n\n"
      "Examples:\n  hapticctl feasible\n  hapticctl feasible --hand-force 4 --object-stiffness 0.38");
  command->add_option("--hand-force", options->hand_force_n, "Force of the hand, in N");
  command->add_option("--object-stiffness", options->object_stiffness_n_per_mm,
                      "Stiffness of the real object, in N/mm");
  command->callback([&session, options] {
    v1::GetFeasibleRangeRequest request;
    if (options->hand_force_n) request.set_hand_force_n(*options->hand_force_n);
    if (options->object_stiffness_n_per_mm)
      request.set_object_stiffness_n_per_mm(*options->object_stiffness_n_per_mm);
    const auto range = session.connect().feasible_range(request);
    if (session.json) return print_json(to_json(range));
    print_range(range);
  });
}

}  // namespace hapticd::cli
