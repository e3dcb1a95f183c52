#include <cmath>
#include <string>

#include "server/identification/session/fixed_text.h"
#include "server/identification/session/structural_identification.h"

namespace hapticd::identification {

std::string StructuralIdentification::rigid_object() const {
  return std::string("wood or steel") +
         (rig_.kind == hal::RigKind::kSimulated ? " (hapticctl sim object wood_plate)" : "");
}

std::vector<std::string> StructuralIdentification::missing(const StructuralFit& fit, bool certain,
                                                           bool steady) const {
  std::vector<std::string> missing;
  const bool rigid = task_.rigid_contact;
  const std::size_t done = pressed_enough();
  const std::size_t wanted = wanted_presses();
  if (outside_missing_ > 0 && outside_missing_ == gate_.judged()) {
    missing.push_back("an instrument from outside that says where the tip is (D§4.6.1: an LVDT)");
  }
  if (done != wanted) {
    const std::string next =
        gives_way() ? "the object gives way: press " + rigid_object() : next_request().words;
    missing.push_back(
        std::to_string(wanted - done) + " of " + std::to_string(wanted) +
        (rigid ? " presses with more than " + fixed_text(0.5 * press_force_n_, 1) + " N of the device"
               : " places") +
        (next.empty() ? "" : ": " + next));
  } else if (!certain) {
    missing.push_back("more presses: the stiffness is known to " +
                      fixed_text(100.0 * (task_.constant ? fit.centre_error : fit.worst_error), 2) +
                      " %, wanted " +
                      fixed_text(100.0 * (rigid            ? kEnoughRigidError
                                          : task_.constant ? kEnoughComplianceError
                                                           : kEnoughFieldError),
                                 1) +
                      " %");
  } else if (!steady) {
    missing.push_back("more presses: the last ones still changed the stiffness by more than 1 %");
  }
  return missing;
}

std::vector<std::string> StructuralIdentification::remarks(const StructuralFit& fit) const {
  const bool rigid = task_.rigid_contact;
  std::vector<std::string> remarks = gate_.remarks();
  const auto remark = [&](std::uint64_t count, const char* what) {
    if (count > 0) remarks.push_back(std::to_string(count) + " " + what);
  };
  remark(jumps_, rigid ? "jumps of the encoders by more than 1 mm under force"
                       : "jumps of more than 1 mm between the instruments");
  if (outside_missing_ < gate_.judged())
    remark(outside_missing_, "samples without the instrument from outside");
  remark(fit.left_out, "presses left out that fit four times worse than the others");
  if (fit.good && fit.order < (task_.constant ? 0 : 2)) {
    remarks.push_back(std::string("too few places for a field: ") + (fit.order == 0 ? "constant" : "linear") +
                      " so far");
  }
  if (fit.good && rigid) {
    const RigidBounds bounds = bounds_of(fit.model);
    remarks.push_back("a lower bound: what the object gives way counts as the device's; on one of " +
                      fixed_text(task_.least_object_stiffness_n_per_mm, 0) + " N/mm, as assumed, it is " +
                      (std::isfinite(bounds.upper_n_per_mm) ? fixed_text(bounds.upper_n_per_mm, 3) + " N/mm"
                                                            : "all the object"));
    if (fit.spread > 0.03) {
      remarks.push_back("presses differ by " + fixed_text(100.0 * fit.spread, 1) +
                        " %: is the object fastened, and does the tip stay on one spot?");
    }
  } else if (fit.good && task_.constant && presses_.size() >= 3 && fit.spread > 0.03) {
    remarks.push_back("the stiffness differs by " + fixed_text(100.0 * fit.spread, 1) +
                      " % from place to place: a constant one is wrong by that much, ask for a field");
  }
  return remarks;
}

}  // namespace hapticd::identification
