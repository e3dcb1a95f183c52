#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "hal/replay/recording.h"
#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/contact/contact_surface.h"
#include "server/identification/estimate/contact/contact_variable_projection.h"
#include "server/identification/gate/palpation_tracker.h"
#include "server/identification/session/contact/contact_identification.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/recording_set.h"
#include "tests/reference/contact_point.h"
#include "tests/reference/creep_force.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;
using Palpation = std::vector<identification::PalpationSample>;

constexpr double kTrace = 1e-3;  ///< N; whatever is above counts as contact, the preload too

/// One cycle on one spot.
struct Cycle {
  std::string name;
  Palpation samples;       ///< displacement from where the first loading says the surface is
  std::size_t loaded = 0;  ///< samples until the deepest
  double step_s = 0.1;
};

hal::RigSample sample_of(const replay::Recording& recording, std::size_t i) {
  hal::RigSample sample;
  sample.tick = i;
  sample.time_ns = std::llround(1e9 * recording.time_s[i]);
  sample.tip_position_mm = {0.0, 0.0, -recording.depth_mm[i]};
  sample.sensor_force_n = {0.0, 0.0, recording.force_n[i]};
  return sample;
}

hal::RigInfo rig_of(const replay::Recording& recording) {
  hal::RigInfo rig;
  rig.kind = hal::RigKind::kReplay;
  rig.rate_hz = 1.0 / recording.median_step_s;
  rig.renders_force = false;
  return rig;
}

std::optional<replay::Recording> load(const RecordingEntry& entry) {
  auto recording = replay::load_recording(entry.config.path,
                                          {entry.config.time, entry.config.force, entry.config.position});
  if (!recording) {
    report::Report::note(recording.error().text());
    return std::nullopt;
  }
  if (const auto error = replay::remove_bias(*recording, entry.config.bias_s, entry.name)) {
    report::Report::note(error->text());
    return std::nullopt;
  }
  return std::move(*recording);
}

std::optional<Cycle> cycle_of(const RecordingEntry& entry, const replay::Recording& recording) {
  Cycle cycle;
  cycle.name = entry.name.substr(entry.set.size() + 1);
  cycle.step_s = recording.median_step_s;
  identification::RecordedPalpation tracker(kTrace, 1.0 / recording.median_step_s);
  identification::PalpationSample sample;
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    if (tracker.update(sample_of(recording, i), sample)) cycle.samples.push_back(sample);
  }
  const auto surface = identification::surface_from_first_loading(cycle.samples);
  if (!surface) return std::nullopt;
  double deepest_mm = 0.0;
  for (identification::PalpationSample& s : cycle.samples) {
    s.displacement_mm -= surface->surface_mm;
    deepest_mm = std::max(deepest_mm, s.displacement_mm);
  }
  const auto peak = std::find_if(
      cycle.samples.begin(), cycle.samples.end(),
      [&](const identification::PalpationSample& s) { return s.displacement_mm > deepest_mm - 0.02; });
  cycle.loaded = static_cast<std::size_t>(peak - cycle.samples.begin()) + 1;
  return cycle;
}

Cycle loading_of(Cycle cycle) {
  cycle.samples.resize(std::min(cycle.samples.size(), cycle.loaded));
  return cycle;
}

// --- laws, fitted to several cycles at once ---

/// Spot of a cycle: each was made on a different one.
struct Spot {
  double offset_mm = 0.0;  ///< the surface lies so far before where the first loading says
  double scale = 1.0;      ///< force on this spot over that of the law
};

/// A law as a function: the force at every sample of a cycle.
using Prediction = std::function<std::vector<double>(const Cycle&, const Spot&)>;

Palpation on_spot(const Cycle& cycle, const Spot& spot) {
  Palpation samples = cycle.samples;
  for (identification::PalpationSample& s : samples) {
    s.displacement_mm += spot.offset_mm;
    s.normal_force_n /= spot.scale;
  }
  return samples;
}

