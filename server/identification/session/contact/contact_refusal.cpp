#include "server/identification/session/contact/contact_refusal.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "server/identification/session/fixed_text.h"

namespace hapticd::identification {

namespace {

constexpr std::uint64_t kMinJudgedSamples = 30;
constexpr const char* kWhere = "identification of contact dynamics";

std::string number(double value, const char* unit) {
  return formatted("%.3g %s", value, unit);
}

}  // namespace

void PalpationExtent::add(double depth_mm, double force_n) noexcept {
  if (samples_ == 0) {
    shallowest_mm_ = deepest_mm_ = depth_mm;
    smallest_n_ = largest_n_ = force_n;
  }
  ++samples_;
  shallowest_mm_ = std::min(shallowest_mm_, depth_mm);
  deepest_mm_ = std::max(deepest_mm_, depth_mm);
  smallest_n_ = std::min(smallest_n_, force_n);
  largest_n_ = std::max(largest_n_, force_n);
  const double n = static_cast<double>(samples_);
  const double dx = depth_mm - mean_mm_;
  const double df = force_n - mean_n_;
  mean_mm_ += dx / n;
  mean_n_ += df / n;
  sxx_ += dx * (depth_mm - mean_mm_);
  sxf_ += dx * (force_n - mean_n_);
  sff_ += df * (force_n - mean_n_);
}

double PalpationExtent::correlation() const noexcept {
  const double scale = std::sqrt(sxx_ * sff_);
  return scale > 0.0 ? sxf_ / scale : 0.0;
}

std::optional<hal::Error> palpation_refusal(const PalpationExtent& extent, const SampleGate& gate,
                                            double threshold_n, bool recorded) {
  const auto refuse = [](std::string what, std::string value, std::string limit, std::string remedy) {
    return hal::Error{std::move(what), kWhere, std::move(value), std::move(limit), std::move(remedy)};
  };
  if (extent.samples() < kMinJudgedSamples) {
    std::string why = "give it more of them";
    if (gate.judged() >= kMinJudgedSamples) {
      why = "fix the data first: ";
      for (const std::string& remark : gate.remarks()) why += remark + "; ";
      why.resize(why.size() - 2);
    }
    return refuse("too few usable samples", std::to_string(extent.samples()),
                  "at least " + std::to_string(kMinJudgedSamples), why);
  }
  const double largest_n = std::max(extent.largest_force_n(), -extent.smallest_force_n());
  if (!(extent.force_range_n() > 1e-9 * largest_n)) {
    return refuse("the force never changes", number(extent.largest_force_n(), "N"),
                  "a force that rises in contact",
                  recorded ? "is this the column of the force?" : "is the sensor connected and running?");
  }
  if (!(extent.depth_range_mm() > 0.0)) {
    return refuse("the position never changes", {}, "a tip that presses and lets go",
                  recorded ? "is this the column of the position?" : "press on the object and let go");
  }
  // A tool that is torn away pulls for a few samples; a sensor that is turned round pulls all the time.
  if (extent.mean_force_n() < 0.0 &&
      -extent.smallest_force_n() > 2.0 * std::max(extent.largest_force_n(), threshold_n)) {
    return refuse("the force has the wrong sign: it pulls where the object should push",
                  number(extent.smallest_force_n(), "N"), "positive when the object pushes back",
                  recorded ? "reverse the sign of the force column (scale -1)"
                           : "reverse the sensor's z axis, or press downwards along it");
  }
  if (!(extent.largest_force_n() > threshold_n)) {
    return refuse(
        "no contact", "at most " + number(extent.largest_force_n(), "N"),
        "above the threshold of " + number(threshold_n, "N"),
        recorded ? "is the force in N? else give its unit, or lower the threshold" : "press on the object");
  }
  if (extent.correlation() < -0.3) {
    return refuse("the position has the wrong sign: force falls where the tip goes deeper",
                  "correlation " + number(extent.correlation(), ""), "positive into the object",
                  recorded ? "reverse the sign of the position column (scale -1)"
                           : "the press axis is -z: press downwards");
  }
  const double range_mm = extent.depth_range_mm();
  if (range_mm < 0.02 || range_mm > 500.0) {
    return refuse("a way of the tip that no palpation has", number(range_mm, "mm"), "0.02 … 500 mm",
                  recorded ? "is the position in mm? else give its unit" : "press deeper");
  }
  const double n_per_mm = extent.largest_force_n() / range_mm;
  if (extent.largest_force_n() > 1e3 || n_per_mm < 1e-4 || n_per_mm > 1e3) {
    return refuse("a stiffness that no object has",
                  number(n_per_mm, "N/mm") + ", up to " + number(extent.largest_force_n(), "N"),
                  "0.0001 … 1000 N/mm, up to 1000 N", "are the units N and mm? give those of the columns");
  }
  return std::nullopt;
}

}  // namespace hapticd::identification
