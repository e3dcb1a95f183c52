#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"
#include "server/identification/session/fixed_text.h"
#include "server/identification/session/inclusion/inclusion_identification.h"

namespace hapticd::identification {

namespace {

constexpr double kNearMm = 8.0;       // a press that is straight over it
constexpr double kFarShare = 0.6;     // of its depth: a press that is off to the side
constexpr double kMinSpreadMm = 4.0;  // rms, of the presses of a scan

double across_mm(const hal::Vector3& a, const hal::Vector3& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

}  // namespace

std::optional<hal::Error> InclusionIdentification::too_little() const {
  const std::vector<Press>& presses = collector_.presses();
  if (presses.size() < min_presses()) {
    if (!collector_.seen_free() && collector_.watched_s() > 0.0) {
      return refusal("the force never fell to zero, so that no press begins", "",
                     "below " + fixed_text(0.5 * task_.threshold_n, 3) + " N between the presses",
                     "bias the sensor with the tool free, check the columns of the force, and record again");
    }
    return refusal("too few presses", std::to_string(presses.size()),
                   "at least " + std::to_string(min_presses()) + ", 2 mm deep and with 0.1 N or more",
                   "press more often, and let go in between");
  }
  hal::Vector3 mean;
  for (const Press& p : presses) mean = mean + p.surface_mm * (1.0 / static_cast<double>(presses.size()));
  double squared = 0.0;
  for (const Press& p : presses) squared += std::pow(across_mm(p.surface_mm, mean), 2);
  const double spread_mm = std::sqrt(squared / static_cast<double>(presses.size()));
  if (!scans()) {
    if (spread_mm < kMinSpreadMm) return std::nullopt;
    return refusal("the depth is stated, but the presses are not straight over one place",
                   "spread over " + fixed_text(spread_mm, 1) + " mm (rms)",
                   "less than " + fixed_text(kMinSpreadMm, 0) + " mm",
                   "press over the inclusion only, or leave the depth to the scan");
  }
  if (spread_mm >= kMinSpreadMm) return std::nullopt;
  return refusal("all presses are at one place, which does not show where the inclusion is",
                 "spread over " + fixed_text(spread_mm, 1) + " mm (rms)",
                 "at least " + fixed_text(kMinSpreadMm, 0) + " mm",
                 "spread them over the surface, or state the depth where it is known (known_depth_mm, "
                 "hapticctl: --known-depth)");
}

/// Lists what no press has shown, with the place as it is known now.
std::vector<std::string> InclusionIdentification::unseen(const InclusionFit& fit) const {
  std::vector<std::string> words;
  if (!scans()) return words;
  const hal::Vector3& over = fit.inclusion.surface_mm;
  const double far_mm = kFarShare * fit.depth_mm.value;
  bool near = false;
  std::size_t far = 0;
  bool sides[4] = {};
  for (const Press& p : collector_.presses()) {
    const double distance_mm = across_mm(p.surface_mm, over);
    near = near || distance_mm < kNearMm;
    if (distance_mm > far_mm) ++far;
    if (distance_mm < 0.25 * kNearMm) continue;
    sides[(p.surface_mm.x > over.x ? 1 : 0) + (p.surface_mm.y > over.y ? 2 : 0)] = true;
  }
  const std::string place = formatted("x = %.0f mm, y = %.0f mm", over.x, over.y);
  if (!near) words.push_back("press closer to where it seems to be: " + place);
  if (std::count(std::begin(sides), std::end(sides), true) < 4) {
    words.push_back("press on all sides of where it seems to be: " + place);
  }
  if (far < 4 && !task_.reference.is_there()) {
    words.push_back(
        formatted("press farther than %.0f mm from it, where the object is as without it", far_mm));
  }
  return words;
}

std::vector<std::string> InclusionIdentification::missing(bool is_certain, bool is_steady) const {
  std::vector<std::string> words;
  if (!replay_ && open_place_mm()) words.push_back(next_request().words);
  if (failed_) words.push_back(failed_->what + (failed_->remedy.empty() ? "" : ": " + failed_->remedy));
  if (replay_ && !fit_ && !failed_) {
    if (auto error = too_little()) words.push_back(error->what + ": " + error->remedy);
  }
  if (!fit_) return words;
  for (const std::string& what : unseen(*fit_)) words.push_back(what);
  if (!is_certain && !shows_inclusion(*fit_)) {
    words.push_back("no inclusion is seen so far: press deeper, and closer to where the object feels hard");
  } else if (!is_certain && !(fit_->residual < kMaxResidual)) {
    words.push_back(formatted("an inclusion is hardly seen: %.0f %% of what it adds is left over",
                              100.0 * std::min(9.99, fit_->residual)));
  } else if (!is_certain && words.empty()) {
    words.push_back("press more often around it: place and depth are not known well enough yet");
  }
  if (is_certain && !is_steady) words.push_back("go on pressing: the place still moves");
  return words;
}

std::vector<rt::EstimatedParameter> InclusionIdentification::parameters_of(const InclusionFit& fit) const {
  std::vector<rt::EstimatedParameter> list;
  const auto add = [&](const char* name, const char* unit, const Estimated& e) {
    list.push_back({name, unit, e.value, std::isfinite(e.standard_error) ? e.standard_error : HUGE_VAL});
  };
  if (scans()) {
    add("place_x_mm", "mm", fit.place_x_mm);
    add("place_y_mm", "mm", fit.place_y_mm);
    add("depth_mm", "mm", fit.depth_mm);
  }
  add("added_force_at_5mm_n", "N", fit.added_at_5mm_n);
  add("stiffness_n_per_mm_m", "N/mm^m", fit.stiffness_n_per_mm_m);
  add("damping_n_s_per_mm_m1", "N·s/mm^(m+1)", fit.damping_n_s_per_mm_m1);
  add("exponent", "1", fit.exponent);
  if (scans()) {
    add("attenuation", "1", fit.attenuation);
    add("approach", "1", fit.approach);
  }
  return list;
}

std::vector<std::string> InclusionIdentification::remarks() const {
  std::vector<std::string> words = collector_.remarks();
  words.push_back(std::to_string(collector_.presses().size()) + " presses");
  if (scans() && tip_radius_mm_.standard_error > 0.0) {
    words.push_back(
        formatted("the radius of the ball that presses is not known: %.0f ± %.0f mm is taken; state it "
                  "(tip_radius_mm, hapticctl: --tip-radius)",
                  tip_radius_mm_.value, tip_radius_mm_.standard_error));
  }
  if (task_.reference.is_there())
    words.push_back("the object without the inclusion: " + task_.reference.words);
  return words;
}

std::string InclusionIdentification::procedure(const InclusionFit& fit) const {
  std::string text = std::to_string(collector_.presses().size()) + " presses ";
  text += scans() ? "spread over the object"
                  : "straight over it; its depth of " + fixed_text(task_.known_depth_mm, 1) +
                        " mm is taken as known";
  text += task_.reference.is_there() ? "; without the inclusion: " + task_.reference.words
                                     : "; without the inclusion: the presses far from it";
  if (scans()) {
    text += tip_radius_mm_.standard_error > 0.0
                ? "; the radius of the ball is not known"
                : "; the radius of the ball is " + fixed_text(tip_radius_mm_.value, 1) + " mm";
  }
  text += "; the object itself " + fixed_text(fit.own_at_5mm_n, 3) + " N at 5 mm";
  for (const std::string& remark : collector_.remarks()) text += "; " + remark;
  return text;
}

}  // namespace hapticd::identification