std::optional<Prediction> fit_hunt_crossley(const std::vector<const Cycle*>& cycles,
                                            const std::vector<Spot>& spots, bool own_offset) {
  Palpation all;
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    const Palpation samples = on_spot(*cycles[i], spots[i]);
    all.insert(all.end(), samples.begin(), samples.end());
  }
  identification::VariableProjectionOptions options;
  if (own_offset) {
    // One cycle: the search finds its surface as well.
    double deepest_mm = 0.0;
    for (const identification::PalpationSample& s : all) deepest_mm = std::max(deepest_mm, s.displacement_mm);
    options.min_offset_mm = -0.1 * deepest_mm;
    options.max_offset_mm = 0.1 * deepest_mm;
  }
  const auto estimate = identification::fit_by_variable_projection(all, options);
  if (!estimate) return std::nullopt;
  return [law = estimate->parameters, offset = estimate->contact_offset_mm](const Cycle& cycle,
                                                                            const Spot& spot) {
    std::vector<double> force_n;
    for (const identification::PalpationSample& s : cycle.samples) {
      force_n.push_back(spot.scale * rt::hunt_crossley_force_n(
                                         law, s.displacement_mm + offset + spot.offset_mm, s.rate_mm_per_s));
    }
    return force_n;
  };
}

std::optional<Prediction> fit_creep(const std::vector<const Cycle*>& cycles, const std::vector<Spot>& spots,
                                    bool) {
  identification::CreepFit fit(identification::creep_times_s(cycles.front()->step_s), 1);
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    fit.rest();
    for (const identification::PalpationSample& s : on_spot(*cycles[i], spots[i]))
      fit.add(s, cycles[i]->step_s);
  }
  identification::CreepFit::Options options;
  options.fewest_samples = 30;
  options.with_errors = false;
  options.for_force = true;
  const auto estimate = fit.solve(options);
  if (!estimate) return std::nullopt;
  return [law = estimate->law.parameters](const Cycle& cycle, const Spot& spot) {
    std::vector<double> force_n;
    identification::CreepForce inverse(law);
    for (const identification::PalpationSample& s : cycle.samples) {
      force_n.push_back(spot.scale * inverse.update(s.displacement_mm + spot.offset_mm, cycle.step_s));
    }
    return force_n;
  };
}

struct Squares {
  double left = 0.0, whole = 0.0;
  double residual() const { return std::sqrt(left / whole); }
};
Squares squares_of(const Cycle& cycle, const std::vector<double>& force_n) {
  Squares squares;
  for (std::size_t i = 0; i < cycle.samples.size(); ++i) {
    squares.left += std::pow(force_n[i] - cycle.samples[i].normal_force_n, 2);
    squares.whole += std::pow(cycle.samples[i].normal_force_n, 2);
  }
  return squares;
}

enum class Own : unsigned char { kNothing, kOffset, kOffsetAndScale };

/// The spot under which a law fits a cycle best, by pattern search.
Spot spot_of(const Prediction& law, const Cycle& cycle, Own own, Spot spot = {}) {
  if (own == Own::kNothing) return {};
  const auto error = [&](const Spot& s) { return squares_of(cycle, law(cycle, s)).left; };
  double least = error(spot);
  double offset_step = 0.2;
  double scale_step = own == Own::kOffsetAndScale ? 0.08 : 0.0;
  while (offset_step > 0.004) {
    bool better = false;
    for (const auto& [du, ds] :
         {std::pair{1.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}, {1.0, -1.0}, {-1.0, 1.0}}) {
      if (ds != 0.0 && scale_step == 0.0) continue;
      const Spot trial{std::clamp(spot.offset_mm + du * offset_step, -1.5, 1.5),
                       std::clamp(spot.scale + ds * scale_step, 0.5, 2.0)};
      const double at = error(trial);
      if (at < least) {
        least = at;
        spot = trial;
        better = true;
      }
    }
    if (better) continue;
    offset_step *= 0.5;
    scale_step *= 0.5;
  }
  return spot;
}

