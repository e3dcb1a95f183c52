#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <utility>

#include "server/model/model_file.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"

namespace hapticd::study {

const IdentificationResult& identified(const std::string& object) {
  static std::map<std::pair<std::string, sim::Plant>, IdentificationResult> known;
  const std::pair key{object, current_plant()};
  const auto found = known.find(key);
  if (found != known.end()) return found->second;
  IdentificationResult result = identify(object);
  // Studies compare both laws, also if the service advises against one.
  if (!result.model.hunt_crossley) result.model.hunt_crossley = result.dissertation.hunt_crossley;
  return known.emplace(key, std::move(result)).first->second;
}

namespace {

/// Error of the dissertation's rod friction (D§4.4.1).
double published_friction_error(const std::string& object) {
  if (object == "sponge_cut") return 0.08;
  if (object == "foam_ball_3d") return 0.07;
  return object == "rubber_ball_3d" ? 0.10 : 0.15;
}

}  // namespace

void run_models(StudyContext& context) {
  using report::fixed;
  using report::significant;
  report::MarkdownTable table({"object", "K N/mm^m", "B/K s/mm", "m", "HC error %", "creep error %",
                               "at once %", "μ_k", "δ mm", "friction error %", "D %"});
  report::SvgPlot plot;
  plot.title = "Identified laws, slow loading: Hunt-Crossley (dashed) and creep law";
  plot.x = {"displacement", "mm"};
  plot.y = {"normal force", "N"};
  plot.y.maximum = 12.0;
  const std::filesystem::path folder = context.report.folder() / ("models" + plant_suffix(current_plant()));
  std::filesystem::create_directories(folder);
  int colour = 0;
  for (const std::string& object : explored_objects()) {
    const IdentificationResult& result = identified(object);
    const rt::ObjectModel& model = result.model;
    const rt::HuntCrossleyParameters& hc = model.hunt_crossley->parameters;
    const rt::CreepParameters& creep = model.creep->parameters;
    table.add_row({object, significant(hc.stiffness_n_per_mm_m),
                   significant(hc.damping_n_s_per_mm_m1 / hc.stiffness_n_per_mm_m), fixed(hc.exponent, 2),
                   fixed(100.0 * model.hunt_crossley->relative_error, 1),
                   fixed(100.0 * model.creep->relative_error, 1), fixed(100.0 * creep.weight[0], 0),
                   fixed(model.rod_friction->kinetic, 3), fixed(model.rod_friction->presliding_mm, 2),
                   fixed(100.0 * result.friction.residual, 1),
                   fixed(100.0 * published_friction_error(object), 0)});
    for (const auto& [law, error] : {std::pair{"hunt_crossley", model.hunt_crossley->relative_error},
                                     {"creep", model.creep->relative_error}}) {
      report::Figure figure{"model_displacement_error", {{"object", object}, {"law", law}}};
      figure.value = error;
      figure.source = "rms over the palpation itself";
      context.report.add(figure);
    }
    report::Figure friction{"friction_error", {{"object", object}, {"tip", "rod"}}};
    friction.value = result.friction.residual;
    friction.reference = published_friction_error(object);
    friction.source = "D§4.4.1, on the data of the fit";
    context.report.add(friction);

    ++colour;
    report::PlotSeries by_hc{"", {}, {}, report::PlotSeries::Style::kLine, colour, true};
    report::PlotSeries by_creep{object, {}, {}, report::PlotSeries::Style::kLine, colour};
    const rt::CreepLaw law(creep, 1000.0);
    for (double force_n = 0.0; force_n <= 12.0; force_n += 0.05) {
      by_hc.add(rt::hunt_crossley_displacement(hc, force_n, 0.0).displacement_mm, force_n);
      by_creep.add(law.curve(force_n).displacement_mm, force_n);
    }
    plot.series.push_back(by_hc);
    plot.series.push_back(by_creep);

    std::ofstream file(folder / (object + ".toml"));
    file << server::write_model(model);
    if (!file.flush()) throw std::runtime_error("cannot write " + (folder / (object + ".toml")).string());
  }
  context.report.add_table("models", "What is identified on the four objects", table,
                           "From encoders and sensor alone, on the high-force device without rendering. "
                           "By the service's own identifications. Errors: rms of x̂/x - 1 beyond a "
                           "tenth of the deepest, over the palpation itself; friction: rms left over rms of "
                           "the friction, turns included. At once: share of the creep law "
                           "that follows the force without delay. Files: models/*.toml.");
  context.report.add_plot("models", plot);
}

}  // namespace hapticd::study
