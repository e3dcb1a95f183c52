#include <fmt/core.h>

#include <cmath>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/names.h"

namespace hapticd::cli {
namespace {

struct TargetOptions {
  double stiffness_n_per_mm = 0.0;
  double ramp_s = 0.0;
  std::int64_t at_time_ns = 0;
  double in_s = 0.0;
  bool has_ramp = false;
  bool has_in = false;
};

void set_target(const TargetOptions& options, Session& session) {
  client::Client client = session.connect();
  v1::SetTargetRequest request;
  request.set_stiffness_n_per_mm(options.stiffness_n_per_mm);
  if (options.has_ramp) request.set_ramp_s(options.ramp_s);
  request.set_at_time_ns(options.at_time_ns);
  if (options.has_in) request.set_at_time_ns(client.rig_state().time_ns() + std::llround(options.in_s * 1e9));

  const v1::SetTargetResponse answer = client.set_target(request);
  if (session.json) return print_json(to_json(answer));
  fmt::print("requested {:g} N/mm, granted {:g} N/mm\n", answer.requested_n_per_mm(),
             answer.granted_n_per_mm());
  if (answer.limiting_reason() > v1::LIMITING_REASON_NONE) {
    fmt::print("limited by {}{}{}\n", word(answer.limiting_reason()),
               answer.explanation().empty() ? "" : ": ", answer.explanation());
  }
  fmt::print("in effect from tick {}, {:.6f} s of the rig's clock\n", answer.effective_tick(),
             static_cast<double>(answer.effective_time_ns()) * 1e-9);
}

}  // namespace

void add_target_command(CLI::App& app, Session& session) {
  CLI::App* target = app.add_subcommand("target", "How stiff the object is to feel");
  target->require_subcommand(1);
  const auto options = std::make_shared<TargetOptions>();
  CLI::App* set = target->add_subcommand("set", "Sets the target stiffness of the loaded scene");
  set->footer(
      "Examples:\n"
      "  hapticctl target set 0.3\n"
      "  hapticctl target set 0.7 --ramp 2        over two seconds\n"
      "  hapticctl target set 0.5 --in 1.5        in a second and a half");
  set->add_option("N_PER_MM", options->stiffness_n_per_mm, "Target stiffness in N/mm")->required();
  CLI::Option* ramp =
      set->add_option("--ramp", options->ramp_s, "Seconds to get there; without it, the scene's own ramp");
  CLI::Option* at =
      set->add_option("--at-ns", options->at_time_ns, "Not before this time of the rig's clock, in ns");
  CLI::Option* in = set->add_option("--in", options->in_s, "Not before so many seconds from now")
                        ->check(CLI::Range(0.0, 60.0));
  at->excludes(in);
  set->callback([&session, options, ramp, in] {
    options->has_ramp = ramp->count() > 0;
    options->has_in = in->count() > 0;
    set_target(*options, session);
  });
}

}  // namespace hapticd::cli
