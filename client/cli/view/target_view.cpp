#include "client/cli/view/target_view.h"

#include <fmt/core.h>

namespace hapticd::cli {
namespace {

std::string knot_words(const v1::StiffnessProfile& profile) {
  std::string text;
  for (const v1::StiffnessProfile::Knot& knot : profile.knots()) {
    text += fmt::format("{}{:g}:{:g}", text.empty() ? "" : ",", knot.at_mm(), knot.stiffness_n_per_mm());
  }
  return text + " (mm:N/mm)";
}

std::string axis_words(const v1::StiffnessProfile& profile) {
  const v1::Vector3& axis = profile.axis();
  if (!profile.has_axis() || (axis.x() > 0.0 && axis.y() == 0.0 && axis.z() == 0.0)) return "x";
  if (axis.x() == 0.0 && axis.y() > 0.0 && axis.z() == 0.0) return "y";
  if (axis.x() == 0.0 && axis.y() == 0.0 && axis.z() > 0.0) return "z";
  return fmt::format("{:.3g},{:.3g},{:.3g}", axis.x(), axis.y(), axis.z());
}

}  // namespace

std::string target_words(const v1::TargetLaw& law) {
  switch (law.kind_case()) {
    case v1::TargetLaw::kLinearNPerMm:
      return fmt::format("linear, {:g} N/mm", law.linear_n_per_mm());
    case v1::TargetLaw::kHuntCrossley: {
      const v1::HuntCrossleyLaw& power = law.hunt_crossley();
      return fmt::format("Hunt-Crossley, K {:g}, B {:g}, M {:g}", power.stiffness_n_per_mm_m(),
                         power.damping_n_s_per_mm_m1(), power.exponent());
    }
    case v1::TargetLaw::kDisplacementProfile:
      return "profile by displacement, " + knot_words(law.displacement_profile());
    case v1::TargetLaw::kPositionProfile:
      return fmt::format("profile by position along {}, {}", axis_words(law.position_profile()),
                         knot_words(law.position_profile()));
    case v1::TargetLaw::KIND_NOT_SET:
      break;
  }
  return "unknown";
}

}  // namespace hapticd::cli
