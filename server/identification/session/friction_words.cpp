#include <algorithm>
#include <cmath>

#include "server/identification/session/friction_identification.h"
#include "server/identification/session/friction_plan.h"

namespace hapticd::identification {

namespace {

const char* words_of(NormalSource source) {
  switch (source) {
    case NormalSource::kScan:
      return "normals from a scan of the surface";
    case NormalSource::kMeanDirection:
      return "normals from the mean direction of the reaction back and forth";
    case NormalSource::kFlat:
      break;
  }
  return "normals taken as straight up";
}

}  // namespace

const char* words_of(FrictionForm form) {
  switch (form) {
    case FrictionForm::kMaxwellSlip:
      return "; Maxwell-slip elements: held-out strokes ask for them";
    case FrictionForm::kDahlExponent:
      return "; exponent found: held-out strokes ask for it";
    case FrictionForm::kDahl:
      break;
  }
  return "; exponent 1: held-out strokes ask for no other";
}

std::vector<rt::EstimatedParameter> FrictionIdentification::parameters_of(const Fit& fit) const {
  const rt::FrictionParameters& p = fit.law.parameters;
  const rt::FrictionParameters& e = fit.law.error;
  std::vector<rt::EstimatedParameter> list{{"kinetic", "1", p.kinetic, e.kinetic}};
  if (task_.tip == rt::Tip::kRod) {
    list.push_back({"presliding_mm", "mm", p.presliding_mm, e.presliding_mm});
    if (fit.options.exponent) list.push_back({"exponent", "1", p.exponent, e.exponent});
    if (p.maxwell_slip) {
      const auto& reaches = p.maxwell_slip->reach_mm;
      const auto elements = std::count_if(reaches.begin(), reaches.end(), [](double mm) { return mm > 0.0; });
      list.push_back({"maxwell_slip_elements", "1", static_cast<double>(elements), 0.0});
    }
  }
  list.push_back({"viscous_n_s_per_mm", "N·s/mm", p.viscous_n_s_per_mm, e.viscous_n_s_per_mm});
  if (replay_) list.push_back({"force_bias_n", "N", fit.law.bias_n, fit.law.bias_error_n});
  const double normal_n = fit.nominal_normal ? kNominalNormalN : task_.normal_force_n;
  if (replay_ && normal_n > 0.0) {
    list.push_back({"coulomb_force_n", "N", p.kinetic * normal_n, e.kinetic * normal_n});
  }
  return list;
}

std::vector<std::string> FrictionIdentification::missing(bool steady, bool is_certain) const {
  std::vector<std::string> words;
  if (!replay_) {
    if (!scanned()) {
      words.push_back(next_request().words);
    } else {
      for (int row = 0; row < kForceBins; ++row) {
        if (!asks_for_row(row)) continue;
        double lacks_mm_per_s = 0.0;
        for (int column = kSpeedBins - 1; column >= 0 && lacks_mm_per_s == 0.0; --column) {
          if (counts_[static_cast<std::size_t>(row * kSpeedBins + column)] < kEnoughPerCell) {
            lacks_mm_per_s = (column + 0.8) * kMaxSpeedMmPerS / kSpeedBins;
          }
        }
        if (lacks_mm_per_s == 0.0) continue;
        words.push_back("stroke with about " + in_newton(kStrokeForceN[row]) + " at up to " +
                        std::to_string(std::lround(lacks_mm_per_s)) + " mm/s");
      }
    }
  }
  if (failed_) words.push_back(failed_->what + (failed_->remedy.empty() ? "" : ": " + failed_->remedy));
  if (fitted_ && !is_certain) words.push_back("turn more often: friction is not known well enough yet");
  if (fitted_ && is_certain && !steady) words.push_back("go on stroking: the parameters still change");
  return words;
}

std::vector<std::string> FrictionIdentification::remarks(const Fit* fit) const {
  std::vector<std::string> words = gate_.remarks();
  if (passages_.given_up() > 0) {
    words.push_back(std::to_string(passages_.given_up()) +
                    " passages of a sort of which there are many were given up to bound memory");
  }
  if (!asks_for_row(kForceBins - 1)) {
    words.push_back("the tip stuck or the sensor was at its end under hard strokes: none of more than " +
                    in_newton(std::max(effort_.limit_n(), kStrokeForceN[0])) + " are asked for");
  }
  if (!sees_tip_ && task_.tip == rt::Tip::kRod) {
    const double unseen_mm = unseen_turn_mm(rig_.device);
    words.push_back(unseen_mm > 0.0
                        ? "at each turn the tip slides " + std::to_string(unseen_mm) +
                              " mm unseen, by the device's dry friction and structural stiffness"
                        : "the device's dry friction or structural stiffness is not known: presliding may be "
                          "found too short");
  }
  if (fit == nullptr) return words;
  words.push_back(words_of(fit->source));
  if (fit->source == NormalSource::kScan) {
    words.back() += ", known to " + std::to_string(fit->normal_error_rad) + " rad";
    if (fit->rows.share_by_scan < 0.995) {
      words.push_back(std::to_string(std::lround(100.0 * (1.0 - fit->rows.share_by_scan))) +
                      " % of the strokes lay outside of the scan");
    }
  }
  if (fit->nominal_normal) {
    words.push_back(
        "no normal force was recorded: coulomb_force_n is what was found, coefficients refer to a "
        "nominal " +
        in_newton(kNominalNormalN));
  }
  if (!fit->law.divided && task_.tip == rt::Tip::kRod) {
    words.push_back("no stroke slid farther than 3 mm: sliding and presliding were fitted together");
  }
  if (!fit->law.viscous_is_identified)
    words.push_back("the speed varied too little to determine the viscous part: taken as 0");
  return words;
}

}  // namespace hapticd::identification