using Fit = std::optional<Prediction> (*)(const std::vector<const Cycle*>&, const std::vector<Spot>&, bool);

/// A law for several cycles, the spot of each found with it; on average they are those of the first loading.
std::optional<Prediction> fit_jointly(Fit fit, const std::vector<const Cycle*>& cycles, Own own) {
  std::vector<Spot> spots(cycles.size());
  std::optional<Prediction> law = fit(cycles, spots, false);
  for (int round = 0; law && own != Own::kNothing && round < 5; ++round) {
    Spot mean{0.0, 0.0};
    for (std::size_t i = 0; i < cycles.size(); ++i) {
      spots[i] = spot_of(*law, *cycles[i], own, spots[i]);
      mean.offset_mm += spots[i].offset_mm / static_cast<double>(cycles.size());
      mean.scale += spots[i].scale / static_cast<double>(cycles.size());
    }
    for (Spot& spot : spots) spot = {spot.offset_mm - mean.offset_mm, spot.scale / mean.scale};
    law = fit(cycles, spots, false);
  }
  return law;
}

// --- the sets ---

struct Law {
  const char* name;
  Fit fit;
};
constexpr std::array kLaws{Law{"hunt_crossley", fit_hunt_crossley}, Law{"creep", fit_creep}};

struct Split {
  const char* name;
  bool across;
  Own own;
};
constexpr std::array kSplits{Split{"within", false, Own::kNothing}, Split{"across", true, Own::kOffset},
                             Split{"across_blind", true, Own::kNothing},
                             Split{"across_spot", true, Own::kOffsetAndScale}};

struct Set {
  std::string name;
  double goal_hunt_crossley, goal_creep;
  std::optional<double> reference;
  std::string source;
};

void study_set(StudyContext& context, const Set& set, const std::vector<Cycle>& cycles,
               report::MarkdownTable& table) {
  std::vector<report::PlotSeries> lines;
  const std::size_t shown = cycles.size() / 2;
  for (const Law& law : kLaws) {
    for (const Split& split : kSplits) {
      Squares pooled;
      std::vector<double> by_file;
      for (std::size_t k = 0; k < cycles.size(); ++k) {
        std::vector<const Cycle*> training;
        for (std::size_t j = 0; j < cycles.size(); ++j) {
          if ((j == k) != split.across) training.push_back(&cycles[j]);
        }
        const auto found = split.across ? fit_jointly(law.fit, training, split.own)
                                        : law.fit(training, std::vector<Spot>(1), true);
        if (!found) continue;
        const Spot spot = spot_of(*found, cycles[k], split.own);
        const std::vector<double> force_n = (*found)(cycles[k], spot);
        const Squares squares = squares_of(cycles[k], force_n);
        pooled.left += squares.left;
        pooled.whole += squares.whole;
        by_file.push_back(squares.residual());
        if (k == shown && (split.name == std::string("across"))) {
          report::PlotSeries line{law.name == std::string("creep") ? "creep law" : "Hunt-Crossley", {}, {}};
          for (std::size_t i = 0; i < force_n.size(); ++i) {
            line.add(cycles[k].samples[i].displacement_mm, force_n[i]);
          }
          lines.push_back(std::move(line));
        }
      }
      report::Figure figure{"recording_residual",
                            {{"set", set.name}, {"law", law.name}, {"split", split.name}}};
      figure.goal = law.name == std::string("creep") ? set.goal_creep : set.goal_hunt_crossley;
      figure.reference = set.reference;
      figure.source = set.source;
      if (by_file.size() == cycles.size()) {
        figure.value = pooled.residual();
      } else {
        figure.failed = "a fit failed";
      }
      context.report.add(figure);
      std::string files;
      for (const double r : by_file) files += (files.empty() ? "" : " ") + fixed(100.0 * r, 1);
      table.add_row({set.name, law.name, split.name,
                     figure.value ? fixed(100.0 * *figure.value, 1) : report::kNoNumber,
                     fixed(100.0 * *figure.goal, 0), files});
    }
  }
  report::Plot plot;
  plot.title = set.name + ", " + cycles[shown].name + ": laws fitted to the other files";
  plot.x = {"displacement", "mm"};
  plot.y = {"force", "N"};
  plot.y.minimum = 0.0;
  report::PlotSeries measured{"measured"};
  for (const identification::PalpationSample& s : cycles[shown].samples) {
    measured.add(s.displacement_mm, s.normal_force_n);
  }
  plot.series.push_back(std::move(measured));
  for (report::PlotSeries& line : lines) plot.series.push_back(std::move(line));
  context.report.add_plot("recording_fit_" + set.name, plot);
}

