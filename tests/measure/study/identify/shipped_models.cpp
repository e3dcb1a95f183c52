#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>

#include "server/model/model_file.h"
#include "tests/measure/study/common/palpation.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/scenes.h"

namespace hapticd::study {

void run_identify_shipped_models(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table({"object", "Hunt-Crossley error %", "creep error %", "known to mm", "μ_k",
                               "δ mm", "exponent", "converged", "contact procedure"});
  const std::filesystem::path folder = context.report.folder() / "shipped_models";
  std::filesystem::create_directories(folder);
  for (const std::string& object : explored_objects()) {
    const IdentificationResult found = identify(object);
    const rt::ObjectModel& model = found.model;
    const rt::IdentifiedModel& contact = found.contact;
    const rt::IdentifiedModel& friction = found.friction;
    const auto add = [&](const char* law, std::optional<double> error) {
      report::Figure figure{"shipped_model_displacement_error", {{"object", object}, {"law", law}}};
      figure.source = "rms over the palpation itself";
      figure.value = error;
      if (!error) figure.failed = "left out: " + contact.procedure;
      context.report.add(figure);
      return error ? fixed(100.0 * *error, 1) : std::string(report::kNoNumber);
    };
    const auto error_of = [](const auto& law) {
      return law ? std::optional(law->relative_error) : std::nullopt;
    };
    table.add_row({object, add("hunt_crossley", error_of(model.hunt_crossley)),
                   add("creep", error_of(model.creep)), fixed(model.max_displacement_mm, 1),
                   fixed(model.rod_friction->kinetic, 3), fixed(model.rod_friction->presliding_mm, 3),
                   fixed(model.rod_friction->exponent, 2),
                   std::string(contact.converged ? "contact " : "") + (friction.converged ? "friction" : ""),
                   contact.procedure + " / " + friction.procedure});
    std::ofstream file(folder / (object + ".toml"));
    file << server::write_model(model);
    if (!file.flush()) throw std::runtime_error("cannot write " + (folder / (object + ".toml")).string());
  }
  context.report.add_table("shipped_models", "Models as the service's own identification makes them", table,
                           "Files: shipped_models/*.toml, those of server/model/shipped.");
}

}  // namespace hapticd::study
