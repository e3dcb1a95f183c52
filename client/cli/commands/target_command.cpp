
#include <cmath>
#include <memory>
#include <optional>

#include "client/cli/commands/commands.h"
#include "client/cli/commands/target_law.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/view/target_view.h"

namespace hapticd::cli {
namespace {

struct TargetOptions {
  std::optional<double> stiffness_n_per_mm;
  std::string hunt_crossley;
  std::string displacement_profile;
  std::string position_profile;
  std::string axis;
  double ramp_s = 0.0;
  std::int64_t at_time_ns = 0;
  double in_s = 0.0;
  bool has_ramp = false;
  bool has_in = false;
};

/// Fills in what was asked for, linear or not.
void fill(const TargetOptions& options, v1::SetTargetRequest& request) {
  if (!options.hunt_crossley.empty()) {
    *request.mutable_law()->mutable_hunt_crossley() = parse_hunt_crossley(options.hunt_crossley);
  } else if (!options.displacement_profile.empty()) {
    *request.mutable_law()->mutable_displacement_profile() =
        parse_profile(options.displacement_profile, "--displacement-profile");
  } else if (!options.position_profile.empty()) {
    auto& profile = *request.mutable_law()->mutable_position_profile();
    profile = parse_profile(options.position_profile, "--position-profile");
    if (!options.axis.empty()) *profile.mutable_axis() = parse_axis(options.axis);
  } else if (options.stiffness_n_per_mm) {
    request.set_stiffness_n_per_mm(*options.stiffness_n_per_mm);
  } else {
    throw LocalError("no target is given", "target set", "",
                     "N_PER_MM, --hunt-crossley, --displacement-profile or --position-profile",
                     "give one of them");
  }
}

void print_grant(const v1::SetTargetRequest& request, const v1::SetTargetResponse& answer) {
  if (request.has_law()) {
    print_line("granted: up to {:g} N/mm within 20 mm", answer.granted_n_per_mm());
    return;
  }
  print_line("requested {:g} N/mm, granted {:g} N/mm", answer.requested_n_per_mm(),
             answer.granted_n_per_mm());
}

void set_target(const TargetOptions& options, Session& session) {
  v1::SetTargetRequest request;
  fill(options, request);
  client::Client client = session.connect();
  if (options.has_ramp) request.set_ramp_s(options.ramp_s);
  request.set_at_time_ns(options.at_time_ns);
  if (options.has_in && options.in_s > 0.0)
    request.set_at_time_ns(client.rig_state().time_ns() + std::llround(options.in_s * 1e9));

  const v1::SetTargetResponse answer = client.set_target(request);
  if (session.json) return print_json(to_json(answer));
  print_grant(request, answer);
  if (answer.limiting_reason() > v1::LIMITING_REASON_NONE) {
    print_line("limited by {}{}{}", word(answer.limiting_reason()), answer.explanation().empty() ? "" : ": ",
               answer.explanation());
  } else if (!answer.explanation().empty()) {
    print_line(answer.explanation());
  }
  print_line("in effect from tick {}, {:.6f} s of the rig's clock", answer.effective_tick(),
             static_cast<double>(answer.effective_time_ns()) * 1e-9);
}

void get_target(Session& session) {
  const v1::RigState state = session.connect().rig_state(client::Histograms::kWithout);
  if (session.json) {
    Json document{{"scene", state.scene()}, {"target_stiffness_n_per_mm", state.target_stiffness_n_per_mm()}};
    if (state.has_target_law()) document["target_law"] = to_json(state.target_law());
    return print_json(document);
  }
  if (state.scene().empty()) return print_line("no scene is loaded, so there is no target");
  print_line("{:g} N/mm in scene '{}'", state.target_stiffness_n_per_mm(), state.scene());
  if (state.has_target_law()) print_line("law: {}", target_words(state.target_law()));
}

}  // namespace

void add_target_command(CLI::App& app, Session& session) {
  CLI::App* target = app.add_subcommand("target", "How stiff the object is to feel");
  target->require_subcommand(1);
  CLI::App* get = target->add_subcommand(
      "get", "The target in force and its law; of one that is not linear, the stiffness where the tip is");
  get->footer("Example:\n  hapticctl target get");
  get->callback([&session] { get_target(session); });
  const auto options = std::make_shared<TargetOptions>();
  CLI::App* set = target->add_subcommand("set", "Sets the target stiffness of the loaded scene");
  set->footer(
      "Examples:\n"
      "  hapticctl target set 0.3\n"
      "  hapticctl target set 0.7 --ramp 2        over two seconds\n"
      "  hapticctl target set 0.5 --in 1.5        in a second and a half\n"
      "In a scene that explores, other laws too:\n"
      "  hapticctl target set --hunt-crossley 0.05,0.001,1.6\n"
      "  hapticctl target set --displacement-profile 0:0.2,5:0.8      stiffer the deeper\n"
      "  hapticctl target set --position-profile -20:0.3,20:0.8 --axis x");
  CLI::Option* linear =
      set->add_option("N_PER_MM", options->stiffness_n_per_mm, "Linear: target stiffness in N/mm");
  CLI::Option* power = set->add_option("--hunt-crossley", options->hunt_crossley,
                                       "F = K x^M + B x^M dx/dt: K,B,M in N, mm and s");
  CLI::Option* deep = set->add_option("--displacement-profile", options->displacement_profile,
                                      "Stiffness by depth: MM:N_PER_MM,...");
  CLI::Option* along = set->add_option("--position-profile", options->position_profile,
                                       "Stiffness by the tip's position along an axis: MM:N_PER_MM,...");
  set->add_option("--axis", options->axis, "Of a position profile: x, y, z or X,Y,Z of the rig; x without it")
      ->needs(along);
  linear->excludes(power)->excludes(deep)->excludes(along);
  power->excludes(deep)->excludes(along);
  deep->excludes(along);
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