/// What the service itself makes of each file.
void add_identification(const RecordingEntry& entry, const replay::Recording& recording,
                        report::MarkdownTable& table) {
  identification::ContactIdentification identification(identification::ContactTask{}, rig_of(recording));
  rt::Observation observation;
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    observation.sample = sample_of(recording, i);
    identification.add(observation);
  }
  const auto model = identification.finish();
  if (!model) {
    table.add_row({entry.name, "", "", "", "", "", "", model.error().text()});
    return;
  }
  const auto shown = [&](const std::string& name, double factor = 1.0) {
    for (const rt::EstimatedParameter& p : model->parameters) {
      if (p.name == name)
        return significant(factor * p.value) + " ± " + significant(factor * p.standard_error, 2);
    }
    return std::string(report::kNoNumber);
  };
  const auto& contact = std::get<rt::ContactModel>(model->content);
  table.add_row({entry.name, shown("contact_point_mm"), shown("stiffness_n_per_mm_m"), shown("exponent"),
                 fixed(100.0 * model->residual, 1), shown("weight_0"),
                 contact.creep ? fixed(100.0 * contact.creep->relative_error, 1) : report::kNoNumber,
                 model->converged ? "converged" : "kept"});
}

// --- nano-indentation ---

void study_approach(StudyContext& context, const std::filesystem::path& folder) {
  const std::string set = "nanoindentation";
  report::Figure alarms{"recording_false_alarms", {{"set", set}}};
  alarms.goal = 0.0;
  alarms.source = "in the free approach of about 10 s";
  report::Figure detection{"recording_detection_samples", {{"set", set}}};
  detection.source = "from the fitted contact point to the declaration, at 1 kHz";
  const auto entries = recordings_of(folder, set);
  const auto recording = entries.empty() ? std::nullopt : load(entries.front());
  if (!recording) {
    alarms.failed = detection.failed = "no recording";
    context.report.add(alarms);
    context.report.add(detection);
    return;
  }
  constexpr double kThresholdN = 0.015;
  identification::ApproachDetector detector(kThresholdN);
  std::vector<identification::ApproachSample> approach;
  std::vector<std::size_t> declared;
  std::size_t peak = 0;
  for (std::size_t i = 0; i < recording->time_s.size(); ++i) {
    approach.push_back({recording->time_s[i], recording->depth_mm[i], recording->force_n[i]});
    if (detector.update(approach.back())) declared.push_back(i);
    if (approach[i].force_n > approach[peak].force_n) peak = i;
  }
  // The contact that leads to the peak is the true one; what was declared before it began is a false alarm.
  std::size_t true_one = 0;
  for (std::size_t i = 0; i < declared.size(); ++i) {
    if (declared[i] <= peak) true_one = i;
  }
  const auto point =
      declared.empty() ? std::nullopt : identification::find_contact_point(approach, declared[true_one]);
  report::MarkdownTable table({"recording", "false alarms", "declared at [s]", "at [mN]", "noise [mN]",
                               "contact point [µm]", "± [µm]", "of it: law unknown [µm]",
                               "samples to declaration"});
  if (point) {
    alarms.value = static_cast<double>(true_one);
    detection.value = static_cast<double>(declared[true_one]) - static_cast<double>(point->sample);
    const identification::ApproachSample& at = approach[declared[true_one]];
    table.add_row({entries.front().name, std::to_string(true_one), fixed(at.time_s, 3),
                   fixed(1e3 * at.force_n, 1), fixed(1e3 * detector.noise_n(), 1), fixed(point->depth_mm, 3),
                   fixed(point->standard_error_mm, 3), fixed(point->model_error_mm, 3),
                   fixed(*detection.value, 0)});
  } else {
    alarms.failed = detection.failed = "no contact was found";
  }
  context.report.add(alarms);
  context.report.add(detection);
  context.report.add_table(
      "recording_approach", "Contact in a nano-indentation", table,
      "Shown as 0.1 µN = 1 N and 1 µm = 1 mm; threshold " + fixed(1e3 * kThresholdN, 0) +
          " mN (1.5 nN) above a baseline that follows drifts slower than 2 s.\nThe contact point is "
          "that of f = f0 + K (x - xc)^1.5; its uncertainty includes that of the power (1 to 2).");
}

}  // namespace

