#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/contact/contact_surface.h"
#include "server/identification/estimate/contact/contact_variable_projection.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/identify/recordings/recorded_contact.h"
#include "tests/measure/study/rig/recording_analysis.h"

namespace hapticd::study {

namespace {

using report::fixed;

/// One cycle on one spot.
struct Cycle {
  Palpation samples;  ///< displacement from where the first loading says the surface is
  double step_s = 0.1;
};

/// `loading`: up to the deepest only.
std::optional<Cycle> cycle_of(const replay::Recording& recording, bool loading) {
  Cycle cycle{palpation_of(recording), recording.median_step_s};
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
  if (loading) cycle.samples.erase(peak + 1, cycle.samples.end());
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
                                            const std::vector<Spot>& spots) {
  Palpation all;
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    const Palpation samples = on_spot(*cycles[i], spots[i]);
    all.insert(all.end(), samples.begin(), samples.end());
  }
  const auto estimate = identification::fit_by_variable_projection(all);
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

std::optional<Prediction> fit_creep(const std::vector<const Cycle*>& cycles, const std::vector<Spot>& spots) {
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
    std::vector<double> force_n = creep_force_n(law, cycle.samples, cycle.step_s, -spot.offset_mm);
    for (double& force : force_n) force *= spot.scale;
    return force_n;
  };
}

enum class Own : unsigned char { kNothing, kOffset, kOffsetAndScale };

/// The spot under which a law fits a cycle best, by pattern search.
Spot spot_of(const Prediction& law, const Cycle& cycle, Own own, Spot spot = {}) {
  if (own == Own::kNothing) return {};
  const auto error = [&](const Spot& s) {
    Squares squares;
    squares.add(cycle.samples, law(cycle, s));
    return squares.left;
  };
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

using Fit = std::optional<Prediction> (*)(const std::vector<const Cycle*>&, const std::vector<Spot>&);

/// A law for several cycles, the spot of each found with it; on average they are those of the first loading.
std::optional<Prediction> fit_jointly(Fit fit, const std::vector<const Cycle*>& cycles, Own own) {
  std::vector<Spot> spots(cycles.size());
  std::optional<Prediction> law = fit(cycles, spots);
  for (int round = 0; law && own != Own::kNothing && round < 5; ++round) {
    Spot mean{0.0, 0.0};
    for (std::size_t i = 0; i < cycles.size(); ++i) {
      spots[i] = spot_of(*law, *cycles[i], own, spots[i]);
      mean.offset_mm += spots[i].offset_mm / static_cast<double>(cycles.size());
      mean.scale += spots[i].scale / static_cast<double>(cycles.size());
    }
    for (Spot& spot : spots) spot = {spot.offset_mm - mean.offset_mm, spot.scale / mean.scale};
    law = fit(cycles, spots);
  }
  return law;
}

// --- the sets ---

struct Split {
  const char* name;
  Own own;
};
constexpr std::array kSplits{Split{"across", Own::kOffset}, Split{"across_blind", Own::kNothing},
                             Split{"across_spot", Own::kOffsetAndScale}};

void study_set(StudyContext& context, const std::string& set, const std::vector<Cycle>& cycles,
               report::MarkdownTable& table) {
  for (const auto& [law, fit] : {std::pair{"hunt_crossley", &fit_hunt_crossley}, {"creep", &fit_creep}}) {
    for (const Split& split : kSplits) {
      Squares pooled;
      std::string files, failed;
      for (std::size_t k = 0; k < cycles.size(); ++k) {
        std::vector<const Cycle*> training;
        for (std::size_t j = 0; j < cycles.size(); ++j) {
          if (j != k) training.push_back(&cycles[j]);
        }
        const auto found = fit_jointly(fit, training, split.own);
        if (!found) {
          failed = "a fit failed";
          continue;
        }
        Squares squares;
        squares.add(cycles[k].samples, (*found)(cycles[k], spot_of(*found, cycles[k], split.own)));
        pooled.left += squares.left;
        pooled.whole += squares.whole;
        files += (files.empty() ? "" : " ") + fixed(100.0 * squares.residual(), 1);
      }
      report::Figure figure{"recording_residual", {{"set", set}, {"law", law}, {"split", split.name}}};
      figure.value = pooled.residual();
      figure.failed = failed;
      context.report.add(figure);
      table.add_row({set, law, split.name, failed.empty() ? fixed(100.0 * *figure.value, 1) : failed, files});
    }
  }
}

/// Contacts that the scene declares in the free approach of a nano-indentation, about 10 s.
void study_approach(StudyContext& context, const std::filesystem::path& folder) {
  report::Figure alarms{"recording_false_alarms", {{"set", "nanoindentation"}}};
  alarms.goal = 0.0;
  alarms.source = "contacts before the one that leads to the peak";
  for (const RecordingEntry& entry : recordings_of(folder, "nanoindentation")) {
    const auto analysis = analyse_recording(entry.config, 0.3);
    if (analysis) alarms.value = analysis->contacts_to_peak - 1;
    if (!analysis) alarms.failed = analysis.error().text();
  }
  context.report.add(alarms);
}

}  // namespace

void run_identify_contact_recordings(StudyContext& context) {
  const auto folder = recordings_folder();
  if (!folder) return report::Report::note(no_recordings_reason());
  report::MarkdownTable table({"set", "law", "split", "residual %", "by file %"});
  const auto cycles_of = [&](const char* set, bool loading) {
    std::vector<Cycle> cycles;
    for (const RecordingEntry& entry : recordings_of(*folder, set)) {
      const auto recording = load(entry);
      if (!recording) continue;
      if (auto cycle = cycle_of(*recording, loading)) cycles.push_back(std::move(*cycle));
    }
    return cycles;
  };
  study_set(context, "silicone_indentation", cycles_of("silicone_indentation", false), table);
  study_set(context, "meat_loading", cycles_of("meat_indentation", true), table);
  context.report.add_table(
      "recording_residuals", "Contact laws across real recordings", table,
      "Residual: rms of what is left of the force over rms force, all files together. "
      "across: fitted to the other files; each file was made on a spot of its own, and one "
      "number of the judged file, where its surface lies, is fitted to it. across_blind: not "
      "even that, the surface is where the first loading points. across_spot: the stiffness "
      "of the spot is fitted to it, too.");
  study_approach(context, *folder);
}

}  // namespace hapticd::study
