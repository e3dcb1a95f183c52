
#include <string>

#include "client/cli/commands/commands.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"

namespace hapticd::cli {
namespace {

void print_summary(const v1::PresentationSummary& s) {
  std::string flaws;
  for (const int flaw : s.flaws())
    flaws += (flaws.empty() ? "" : ", ") + spaced(word(static_cast<v1::PresentationFlaw>(flaw)));
  print_line("presentation {}, ticks {} … {}: {}", s.number(), s.begin_tick(), s.end_tick(),
             flaws.empty() ? "valid" : "not valid: " + flaws);
  print_line("  pressed with {:.0f} mm/s, touched with {:.0f} mm/s, {} new contact{}, {:.2f} s in contact",
             s.peak_press_speed_mm_per_s(), s.peak_contact_speed_mm_per_s(), s.contacts(),
             s.contacts() == 1 ? "" : "s", s.time_in_contact_s());
  print_line("  the object gave up to {:.2f} N; {:.2f} mm deep, {:.1f} mm aside, {:.1f} mm along the surface",
             s.peak_force_n(), s.peak_displacement_mm(), s.peak_lateral_mm(), s.lateral_path_mm());
  print_line("  bounded by the guard in {} ticks, late in {}", s.guard_limited_ticks(), s.late_ticks());
}

}  // namespace

void add_presentation_command(CLI::App& app, Session& session) {
  CLI::App* presentation =
      app.add_subcommand("presentation", "Whether a press was valid, in scenes with [watch]");
  presentation->require_subcommand(1);
  presentation->footer("Examples:\n  hapticctl presentation begin\n  hapticctl presentation end --json");
  CLI::App* begin = presentation->add_subcommand("begin", "Begins one at the next tick");
  begin->footer("Example:\n  hapticctl presentation begin");
  begin->callback([&session] {
    const v1::BeginPresentationResponse begun = session.connect().begin_presentation();
    if (session.json) return print_json(to_json(begun));
    print_line("presentation {} begins with tick {}", begun.number(), begun.begin_tick());
  });
  CLI::App* end = presentation->add_subcommand("end", "Ends it, and says what it was like");
  end->footer(
      "Exit codes: 0 it was valid, 1 it was not, or there was none.\n\nExample:\n  hapticctl presentation "
      "end");
  end->callback([&session] {
    const v1::PresentationSummary summary = session.connect().end_presentation();
    if (!summary.flaws().empty()) session.exit_code = ExitCode::kRefused;
    if (session.json) return print_json(to_json(summary));
    print_summary(summary);
  });
}

}  // namespace hapticd::cli
