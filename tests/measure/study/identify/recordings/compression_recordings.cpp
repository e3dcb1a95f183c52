#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/replay/recording.h"
#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/contact/contact_variable_projection.h"
#include "server/identification/gate/palpation_tracker.h"
#include "server/identification/session/contact/contact_identification.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/recording_set.h"
#include "tests/reference/creep_force.h"

namespace hapticd::study {

namespace {

using report::fixed;
using Palpation = std::vector<identification::PalpationSample>;

constexpr const char* kSet = "ecoflex_compression";
constexpr double kHeightMm = 30.0;
constexpr double kTraceN = 1e-3;

/// One slow loading of one casting, as deep as it is judged.
struct Loading {
  std::string name, material;
  char casting = 'A';
  replay::Recording recording;
  Palpation samples;
};

hal::RigSample sample_of(const replay::Recording& recording, std::size_t i) {
  hal::RigSample sample;
  sample.tick = i;
  sample.time_ns = std::llround(1e9 * recording.time_s[i]);
  sample.tip_position_mm = {0.0, 0.0, -recording.depth_mm[i]};
  sample.sensor_force_n = {0.0, 0.0, recording.force_n[i]};
  return sample;
}

std::optional<Loading> load(RecordingEntry entry, double to_mm) {
  entry.config.position.column = "compression_mm";
  auto recording = replay::load_recording(entry.config.path,
                                          {entry.config.time, entry.config.force, entry.config.position});
  if (!recording) {
    report::Report::note(recording.error().text());
    return std::nullopt;
  }
  Loading loading;
  loading.name = entry.name.substr(entry.set.size() + 1);
  const std::size_t mark = loading.name.rfind('_');
  loading.material = loading.name.substr(0, mark);
  loading.casting = loading.name.at(mark + 1);
  const auto end =
      static_cast<std::ptrdiff_t>(std::find_if(recording->depth_mm.begin(), recording->depth_mm.end(),
                                               [&](double x) { return x > to_mm; }) -
                                  recording->depth_mm.begin());
  loading.recording.median_step_s = recording->median_step_s;
  loading.recording.time_s.assign(recording->time_s.begin(), recording->time_s.begin() + end);
  loading.recording.force_n.assign(recording->force_n.begin(), recording->force_n.begin() + end);
  loading.recording.depth_mm.assign(recording->depth_mm.begin(), recording->depth_mm.begin() + end);
  identification::RecordedPalpation tracker(kTraceN, 1.0 / recording->median_step_s);
  identification::PalpationSample sample;
  for (std::size_t i = 0; i < loading.recording.time_s.size(); ++i) {
    if (tracker.update(sample_of(loading.recording, i), sample)) loading.samples.push_back(sample);
  }
  return loading;
}

/// A law fitted to one loading: the force at each sample of any other, its memory that of a rested object.
using Prediction = std::function<std::vector<double>(const Loading&)>;
using Fit = std::function<std::optional<Prediction>(const Loading&, const identification::HeldOutBlocks&)>;

std::vector<double> forces_of(const rt::CreepParameters& law, double surface_mm, const Loading& loading) {
  identification::CreepForce inverse(law);
  std::vector<double> force_n;
  for (const identification::PalpationSample& s : loading.samples) {
    force_n.push_back(inverse.update(s.displacement_mm - surface_mm, loading.recording.median_step_s));
  }
  return force_n;
}

std::optional<Prediction> fit_power(const Loading& loading, const identification::HeldOutBlocks& held_out) {
  Palpation training;
  double deepest_mm = 0.0;
  for (std::size_t i = 0; i < loading.samples.size(); ++i) {
    if (held_out.contains(i, loading.samples.size())) continue;
    training.push_back(loading.samples[i]);
    deepest_mm = std::max(deepest_mm, training.back().displacement_mm);
  }
  // The one loading cannot distinguish stiffness from damping; its surface may lie a little off.
  identification::VariableProjectionOptions options;
  options.min_offset_mm = -0.1 * deepest_mm;
  options.max_offset_mm = 0.1 * deepest_mm;
  const auto found = identification::fit_by_variable_projection(training, options);
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

std::optional<Prediction> fit_curve(const Loading& loading, const identification::HeldOutBlocks& held_out) {
  identification::CreepFit fit(identification::creep_times_s(loading.recording.median_step_s), 1);
  for (const identification::PalpationSample& s : loading.samples)
    fit.add(s, loading.recording.median_step_s);
  identification::CreepFit::Options options;
  options.fewest_samples = 30;
  options.with_errors = false;
  options.for_force = true;
  options.elastic = true;
  options.held_out = held_out;
  const auto found = fit.solve(options);
  if (!found) return std::nullopt;
  return [law = found->law.parameters](const Loading& judged) { return forces_of(law, 0.0, judged); };
}

hal::Result<rt::IdentifiedModel> identify(const Loading& loading) {
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
  return identification.finish();
}

double parameter(const rt::IdentifiedModel& model, const std::string& name) {
  for (const rt::EstimatedParameter& p : model.parameters) {
    if (p.name == name) return p.value;
  }
  return std::nan("");
}

/// What the service stores of the loading: its choice of a law, made on that loading alone.
std::optional<Prediction> fit_identified(const Loading& loading, const identification::HeldOutBlocks&) {
  const auto model = identify(loading);
  if (!model) {
    report::Report::note(loading.name + ": " + model.error().text());
    return std::nullopt;
  }
  const auto& creep = std::get<rt::ContactModel>(model->content).creep;
  if (!creep) return std::nullopt;
  // The curve's zero is where the first loading says the surface is, the power law's next to it.
  return [law = creep->parameters, surface = parameter(*model, "curve_surface_mm")](const Loading& judged) {
    return forces_of(law, std::isfinite(surface) ? surface : 0.0, judged);
  };
}

struct Law {
  const char* name;
  Fit fit;
};

struct Split {
  const char* name;
  const char* words;
  bool held_out;  ///< judged on the blocks kept from the fit
  enum class Judged : unsigned char { kItself, kSameCasting, kOtherCasting } judged;
  /// One number of the judged file fitted to it: its stiffness, over so much of its depth. 0 = nothing is.
  double scaled_to_share;
};
const std::array kSplits{
    Split{"within", "on the file fitted to", false, Split::Judged::kItself, 0.0},
    Split{"within_held_out", "on blocks of the file kept from the fit", true, Split::Judged::kItself, 0.0},
    Split{"repeat", "on a repeat on the same casting", false, Split::Judged::kSameCasting, 0.0},
    Split{"across", "from casting A on B, nothing fitted to B", false, Split::Judged::kOtherCasting, 0.0},
    Split{"across_scaled", "the same, B's stiffness scale fitted to all of it", false,
          Split::Judged::kOtherCasting, 1.0},
    Split{"across_scaled_shallow", "the same, the scale fitted to the shallower half only", false,
          Split::Judged::kOtherCasting, 0.5}};

bool judges(const Split& split, const Loading& fitted, const Loading& judged) {
  if (fitted.material != judged.material) return false;
  switch (split.judged) {
    case Split::Judged::kItself:
      return fitted.name == judged.name;
    case Split::Judged::kSameCasting:
      return fitted.casting == judged.casting && fitted.name != judged.name;
    case Split::Judged::kOtherCasting:
      return fitted.casting == 'A' && judged.casting == 'B';
  }
  return false;
}

struct Squares {
  double left = 0.0, whole = 0.0;
};

double residual_of(const Split& split, const Law& law, const Prediction* whole, const Loading& fitted,
                   const Loading& judged) {
  Squares squares;
  const auto add = [&](const std::vector<double>& force_n, double scale,
                       const identification::HeldOutBlocks* blocks) {
    for (std::size_t i = 0; i < force_n.size(); ++i) {
      if (blocks != nullptr && !blocks->contains(i, force_n.size())) continue;
      const double measured_n = judged.samples[i].normal_force_n;
      squares.left += std::pow(scale * force_n[i] - measured_n, 2);
      squares.whole += measured_n * measured_n;
    }
  };
  if (split.held_out) {
    for (identification::HeldOutBlocks blocks{0}; blocks.fold < identification::HeldOutBlocks::kFolds;
         ++blocks.fold) {
      const auto found = law.fit(fitted, blocks);
      if (!found) return std::nan("");
      add((*found)(judged), 1.0, &blocks);
    }
    return std::sqrt(squares.left / squares.whole);
  }
  if (whole == nullptr) return std::nan("");
  const std::vector<double> force_n = (*whole)(judged);
  double scale = 1.0;
  if (split.scaled_to_share > 0.0) {
    double pp = 0.0, pf = 0.0;
    const double to_mm = split.scaled_to_share * judged.samples.back().displacement_mm;
    for (std::size_t i = 0; i < force_n.size(); ++i) {
      if (judged.samples[i].displacement_mm > to_mm) break;
      pp += force_n[i] * force_n[i];
      pf += force_n[i] * judged.samples[i].normal_force_n;
    }
    scale = pf / pp;
  }
  add(force_n, scale, nullptr);
  return std::sqrt(squares.left / squares.whole);
}

struct Depth {
  const char* name;
  double to_mm;
};
constexpr std::array kDepths{Depth{"third", kHeightMm / 3.0}, Depth{"full", 2.0 * kHeightMm / 3.0 + 0.1}};

std::optional<double> goal_of(const Split& split) {
  if (split.judged == Split::Judged::kItself) return 0.02;
  if (split.judged == Split::Judged::kOtherCasting) return 0.04;
  return std::nullopt;
}

report::Figure figure_of(const Law& law, const Split& split, const Depth& depth) {
  report::Figure figure{"recording_residual",
                        {{"set", kSet}, {"law", law.name}, {"split", split.name}, {"depth", depth.name}}};
  figure.goal = goal_of(split);
  figure.source = std::string("rms over files of rms force left over rms force, ") + split.words;
  return figure;
}

const std::vector<Law>& laws() {
  static const std::vector<Law> all{
      {"hunt_crossley", fit_power}, {"elastic_curve", fit_curve}, {"identified", fit_identified}};
  return all;
}

void study_depth(StudyContext& context, const Depth& depth, const std::vector<Loading>& loadings,
                 report::MarkdownTable& table, report::MarkdownTable& models) {
  for (const Law& law : laws()) {
    std::map<std::string, std::optional<Prediction>> fitted;
    for (const Loading& loading : loadings) fitted[loading.name] = law.fit(loading, {});
    for (const Split& split : kSplits) {
      // The service is given whole recordings; what it makes of parts of one is its own held-out error.
      if (split.held_out && law.name == std::string("identified")) continue;
      double sum = 0.0;
      std::string files;
      std::size_t count = 0;
      for (const Loading& from : loadings) {
        for (const Loading& to : loadings) {
          if (!judges(split, from, to)) continue;
          const auto& whole = fitted[from.name];
          const double residual = residual_of(split, law, whole ? &*whole : nullptr, from, to);
          sum += residual * residual;
          ++count;
          files += (files.empty() ? "" : " ") + fixed(100.0 * residual, 1);
        }
      }
      report::Figure figure = figure_of(law, split, depth);
      const double value = std::sqrt(sum / static_cast<double>(count));
      if (std::isfinite(value)) {
        figure.value = value;
      } else {
        figure.failed = "a fit failed";
      }
      context.report.add(figure);
      table.add_row({depth.name, law.name, split.name,
                     figure.value ? fixed(100.0 * value, 2) : report::kNoNumber,
                     figure.goal ? fixed(100.0 * *figure.goal, 0) : report::kNoNumber, files});
    }
  }
  for (const Loading& loading : loadings) {
    const auto model = identify(loading);
    if (!model) {
      models.add_row({depth.name, loading.name, "", "", "", "", model.error().text()});
      continue;
    }
    const auto percent = [&](const char* name) {
      const double value = parameter(*model, name);
      return std::isfinite(value) ? fixed(100.0 * value, 2) : report::kNoNumber;
    };
    models.add_row({depth.name, loading.name, percent("held_out_power"), percent("held_out_elastic_curve"),
                    percent("held_out_creep"), fixed(model->validity.max_displacement_mm, 2),
                    model->procedure.substr(model->procedure.find("chosen"))});
  }
}

}  // namespace

void run_identify_compression_recordings(StudyContext& context) {
  const auto folder = recordings_folder();
  if (!folder) {
    report::Report::note(no_recordings_reason());
    for (const Depth& depth : kDepths) {
      for (const Law& law : laws()) {
        for (const Split& split : kSplits) {
          report::Figure figure = figure_of(law, split, depth);
          figure.failed = no_recordings_reason();
          context.report.add(figure);
        }
      }
    }
    return;
  }
  report::MarkdownTable table({"depth", "law", "split", "residual %", "goal %", "by file %"});
  report::MarkdownTable models(
      {"depth", "file", "power law %", "elastic curve %", "creep %", "known to mm", "law"});
  for (const Depth& depth : kDepths) {
    std::vector<Loading> loadings;
    for (const RecordingEntry& entry : recordings_of(*folder, kSet)) {
      if (auto loading = load(entry, depth.to_mm)) loadings.push_back(std::move(*loading));
    }
    study_depth(context, depth, loadings, table, models);
  }
  std::string words =
      "Residual: rms of what is left of the force over rms force of a file, root mean square over files.";
  for (const Split& split : kSplits) words += std::string("\n") + split.name + ": " + split.words + ".";
  words +=
      "\nThird: to a third of the height of 30 mm; full: the whole recording, two thirds of it.\nidentified: "
      "what the "
      "service stores, surface included. Two castings of one mixture differ in stiffness, and so "
      "do repeats on one casting (repeat): without a scale of its own, what the judged casting is stiffer by "
      "no law "
      "of the other one can know.";
  context.report.add_table("compression_residuals", "Contact laws on compressed EcoFlex", table, words);
  context.report.add_table("compression_models", "What an identification chooses for compressed EcoFlex",
                           models,
                           "Error of the displacement on samples held out of the fit, by form of the law.");
}

}  // namespace hapticd::study