void run_identify_contact_recordings(StudyContext& context) {
  const auto folder = recordings_folder();
  const std::vector<Set> sets{{"silicone_indentation", 0.10, 0.05, 0.10,
                               "cycles with unloading; others' least squares: 9-11 % per file"},
                              {"silicone_loading", 0.03, 0.03, 0.03, "loading alone; others' power law: 3 %"},
                              {"meat_loading", 0.06, 0.06, std::nullopt, "loading alone"}};
  if (!folder) {
    const std::string why = no_recordings_reason();
    report::Report::note(why);
    for (const Set& set : sets) {
      for (const Law& law : kLaws) {
        for (const Split& split : kSplits) {
          context.report.add({.figure = "recording_residual",
                              .conditions = {{"set", set.name}, {"law", law.name}, {"split", split.name}},
                              .failed = why});
        }
      }
    }
    for (const char* figure : {"recording_false_alarms", "recording_detection_samples"}) {
      context.report.add({.figure = figure, .conditions = {{"set", "nanoindentation"}}, .failed = why});
    }
    return;
  }
  report::MarkdownTable table({"set", "law", "split", "residual %", "goal %", "by file %"});
  report::MarkdownTable models({"recording", "contact point [mm]", "K [N/mm^m]", "m", "residual %", "at once",
                                "creep error %", "remark"});
  std::vector<Cycle> silicone, silicone_loading, meat_loading;
  for (const std::string set : {"silicone_indentation", "meat_indentation"}) {
    for (const RecordingEntry& entry : recordings_of(*folder, set)) {
      const auto recording = load(entry);
      if (!recording) continue;
      add_identification(entry, *recording, models);
      const auto cycle = cycle_of(entry, *recording);
      if (!cycle) continue;
      if (set == "silicone_indentation") {
        silicone.push_back(*cycle);
        silicone_loading.push_back(loading_of(*cycle));
      } else {
        meat_loading.push_back(loading_of(*cycle));
      }
    }
  }
  const std::vector<const std::vector<Cycle>*> cycles{&silicone, &silicone_loading, &meat_loading};
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (cycles[i]->size() > 2) study_set(context, sets[i], *cycles[i], table);
  }
  context.report.add_table("recording_residuals", "Contact laws across real recordings", table,
                           "Residual: rms of what is left of the force over rms force, all files together. "
                           "within: fitted to the file it is "
                           "judged on.\nacross: fitted to the other files; each file was made on a spot of "
                           "its own, and one number of the judged "
                           "file, where its\nsurface lies, is fitted to it. across_blind: not even that, the "
                           "surface is where the first loading points. "
                           "across_spot: the\nstiffness of the spot is fitted to it, too.");
  context.report.add_table(
      "recording_models", "What an identification says of each recording", models,
      "As identify contact --recording would: Hunt-Crossley by variable projection with the contact "
      "point, and the creep law.");
  study_approach(context, *folder);
}

}  // namespace hapticd::study
