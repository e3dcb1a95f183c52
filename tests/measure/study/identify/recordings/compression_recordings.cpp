#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/identification/estimate/contact/contact_variable_projection.h"
#include "server/identification/session/contact/contact_identification.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/identify/recordings/recorded_contact.h"

namespace hapticd::study {

namespace {

using report::fixed;

constexpr const char* kSet = "ecoflex_compression";
constexpr double kHeightMm = 30.0;

/// One slow loading of one casting, as deep as it is judged.
struct Loading {
  std::string name, material;
  char casting = 'A';
  replay::Recording recording;
  Palpation samples;
};

std::optional<Loading> load_to(RecordingEntry entry, double to_mm) {
  entry.config.position.column = "compression_mm";
  auto recording = load(entry);
  if (!recording) return std::nullopt;
  Loading loading;
  loading.name = entry.name.substr(entry.set.size() + 1);
  const std::size_t mark = loading.name.rfind('_');
  loading.material = loading.name.substr(0, mark);
  loading.casting = loading.name.at(mark + 1);
  const auto deep = std::find_if(recording->depth_mm.begin(), recording->depth_mm.end(),
                                 [&](double x) { return x > to_mm; });
  const auto count = static_cast<std::size_t>(deep - recording->depth_mm.begin());
  for (auto* column : {&recording->time_s, &recording->force_n, &recording->depth_mm}) column->resize(count);
  loading.samples = palpation_of(*recording);
  loading.recording = std::move(*recording);
  return loading;
}

/// A law fitted to one loading: the force at each sample of any other, its memory that of a rested object.
using Prediction = std::function<std::vector<double>(const Loading&)>;

std::optional<Prediction> fit_power(const Loading& loading) {
  double deepest_mm = 0.0;
  for (const identification::PalpationSample& s : loading.samples)
    deepest_mm = std::max(deepest_mm, s.displacement_mm);
  // The one loading cannot distinguish stiffness from damping; its surface may lie a little off.
  identification::VariableProjectionOptions options;
  options.min_offset_mm = -0.1 * deepest_mm;
  options.max_offset_mm = 0.1 * deepest_mm;
  const auto found = identification::fit_by_variable_projection(loading.samples, options);
  if (!found) return std::nullopt;
  return [law = *found](const Loading& judged) {
    std::vector<double> force_n;
    for (const identification::PalpationSample& s : judged.samples) {
      force_n.push_back(rt::hunt_crossley_force_n(law.parameters, s.displacement_mm + law.contact_offset_mm,
                                                  s.rate_mm_per_s));
    }
    return force_n;
  };
}

/// What the service stores of the loading: its choice of a law, made on that loading alone.
std::optional<Prediction> fit_identified(const Loading& loading) {
  hal::RigInfo rig;
  rig.kind = hal::RigKind::kReplay;
  rig.rate_hz = 1.0 / loading.recording.median_step_s;
  rig.renders_force = false;
  identification::ContactIdentification identification(identification::ContactTask{}, rig);
  rt::Observation observation;
  for (std::size_t i = 0; i < loading.recording.time_s.size(); ++i) {
    observation.sample = sample_of(loading.recording, i);
    identification.add(observation);
  }
  const auto model = identification.finish();
  if (!model) {
    report::Report::note(loading.name + ": " + model.error().text());
    return std::nullopt;
  }
  const auto& creep = std::get<rt::ContactModel>(model->content).creep;
  if (!creep) return std::nullopt;
  // The curve's zero is where the first loading says the surface is, the power law's next to it.
  double surface_mm = 0.0;
  for (const rt::EstimatedParameter& p : model->parameters) {
    if (p.name == "curve_surface_mm" && std::isfinite(p.value)) surface_mm = p.value;
  }
  return [law = creep->parameters, surface_mm](const Loading& judged) {
    return creep_force_n(law, judged.samples, judged.recording.median_step_s, surface_mm);
  };
}

/// Residual on another casting, whose stiffness alone is fitted.
double residual_of(const Prediction& law, const Loading& judged) {
  const std::vector<double> force_n = law(judged);
  double pp = 0.0, pf = 0.0;
  for (std::size_t i = 0; i < force_n.size(); ++i) {
    pp += force_n[i] * force_n[i];
    pf += force_n[i] * judged.samples[i].normal_force_n;
  }
  Squares squares;
  squares.add(judged.samples, force_n, pf / pp);
  return squares.residual();
}

}  // namespace

void run_identify_compression_recordings(StudyContext& context) {
  const auto folder = recordings_folder();
  if (!folder) return report::Report::note(no_recordings_reason());
  report::MarkdownTable table({"depth", "law", "residual %", "by file %"});
  for (const auto& [depth, to_mm] :
       {std::pair{"third", kHeightMm / 3.0}, {"full", 2.0 * kHeightMm / 3.0 + 0.1}}) {
    std::vector<Loading> loadings;
    for (const RecordingEntry& entry : recordings_of(*folder, kSet)) {
      if (auto loading = load_to(entry, to_mm)) loadings.push_back(std::move(*loading));
    }
    for (const auto& [law, fit] : {std::pair{"hunt_crossley", &fit_power}, {"identified", &fit_identified}}) {
      double sum = 0.0, count = 0.0;
      std::string files;
      for (const Loading& from : loadings) {
        if (from.casting != 'A') continue;
        const auto found = fit(from);
        for (const Loading& to : loadings) {
          if (to.casting != 'B' || to.material != from.material) continue;
          const double residual = found ? residual_of(*found, to) : std::nan("");
          sum += residual * residual;
          count += 1.0;
          files += (files.empty() ? "" : " ") + fixed(100.0 * residual, 1);
        }
      }
      report::Figure figure{"recording_residual",
                            {{"set", kSet}, {"law", law}, {"split", "across_scaled"}, {"depth", depth}}};
      figure.goal = 0.04;
      figure.source = "rms over files of rms force left over rms force";
      figure.value = std::sqrt(sum / count);
      context.report.add(figure);
      table.add_row({depth, law, fixed(100.0 * *figure.value, 2), files});
    }
  }
  context.report.add_table(
      "compression_residuals", "Contact laws on compressed EcoFlex", table,
      "Residual: rms of what is left of the force over rms force of a file, root mean square over files. "
      "Fitted to "
      "casting A, judged on B, whose stiffness scale alone is fitted: two castings of one mixture differ in "
      "stiffness.\nThird: to a third of the height of 30 mm; full: the whole recording, two thirds of it. "
      "identified: what the service stores, surface included.");
}

}  // namespace hapticd::study
