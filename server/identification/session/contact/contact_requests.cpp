#include "server/identification/session/contact/contact_requests.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/identification/session/fixed_text.h"

namespace hapticd::identification {

namespace {

constexpr double kHoldS = 0.8;

bool gently_touched(const PalpationNeeds& n) {
  return n.largest_force_n >= 0.15 * n.force_n;
}
bool force_reached(const PalpationNeeds& n) {
  return n.largest_force_n >= 0.9 * n.force_n;
}
bool depth_reached(const PalpationNeeds& n) {
  return n.deepest_mm >= 0.95 * n.displacement_mm;
}
bool held(const PalpationNeeds& n) {
  return !n.hold_wanted || n.held_s >= kHoldS;
}

MotionRequest press(double force_n, double rate_n_per_s, double hold_s, std::string words) {
  MotionRequest request;
  request.motion = MotionRequest::Motion::kPress;
  request.force_n = force_n;
  request.force_rate_n_per_s = std::clamp(rate_n_per_s, 0.05, 100.0);
  request.hold_s = hold_s;
  request.words = std::move(words);
  return request;
}

/// Words without what came of it so far: they stay while the motion is made, the number would be an old one.
std::string lasting(const std::string& words) {
  return words.substr(0, words.find(" ("));
}

}  // namespace

std::vector<std::string> missing_in_words(const PalpationNeeds& n) {
  std::vector<std::string> missing;
  if (!depth_reached(n)) {
    missing.push_back(
        formatted("press deeper than %.3g mm (%.3g mm so far)", n.displacement_mm, n.deepest_mm));
  } else if (!force_reached(n) && !(n.displacement_mm > 0.0)) {
    missing.push_back(
        n.largest_force_n > 0.0
            ? formatted("press harder: up to %.3g N (%.3g N so far)", n.force_n, n.largest_force_n)
            : formatted("press harder: up to %.3g N (no contact seen yet)", n.force_n));
  }
  if (!held(n)) {
    missing.push_back(
        formatted("hold still for a second under %.3g N or more (%.2g s so far)", 0.4 * n.force_n, n.held_s));
  }
  for (const MissingCoverage& cells : n.coverage) missing.push_back(cells.words);
  if (missing.empty() && !n.certain) {
    missing.push_back("press a few times more, harder and softer, faster and slower" +
                      (n.uncertain.empty() ? std::string() : ": " + n.uncertain));
  }
  if (missing.empty() && !n.steady) missing.emplace_back("go on pressing: the estimate still moves");
  return missing;
}

MotionRequest next_palpation(const PalpationNeeds& n) {
  const std::vector<std::string> missing = missing_in_words(n);
  if (missing.empty()) return {};
  const std::string words = lasting(missing.front());
  const double f = n.force_n;
  if (!gently_touched(n)) return press(0.4 * f, 0.6 * f, 0.3, words);
  if (!depth_reached(n)) {
    // The force grows with depth: no more than twice what was allowed for.
    const double force_n =
        n.largest_force_n * std::pow(n.displacement_mm / std::max(1e-3, n.deepest_mm), 1.7);
    return press(std::clamp(1.05 * force_n, 0.4 * f, 2.0 * f), f, 0.3, words);
  }
  const bool force_wanted = !(n.displacement_mm > 0.0) && !force_reached(n);
  if (force_wanted || !held(n)) {
    // A soft object takes its time: slower, longer and a little harder from try to try.
    const double tries = static_cast<double>(std::clamp(n.contacts, 1U, 5U));
    return press(std::min(1.2, 0.97 + 0.03 * tries) * f, f / tries, (n.hold_wanted ? 0.8 : 0.2) + 0.2 * tries,
                 words);
  }
  if (!n.coverage.empty()) {
    const MissingCoverage& cells = n.coverage.front();
    if (cells.need == CoverageNeed::kSlow) return press(0.9 * f, 0.5 * f, 0.2, cells.words);
    if (cells.need == CoverageNeed::kModerate) return press(0.9 * f, 3.0 * f, 0.1, cells.words);
    // A hand falls short of a force it has no time for.
    if (n.contacts % 3 != 1) return press(1.2 * f, 10.0 * f, 0.1, cells.words);
    MotionRequest tap;
    tap.motion = MotionRequest::Motion::kTap;
    tap.speed_mm_per_s = std::min(400.0, 4.0 * n.speed_mm_per_s);
    tap.repetitions = 2;
    tap.words = cells.words;
    return tap;
  }
  struct Variation {
    double force, rate, hold_s;
  };
  static constexpr std::array kVariations{Variation{0.6, 2.0, 0.3}, Variation{1.0, 4.0, 0.2},
                                          Variation{0.8, 0.8, 0.5}, Variation{0.4, 6.0, 0.1}};
  const Variation& v = kVariations[n.contacts % kVariations.size()];
  return press(v.force * f, v.rate * f, v.hold_s, words);
}

}  // namespace hapticd::identification
